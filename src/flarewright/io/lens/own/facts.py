"""Maker and patent of a lens, found in its texts: name, source, notes and the path of its file."""

from __future__ import annotations

import re

# words by maker: the maker's name and its lines of lenses
_MAKERS = {
    "Angenieux": "angenieux angénieux optimo",
    "ARRI": "arri",
    "Bausch & Lomb": "bausch baltar",
    "Canon": "canon serenar canonet",
    "Carl Zeiss": "zeiss planar sonnar distagon biogon hologon tessar contax biotar flektogon otus batis",
    "Cooke": "cooke panchro",
    "Corning": "corning",
    "Dallmeyer": "dallmeyer",
    "Edmund Optics": "edmund",
    "Fujifilm": "fuji fujifilm fujinon fujica",
    "Goerz": "goerz dagor",
    "Isco": "isco",
    "Kern": "kern switar",
    "Kodak": "kodak ektar",
    "Konica": "konica hexanon hexar",
    "Kowa": "kowa prominar",
    "Largan": "largan",
    "Leica": "leica leitz summicron summilux summar summitar elmarit elmar noctilux hektor",
    "Mamiya": "mamiya sekor",
    "Meyer": "meyer gorlitz görlitz trioplan primoplan",
    "Minolta": "minolta rokkor",
    "Nikon": "nikon nikkor nippon",
    "Olympus": "olympus zuiko",
    "Panasonic": "panasonic matsushita lumix",
    "Panavision": "panavision",
    "Pentax": "pentax takumar asahi",
    "Perkin-Elmer": "perkin",
    "Polaroid": "polaroid",
    "Ricoh": "ricoh rikenon",
    "Rodenstock": "rodenstock heligon",
    "Ross": "ross",
    "Samsung": "samsung",
    "Schneider": "schneider kreuznach xenon xenar xenotar symmar angulon",
    "Sigma": "sigma",
    "Sony": "sony",
    "Steinheil": "steinheil",
    "Tamron": "tamron",
    "Taylor & Hobson": "taylor",
    "Thorlabs": "thorlabs",
    "Tokina": "tokina vivitar",
    "Voigtländer": "voigtlander voigtländer heliar nokton ultron skopar",
    "Yashica": "yashica yashinon",
}
_BY_WORD = {word: maker for maker, words in _MAKERS.items() for word in words.split()}
_WORD = re.compile(r"[^\W\d_]+")
# an office, the word patent or both, and a number of at least five digits
_OFFICES = "US|USP|U\\.S\\.|JP|JPA|GB|UK|DE|DRP|FR|EP|WO|CH|CN|IT"
_WORDS = r"(?:pat(?:ent)?s?\.?\s*)?(?:no\.?\s*|number\s*|appl(?:ication)?\.?\s*)?"
_NUMBER = r"[A-Z]?\d{1,4}(?:[,./\- ]?\d{3,7})+(?:\s?[AB]\d?)?"
_PATENT = re.compile(
    rf"(?<![A-Za-z])(?:(?P<office>{_OFFICES})[\s_-]*{_WORDS}|patent\s*(?:no\.?\s*)?)(?P<number>{_NUMBER})", re.I
)


def maker_of(*texts: str) -> str:
    """Return the maker of a lens, found by its name or by one of its lines of lenses; "" if unknown.

    Parameters
    ----------
    *texts : str
        The first one that names a maker decides.

    Examples
    --------
    >>> maker_of("Summicron 50 mm f/2", "patents/nikon/0012.zmx")
    'Leica'
    """
    for text in texts:
        words = {word.lower() for word in _WORD.findall(text)}
        # a maker's name counts more than a line of lenses, which others may imitate
        by_name = [maker for maker in _MAKERS if words & {_MAKERS[maker].split()[0]}]
        if by_name:
            return by_name[0]
        if lines := sorted(words & _BY_WORD.keys()):
            return _BY_WORD[lines[0]]
    return ""


def patent_of(*texts: str) -> str:
    """Return the first patent number in some texts, as "US 2,645,156"; "" if there is none.

    Examples
    --------
    >>> patent_of("Heliar, USP 2645156, example 1")
    'US 2,645,156'
    """
    for text in texts:
        if (found := _PATENT.search(text)) is None:
            continue
        office = (found["office"] or "").upper().replace(".", "")
        office = {"USP": "US", "JPA": "JP", "DRP": "DE", "UK": "GB"}.get(office, office)
        number = " ".join(found["number"].split())
        return f"{office} {_american(number) if office == 'US' else number}".strip()
    return ""


def _american(number: str) -> str:
    """Return a number of a US patent as printed on it: 2,645,156, or 2015/0146044 for an application."""
    plain = re.sub(r"[,. ]", "", number).lstrip("0")
    if not plain.isdecimal():
        return number
    if len(plain) == 11:
        return f"{plain[:4]}/{plain[4:]}"
    return f"{int(plain):,}" if 5 <= len(plain) <= 8 else number
