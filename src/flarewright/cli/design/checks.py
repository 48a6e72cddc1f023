"""Checks of options that several design commands share."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from ...errors import ProjectError

if TYPE_CHECKING:
    from ...design.coatings.color_genes import ColorMeasure
    from ...design.coatings.colors import Kind
    from ...design.solvers.genes import Measure


def check_time(time_s: float, flag: str = "--time") -> None:
    """Raise an error unless a time is above 0."""
    if not (math.isfinite(time_s) and time_s > 0.0):
        raise ProjectError(f"{flag} {time_s:g} is no time; give seconds above 0")


def check_sensor_width(width_mm: float | None) -> None:
    """Raise an error unless `--sensor-width` is a width, or not given."""
    if width_mm is not None and not 0.1 <= width_mm <= 10000.0:
        raise ProjectError(f"--sensor-width {width_mm:g} is no width of a sensor; give millimetres above 0.1")


def check_fitness(text: str) -> Measure:
    """Return the fitness of `--fitness`, checked."""
    if text == "ours":
        return "ours"
    if text == "algorithm1":
        return "algorithm1"
    raise ProjectError(f"there is no fitness {text!r}; choose ours or algorithm1")


def check_films(text: str, flag: str = "--films") -> tuple[Kind, int]:
    """Return the kind of `--films`, and the largest number of films on a surface."""
    if text == "quarter-wave":
        return "quarter-wave", 1
    if text in ("free", "1", "2", "3"):
        return "film", 1 if text == "free" else int(text)
    raise ProjectError(f"{flag} {text!r} is unknown; choose quarter-wave or free, or 2 or 3 for up to that many")


def check_color_fitness(text: str) -> ColorMeasure:
    """Return the fitness of `--fitness` for colours, checked."""
    if text == "ours":
        return "ours"
    if text == "algorithm2":
        return "algorithm2"
    raise ProjectError(f"there is no fitness {text!r} of colours; choose ours or algorithm2")
