"""Predict the flare of a scene: every light in every camera at every time, ranked."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import datetime
from math import inf, log2

import numpy as np

from ..model.project.scene import Scene, SceneCamera, SceneLight
from ..typing import Floats, Mask, Progress
from .contrast import WASHED, contrast
from .flare import Flare, Frame
from .photometry import exposure_level
from .pictures import Memory, PictureRequest, Spread, draw_all
from .statistics import NAMES
from .table import FlareTable
from .tracks import CameraSighting, CameraTrack, camera_track, moments, sightings

FlareMaker = Callable[[SceneCamera, SceneLight, float, float | None], tuple[Flare, Frame]]

# distance between drawn constellations, degrees; lights smaller than the second number are drawn as points
STEP_DEG, POINT_DEG = 2.0, 1.0
# distance, focal lengths, below which a light's ghosts differ from those of a distant light
NEAR = 50.0
# change of distance, as a factor, below which ghosts hardly change
STAYS = 2.0


@dataclass(frozen=True)
class Pair:
    """One light in one camera over time.

    Attributes
    ----------
    sighting : CameraSighting
    values : ndarray, shape (T, 5)
        `statistics.NAMES`, in lx on the sensor (the sum in lx mm^2); NaN where unknown.
    known : ndarray of bool, shape (T,)
        Whether the camera's flare is known at that time.
    """

    sighting: CameraSighting
    values: Floats
    known: Mask

    def column(self, name: str) -> Floats:
        """Return one statistic over time, shape (T,)."""
        return self.values[:, NAMES.index(name)]


@dataclass(frozen=True)
class Plan:
    """A scene with all its flare.

    Attributes
    ----------
    scene : Scene
    times_s : ndarray, shape (T,)
    dates : tuple of datetime or None
    tracks : tuple of CameraTrack
    tables : tuple of tuple of FlareTable
        By camera and light.
    pairs : tuple of tuple of Pair
        By camera and light.
    remarks : tuple of str
    """

    scene: Scene
    times_s: Floats
    dates: tuple[datetime, ...] | None
    tracks: tuple[CameraTrack, ...]
    tables: tuple[tuple[FlareTable, ...], ...]
    pairs: tuple[tuple[Pair, ...], ...]
    remarks: tuple[str, ...]

    def scene_scale(self, camera: int) -> float:
        """Return the illuminance on a camera's sensor per luminance of the scene, lx per cd/m^2."""
        return self.tables[camera][0].flare.scene_scale

    def veil(self, camera: int, light: int | None = None) -> Floats:
        """Return the mean flare of one light or of all, as luminance of the scene, cd/m^2, shape (T,).

        NaN where a light is outside the known range of the camera's flare.
        """
        chosen = self.pairs[camera] if light is None else [self.pairs[camera][light]]
        total = np.zeros(len(self.times_s))
        for pair in chosen:
            total = total + pair.column("mean")
        return total / self.scene_scale(camera)

    @property
    def ideal_contrast(self) -> float | None:
        """K_ideal (equation 9.1), or None when the scene's luminance is unknown."""
        if self.scene.luminance_cd_m2 is None:
            return None
        low, high = self.scene.luminance_cd_m2
        return contrast(high, low, 0.0).k_ideal

    def contrast_left(self, veil_cd_m2: Floats) -> Floats | None:
        """Return K_real / K_ideal under a veil (equation 9.3), or None when the scene's luminance is unknown."""
        if self.scene.luminance_cd_m2 is None:
            return None
        low, high = self.scene.luminance_cd_m2
        return np.array([contrast(high, low, float(one)).ratio for one in veil_cd_m2])

    def glare_indicator(self, camera: int, light: int) -> Floats | None:
        """Return the log-average of a flare over that of the scene (Walch 2017, section 9.2), shape (T,)."""
        if self.scene.luminance_cd_m2 is None:
            return None
        low, high = self.scene.luminance_cd_m2
        key = self.scene.key_cd_m2 if self.scene.key_cd_m2 is not None else float(np.sqrt(low * high))
        if key <= 0.0:
            return None
        return self.pairs[camera][light].column("log_average") / self.scene_scale(camera) / key


@dataclass(frozen=True)
class Ranked:
    """Result of the ranking for a light in a camera.

    Attributes
    ----------
    camera, light : int
    known_share : float
        Part of the time in which the camera's flare is known; the following values refer to it, None if it is 0.
    mean_veil_cd_m2 : float or None
        Mean over time.
    worst : int or None
        Index of the time with the brightest veil.
    worst_veil_cd_m2 : float or None
    worst_constellation_deg : float or None
    contrast_left : float or None
        At that time.
    seen_share : float or None
        Part of the time in which less than nine tenths of the contrast remain.
    brightest_stops : float or None
        Exposure of the brightest spot at any time, relative to clipping; above 0 it clips. None if the clipping level
        of a measured flare is unknown.
    """

    camera: int
    light: int
    known_share: float
    mean_veil_cd_m2: float | None = None
    worst: int | None = None
    worst_veil_cd_m2: float | None = None
    worst_constellation_deg: float | None = None
    contrast_left: float | None = None
    seen_share: float | None = None
    brightest_stops: float | None = None


def _tables_of(
    scene: Scene, seen: Sequence[Sequence[CameraSighting]], maker: FlareMaker, memory: Memory | None = None
) -> tuple[tuple[FlareTable, ...], ...]:
    """Build the tables of all cameras and lights; equal flares share their pictures."""
    known: Memory = {} if memory is None else memory
    out = []
    for camera, row in zip(scene.cameras, seen, strict=True):
        tables = []
        for light, sighting in zip(scene.lights, row, strict=True):
            flare, frame = near_or_far(maker, camera, light, sighting)
            tables.append(FlareTable(flare, frame, STEP_DEG, drawn=known.setdefault(flare.fingerprint, {})))
        out.append(tuple(tables))
    return tuple(out)


def near_or_far(
    maker: FlareMaker, camera: SceneCamera, light: SceneLight, sighting: CameraSighting
) -> tuple[Flare, Frame]:
    """Return the flare of a light at its distance, and the camera's frame."""
    size = rounded_diameter(sighting)
    flare, frame = maker(camera, light, size, None)
    distance = rounded_distance(sighting, flare.efl)
    return (flare, frame) if distance is None else maker(camera, light, size, distance)


def rounded_distance(sighting: CameraSighting, efl_mm: float | None) -> float | None:
    """Return the distance at which a light is drawn, m: its median over time, rounded so that few are drawn.

    None (infinite) if it never comes within `NEAR` focal lengths, or if the focal length is unknown, as for a measured
    flare, whose light had a fixed distance. Otherwise 1 m times a power of the square root of two.
    """
    lit = sighting.illuminance_lx > 0.0
    if efl_mm is None or not lit.any() or sighting.distance_m[lit].min() >= 1e-3 * NEAR * abs(efl_mm):
        return None
    return float(2.0 ** (0.5 * round(2.0 * log2(float(np.median(sighting.distance_m[lit]))))))


def rounded_diameter(sighting: CameraSighting) -> float:
    """Return the angular diameter at which a light is drawn: its largest over time, rounded so that few are drawn.

    Below one degree it is a point, which is three times as fast: the mean changes by less than a thousandth, the
    brightest spots become up to a tenth brighter. Above, it is a power of two degrees.
    """
    lit = sighting.illuminance_lx > 0.0
    largest = float(sighting.diameter_deg[lit].max()) if lit.any() else 0.0
    return 0.0 if largest < POINT_DEG else min(2.0 ** round(log2(largest)), 32.0)


def plan_scene(
    scene: Scene,
    maker: FlareMaker,
    progress: Callable[[str], Progress],
    memory: Memory | None = None,
    spread: Spread | None = None,
) -> Plan:
    """Compute the positions of cameras and lights over time, and the flare of all pairs.

    Parameters
    ----------
    scene : Scene
    maker : callable
        Maps (camera, light, diameter_deg, distance_m) to a flare for tables and the camera's frame; a distance of None
        is infinite.
    progress : callable
        Called with the name of a part of the work; returns the progress callback of that part.
    memory : dict, optional
        Pictures drawn before, by the flares' fingerprints; new ones are added.
    spread : callable, optional
        Draws pictures by other processes; the plan does not depend on it.

    Raises
    ------
    FlarewrightError
        When a lens cannot be used, or a light is at a camera's position.
    """
    times, dates = moments(scene)
    tracks = tuple(camera_track(one, times, f"cameras[{c}] ({one.name})") for c, one in enumerate(scene.cameras))
    seen = sightings(scene, tracks, times, dates)
    tables = _tables_of(scene, seen, maker, memory)
    # all pictures that the sightings need, so that the progress is known
    pairs_of = (
        (table, sighting) for row in zip(tables, seen, strict=True) for table, sighting in zip(*row, strict=True)
    )
    draw_all(
        [request for table, sighting in pairs_of for request in requests_of(table, sighting)],
        spread,
        progress("flares"),
    )
    pairs, remarks = [], []
    for c, (camera, row) in enumerate(zip(scene.cameras, seen, strict=True)):
        remarks += [f"{camera.name}: {remark}" for table in tables[c] for remark in table.flare.remarks]
        line = []
        for k, (light, sighting) in enumerate(zip(scene.lights, row, strict=True)):
            pair = _measured(tables[c][k], sighting)
            line.append(pair)
            remarks += _pair_remarks(camera, light, tables[c][k].flare, pair)
        pairs.append(tuple(line))
    return Plan(scene, times, dates, tracks, tables, tuple(pairs), tuple(dict.fromkeys(remarks)))


def requests_of(table: FlareTable, sighting: CameraSighting, times: Mask | None = None) -> list[PictureRequest]:
    """Return the pictures that the flare of a light needs.

    Parameters
    ----------
    table : FlareTable
    sighting : CameraSighting
    times : ndarray of bool, shape (T,), optional
        Times that count (default: all).

    Returns
    -------
    list of PictureRequest
        Each once.
    """
    angles = sighting.constellation_deg
    lit = table.flare.covers(angles) & (sighting.illuminance_lx > 0.0)
    needed: dict[tuple[float, float], PictureRequest] = {}
    for t in np.flatnonzero(lit if times is None else lit & times):
        for node, roll, _, _ in table.nodes(float(angles[t]), float(sighting.roll_deg[t])):
            request = table.request(node, roll)
            needed[request.at] = request
    return list(needed.values())


def _measured(table: FlareTable, sighting: CameraSighting) -> Pair:
    angles, lux = sighting.constellation_deg, sighting.illuminance_lx
    inside = table.flare.covers(angles)
    known = inside | table.flare.dark_beyond | (lux == 0.0)
    values = np.where(known[:, None], np.zeros(len(NAMES)), np.nan)
    for t in np.flatnonzero(inside & (lux > 0.0)):
        values[t] = table.between(float(angles[t]), float(sighting.roll_deg[t])).values * lux[t]
    return Pair(sighting, values, known)


def _pair_remarks(camera: SceneCamera, light: SceneLight, flare: Flare, pair: Pair) -> list[str]:
    remarks = []
    unknown = float(np.mean(~pair.known))
    if unknown > 0.0:
        remarks.append(
            f"{camera.name} was measured from {flare.least_deg:g} to {flare.reach_deg:g} degrees; {light.name} stands "
            f"elsewhere in {unknown:.0%} of the times, in which its flare is not known"
        )
    drawn = rounded_distance(pair.sighting, flare.efl)
    lit = pair.sighting.distance_m[pair.sighting.illuminance_lx > 0.0]
    if drawn is not None and float(lit.max() / lit.min()) > STAYS:
        remarks.append(
            f"{light.name} moves between {lit.min():.3g} m and {lit.max():.3g} m from {camera.name}: its ghosts are "
            f"drawn for a distance of {drawn:.3g} m, only its brightness follows"
        )
    return remarks


def ranking(plan: Plan) -> list[Ranked]:
    """Rank every light in every camera by its mean veil over time, worst first.

    Returns
    -------
    list of Ranked
        Pairs whose flare is unknown come last.
    """
    out = []
    for c, camera in enumerate(plan.scene.cameras):
        for k, pair in enumerate(plan.pairs[c]):
            if not pair.known.any():
                out.append(Ranked(c, k, 0.0))
                continue
            veil = plan.veil(c, k)
            worst = int(np.nanargmax(veil))
            left = plan.contrast_left(veil)
            peak = float(pair.column("maximum")[pair.known].max())
            level = _level(peak, camera, plan.tables[c][k].flare)
            out.append(
                Ranked(
                    camera=c,
                    light=k,
                    known_share=float(pair.known.mean()),
                    mean_veil_cd_m2=float(veil[pair.known].mean()),
                    worst=worst,
                    worst_veil_cd_m2=float(veil[worst]),
                    worst_constellation_deg=float(pair.sighting.constellation_deg[worst]),
                    contrast_left=None if left is None else float(left[worst]),
                    seen_share=None if left is None else float(np.mean(left[pair.known] < WASHED)),
                    brightest_stops=log2(level) if level > 0.0 else None,
                )
            )
    return sorted(out, key=lambda one: (-_or(one.mean_veil_cd_m2, -inf), one.camera, one.light))


def _level(peak: float, camera: SceneCamera, flare: Flare) -> float:
    """Return the signal of a flare's brightest spot over its clipping level; 0 when unknown or dark."""
    if camera.model is None:
        return exposure_level(peak, camera.iso, camera.exposure_s)
    return 0.0 if flare.over_clipping is None else peak * flare.over_clipping


def _or(value: float | None, otherwise: float) -> float:
    return otherwise if value is None else value
