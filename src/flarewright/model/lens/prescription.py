"""The prescription of a lens: rows from front to back, one of them the stop."""

from __future__ import annotations

from math import inf, sqrt
from typing import Annotated, Literal

from pydantic import Field, StrictBool, model_validator

from ..base import Frozen
from .coating import Coating
from .figure import Figure
from .glass import Medium
from .iris import Iris
from .scatter import Scatter

# exclusive lower and inclusive upper limit of f-numbers
LEAST_F_NUMBER, LARGEST_F_NUMBER = 0.3, 256.0

# A4 to A20
MOST_TERMS = 9
NO_GLASS = "no row has glass behind it, so no surface refracts"

Offset = Annotated[float, Field(ge=-100.0, le=100.0)]
Tilt = Annotated[float, Field(ge=-45.0, le=45.0)]


class Surface(Frozen):
    """A refracting surface and the gap behind it.

    Attributes
    ----------
    curvature : float
        1 / radius in 1/mm; positive when the centre of curvature lies behind the vertex; 0 is flat. Of a toroid or a
        cylinder: in the y-z plane.
    conic : float
        Conic constant; 0 is a sphere, -1 a paraboloid. Of a toroid or a cylinder: in the y-z plane.
    curvature_x, conic_x : float or None
        The same in the x-z plane; None: as in the y-z plane. A cylinder has one curvature that is 0.
    torus : bool
        The profile in the y-z plane, with its terms, rotates about a line parallel to y at the radius of the x-z plane,
        where it is a circle. False: the biconic form, which differs from it in the fourth order.
    asphere : tuple of float
        A4, A6, ... of the sag's terms A4 r^4 + A6 r^6 + ..., 1/mm^3, 1/mm^5, ...
    odd_asphere : tuple of float
        A3, A5, ... of the sag's terms A3 r^3 + A5 r^5 + ..., 1/mm^2, 1/mm^4, ...; a term of r would be a tip without a
        normal on the axis.
    decentre : tuple of float or None
        (x, y) of the vertex beside the axis, mm.
    tilt_deg : tuple of float or None
        Right-handed turns about the surface's x axis, then about the lens' y axis, at the vertex.
    figure : Figure or None
        Departure from the ideal form.
    thickness : float
        Distance to the next row's vertex, mm; of the last row: the patent's image distance, kept as a record only.
    medium : Medium or None
        What fills that gap; None is air.
    semi_diameter : float or None
        Half the clear diameter, mm; None is unknown (estimated by `optics.lens_import.semi_diameters`).
    semi_diameter_estimated : bool
        True when the value is an estimate, not the prescription's.
    coating : Coating or None
        None: bare.
    """

    kind: Literal["surface"] = "surface"
    curvature: float = 0.0
    conic: float = 0.0
    curvature_x: float | None = None
    conic_x: float | None = None
    torus: StrictBool = False
    asphere: tuple[float, ...] = Field((), max_length=MOST_TERMS)
    odd_asphere: tuple[float, ...] = Field((), max_length=MOST_TERMS)
    decentre: tuple[Offset, Offset] | None = None
    tilt_deg: tuple[Tilt, Tilt] | None = None
    figure: Figure | None = None
    thickness: float = Field(0.0, ge=-1000.0, le=10000.0)
    medium: Medium | None = None
    semi_diameter: float | None = Field(None, gt=0.0, le=2000.0)
    semi_diameter_estimated: StrictBool = False
    coating: Coating | None = None

    @property
    def meridian_x(self) -> tuple[float, float]:
        """Curvature and conic constant in the x-z plane."""
        c = self.curvature if self.curvature_x is None else self.curvature_x
        if self.torus:
            return c, 0.0
        return c, self.conic if self.conic_x is None else self.conic_x

    @property
    def toroidal(self) -> bool:
        """Whether it is a torus or its two meridians differ."""
        return self.torus or self.meridian_x != (self.curvature, self.conic)

    @property
    def equator(self) -> float:
        """Height at which the conic becomes parallel to the axis, mm: the radius of a sphere; inf for never."""
        return min(
            1.0 / (abs(curvature) * sqrt(1.0 + conic)) if curvature != 0.0 and conic > -1.0 else inf
            for curvature, conic in (self.meridian_x, (self.curvature, self.conic))
        )

    @property
    def lifted(self) -> float:
        """Largest departure of the asphere terms from the conic at the rim, mm; 0 for an unknown semi-diameter."""
        semi = self.semi_diameter or 0.0
        return abs(sum(term * semi**power for power, term in self.terms.items()))

    @property
    def terms(self) -> dict[int, float]:
        """Coefficients of its aspheric terms by the power of r; those that are 0 are left out."""
        even = {2 * k + 4: term for k, term in enumerate(self.asphere) if term}
        return even | {2 * k + 3: term for k, term in enumerate(self.odd_asphere) if term}

    @property
    def displaced(self) -> bool:
        """Whether it is decentred or tilted."""
        return any(self.decentre or ()) or any(self.tilt_deg or ())

    @model_validator(mode="after")
    def _is_one_form(self) -> Surface:
        if self.torus and self.conic_x:
            raise ValueError("a torus is a circle in the x-z plane; leave out conic_x, or torus")
        if self.torus and any(self.odd_asphere):
            raise ValueError("a torus has even terms only; leave out odd_asphere, or torus")
        return self


class Stop(Frozen):
    """The aperture stop: a plane that refracts nothing; the f-number sets its opening."""

    kind: Literal["stop"] = "stop"
    thickness: float = Field(0.0, ge=-1000.0, le=10000.0)


Row = Annotated[Surface | Stop, Field(discriminator="kind")]


class Element(Frozen):
    """Rows that move together: a lens, a cemented group, or any part between two gaps.

    Attributes
    ----------
    rows : tuple of int
        First and last row, both included; the stop is not among them.
    decentre : tuple of float
        Shift (x, y), mm.
    tilt_deg : tuple of float
        Rotation about the x axis, then about the lens' y axis, at the vertex of the first row.
    """

    rows: tuple[int, int]
    decentre: tuple[Offset, Offset] = (0.0, 0.0)
    tilt_deg: tuple[Tilt, Tilt] = (0.0, 0.0)

    @property
    def displaced(self) -> bool:
        """Whether it is decentred or tilted."""
        return any(self.decentre) or any(self.tilt_deg)


class Position(Frozen):
    """A setting of the zoom or focus: thicknesses of the moving gaps.

    Attributes
    ----------
    name : str
    gaps : tuple of (int, float)
        Row and the thickness behind it, mm.
    focal_length : float or None
        As the source states it, mm; a remark reports a difference from the traced value.
    focus_distance : float or None
        Distance of the plane in focus in front of the first vertex, mm, for a focus position; None: infinity.
    f_number, field_deg : float or None
        Values that differ from the lens' own; None: the same.
    """

    name: str = Field(min_length=1)
    gaps: tuple[tuple[int, Annotated[float, Field(ge=-1000.0, le=10000.0)]], ...] = Field(min_length=1)
    focal_length: float | None = Field(None, gt=0.0)
    focus_distance: float | None = Field(None, gt=0.0)
    f_number: float | None = Field(None, gt=LEAST_F_NUMBER, le=LARGEST_F_NUMBER)
    field_deg: float | None = Field(None, gt=0.0, lt=90.0)


class Lens(Frozen):
    """A validated prescription.

    Attributes
    ----------
    name, source, notes : str
        Title, origin of the numbers (patent), and observations.
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
    squeeze : float or None
        Factor by which an anamorphic lens compresses the image horizontally.
    iris : Iris
        Default blades.
    elements : tuple of Element
        Groups of rows that are decentred or tilted.
    positions : tuple of Position
        Settings of the zoom, or of the focus where inner gaps change with it.
    coating_presets : dict of str to tuple of Coating or None
        Named sets, one entry per row (the stop's is ignored).
    scatter : Scatter or None
        Surface scatter; None: none.
    """

    schema_version: Literal[1] = 1
    name: str = Field(min_length=1)
    source: str = ""
    notes: str = ""
    stated_focal_length: float | None = Field(None, gt=0.0)
    f_number: float = Field(gt=LEAST_F_NUMBER, le=LARGEST_F_NUMBER)
    field_deg: float | None = Field(None, gt=0.0, lt=90.0)
    sensor_distance: float | None = Field(None, gt=0.0)
    focus_distance: float | None = Field(None, gt=0.0)
    squeeze: float | None = Field(None, ge=0.25, le=4.0)
    iris: Iris = Iris()
    rows: tuple[Row, ...] = Field(min_length=2)
    elements: tuple[Element, ...] = ()
    positions: tuple[Position, ...] = ()
    coating_presets: dict[str, tuple[Coating | None, ...]] = Field(default_factory=dict)
    scatter: Scatter | None = None

    def __hash__(self) -> int:
        # equal lenses have equal rows; the presets are a dict, which has no hash
        return hash((self.name, self.rows))

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
            raise ValueError(NO_GLASS)
        last = self.rows[-1]
        if isinstance(last, Surface) and last.medium is not None:
            raise ValueError(f"row {len(self.rows) - 1}: behind the last row must be air, not glass")
        self._elements_are_apart(stops[0])
        self._positions_agree()
        for name, coatings in self.coating_presets.items():
            if len(coatings) != len(self.rows):
                raise ValueError(
                    f"coating preset {name!r} has {len(coatings)} entries, the lens has {len(self.rows)} rows"
                )
        return self

    def _elements_are_apart(self, stop: int) -> None:
        taken: dict[int, int] = {}
        for number, element in enumerate(self.elements):
            first, last = element.rows
            where = f"element {number} (rows {first} to {last})"
            if not 0 <= first <= last < len(self.rows):
                raise ValueError(f"{where}: give its first and last row, between 0 and {len(self.rows) - 1}")
            if first <= stop <= last:
                raise ValueError(f"{where} holds the stop, row {stop}, which is never moved; make it two elements")
            for row in range(first, last + 1):
                if row in taken:
                    raise ValueError(f"{where} shares row {row} with element {taken[row]}; a row belongs to one")
                taken[row] = number

    def _positions_agree(self) -> None:
        names = [position.name.lower() for position in self.positions]
        if any(position.focus_distance is not None for position in self.positions):
            settings = [(position.focal_length, position.focus_distance) for position in self.positions]
            for position, setting in zip(self.positions, settings, strict=True):
                other = self.positions[settings.index(setting)]
                if other is not position:
                    raise ValueError(
                        f"positions {other.name!r} and {position.name!r} are for one focal length and one focus "
                        "distance; make them differ"
                    )
        moving: set[int] | None = None
        for position in self.positions:
            where = f"position {position.name!r}"
            rows = {row for row, _ in position.gaps}
            if names.count(position.name.lower()) > 1:
                raise ValueError(f"{where} appears twice; give each position a unique name")
            if not rows <= set(range(len(self.rows) - 1)):
                raise ValueError(f"{where}: gaps lie behind rows 0 to {len(self.rows) - 2}")
            if moving is not None and rows != moving:
                raise ValueError(f"{where}: every position must give the same gaps, those behind rows {sorted(moving)}")
            moving = rows
            for row, gap in position.gaps:
                surface = self.rows[row]
                if isinstance(surface, Surface) and surface.medium is not None:
                    raise ValueError(f"{where}: behind row {row} is glass, whose thickness cannot change")
                if gap < 0.0:
                    raise ValueError(f"{where}: the gap behind row {row} is {gap:g} mm; moving gaps must be 0 or more")
