"""The lens analyses of the library: first-order data and the ghost table, for any form of lens, with all checks."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from .._version import __version__
from ..errors import ProjectError
from ..io.lens.coating_text import coating_choice
from ..model import Coating, CoatingChoice, Imperfection, Lens, Plate
from ..optics.lens.dispersion import D_LINE_NM
from ..optics.lens.paraxial import FirstOrder, first_order
from ..optics.lens.plane_plates import filter_length
from ..optics.rays.ghost_table import GhostQuery, GhostTable, ghost_table, pack_for_query
from ..optics.rays.pack import SensorMirror
from ..typing import Progress
from .analysis_memory import AnalysisMemory, AnalysisPart
from .image.partial_picture import digest_of
from .progress_parts import progress_parts
from .scene.resolve import (
    build,
    check_distances,
    check_in_front,
    check_opens,
    distance_from_front,
    open_lens,
)

# time of the search for paths of four reflections, and of the ghosts
_WEIGHTS = {"search": 1.0, "ghosts": 9.0}


def paraxial(
    lens: Lens | str | Path,
    f_number: float | None = None,
    *,
    sensor_distance: float | None = None,
    focus_distance: float | None = None,
) -> FirstOrder:
    """Compute focal length, pupils, stop and sensor position of a lens at the d line.

    Parameters
    ----------
    lens : Lens or str or Path
        A prescription, a shipped lens' name, or a lens file.
    f_number : float, optional
        None: wide open.
    sensor_distance, focus_distance : float, optional
        Override the values of the lens file, mm.

    Raises
    ------
    FlarewrightError
        The lens is unknown, forms no image, or does not reach the f-number, or a distance is not above 0.
    """
    check_distances(sensor_distance, focus_distance)
    known = open_lens(lens).lens
    check_opens(known, f_number)
    return first_order(known, f_number, sensor_distance=sensor_distance, focus_distance=focus_distance)


def ghosts(
    lens: Lens | str | Path,
    field_deg: tuple[float, float],
    *,
    f_number: float | None = None,
    coating: str | Path | Coating | CoatingChoice | None = None,
    wavelength_nm: float = D_LINE_NM,
    paths: str = "all",
    sensor_distance: float | None = None,
    focus_distance: float | None = None,
    zoom: str | float | None = None,
    filter_plate: Plate | None = None,
    cover_glass: Plate | None = None,
    sensor_reflectance: float = 0.0,
    imperfection: Imperfection | None = None,
    orders: int = 2,
    order4_limit: float = 1e-4,
    distance: float | None = None,
    remarks: list[str] | None = None,
    threads: int | None = None,
) -> GhostTable:
    """Analyse every ghost of a lens for one light.

    Parameters
    ----------
    lens : Lens or str or Path
        A prescription, a shipped lens' name, or a lens file.
    field_deg, distance, wavelength_nm, paths, orders, order4_limit
        As in `optics.rays.ghost_table.GhostQuery`.
    f_number : float, optional
        None: wide open.
    coating : str, path, Coating or CoatingChoice, optional
        A text as for the command line's `--coating`, one coating for all surfaces between glass and air, or one per
        row. None: the coatings of the lens file.
    sensor_distance, focus_distance : float, optional
        Override the values of the lens file, mm.
    zoom : str or float, optional
        Name of a zoom position, or a focal length in mm.
    filter_plate, cover_glass : Plate, optional
        Plane plates in front of the lens and of the sensor; they count as rows.
    sensor_reflectance : float
        Above 0 the sensor, taken as unbounded, is a mirror too, and the table has paths "sensor-i".
    imperfection : Imperfection, optional
        One sample of the lens within its tolerances.
    remarks : list of str, optional
        List to which assumptions and the rows of filter and cover glass are appended.
    threads : int, optional
        None: all cores. The results do not depend on it.

    Raises
    ------
    FlarewrightError
        As in `paraxial` and `find_ghosts`, and for a coating that does not fit the lens.
    """
    opened = open_lens(lens)
    built = build(
        opened.lens, coating_choice(coating), zoom=zoom, filter_plate=filter_plate,
        cover_glass=cover_glass, imperfection=imperfection, sensor_distance=sensor_distance,
        focus_distance=focus_distance,
    )  # fmt: skip
    if not 0.0 <= sensor_reflectance <= 1.0:
        raise ProjectError(f"a sensor reflects between 0 and 1 of the light, not {sensor_reflectance:g}")
    check_opens(built.lens, f_number)
    order = first_order(
        built.lens, f_number, sensor_distance=built.sensor_distance, focus_distance=built.focus_distance
    )
    sensor = SensorMirror(sensor_reflectance) if sensor_reflectance > 0.0 else None
    if distance is not None:
        distance = distance_from_front(distance, filter_plate, "distance")
    query = GhostQuery(field_deg, distance, wavelength_nm, paths, sensor, orders, order4_limit)
    ahead = filter_length(filter_plate)
    table, found = find_ghosts(built.lens, order, built.coating, query, ahead=ahead, threads=threads)
    if remarks is not None:
        remarks += (*opened.remarks, *built.remarks, *found)
    return table


def find_ghosts(
    lens: Lens,
    order: FirstOrder,
    coating: CoatingChoice,
    query: GhostQuery,
    *,
    ahead: float = 0.0,
    threads: int | None = None,
    progress: Progress | None = None,
    memory: AnalysisMemory | None = None,
) -> tuple[GhostTable, tuple[str, ...]]:
    """Analyse every ghost of a lens that is built, including those of four reflections on request.

    Parameters
    ----------
    lens : Lens
        With its plates, zoomed (`ResolvedProject.lens`).
    order : FirstOrder
        At the opening and focus to be used.
    coating : CoatingChoice
    query : GhostQuery
    ahead : float
        Length of the filter in front of the lens, mm: errors state the distance of the light from the lens.
    threads : int, optional
    progress : callable, optional
        Called with the finished fraction (0 to 1) and a description.
    memory : AnalysisMemory, optional
        Finished parts of analyses, of an interrupted command too; those of this one are added.

    Returns
    -------
    table : GhostTable
    remarks : tuple of str
        Four-reflection ghosts that are not listed.

    Raises
    ------
    ProjectError
        The light stands in or beside the lens, or the paths, the orders or their limit are unknown.
    """
    if not all(-90.0 < angle < 90.0 for angle in query.field_deg):
        across, up = query.field_deg
        raise ProjectError(f"a light stands less than 90 degrees from the axis, not at ({across:g}, {up:g})")
    if query.paths not in ("all", "same-side"):
        raise ProjectError(f"paths are 'all' or 'same-side', not {query.paths!r}")
    if query.orders not in (2, 4) or not 0.0 < query.order4_limit < 1.0:
        raise ProjectError(
            f"orders are 2 or 4, not {query.orders}, and their limit lies between 0 and 1: {query.order4_limit:g}"
        )
    packed = pack_for_query(lens, order, coating, query)
    check_in_front(packed, query.distance, lens.name, ahead)
    part = AnalysisPart() if memory is None else memory.part(digest_of(__version__, lens, packed, query))
    if query.orders == 2:
        return ghost_table(lens, packed, query, threads=threads, progress=progress, measured=part.rows), ()
    from .reference.four_reflections import find_four_reflections_unbounded

    parts = progress_parts(progress, _WEIGHTS)
    found = find_four_reflections_unbounded(
        lens, packed, query, threads=threads, progress=parts["search"], sums=part.sums
    )
    table = ghost_table(
        lens, packed, query, others=found.paths, threads=threads, progress=parts["ghosts"], measured=part.rows
    )
    # remove the rows below the limit
    two = sum(row.throughput_mm2 for row in table.ghosts if not row.later_reflections)
    rows = [row for row in table.ghosts if not row.later_reflections or row.throughput_mm2 > query.order4_limit * two]
    dark, share = found.left_out({row.name for row in rows})
    remark = (
        f"ghosts of four reflections carry {found.share:.2%} of what those of two do; {dark} fainter ones with "
        f"{share:.1%} of that are not listed"
    )
    return replace(table, ghosts=tuple(rows)), (remark,)
