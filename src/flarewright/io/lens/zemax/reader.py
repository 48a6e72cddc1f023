"""Reader of Zemax' sequential lens files (`.zmx`).

The text has one keyword per line; the lines of a surface are indented below its `SURF n`. The reader uses NAME, NOTE,
UNIT, GCAT, the aperture (FNUM, ENPD, FLOA, OBNA), the fields (FTYP, XFLN, YFLN), the primary wavelength (WAVM, PWAV),
and of each surface TYPE, CURV, CONI, PARM, XDAT, DISZ, GLAS, DIAM, CLAP, FLAP, COAT and STOP. `keywords` lists
the keywords without effect on a ghost; a remark names every other one. `optics.lens_import.sequential_import` makes a
lens of the result.

Source: published files of lens makers and vendors; the sag of each surface type is that of the
OpticStudio help ("Even Asphere", "Extended Asphere", "Biconic", "Toroidal").
"""

from __future__ import annotations

import math
from contextlib import suppress
from itertools import pairwise
from pathlib import Path

from ....colorimetry import VISIBLE_NM
from ....errors import GlassError
from ....model import Medium
from ....model.lens.prescription import MOST_TERMS
from ....model.lens.raw_lens import Configuration, RawSequence, SequenceRow
from ....sentences import did_you_mean, listed, shorten
from ...files.door import shown
from .. import media
from ..foreign_file import INFINITE, MOST_SURFACES, decoded, largest_field, lens_data, number_of, sequence_row, whole
from ..glass_catalogue import CatalogueGlass, by_name, same_name
from ..lens_fields import CURVATURE, ROW_NUMBERS
from .configurations import configurations
from .keywords import APERTURES, HARMLESS, HARMLESS_OF_SURFACE, USED, USED_OF_SURFACE, VIGNETTING
from .text import Block, Text, grouped

_MM = {"MM": 1.0, "CM": 10.0, "IN": 25.4, "INCH": 25.4, "METER": 1000.0, "M": 1000.0}
# value in a GLAS line for a glass without numbers
_NO_NUMBERS = ((0.0, 0.0), (1.5, 40.0))
# the numbers of a GLAS line take precedence over a name whose n_d differs by more
_INDEX_TOLERANCE = 0.002
_AIR = ("AIR", "VACUUM")
_AIR_TOLERANCE = 5e-4
# a larger semi-diameter in mm is a misprint
_WIDEST = 2000.0
# largest number of unknown keywords that are named
_LISTED = 8
_MOULDED = ("_MOLD", "_MOULD")
# glasses of Zemax' MISC catalogue in photographic lenses that no maker's catalogue has (n_d, V_d)
_MISC = {
    "PMMA": (1.491756, 57.44), "ACRYLIC": (1.491668, 55.31), "POLYCARB": (1.585470, 29.91),
    "POLYSTYR": (1.590481, 30.87), "F_SILICA": (1.458464, 67.82), "B270": (1.522900, 58.50),
}  # fmt: skip


def read_zmx(path: str | Path) -> RawSequence:
    """Read a sequential Zemax file; each glass gets its dispersion.

    Parameters
    ----------
    path : str or Path
        UTF-16 or UTF-8, with or without a byte order mark, or the Windows code page of old versions.

    Raises
    ------
    LensError
        When the file cannot be read or is not supported; `problems` gives each surface by the file's number.
    """
    with lens_data(path, "a .zmx file") as data:
        found = grouped(decoded(data))
        raw = _sequential(Path(path), found)
    return whole(path, raw, found.problems)


def _sequential(path: Path, found: Text) -> RawSequence | None:
    """Return the contents of a file; None after an error, which is appended to the problems."""
    mode = (found.head.get("MODE") or ["SEQ"])[0].upper()
    if mode != "SEQ":
        found.problems.append(f"MODE {mode[:40]}: the file is not sequential and holds no prescription")
    elif len(found.blocks) < 4:
        found.problems.append("the SURF blocks of object, lens and image are missing: is it a .zmx file?")
    elif len(found.blocks) > MOST_SURFACES:
        found.problems.append(f"it has {len(found.blocks)} surfaces, a lens has at most {MOST_SURFACES}")
    return None if found.problems else _sequence(path, found)


def _sequence(path: Path, found: Text) -> RawSequence | None:
    unit = (found.head.get("UNIT") or ["MM"])[0].upper()
    if unit not in _MM:
        found.problems.append(f"UNIT {unit[:40]} is unknown; known are {', '.join(_MM)}")
        return None
    mm = _MM[unit]
    if mm != 1.0:
        found.remarks.append(f"lengths are in {unit}; converted to mm")
    findings: list[tuple[int, media.Finding]] = []
    for before, block in pairwise(found.blocks):
        # a coordinate break has the medium of the surface before it
        if block.kind == "COORDBRK" and "GLAS" in before.words:
            block.words["GLAS"] = before.words["GLAS"]
    if glass := _glass_of(found.blocks[0]):
        medium = f"n_d = {glass[3][:20]}" if glass[0].startswith("___") and len(glass) > 3 else glass[0][:40]
        found.problems.append(
            f"surface 0: the lens stands in a medium ({medium}): Flarewright traces light that comes through air"
        )
    rows = [_row(block, mm, found, findings) for block in found.blocks[1:-1]]
    if found.problems:
        return None
    _remark_ignored(found)
    _remark_wavelength(found)
    aperture = _opening(found, mm)
    field_deg, image_height = _field(found, mm)
    distance = _length(found.blocks[0], "DISZ", found.problems, infinite=math.inf) * mm
    stops = [row for row in rows if row is not None and row.stop]
    stated = stops[0].surface.semi_diameter if stops else None
    one = Configuration(
        number=1, **aperture, stop_semi_diameter=stated, field_deg=field_deg, image_height=image_height,
        focus_distance=None if not 0.0 < distance < INFINITE else distance,
    )  # fmt: skip
    several = configurations(found, one, stops[0].number if stops else None, mm)
    return RawSequence(
        file=shown(path.name), name=" ".join(" ".join(found.head.get("NAME", [])).split()) or shown(path.stem),
        notes=" ".join(note for note in found.notes if note), rows=tuple(row for row in rows if row is not None),
        stop_semi_diameter=stated, field_deg=field_deg, image_height=image_height, **aperture,
        focus_distance=one.focus_distance, configurations=several,
        remarks=(*found.remarks, *media.remarks(findings, "surface")),
    )  # fmt: skip


def _row(block: Block, mm: float, found: Text, findings: list[tuple[int, media.Finding]]) -> SequenceRow | None:
    """Return the surface of a block; appends errors to the problems."""
    problems, where = found.problems, f"surface {block.number}"
    before = len(problems)
    glass = _glass_of(block)
    if glass and glass[0].upper() == "MIRROR":
        problems.append(f"{where} is a mirror: reflecting surfaces are not supported")
        return None
    thickness = _gap(block, found) * mm
    values = _shape(block, mm, found) | {"thickness": thickness, "semi_diameter": _rim(block, mm, found)}
    values["medium"] = None
    CURVATURE.read(values.get("curvature", 0.0), f"{where}: the curvature", problems)
    if glass:
        values["medium"] = _medium(block.number, glass, found, findings)
    stop, automatic = "STOP" in block.words, _automatic(block)
    return sequence_row(where, problems, before, number=block.number, stop=stop, automatic_rim=automatic, **values)


def _glass_of(block: Block) -> list[str]:
    """Return the words of a surface's GLAS line; none for air, however it is written."""
    words = block.words.get("GLAS", [])
    if not words or words[0].upper() in _AIR:
        return []
    index = number_of(words[3]) if len(words) > 3 else None
    nameless = words[0].startswith("___")
    return [] if nameless and index is not None and abs(index - 1.0) < _AIR_TOLERANCE else words


def _gap(block: Block, found: Text) -> float:
    """Return the distance to the next surface in the file's unit; appends an error for an infinite gap in the lens."""
    gap = _length(block, "DISZ", found.problems, infinite=math.inf)
    if abs(gap) < INFINITE:
        return gap
    if block.number == len(found.blocks) - 2:
        found.remarks.append("the file's image lies at infinity; the sensor is placed at the paraxial focus")
        return 0.0
    found.problems.append(
        f"surface {block.number}: the gap to the next surface is infinite, so they form no lens: give its length"
    )
    return 0.0


def _shape(block: Block, mm: float, found: Text) -> dict[str, object]:
    where, problems = f"surface {block.number}", found.problems
    curvature = _number(block, "CURV", problems) / mm
    conic = _number(block, "CONI", problems)
    used = {
        "EVENASPH": "PARM", "XASPHERE": "PARM, XDAT", "BICONICX": "PARM", "COORDBRK": "PARM", "TOROIDAL": "PARM, XDAT",
        "ODDASPHE": "PARM", "XOSPHERE": "PARM, XDAT",
    }.get(block.kind, "")  # fmt: skip
    for key, numbers in (("PARM", block.parameters), ("XDAT", block.extra)):
        if key not in used and any(numbers.values()):
            found.remarks.append(f"{where}: {key} has no meaning for the type {block.kind[:40]}; left out")
    last = {"BICONICX": 2, "TOROIDAL": 8}.get(block.kind, math.inf)
    if beyond := [f"PARM {n}" for n, value in block.parameters.items() if n > last and value]:
        found.remarks.append(f"{where}: {', '.join(beyond[:3])} is no parameter of {block.kind}; left out")
    if block.kind == "STANDARD":
        return {"curvature": curvature, "conic": conic}
    if block.kind == "COORDBRK":
        # the sixth parameter only sets the order of tilt and shift
        if any(value for n, value in block.parameters.items() if n != 6):
            problems.append(
                f"{where} tilts or shifts what follows (COORDBRK), which is unsupported: set its numbers to 0, convert "
                "the file, and write them as [[elements]] of the new one"
            )
        return {}
    if block.kind == "BICONICX":
        radius, conic_x = block.parameters.get(1, 0.0) * mm, block.parameters.get(2, 0.0)
        return {
            "curvature": curvature, "conic": conic, "curvature_x": 1.0 / radius if radius else 0.0, "conic_x": conic_x
        }  # fmt: skip
    if block.kind == "TOROIDAL":
        return _toroid(block, curvature, conic, mm, problems)
    odd: dict[int, float] = {}
    if block.kind == "EVENASPH":
        terms = {n: block.parameters.get(n, 0.0) for n in block.parameters if n > 0}
    elif block.kind == "XASPHERE":
        unit = block.extra.get(2, 1.0) or 1.0
        most = min(max(int(block.extra.get(1, 0.0)), 0), MOST_SURFACES)
        terms = {n: block.extra.get(n + 2, 0.0) / unit ** (2 * n) for n in range(1, most + 1)}
        if beyond := [f"XDAT {n}" for n, value in block.extra.items() if n > most + 2 and value]:
            found.remarks.append(
                f"{where}: {', '.join(beyond[:3])} lies beyond the number of terms that XDAT 1 states; left out"
            )
        # other programs write the terms as those of an even asphere
        plain = {n: value for n, value in block.parameters.items() if n > 0 and value}
        if plain and any(terms.values()) and any(terms.get(n) != value for n, value in plain.items()):
            problems.append(f"{where} has different terms in PARM and in XDAT: remove those that are wrong")
        terms |= plain
    elif block.kind in ("ODDASPHE", "XOSPHERE"):
        terms, odd = _even_and_odd(block, problems)
    else:
        problems.append(
            f"{where} is of type {block.kind[:40]}; known are STANDARD, EVENASPH, XASPHERE, BICONICX, TOROIDAL, "
            "ODDASPHE, XOSPHERE and an idle COORDBRK"
        )
        return {}
    values = _asphere(where, curvature, conic, {n: value / mm ** (2 * n - 1) for n, value in terms.items()}, problems)
    if odd:
        values["odd_asphere"] = tuple(odd.get(n, 0.0) / mm ** (n - 1) for n in range(3, max(odd) + 1, 2))
    return values


def _even_and_odd(block: Block, problems: list[str]) -> tuple[dict[int, float], dict[int, float]]:
    """Return an odd asphere's terms: even ones by half the power of r, odd ones by the power."""
    where = f"surface {block.number}"
    # an odd asphere has its terms in PARM only
    extra = block.extra if block.kind == "XOSPHERE" else {}
    unit = extra.get(2, 1.0) or 1.0
    powers = {n - 2: value / unit ** (n - 2) for n, value in extra.items() if n > 2}
    if beyond := [n + 2 for n, value in powers.items() if value and n > extra.get(1, 0.0)]:
        problems.append(f"{where}: XDAT {beyond[0]} lies beyond the number of terms that XDAT 1 states")
    plain = {n: value for n, value in block.parameters.items() if n > 0 and value}
    if any(powers.values()) and any(powers.get(n) != value for n, value in plain.items()):
        problems.append(f"{where} has different terms in PARM and in XDAT: remove those that are wrong")
    powers = {n: value for n, value in (powers | plain).items() if value}
    if 1 in powers:
        problems.append(f"{where} has a term of r, a tip without a normal on the axis, which is not supported")
    odd = {n: value for n, value in powers.items() if n % 2 and n > 1}
    if any(n > 2 * MOST_TERMS + 1 for n in odd):
        problems.append(f"{where} has terms beyond r^{2 * MOST_TERMS + 1}, which are not supported")
    return {n // 2: value for n, value in powers.items() if n % 2 == 0}, odd


def _toroid(block: Block, curvature: float, conic: float, mm: float, problems: list[str]) -> dict[str, object]:
    """Return a torus or a cylinder; refuse one with Zernike terms.

    The profile of the y-z plane, a conic and even terms of y (parameters 2 to 8), rotates about an axis parallel to y
    at the radius of parameter 1; 0 is a cylinder.
    """
    where, radius = f"surface {block.number}", block.parameters.get(1, 0.0) * mm
    if figure := [f"XDAT {n}" for n, value in block.extra.items() if value]:
        problems.append(f"{where} is a toroid with Zernike terms ({', '.join(figure[:3])}), which are not supported")
    terms = {n - 1: value / mm ** (2 * n - 3) for n, value in block.parameters.items() if 2 <= n <= 8}
    profile = _asphere(where, curvature, conic, terms, problems)
    return {**profile, "curvature_x": 1.0 / radius if radius else 0.0, "torus": True}


def _asphere(
    where: str, curvature: float, conic: float, terms: dict[int, float], problems: list[str]
) -> dict[str, object]:  # fmt: skip
    """Return the terms of r^2, r^4, ...; that of r^2 becomes a curvature."""
    square = terms.pop(1, 0.0)
    if square and curvature == 0.0:
        # a r^2 is a paraboloid of curvature 2 a
        curvature, conic = 2.0 * square, -1.0
    elif square:
        problems.append(f"{where} has a term of r^2 beside its curvature, which is not supported")
    if any(value for n, value in terms.items() if n > MOST_TERMS + 1):
        problems.append(f"{where} has terms beyond r^{2 * MOST_TERMS + 2}, which are not supported")
    last = max((n for n, value in terms.items() if value), default=1)
    asphere = tuple(terms.get(n, 0.0) for n in range(2, last + 1))
    return {"curvature": curvature, "conic": conic, "asphere": asphere}


def _medium(number: int, words: list[str], found: Text, findings: list[tuple[int, media.Finding]]) -> Medium | None:
    """Return the medium of a glass by its name; by its numbers for a nameless, unknown or contradicted one."""
    name, nameless = words[0], words[0].startswith("___")
    n_d, v_d, refusal = _glass_numbers(number, words, found)
    plain = name
    for ending in _MOULDED:
        plain = plain.removesuffix(ending)
    known = None if nameless else _by_name(number, plain, n_d, found)
    if known is not None and refusal:
        found.remarks.append(f"surface {number}: the glass {refusal}; using that of {known.full_name}")
    if known is not None:
        if n_d is not None and not media.contradicts(known, n_d, v_d, _INDEX_TOLERANCE):
            # rounded numbers of the same glass
            n_d = v_d = None
        medium, finding = media.attach_known(plain, known, n_d, v_d, _INDEX_TOLERANCE)
        findings.append((number, finding))
        return medium
    misc = None if nameless else _MISC.get(name.upper())
    if misc is not None and (n_d is None or abs(n_d - misc[0]) <= _INDEX_TOLERANCE):
        n_d, v_d, nameless = *misc, True
    if n_d is None:
        what = "" if nameless else f"{name[:40]} is in no catalogue and "
        found.problems.append(
            f"surface {number}: the glass {what}{refusal or 'has no index in the file'}: write its n_d and V_d into "
            "the GLAS line"
        )
        return None
    medium, finding = media.attach(None if nameless else name, n_d, v_d)
    findings.append((number, finding))
    return medium


def _glass_numbers(number: int, words: list[str], found: Text) -> tuple[float | None, float | None, str]:
    """Return n_d and V_d of a GLAS line, None where it has none, and why a stated n_d is no glass's."""
    n_d, v_d = [*(number_of(word) for word in words[3:5]), None, None][:2]
    if len(words) < 4 or (n_d, v_d) in _NO_NUMBERS:
        return None, None, ""
    if n_d is None:
        return None, None, f"has the n_d {words[3][:20]}, no number"
    if refusal := ROW_NUMBERS["n_d"].refuse(n_d):
        return None, None, f"has an n_d that {refusal}"
    if len(words) < 5 or v_d == 0.0:
        return n_d, None, ""
    wrong = f"is {words[4][:20]}, no number" if v_d is None else ROW_NUMBERS["v_d"].refuse(v_d)
    if wrong:
        found.remarks.append(f"surface {number}: the glass's V_d {wrong}; treated as unknown")
    return n_d, None if wrong else v_d, ""


def _by_name(number: int, name: str, n_d: float | None, found: Text) -> CatalogueGlass | None:
    """Return the glass of a name: of the catalogues that the file states, else of any; None if there is none."""
    for maker in found.makers:
        with suppress(GlassError):
            glass = by_name(f"{maker} {name}", suggest=False)
            if same_name(glass.name, name):
                return glass
    try:
        glass = by_name(name, n_d, suggest=False)
    except GlassError:
        return None
    if found.makers and glass.maker not in found.makers:
        found.remarks.append(
            f"surface {number}: glass {name} is not in the catalogues that the file states "
            f"({', '.join(found.makers)}); using {glass.full_name}"
        )
    return glass


def _rim(block: Block, mm: float, found: Text) -> float | None:
    """Return the clear semi-diameter: a stated aperture, else the column of the table."""
    for key, place in (("CLAP", 1), ("FLAP", 1), ("DIAM", 0)):
        words = block.words.get(key, [])
        if len(words) > place:
            value = number_of(words[place])
            if value is None or value < 0.0:
                found.problems.append(
                    f"surface {block.number}: {key} is {shorten(' '.join(words))}, a length was expected"
                )
            elif value * mm > _WIDEST:
                found.remarks.append(
                    f"surface {block.number}: a rim of {value * mm:g} mm is no lens's; left out and estimated"
                )
                return None
            elif value > 0.0:
                return value * mm
    return None


def _automatic(block: Block) -> bool:
    return not {"CLAP", "FLAP"} & set(block.words) and (block.words.get("DIAM") or ["", "1"])[1:2] == ["0"]


def _remark_ignored(found: Text) -> None:
    """Append remarks on contents of the file that the reader ignores."""
    lens = found.blocks[1:-1]
    coats = sorted({words[0] for block in lens if (words := block.words.get("COAT"))})
    if coats:
        found.remarks.append(
            f"coatings are named ({', '.join(coats)}) and not described; all surfaces are bare until one is chosen"
        )
    for keys, remark in APERTURES:
        places = [str(b.number) for b in lens if any(_is_set(b, key) for key in keys)]
        if places:
            found.remarks.append(f"surface{'s'[: len(places) > 1]} {', '.join(places)}: {remark}")
    _remark_unknown(found)
    if _number(found.blocks[-1], "CURV", found.problems) != 0.0:
        found.remarks.append("the image surface is curved; the sensor is flat")


def _is_set(block: Block, key: str) -> bool:
    """Return whether an aperture keyword has an effect: CLAP and FLAP by their inner radius, OBDC by its shift."""
    words = block.words.get(key)
    if words is None or key not in ("CLAP", "FLAP", "OBDC"):
        return words is not None
    return any(number_of(word) != 0.0 for word in words[: 2 if key == "OBDC" else 1])


def _remark_unknown(found: Text) -> None:
    """Append remarks on keywords that are neither used nor known to be harmless."""
    places: dict[str, list[str]] = {}
    for block in found.blocks:
        for key in block.words:
            if key not in USED_OF_SURFACE | HARMLESS_OF_SURFACE:
                places.setdefault(key, []).append(str(block.number))
    for key, at in places.items():
        hint = did_you_mean(key, USED_OF_SURFACE)
        found.remarks.append(f"surface{'s'[: len(at) > 1]} {', '.join(at)}: keyword {shorten(key)} is left out{hint}")
    # with several configurations, a remark on each of them says what its rows change
    rows = {operand.key for operand in found.operands if operand.configuration > 1}
    head = [key for key in found.head if key not in USED | HARMLESS | rows]
    if head:
        near = "".join(did_you_mean(key, USED) for key in head[:1])
        keys = listed([key[:20] for key in head], _LISTED)
        found.remarks.append(f"keyword{'s'[: len(head) > 1]} {keys} left out{near}")
    cut = [key for key in VIGNETTING if any(number_of(word) for word in found.head.get(key, []))]
    if cut:
        found.remarks.append(f"vignetting factors ({', '.join(cut)}) are left out; the rims vignette")
    environment = found.head.get("ENVD", [])
    if len(environment) > 2 and number_of(environment[2]):
        found.remarks.append(
            f"the indices hold at {environment[0]} degrees Celsius and {environment[1]} atmospheres in the file; those "
            "of the catalogue are used"
        )


def _remark_wavelength(found: Text) -> None:
    """Append a remark when the primary wavelength is invisible: the lens is then not made for a camera."""
    primary = int(number_of((found.head.get("PWAV") or ["1"])[0]) or 1)
    wavelength_um = found.wavelengths_um.get(primary)
    if wavelength_um is not None and not VISIBLE_NM[0] <= 1000.0 * wavelength_um <= VISIBLE_NM[1]:
        found.remarks.append(
            f"the file's primary wavelength is {1000.0 * wavelength_um:g} nm, not visible: focal length and image hold "
            "at 587.6 nm here; flarewright lens show --wavelength gives others"
        )


def _opening(found: Text, mm: float) -> dict[str, float | None]:
    """Return the aperture specification: f_number or entrance_pupil_diameter, or neither."""
    for key, name, unit in (("FNUM", "f_number", 1.0), ("ENPD", "entrance_pupil_diameter", mm)):
        words = found.head.get(key, [])
        value = number_of(words[0]) if words else None
        if value is not None and value > 0.0:
            return {name: value * unit}
    return {}


def _field(found: Text, mm: float) -> tuple[float | None, float | None]:
    """Return the largest field as an angle or an image height; neither for a near object."""
    kind = int(number_of((found.head.get("FTYP") or ["0"])[0]) or 0)
    columns = []
    for axis in "XY":
        words = found.head.get(f"{axis}FLN") or found.head.get(f"{axis}FLD") or []
        columns.append([number_of(word) for word in words])
    largest = largest_field(*columns)
    if largest <= 0.0:
        return None, None
    if kind == 0 and largest < 90.0:
        return largest, None
    if kind in (2, 3):
        return None, largest * mm
    reason = f"{largest:g} degrees" if kind == 0 else "heights of the object" if kind == 1 else f"of kind {kind}"
    found.remarks.append(f"the file's fields are {reason}; the field of view is left out")
    return None, None


def _number(block: Block, key: str, problems: list[str]) -> float:
    words = block.words.get(key)
    if not words:
        return 0.0
    value = number_of(words[0])
    if value is None:
        problems.append(f"surface {block.number}: {key} is {shorten(words[0])}, a number was expected")
        return 0.0
    return value


def _length(block: Block, key: str, problems: list[str], infinite: float) -> float:
    words = block.words.get(key)
    return infinite if words and words[0].upper() == "INFINITY" else _number(block, key, problems)
