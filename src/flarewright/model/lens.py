"""A lens as its prescription: rows from front to back, one of them the stop."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from .base import Frozen
from .coating import Coating
from .glass import Medium
from .iris import Iris

SCHEMA_VERSION = 1


class Surface(Frozen):
    """A refracting surface and the gap behind it.

    Attributes
    ----------
    curvature : float
        1 / radius in 1/mm; positive when the centre of curvature lies behind the vertex; 0 is flat.
    conic : float
        Conic constant; 0 is a sphere, -1 a paraboloid.
    thickness : float
        Distance to the next row's vertex, mm; of the last row: the patent's image distance, kept as a record only.
    medium : Medium or None
        What fills that gap; None is air.
    semi_diameter : float or None
        Half the clear diameter, mm; None is unknown (estimated by `optics.semi_diameters`).
    semi_diameter_estimated : bool
        True when the value is an estimate, not the prescription's.
    coating : Coating or None
        None: bare.
    """

    kind: Literal["surface"] = "surface"
    curvature: float = 0.0
    conic: float = 0.0
    thickness: float = Field(0.0, ge=-1000.0, le=10000.0)
    medium: Medium | None = None
    semi_diameter: float | None = Field(None, gt=0.0, le=2000.0)
    semi_diameter_estimated: bool = False
    coating: Coating | None = None


class Stop(Frozen):
    """The aperture stop: a plane that refracts nothing; its opening follows from the f-number."""

    kind: Literal["stop"] = "stop"
    thickness: float = Field(0.0, ge=-1000.0, le=10000.0)


Row = Annotated[Surface | Stop, Field(discriminator="kind")]


class Lens(Frozen):
    """A validated prescription.

    Attributes
    ----------
    name, source, notes : str
        What it is, where the numbers come from (patent), and what was noticed.
    rows : tuple of Surface or Stop
        Front to back; exactly one is a Stop.
    f_number : float
        Wide open; together with the focal length it sets the stop.
    field_deg : float or None
        Half field of view in degrees (object side), used to estimate missing semi-diameters; None: from a 43.3 mm
        image circle.
    sensor_distance : float or None
        Last vertex to sensor, mm; None puts the sensor at the paraxial focus.
    focus_distance : float or None
        Distance of the plane in focus in front of the first vertex, mm; None is infinity.
    iris : Iris
        Default blades.
    coating_presets : dict of str to tuple of Coating or None
        Named sets, one entry per row (the stop's is ignored).
    """

    schema_version: Literal[1] = 1
    name: str = Field(min_length=1)
    source: str = ""
    notes: str = ""
    stated_focal_length: float | None = Field(None, gt=0.0)
    f_number: float = Field(gt=0.3, le=256.0)
    field_deg: float | None = Field(None, gt=0.0, lt=90.0)
    sensor_distance: float | None = Field(None, gt=0.0)
    focus_distance: float | None = Field(None, gt=0.0)
    iris: Iris = Iris()
    rows: tuple[Row, ...] = Field(min_length=2)
    coating_presets: dict[str, tuple[Coating | None, ...]] = Field(default_factory=dict)

    @property
    def stop_row(self) -> int:
        """Index of the stop among the rows."""
        return next(k for k, row in enumerate(self.rows) if isinstance(row, Stop))

    @model_validator(mode="after")
    def _rows_make_a_lens(self) -> Lens:
        stops = [k for k, row in enumerate(self.rows) if isinstance(row, Stop)]
        if len(stops) != 1:
            found = "none was found" if not stops else f"rows {stops} are stops"
            raise ValueError(f"a lens has exactly one stop, {found}")
        if not any(isinstance(row, Surface) and row.medium is not None for row in self.rows):
            raise ValueError("no row has glass behind it, so nothing bends the light")
        last = self.rows[-1]
        if isinstance(last, Surface) and last.medium is not None:
            raise ValueError(f"row {len(self.rows) - 1}: behind the last row must be air, not glass")
        for name, coatings in self.coating_presets.items():
            if len(coatings) != len(self.rows):
                raise ValueError(
                    f"coating preset {name!r} has {len(coatings)} entries, the lens has {len(self.rows)} rows"
                )
        return self
