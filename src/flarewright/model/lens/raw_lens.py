"""A prescription as a foreign file states it, before validation and repair."""

from __future__ import annotations

from typing import NamedTuple

from ..base import Frozen
from .glass import Medium
from .prescription import Lens, Surface


class LensReading(NamedTuple):
    """A usable lens, and a remark on everything that the reader noticed, assumed or repaired.

    Attributes
    ----------
    lens : Lens
    remarks : tuple of str
        One sentence each; rows are counted from 0.
    """

    lens: Lens
    remarks: tuple[str, ...]


class RawRow(Frozen):
    """One row of the file's table.

    Attributes
    ----------
    line : int
        Line of the file, counted from 1.
    stop : bool
    curvature : float
        1 / radius in 1/mm; 0 is flat.
    thickness : float
        Distance to the next row, mm.
    n_d, v_d : float
        Of the medium behind the row; 1 and 0 for air.
    medium : Medium or None
        The same with its dispersion; None is air.
    aperture : float
        The aperture column, mm: a diameter or a semi-diameter, not yet determined.
    coating_layers : int
    """

    line: int
    stop: bool = False
    curvature: float = 0.0
    thickness: float = 0.0
    n_d: float = 1.0
    v_d: float = 0.0
    medium: Medium | None = None
    aperture: float = 0.0
    coating_layers: int = 0


class RawLens(Frozen):
    """Rows of a `.lens` file; `lens_import.patent_repair` makes a Lens of it or raises an error with the reason.

    Attributes
    ----------
    file : str
        File name, for messages.
    name : str
        The `name:` line.
    title, patent : str
        From the header comment.
    f_number : float or None
        From the header comment; None when it states none.
    focal_length : float or None
        The `focal_length:` line in mm; None for infinity or when missing.
    stated_surfaces : int or None
        Count of the header comment.
    rows : tuple of RawRow
    remarks : tuple of str
        What the reader noticed (glasses, odd lines).
    """

    file: str
    name: str
    title: str = ""
    patent: str = ""
    f_number: float | None = None
    focal_length: float | None = None
    stated_surfaces: int | None = None
    rows: tuple[RawRow, ...]
    remarks: tuple[str, ...] = ()


class SequenceRow(Frozen):
    """One surface of a sequential ray-trace file.

    Attributes
    ----------
    number : int
        Number in the file; the object is 0.
    surface : Surface
        Includes the medium behind it.
    stop : bool
        Whether the file marks it as the stop; a stop can also refract.
    automatic_rim : bool
        Whether the program that wrote the file computed the semi-diameter, so that the file's fields pass.
    """

    number: int
    surface: Surface
    stop: bool = False
    automatic_rim: bool = False


class Configuration(Frozen):
    """One setting of a file that holds several: what differs from the file's surfaces.

    Attributes
    ----------
    number : int
        Number in the file, from 1.
    gaps : tuple of (int, float)
        Number of a surface and the gap behind it, mm.
    f_number, entrance_pupil_diameter, stop_semi_diameter, field_deg, image_height : float or None
        As in `RawSequence`, all of this setting.
    focus_distance : float or None
        From the object to the first surface, mm; None: object at infinity.
    """

    number: int
    gaps: tuple[tuple[int, float], ...] = ()
    f_number: float | None = None
    entrance_pupil_diameter: float | None = None
    stop_semi_diameter: float | None = None
    field_deg: float | None = None
    image_height: float | None = None
    focus_distance: float | None = None


class RawSequence(Frozen):
    """Rows of a sequential ray-trace file; `sequential_import` makes a Lens of it or raises an error with the reason.

    Attributes
    ----------
    file : str
        File name, for messages.
    name, notes : str
    rows : tuple of SequenceRow
        Between object and image, mm.
    f_number, entrance_pupil_diameter : float or None
        Aperture specification; when both are None, the stop's semi-diameter is the specification.
    stop_semi_diameter : float or None
    field_deg, image_height : float or None
        The largest field, as an angle or as an image height in mm.
    focus_distance : float or None
        From the object to the first of `rows`, mm; None: object at infinity.
    stated_focal_length : float or None
        As the file states it, mm.
    configurations : tuple of Configuration
        Settings of a zoom or of the focus; empty for a file with one.
    remarks : tuple of str
    """

    file: str
    name: str
    notes: str = ""
    rows: tuple[SequenceRow, ...]
    f_number: float | None = None
    entrance_pupil_diameter: float | None = None
    stop_semi_diameter: float | None = None
    field_deg: float | None = None
    image_height: float | None = None
    focus_distance: float | None = None
    stated_focal_length: float | None = None
    configurations: tuple[Configuration, ...] = ()
    remarks: tuple[str, ...] = ()
