"""What the design commands refuse alike."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from ..errors import ProjectError

if TYPE_CHECKING:
    from ..design.color_genes import ColorMeasure
    from ..design.colors import Kind
    from ..design.genes import Measure


def check_time(time_s: float, flag: str = "--time") -> None:
    """Refuse a time that is none."""
    if not (math.isfinite(time_s) and time_s > 0.0):
        raise ProjectError(f"{flag} {time_s:g} is no time; give seconds above 0")


def check_fitness(text: str) -> Measure:
    """Return what `--fitness` says, checked."""
    if text == "ours":
        return "ours"
    if text == "algorithm1":
        return "algorithm1"
    raise ProjectError(f"there is no fitness {text!r}; choose ours or algorithm1")


def check_films(text: str, flag: str = "--films") -> tuple[Kind, int]:
    """Return what `--films` says: the kind, and how many on a surface at most."""
    if text == "quarter-wave":
        return "quarter-wave", 1
    if text in ("free", "1", "2", "3"):
        return "film", 1 if text == "free" else int(text)
    raise ProjectError(f"{flag} {text!r} is unknown; choose quarter-wave or free, or 2 or 3 for up to so many")


def check_color_fitness(text: str) -> ColorMeasure:
    """Return what `--fitness` says of colours, checked."""
    if text == "ours":
        return "ours"
    if text == "algorithm2":
        return "algorithm2"
    raise ProjectError(f"there is no fitness {text!r} of colours; choose ours or algorithm2")
