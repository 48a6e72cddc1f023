"""The analyses as a person calls them: any form of lens, every check made."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..errors import ProjectError
from ..io.coating_text import coating_choice
from ..model import Coating, CoatingChoice, Imperfection, Lens, Plate
from ..optics.bundle import least_distance
from ..optics.ghosts import GhostTable, ghost_table
from ..optics.pack import SensorMirror, pack_lens, resolve_coatings
from ..optics.paraxial import D_LINE_NM, FirstOrder
from .prepare import as_lens, build, first_order

if TYPE_CHECKING:
    from .four_reflections import FourReflections


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
        Override the lens file's, mm.

    Returns
    -------
    FirstOrder

    Raises
    ------
    FlarewrightError
        When there is no such lens, it makes no image, or it does not open that far.
    """
    known = as_lens(lens)
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
    """Analyse every ghost of a lens for one light (`optics.ghosts.ghost_table`).

    Parameters
    ----------
    lens : Lens or str or Path
        A prescription, a shipped lens' name, or a lens file.
    field_deg : tuple of float
        (X, Y) of the light.
    f_number : float, optional
        None: wide open.
    coating : str, path, Coating or CoatingChoice, optional
        A text as the command line's `--coating` takes it, one coating for all surfaces between glass and air, or one a
        row. None: as the lens file says.
    wavelength_nm : float
    paths : {"all", "same-side"}
    sensor_distance, focus_distance : float, optional
        Override the lens file's, mm.
    zoom : str or float, optional
        A position's name or a focal length, mm.
    filter_plate, cover_glass : Plate, optional
        Plane plates in front of the lens and of the sensor; they are rows too.
    sensor_reflectance : float
        Above 0 the sensor, unbounded here, is a mirror too, and there are paths "sensor-i".
    imperfection : Imperfection, optional
        One sample of the lens within tolerances.
    orders : {2, 4}
        4 adds ghosts of four reflections.
    order4_limit : float
        Of those only paths that carry more than this part of all two-reflection light on the unbounded sensor plane.
    distance : float, optional
        How far in front of the first vertex the light stands, mm along the axis; None: distant.
    remarks : list of str, optional
        What is assumed on the way, and which rows a filter and a cover glass are, is appended to it.
    threads : int, optional
        None: all cores; the numbers do not depend on it.

    Returns
    -------
    GhostTable

    Raises
    ------
    FlarewrightError
        As `paraxial`, and for a coating that does not fit the lens.
    """
    known = as_lens(lens, remarks=remarks)
    built = build(
        known, coating_choice(coating), zoom=zoom, filter_plate=filter_plate,
        cover_glass=cover_glass, imperfection=imperfection, sensor_distance=sensor_distance,
        focus_distance=focus_distance,
    )  # fmt: skip
    if remarks is not None:
        remarks.extend(built.remarks)
    if not 0.0 <= sensor_reflectance <= 1.0:
        raise ProjectError(f"a sensor reflects between 0 and 1 of the light, not {sensor_reflectance:g}")
    if orders not in (2, 4) or not 0.0 < order4_limit < 1.0:
        raise ProjectError(f"orders are 2 or 4, not {orders}, and their limit lies between 0 and 1: {order4_limit:g}")
    # refuses an f-number that the lens does not open to
    order = first_order(
        built.lens, f_number, sensor_distance=built.sensor_distance, focus_distance=built.focus_distance
    )
    sensor = SensorMirror(sensor_reflectance) if sensor_reflectance > 0.0 else None
    found = None
    packed = pack_lens(
        built.lens, order, resolve_coatings(built.lens, built.coating), np.array([wavelength_nm]), sensor=sensor
    )
    if distance is not None and not distance > least_distance(packed):
        raise ProjectError(
            f"a light at {distance:g} mm stands in the lens {built.lens.name} or behind its entrance pupil; "
            f"give more than {least_distance(packed):.4g} mm"
        )
    if orders == 4:
        from .four_reflections import find_fours_everywhere

        found = find_fours_everywhere(
            built.lens, packed, field_deg, order4_limit, distance=distance, which=paths, threads=threads
        )
    table = ghost_table(
        built.lens,
        field_deg,
        f_number=f_number,
        coating=built.coating,
        wavelength_nm=wavelength_nm,
        paths=paths,
        sensor_distance=built.sensor_distance,
        focus_distance=built.focus_distance,
        sensor=sensor,
        others=() if found is None else found.paths,
        distance=distance,
        threads=threads,
    )
    return table if found is None else _above(table, found, order4_limit, remarks)


def _above(table: GhostTable, found: FourReflections, limit: float, remarks: list[str] | None) -> GhostTable:
    """Leave out four-reflection rows below the limit, and tell what is missing."""
    two = sum(row.throughput_mm2 for row in table.ghosts if not row.later_reflections)
    rows = [row for row in table.ghosts if not row.later_reflections or row.throughput_mm2 > limit * two]
    if remarks is not None:
        dark, part = found.left_out({row.name for row in rows})
        remarks.append(
            f"ghosts of four reflections carry {found.share:.2%} of what those of two do; {dark} fainter ones with "
            f"{part:.1%} of that are not listed"
        )
    return replace(table, ghosts=tuple(rows))
