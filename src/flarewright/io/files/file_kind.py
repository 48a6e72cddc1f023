"""Kinds of files, by suffix and contents, and errors about a file given instead of another kind."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, Literal

from ...errors import FileError
from .door import outside

FOREIGN_LENS_SUFFIXES = (".lens", ".zmx", ".seq", ".len", ".dat", ".csv")
"""Lens files of other programs; `.json` is a lens or a measured flare."""
LENS_SUFFIXES = (".toml", *FOREIGN_LENS_SUFFIXES, ".json")
WRITTEN_LENS_SUFFIXES = (".toml", ".zmx", ".lens", ".csv", ".json")
"""Lens files that `workflow.lens_export` writes."""

Kind = Literal["dataset", "lens", "look", "project", "scene"]

REALFLARE_KEY, OPTILAND_KEY = "lens_elements", "surface_group"
# the key that distinguishes them lies within this number of bytes
_START = 65536
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")


def refuse_other_kind(path: str | Path, table: dict[str, Any], wanted: Kind) -> None:
    """Raise an error when a file is clearly of another kind than the wanted one.

    Parameters
    ----------
    path : str or Path
    table : dict
        Its parsed contents.
    wanted : {"dataset", "lens", "look", "project", "scene"}

    Raises
    ------
    ValueError
        With the command to use instead; the message is one sentence.
    """
    kind = kind_of(table)
    if kind == "look" != wanted:
        raise ValueError(
            f"{path} is a look, not a {wanted} file: apply it to a lens with flarewright render LENS --light X,Y "
            f"--look {path}"
        )
    if kind == "dataset" != wanted:
        raise ValueError(
            f"{path} is a specification of a data set, not a {wanted} file: draw it with flarewright dataset {path} "
            "-n 100 -o FOLDER"
        )
    if kind is not None and kind != wanted:
        use = f", render it with flarewright render --project {path}" if kind == "project" else ""
        raise ValueError(
            f"{path} is a {kind} file, not a {wanted} file: check it with flarewright {kind} check {path}{use}"
        )


def refuse_lens_suffix(path: str | Path, wanted: Kind) -> None:
    """Raise ValueError when the suffix is that of another program's lens file, which is not TOML."""
    if Path(path).is_file() and Path(path).suffix.lower() in FOREIGN_LENS_SUFFIXES:
        raise ValueError(f"{path} is a lens file, not a {wanted} file: check it with flarewright lens check {path}")


def kind_of(table: dict[str, Any]) -> Kind | None:
    """Return the kind of a file by its keys; None when they are ambiguous or contradictory."""
    kinds: list[Kind] = []
    if isinstance(table.get("rows"), list) and "lights" not in table:
        kinds.append("lens")
    if "lens" in table and "rows" not in table and isinstance(table["lens"], dict) and "names" in table["lens"]:
        kinds.append("dataset")
    elif "lens" in table and "rows" not in table:
        # a project has no name
        kinds.append("look" if "name" in table else "project")
    if "cameras" in table:
        kinds.append("scene")
    return kinds[0] if len(kinds) == 1 else None


def lens_key(path: str | Path) -> str:
    """Return the key that makes a JSON file a lens of another program; "" for other files, such as a measured flare."""
    try:
        with outside(path, "a JSON file") as file:
            start = file.read(_START)
    except FileError:
        return ""
    if not start.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"{"):
        return ""
    return next((key for key in (REALFLARE_KEY, OPTILAND_KEY) if f'"{key}"'.encode() in start), "")


def foreign_hint(text: str) -> str:
    """Return what a text file of another program is, with the remedy; "" for any other text.

    Parameters
    ----------
    text : str
        Contents of the file, or their beginning.

    Returns
    -------
    str
        The predicate of a sentence that begins with the file's name.
    """
    start = text[:20000]
    if start.lstrip().startswith("{") and '"lens_elements"' in start:
        return (
            "is a lens of RealFlare (JSON): name it with the suffix .json and give it as a lens, as in "
            "flarewright lens check FILE"
        )
    lines = [line.split() for line in start.splitlines() if line.strip() and not line.lstrip().startswith("#")]
    if len(lines) >= 3 and all(len(words) == 4 and all(map(_NUMBER.fullmatch, words)) for words in lines[:12]):
        return (
            "is a lens table of pbrt (radius, thickness, index, aperture diameter): name it with the suffix .dat and "
            "give it as a lens, as in flarewright lens check FILE"
        )
    return ""


def is_ghost_model_file(what: object) -> bool:
    """Return whether an argument given as a lens is a measured flare: JSON that is no lens of another program."""
    is_json = isinstance(what, str) and what.lower().endswith(".json") and Path(what).is_file()
    return is_json and not lens_key(str(what))
