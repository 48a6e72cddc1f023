"""Which of our own files a TOML text is, so that one given in another's place is told what it is."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

Kind = Literal["lens", "look", "project", "scene"]


def refuse_other_kind(path: str | Path, table: dict[str, Any], wanted: Kind) -> None:
    """Refuse a file that is plainly another one.

    Parameters
    ----------
    path : str or Path
    table : dict
        What it holds.
    wanted : {"lens", "look", "project", "scene"}

    Raises
    ------
    ValueError
        With the command that checks it; the message is one sentence.
    """
    kind = kind_of(table)
    if kind == "look" != wanted:
        raise ValueError(
            f"{path} is a look, not a {wanted} file: put it on a lens with flarewright render LENS --light X,Y "
            f"--look {path}"
        )
    if kind is not None and kind != wanted:
        use = f", render it with flarewright render --project {path}" if kind == "project" else ""
        raise ValueError(
            f"{path} is a {kind} file, not a {wanted} file: check it with flarewright {kind} check {path}{use}"
        )


def refuse_lens_suffix(path: str | Path, wanted: Kind) -> None:
    """Refuse the lens files of other programs by their names, before they are read as TOML; raises as above."""
    if Path(path).is_file() and Path(path).suffix.lower() in (".lens", ".zmx"):
        raise ValueError(f"{path} is a lens file, not a {wanted} file: check it with flarewright lens check {path}")


def kind_of(table: dict[str, Any]) -> Kind | None:
    """Return which file a table plainly is; None where its keys do not tell, or contradict each other."""
    kinds: list[Kind] = []
    if isinstance(table.get("rows"), list) and "lights" not in table:
        kinds.append("lens")
    if "lens" in table and "rows" not in table:
        # a project has no name
        kinds.append("look" if "name" in table else "project")
    if "cameras" in table:
        kinds.append("scene")
    return kinds[0] if len(kinds) == 1 else None
