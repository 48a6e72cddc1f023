"""A scene's flare: every light in every camera at every time, ranked."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import datetime
from math import inf, log2

import numpy as np
from numpy.typing import NDArray

from ..model.scene import Scene, SceneCamera, SceneLight
from .contrast import WASHED, contrast
from .curves import Progress
from .flare import Flare, Frame
from .photometry import exposure_level
from .statistics import NAMES
from .table import FlareTable, Memory
from .tracks import CameraTrack, Sighting, camera_track, moments, sightings

Floats = NDArray[np.float64]
FlareMaker = Callable[[SceneCamera, SceneLight, float, float | None], tuple[Flare, Frame]]

# between drawn constellations, degrees; lights smaller than this are drawn as points
STEP_DEG, POINT_DEG = 2.0, 1.0
# nearer than so many focal lengths a light's ghosts are no longer those of a distant one
NEAR = 50.0
# a distance that changes by less than this factor changes no ghost much
STAYS = 2.0

__all__ = [
    "FlareMaker", "Pair", "Plan", "Ranked", "near_or_far", "plan_scene", "ranking", "rounded_diameter",
    "rounded_distance", "tables_of",
]  # fmt: skip


@dataclass(frozen=True)
class Pair:
    """One light in one camera over time.

    Attributes
    ----------
    sighting : Sighting
    values : ndarray, shape (T, 5)
        `statistics.NAMES`, in lx on the sensor (the sum in lx mm^2); NaN where it is not known.
    known : ndarray of bool, shape (T,)
        Whether the camera's flare is known there.
    """

    sighting: Sighting
    values: Floats
    known: NDArray[np.bool_]

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
        """Return the mean flare of one light, or of all together, as luminance of the scene, cd/m^2, shape (T,).

        NaN where a light stands beyond what is known of the camera.
        """
        chosen = self.pairs[camera] if light is None else [self.pairs[camera][light]]
        total = np.zeros(len(self.times_s))
        for pair in chosen:
            total = total + pair.column("mean")
        return total / self.scene_scale(camera)

    @property
    def ideal_contrast(self) -> float | None:
        """K_ideal (equation 9.1), or None when the scene's luminance is not told."""
        if self.scene.luminance_cd_m2 is None:
            return None
        low, high = self.scene.luminance_cd_m2
        return contrast(high, low, 0.0).k_ideal

    def contrast_left(self, veil_cd_m2: Floats) -> Floats | None:
        """Return K_real / K_ideal under a veil (equation 9.3), or None when the scene's luminance is not told."""
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
    """A light in a camera, as the ranking tells it.

    Attributes
    ----------
    camera, light : int
    known_share : float
        Part of the time in which the camera's flare is known; all that follows is of it, and None where there is none.
    mean_veil_cd_m2 : float or None
        Over time.
    worst : int or None
        Which time has the brightest veil.
    worst_veil_cd_m2 : float or None
    worst_constellation_deg : float or None
    contrast_left : float or None
        At that time.
    seen_share : float or None
        Part of the time in which less than nine tenths of the contrast are left.
    brightest_stops : float or None
        Of the brightest spot, at any time, from where the sensor clips; above 0 it clips. None where a measured flare
        does not tell where that is.
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


def tables_of(
    scene: Scene, seen: Sequence[Sequence[Sighting]], maker: FlareMaker, memory: Memory | None = None
) -> tuple[tuple[FlareTable, ...], ...]:
    """Make the tables of all cameras and lights; what draws the same is drawn once.

    Parameters
    ----------
    scene : Scene
    seen : sequence of sequence of Sighting
    maker : callable
        (camera, light, diameter_deg, distance_m) to a flare for tables and the camera's frame; a distance of None is
        far away.
    memory : dict, optional
        Pictures drawn before, by the flares' fingerprints; new ones are added to it.

    Returns
    -------
    tuple of tuple of FlareTable
        By camera and light.
    """
    known: Memory = {} if memory is None else memory
    out = []
    for camera, row in zip(scene.cameras, seen, strict=True):
        tables = []
        for light, sighting in zip(scene.lights, row, strict=True):
            flare, frame = near_or_far(maker, camera, light, sighting)
            tables.append(FlareTable(flare, frame, STEP_DEG, drawn=known.setdefault(flare.fingerprint, {})))
        out.append(tuple(tables))
    return tuple(out)


def near_or_far(maker: FlareMaker, camera: SceneCamera, light: SceneLight, sighting: Sighting) -> tuple[Flare, Frame]:
    """Return the flare of a light as far away as it is, and the camera's frame."""
    size = rounded_diameter(sighting)
    flare, frame = maker(camera, light, size, None)
    distance = rounded_distance(sighting, flare.efl)
    return (flare, frame) if distance is None else maker(camera, light, size, distance)


def rounded_distance(sighting: Sighting, efl_mm: float | None) -> float | None:
    """Return the distance a light is drawn at, m: its middle one over time, rounded so that few are drawn.

    None where it never comes within `NEAR` focal lengths, or the focal length is not known: a measured flare's light
    stood where it stood. Else half an octave's multiple of 1 m.
    """
    lit = sighting.illuminance_lx > 0.0
    if efl_mm is None or not lit.any() or sighting.distance_m[lit].min() >= 1e-3 * NEAR * abs(efl_mm):
        return None
    return float(2.0 ** (0.5 * round(2.0 * log2(float(np.median(sighting.distance_m[lit]))))))


def rounded_diameter(sighting: Sighting) -> float:
    """Return the size a light is drawn with, its largest over time, rounded so that few are drawn.

    Below a degree it is a point, three times as fast: the mean stays within a thousandth, the brightest spots come out
    up to a tenth brighter. Above, it is a power of two degrees.
    """
    lit = sighting.illuminance_lx > 0.0
    largest = float(sighting.diameter_deg[lit].max()) if lit.any() else 0.0
    return 0.0 if largest < POINT_DEG else min(2.0 ** round(log2(largest)), 32.0)


def plan_scene(scene: Scene, maker: FlareMaker, told: Callable[[str], Progress], memory: Memory | None = None) -> Plan:
    """Follow cameras and lights, and measure the flare of all of them.

    Parameters
    ----------
    scene : Scene
    maker : callable
        As in `tables_of`.
    told : callable
        Returns where progress of a named part of the work is told.
    memory : dict, optional
        As in `tables_of`.

    Returns
    -------
    Plan

    Raises
    ------
    FlarewrightError
        When a lens cannot be used, or camera and light do not fit together.
    """
    times, dates = moments(scene)
    tracks = tuple(camera_track(one, times, f"cameras[{c}] ({one.name})") for c, one in enumerate(scene.cameras))
    seen = sightings(scene, tracks, times, dates)
    tables = tables_of(scene, seen, maker, memory)
    draw_ahead(tables, seen, told("flares"))
    pairs, remarks = [], []
    for c, (camera, row) in enumerate(zip(scene.cameras, seen, strict=True)):
        remarks += [f"{camera.name}: {remark}" for table in tables[c] for remark in table.flare.remarks]
        line = []
        for k, (light, sighting) in enumerate(zip(scene.lights, row, strict=True)):
            pair = _measured(tables[c][k], sighting)
            line.append(pair)
            remarks += _doubts(camera, light, tables[c][k].flare, pair)
        pairs.append(tuple(line))
    return Plan(scene, times, dates, tracks, tables, tuple(pairs), tuple(dict.fromkeys(remarks)))


def draw_ahead(tables: Sequence[Sequence[FlareTable]], seen: Sequence[Sequence[Sighting]], progress: Progress) -> None:
    """Draw every picture that the sightings need, so that progress and what is left are known."""
    wanted: dict[tuple[str, float, float], FlareTable] = {}
    for row, line in zip(tables, seen, strict=True):
        for table, sighting in zip(row, line, strict=True):
            for c, roll, lux in zip(
                sighting.constellation_deg, sighting.roll_deg, sighting.illuminance_lx, strict=True
            ):
                if lux > 0.0 and table.flare.least_deg <= c <= table.flare.reach_deg:
                    for node, at_roll, _, _ in table.nodes(float(c), float(roll)):
                        wanted[table.flare.fingerprint, node, at_roll] = table
    for k, ((_, node, roll), table) in enumerate(wanted.items()):
        table.light(node, roll)
        progress((k + 1) / len(wanted), f"{table.flare.name}, {node:.4g} degrees")


def _measured(table: FlareTable, sighting: Sighting) -> Pair:
    angles, lux = sighting.constellation_deg, sighting.illuminance_lx
    inside = table.flare.covers(angles)
    known = inside | table.flare.dark_beyond | (lux == 0.0)
    values = np.where(known[:, None], np.zeros(len(NAMES)), np.nan)
    for t in np.flatnonzero(inside & (lux > 0.0)):
        values[t] = table.between(float(angles[t]), float(sighting.roll_deg[t])).values * lux[t]
    return Pair(sighting, values, known)


def _doubts(camera: SceneCamera, light: SceneLight, flare: Flare, pair: Pair) -> list[str]:
    told = []
    unknown = float(np.mean(~pair.known))
    if unknown > 0.0:
        told.append(
            f"{camera.name} was measured from {flare.least_deg:g} to {flare.reach_deg:g} degrees; {light.name} stands "
            f"elsewhere in {unknown:.0%} of the times, in which its flare is not known"
        )
    drawn = rounded_distance(pair.sighting, flare.efl)
    lit = pair.sighting.distance_m[pair.sighting.illuminance_lx > 0.0]
    if drawn is not None and float(lit.max() / lit.min()) > STAYS:
        told.append(
            f"{light.name} comes within {lit.min():.3g} m of {camera.name} and goes {lit.max():.3g} m away: its ghosts "
            f"are drawn as if it stayed {drawn:.3g} m away, its brightness follows"
        )
    return told


def ranking(plan: Plan) -> list[Ranked]:
    """Rank every light in every camera by its mean veil over time, worst first.

    Parameters
    ----------
    plan : Plan

    Returns
    -------
    list of Ranked
        Those of which nothing is known stand behind all others, for nobody can rank them.
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
    """Return the signal of a flare's brightest spot over the one at which the sensor clips; 0: not known, or none."""
    if camera.model is None:
        return exposure_level(peak, camera.iso, camera.exposure_s)
    return 0.0 if flare.over_clipping is None else peak * flare.over_clipping


def _or(value: float | None, otherwise: float) -> float:
    return otherwise if value is None else value
