"""Ghosts over fields, wavelengths and f-numbers, and the surfaces where a better coating gains most."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby, product
from math import atan, degrees, hypot, radians, tan

from ..model import Project
from ..optics.lens.plane_plates import filter_length
from ..optics.rays.ghost_table import GhostQuery, GhostTable
from ..render.analysis import find_ghosts
from ..render.analysis_memory import AnalysisMemory
from ..render.scene.resolve import resolve_project
from ..typing import Progress


@dataclass(frozen=True)
class SweepPoint:
    """The ghosts of one combination.

    Attributes
    ----------
    field_deg : tuple of float
        Field angles of the light.
    wavelength_nm, f_number : float
    table : GhostTable
    """

    field_deg: tuple[float, float]
    wavelength_nm: float
    f_number: float
    table: GhostTable

    @property
    def throughput_mm2(self) -> float:
        """Flux of all ghosts, as in `optics.rays.ghost_table.GhostRow`."""
        return sum(row.throughput_mm2 for row in self.table.ghosts)


@dataclass(frozen=True)
class SurfaceGain:
    """What a coating without reflection would gain at one surface.

    Attributes
    ----------
    row : int
        Row of the lens.
    part : float
        Flux of the ghosts that reflect there over the flux of all ghosts, both summed over the sweep.
    largest_part : float
        The same at the point of the sweep where it is largest.
    brightest : str or None
        Of these ghosts, the one with the largest peak irradiance at any point; None where no point has a direct image.
    peak_irradiance : float
        That peak, as in `optics.rays.ghost_table.GhostRow`.
    """

    row: int
    part: float
    largest_part: float
    brightest: str | None
    peak_irradiance: float


def along(light_deg: tuple[float, float], angles_deg: Sequence[float]) -> tuple[tuple[float, float], ...]:
    """Return field angles at distances from the axis in the direction of a light, to the right for one on the axis."""
    # directions are a straight line in the picture in their tangents, not in field angles
    x, y = (tan(radians(angle)) for angle in light_deg)
    length = hypot(x, y)
    right, up = (1.0, 0.0) if length == 0.0 else (x / length, y / length)
    return tuple((_part(angle, right), _part(angle, up)) for angle in angles_deg)


def _part(angle_deg: float, part: float) -> float:
    """Return the field angle along an axis of the picture, whose tangent is a part of that of the whole angle."""
    # along an axis without rounding
    if part in (-1.0, 0.0, 1.0):
        return angle_deg * part
    return degrees(atan(tan(radians(angle_deg)) * part))


def sweep_ghosts(
    project: Project,
    query: GhostQuery,
    fields_deg: Sequence[tuple[float, float]],
    wavelengths_nm: Sequence[float],
    f_numbers: Sequence[float | None],
    *,
    memory: AnalysisMemory | None = None,
    progress: Progress | None = None,
) -> Iterator[SweepPoint]:
    """Analyse the ghosts of every combination.

    Parameters
    ----------
    project : Project
        Lens, coating, plates and focus; its f-number is replaced.
    query : GhostQuery
        Everything but field and wavelength.
    fields_deg : sequence of (float, float)
    wavelengths_nm : sequence of float
    f_numbers : sequence of float or None
        None: wide open.
    memory, progress
        As of `render.analysis.find_ghosts`.

    Yields
    ------
    SweepPoint
        In the order of f-numbers, fields, wavelengths.

    Raises
    ------
    FlarewrightError
        As in `render.analysis.ghosts`.
    """
    number, done = len(f_numbers) * len(fields_deg) * len(wavelengths_nm), 0
    for f_number, points in groupby(product(f_numbers, fields_deg, wavelengths_nm), key=lambda point: point[0]):
        settled = resolve_project(project.replace(f_number=f_number))
        for _, field_deg, wavelength_nm in points:
            asked = replace(query, field_deg=field_deg, wavelength_nm=wavelength_nm)
            table, _ = find_ghosts(
                settled.lens, settled.order, settled.coating, asked, ahead=filter_length(project.filter), memory=memory,
                progress=_of_point(progress, done, number),
            )  # fmt: skip
            done += 1
            yield SweepPoint(field_deg, wavelength_nm, table.f_number, table)


def _of_point(progress: Progress | None, done: int, number: int) -> Progress | None:
    """Return the callback of one point of a sweep."""
    if progress is None:
        return None
    return lambda part, words: progress((done + part) / number, f"{done + 1} of {number}, {words}")


def surface_gains(points: Sequence[SweepPoint]) -> tuple[SurfaceGain, ...]:
    """Rank surfaces by the ghost light that a coating without reflection there would remove.

    Returns
    -------
    tuple of SurfaceGain
        The largest gain first. A ghost counts at each surface that reflects it once, so that the parts of ghosts with
        two reflections add up to 2.

    Notes
    -----
    A ghost's flux is proportional to the product of the reflectances of its surfaces; if one of them is 0, the ghost
    vanishes. The other ghosts gain by at most the reflectance at each passage through that surface.
    """
    everything = sum(point.throughput_mm2 for point in points)
    light: dict[int, float] = {}
    largest: dict[int, float] = {}
    # peaks of points without a direct image are 0 and cannot be compared
    peaks: dict[int, tuple[float, str | None]] = {}
    for point in points:
        here: dict[int, float] = {}
        for ghost in point.table.ghosts:
            mirrors = {ghost.first_reflection, ghost.second_reflection, *ghost.later_reflections}
            for row in mirrors:
                # the sensor is a mirror, too, but has no coating of the lens
                if isinstance(row, int):
                    here[row] = here.get(row, 0.0) + ghost.throughput_mm2
                    if ghost.peak_irradiance > peaks.setdefault(row, (0.0, None))[0]:
                        peaks[row] = (ghost.peak_irradiance, ghost.name)
        for row, flux in here.items():
            light[row] = light.get(row, 0.0) + flux
            part = flux / point.throughput_mm2 if point.throughput_mm2 > 0.0 else 0.0
            largest[row] = max(largest.get(row, 0.0), part)
    gains = [
        SurfaceGain(row, flux / everything if everything > 0.0 else 0.0, largest[row], peaks[row][1], peaks[row][0])
        for row, flux in light.items()
    ]
    return tuple(sorted(gains, key=lambda gain: (-gain.part, gain.row)))
