"""Insert filters and cover glasses into a lens as rows."""

from __future__ import annotations

from ...errors import ProjectError
from ...model import Lens, Medium, Plate, Surface
from .paraxial import first_order

# default gaps between a filter and the first vertex, and between a cover glass and the sensor, mm
FILTER_GAP, COVER_GAP = 5.0, 0.5
# a sensor lies behind the last vertex: a cover glass on the sensor is a nanometre in front of it
CEMENTED_GAP = 1e-6
# rows of a filter in front of the rows of the lens
FILTER_ROWS = 2


def _faces(plate: Plate, medium: Medium, behind: float) -> tuple[Surface, Surface]:
    front = Surface(thickness=plate.thickness, medium=medium, coating=plate.coating)
    return front, Surface(thickness=behind, coating=plate.coating)


def filter_length(plate: Plate | None) -> float:
    """Return the distance from the front of a filter to the first vertex of the lens, mm; 0 without one."""
    return 0.0 if plate is None else plate.thickness + (FILTER_GAP if plate.gap is None else plate.gap)


def with_filter(lens: Lens, plate: Plate, medium: Medium) -> Lens:
    """Put a plane plate in front of a lens.

    Parameters
    ----------
    lens : Lens
    plate : Plate
    medium : Medium
        Its glass.

    Returns
    -------
    Lens
        The filter is its first two rows; all row numbers rise by two.
    """
    faces = _faces(plate, medium, FILTER_GAP if plate.gap is None else plate.gap)
    moved = tuple(element.replace(rows=(element.rows[0] + 2, element.rows[1] + 2)) for element in lens.elements)
    presets = {name: (plate.coating, plate.coating, *rows) for name, rows in lens.coating_presets.items()}
    positions = tuple(
        position.replace(gaps=tuple((row + 2, gap) for row, gap in position.gaps)) for position in lens.positions
    )
    return lens.replace(
        rows=(*faces, *lens.rows), elements=moved, coating_presets=presets, positions=positions
    )  # fmt: skip


def with_cover_glass(
    lens: Lens,
    plate: Plate,
    medium: Medium,
    *,
    sensor_distance: float | None = None,
    focus_distance: float | None = None,
) -> Lens:
    """Put a plane plate in front of the sensor; the sensor stays in focus.

    Parameters
    ----------
    lens : Lens
    plate : Plate
    medium : Medium
        Its glass.
    sensor_distance, focus_distance : float, optional
        Override those of the lens file, mm. A stated sensor distance is from the original last vertex.

    Returns
    -------
    Lens
        The plate is its last two rows; its distance to the sensor is the plate's `gap`.

    Raises
    ------
    ProjectError
        When the plate does not fit behind the lens.

    Notes
    -----
    A plate of index n and thickness t moves the paraxial focus back by t (1 - 1/n), for any position behind the lens;
    the sensor moves with the focus, unless its distance is stated.
    """
    gap = COVER_GAP if plate.gap is None else plate.gap
    stated = sensor_distance if sensor_distance is not None or focus_distance is not None else lens.sensor_distance
    if stated is None:
        plain = first_order(lens, sensor_distance=sensor_distance, focus_distance=focus_distance).sensor_distance
        stated = plain + plate.thickness * (1.0 - 1.0 / medium.n_d)
    room = stated - plate.thickness - gap
    if room < 0.0:
        raise ProjectError(
            f"the cover glass ({plate.thickness:g} mm, {gap:g} mm in front of the sensor) does not fit behind "
            f"{lens.name}, whose sensor lies {stated:.2f} mm behind its last vertex"
        )
    last = lens.rows[-1].replace(thickness=room)
    faces = _faces(plate, medium, 0.0)
    presets = {name: (*rows, plate.coating, plate.coating) for name, rows in lens.coating_presets.items()}
    return lens.replace(
        rows=(*lens.rows[:-1], last, *faces),
        coating_presets=presets,
        sensor_distance=max(gap, CEMENTED_GAP),
        focus_distance=None,
    )
