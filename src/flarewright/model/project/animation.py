"""Values of a project over time: curves through keys, and the frames of a shot."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Literal, TypeVar

from pydantic import AfterValidator, Field, ValidationInfo, field_validator

from ..base import Frozen
from ..lens.prescription import LARGEST_F_NUMBER, LEAST_F_NUMBER

Motion = Literal["linear", "smooth"]
"""Interpolation between keys: straight lines, or monotone cubic curves through every key, without overshoot."""

LAST_S = 86400.0
"""Latest time of a key, seconds."""
FIRST_FRAME, LAST_FRAME = -1_000_000, 10_000_000
"""Least and largest number of the frame at 0 s."""
LARGEST_INTENSITY = 1e20
"""Largest intensity of a light: above that of every light, and its products stay within 32-bit floats."""

# least and largest value of each curve; an open interval where a value at the end is none
_RANGES: dict[str, tuple[float, float]] = {
    "intensity": (0.0, LARGEST_INTENSITY),
    "rgb": (0.0, 1e9),
    "temperature_k": (500.0, 100000.0),
    "f_number": (LEAST_F_NUMBER, LARGEST_F_NUMBER),
    "zoom": (1e-3, 1e6),
    "focus_distance": (1e-3, 1e9),
    "rotation_deg": (-1e5, 1e5),
    "gain.starburst": (0.0, 1e9),
    "gain.ghosts": (0.0, 1e9),
    "gain.scatter": (0.0, 1e9),
}

At = Annotated[float, Field(ge=0.0, le=LAST_S)]


def rising(at_s: tuple[float, ...]) -> tuple[float, ...]:
    """Return times unchanged; raises ValueError unless they rise."""
    for before, after in pairwise(at_s):
        if after <= before:
            raise ValueError(f"times of keys must rise: {after:g} s follows {before:g} s")
    return at_s


class Curve(Frozen):
    """A value over time; constant before its first key and after its last one.

    Attributes
    ----------
    of : str
        The value.
    at_s : tuple of float
        Ascending times of the keys, seconds.
    values : tuple of float, or of (red, green, blue)
        As many as times.
    motion : {"linear", "smooth"}
    """

    of: str
    at_s: Annotated[tuple[At, ...], AfterValidator(rising)] = Field(min_length=1, max_length=10000)
    values: tuple[float | tuple[float, float, float], ...] = Field(min_length=1, max_length=10000)
    motion: Motion = "linear"

    @field_validator("values")
    @classmethod
    def _values_fit(
        cls, values: tuple[float | tuple[float, float, float], ...], info: ValidationInfo
    ) -> tuple[float | tuple[float, float, float], ...]:
        of, at_s = info.data.get("of"), info.data.get("at_s")
        if at_s is not None and len(values) != len(at_s):
            raise ValueError(f"a curve needs as many values as times: {len(values)} values, {len(at_s)} times")
        low, high = _RANGES.get(str(of), (-1e30, 1e30))
        for value in values:
            if isinstance(value, tuple) != (of == "rgb"):
                wanted = "three numbers, [red, green, blue]" if of == "rgb" else "one number"
                raise ValueError(f"each value of a curve of {of} is {wanted}")
            parts = value if isinstance(value, tuple) else (value,)
            if not all(low <= part <= high for part in parts):
                raise ValueError(f"{of} lies between {low:g} and {high:g}, not {value}")
            if of == "rgb" and max(parts) <= 0.0:
                raise ValueError("black has no colour; give red, green or blue above 0, and a curve of intensity")
        return values


AnyCurve = TypeVar("AnyCurve", bound=Curve)


class LightCurve(Curve):
    """A value of a light over time.

    Attributes
    ----------
    of : {"intensity", "rgb", "temperature_k"}
        The irradiance; the colour as linear Rec.709; the temperature of a black body, kelvin.
    """

    of: Literal["intensity", "rgb", "temperature_k"]


class ProjectCurve(Curve):
    """A value of a project over time.

    Attributes
    ----------
    of : str
        f_number; zoom, a focal length in mm; focus_distance of the camera, mm; rotation_deg of the iris; the gain of a
        pass, such as gain.ghosts.
    """

    of: Literal["f_number", "zoom", "focus_distance", "rotation_deg", "gain.starburst", "gain.ghosts", "gain.scatter"]


class Timeline(Frozen):
    """The frames of a shot.

    Attributes
    ----------
    fps : float
        Frames per second; 23.976, 29.97 and 59.94 mean 24000/1001, 30000/1001 and 60000/1001.
    start : int
        Number of the frame at 0 s.
    """

    fps: float = Field(24.0, ge=0.01, le=1000.0)
    start: int = Field(1, ge=FIRST_FRAME, le=LAST_FRAME)


def one_curve_each(curves: tuple[AnyCurve, ...]) -> tuple[AnyCurve, ...]:
    """Return curves unchanged; raises ValueError if two set the same value."""
    names = [curve.of for curve in curves]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"there are {names.count(name)} curves of {name}; keep one")
    if "rgb" in names and "temperature_k" in names:
        raise ValueError("curves of rgb and of temperature_k both set the colour of a light; keep one")
    return curves
