"""Number fields of the lens file: limits, units and descriptions, shared by the reader and the JSON Schema."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from ...sentences import shorten


@dataclass(frozen=True)
class NumberField:
    """A number field of the file.

    Attributes
    ----------
    about : str
        Description for the schema.
    low, high : float
        Limits.
    low_open, high_open : bool
        True: the limit itself is invalid.
    unit : str
    """

    about: str
    low: float
    high: float
    low_open: bool = False
    high_open: bool = False
    unit: str = "mm"

    def refuse(self, value: object) -> str | None:
        """Return an error text for an invalid value, else None."""
        unit = f" in {self.unit}" if self.unit else ""
        if isinstance(value, bool) or not isinstance(value, int | float):
            return f"is {shorten(value)}, a number{unit} was expected"
        if isinstance(value, float) and math.isnan(value):
            return f"is nan, a number{unit} was expected"
        if value < self.low or (self.low_open and value == self.low):
            return f"is {shorten(value)}: it must be {'above' if self.low_open else 'at least'} {self.low:g}{unit}"
        if value > self.high or (self.high_open and value == self.high):
            return f"is {shorten(value)}: it must be {'below' if self.high_open else 'at most'} {self.high:g}{unit}"
        return None

    def read(self, value: object, where: str, problems: list[str]) -> float | None:
        """Return a valid value as a number; None for an invalid one, whose error is appended."""
        refusal = self.refuse(value)
        if refusal is None:
            return float(value)  # type: ignore[arg-type]
        problems.append(f"{where} {refusal}")
        return None

    def schema(self) -> dict[str, Any]:
        """Return the field's JSON Schema."""
        return {
            "type": "number",
            "exclusiveMinimum" if self.low_open else "minimum": self.low,
            "exclusiveMaximum" if self.high_open else "maximum": self.high,
            "description": f"{self.about}, {self.unit}" if self.unit else self.about,
        }


TOP_NUMBERS = {
    "f_number": NumberField("f-number wide open; sets the stop", 0.3, 256.0, low_open=True, unit=""),
    "field_deg": NumberField("half field of view", 0.0, 90.0, True, True, unit="degrees"),
    "stated_focal_length": NumberField("focal length as the source states it", 0.0, 1e9, low_open=True),
    "sensor_distance": NumberField(
        "last vertex to sensor; without it the sensor lies at the paraxial focus", 0.0, 1e9, low_open=True
    ),
    "focus_distance": NumberField(
        "plane in focus, in front of the first vertex; without it infinity", 0.0, 1e9, low_open=True
    ),
}

TOP_NUMBERS["squeeze"] = NumberField("factor by which an anamorphic lens compresses its picture", 0.25, 4.0, unit="")

ROW_NUMBERS = {
    "conic": NumberField("conic constant, 0 is a sphere", -1e6, 1e6, unit=""),
    "thickness": NumberField("distance to the next row's vertex", -1000.0, 10000.0),
    "n_d": NumberField("index at 587.56 nm of the medium behind", 1.0, 4.5, True, True, unit=""),
    "v_d": NumberField("Abbe number of the medium behind", 5.0, 150.0, True, True, unit=""),
    "semi_diameter": NumberField("half the clear diameter", 0.0, 2000.0, low_open=True),
}

RADIUS = NumberField('radius of curvature or "flat"; positive: the centre lies behind the vertex', -1e9, 1e9)
CURVATURE = NumberField("1 / radius, instead of `radius`; 0 is flat", -1e3, 1e3, unit="1/mm")

TOP_TEXTS = {"name": "name of the lens", "source": "origin of the numbers, such as the patent", "notes": "observations"}

TOP_KEYS = (
    "schema_version",
    *TOP_TEXTS,
    *TOP_NUMBERS,
    "iris",
    "rows",
    "elements",
    "positions",
    "scatter",
    "coating_presets",
)
STOP_KEYS = ("stop", "thickness")
SHAPE_KEYS = ("radius_x", "curvature_x", "conic_x", "torus", "asphere", "odd_asphere", "decentre", "tilt_deg", "figure")
SURFACE_KEYS = ("radius", "curvature", "glass", "semi_diameter_estimated", "coating", *ROW_NUMBERS, *SHAPE_KEYS)
