"""The best position near a given one: where a camera, aiming at the same place, sees the least flare."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, nan

import numpy as np
from numpy.typing import NDArray

from ..errors import ProjectError
from .curves import Progress
from .plan import Plan
from .tracks import camera_track, moved_by, sightings

Floats = NDArray[np.float64]

# a position is told as better when it takes away at least this part of the veil
WORTH = 0.02
# positions over the whole disc, then rounds about the best of so many in a disc this much smaller each time
FIRST, ROUNDS, LATER, SMALLER = 61, 4, 16, 0.4
# times looked at, evenly chosen
MOMENTS = 24

__all__ = ["WORTH", "Found", "best_position"]


@dataclass(frozen=True)
class Found:
    """What a search found.

    Attributes
    ----------
    camera : int
    radius_m, height_m : float
    offsets_m : ndarray, shape (N, 3)
        Tried, the first is 0: the position as it is.
    veils_cd_m2 : ndarray, shape (N,)
        Mean over these times of the veil of all lights; infinite where the camera cannot stand, NaN where its flare is
        not known in one of them.
    best : int
        Of those that are known; 0 where none is.
    moments : int
        Times that were looked at.
    unknown : int
        Times that were left out: what flare the camera has where it stands is not known then.
    """

    camera: int
    radius_m: float
    height_m: float
    offsets_m: Floats
    veils_cd_m2: Floats
    best: int
    moments: int
    unknown: int = 0

    @property
    def better(self) -> bool:
        """Whether there is a position worth moving to."""
        return bool(self.veils_cd_m2[self.best] < (1.0 - WORTH) * self.veils_cd_m2[0])


def best_position(
    plan: Plan, camera: int, radius_m: float, height_m: float = 0.0, progress: Progress | None = None
) -> Found:
    """Look for less flare within a disc about a camera's position, or a flat cylinder.

    Parameters
    ----------
    plan : Plan
    camera : int
    radius_m : float
        Of the disc, level with the plan.
    height_m : float
        Up and down.
    progress : callable, optional

    Returns
    -------
    Found

    Notes
    -----
    Sunflower points over the disc, then smaller discs about the best; a moving camera moves as a whole and aims where
    it did. Flare has narrow valleys, so a better position between the points may be missed: nothing here claims a
    global best.
    """
    scene = plan.scene
    chosen = np.unique(np.round(np.linspace(0, len(plan.times_s) - 1, MOMENTS)).astype(np.int64))
    times = plan.times_s[chosen]
    dates = None if plan.dates is None else tuple(plan.dates[t] for t in chosen)
    one = scene.cameras[camera]
    track = camera_track(one, times, one.name)
    # positions are compared while it is known what flare there is now
    known = np.all([pair.known[chosen] for pair in plan.pairs[camera]], axis=0)

    def veil(offset: Floats) -> float:
        try:
            moved = moved_by(track, offset, one, times, one.name)
            seen = sightings(scene, [moved], times, dates)[0]
        except ProjectError:
            # on a lamp, or where it aims
            return inf
        total = 0.0
        for table, sighting in zip(plan.tables[camera], seen, strict=True):
            lit = known & (sighting.illuminance_lx > 0.0)
            inside = table.flare.covers(sighting.constellation_deg)
            if not table.flare.dark_beyond and (lit & ~inside).any():
                return nan
            for t in np.flatnonzero(lit & inside):
                mean = table.mean_between(float(sighting.constellation_deg[t]), float(sighting.roll_deg[t]))
                total += mean * float(sighting.illuminance_lx[t])
        return total / plan.scene_scale(camera) / int(known.sum())

    offsets = [np.zeros(3)]
    if not known.any():
        return Found(camera, radius_m, height_m, np.array(offsets), np.array([nan]), 0, 0, len(times))
    veils = [veil(offsets[0])]
    count = FIRST + ROUNDS * LATER
    centre, reach, high = np.zeros(3), radius_m, height_m
    for turn in range(ROUNDS + 1):
        for offset in _sunflower(FIRST if turn == 0 else LATER, reach, high) + centre:
            flat = float(np.hypot(offset[0], offset[1]))
            if flat > radius_m:
                offset[:2] *= radius_m / flat
            offset[2] = np.clip(offset[2], -height_m, height_m)
            offsets.append(offset)
            veils.append(veil(offset))
            if progress is not None:
                progress((len(veils) - 1) / count, f"position {len(veils) - 1} of {count}")
        best = _least(veils)
        centre, reach, high = offsets[best], SMALLER * reach, SMALLER * high
    looked = int(known.sum())
    return Found(
        camera, radius_m, height_m, np.array(offsets), np.array(veils), _least(veils), looked, len(times) - looked
    )


def _least(veils: list[float]) -> int:
    return int(np.argmin(np.where(np.isnan(veils), inf, veils)))


def _sunflower(count: int, radius: float, height: float) -> Floats:
    """Spread points evenly over a disc, their heights by the golden ratio, shape (count, 3)."""
    k = np.arange(count) + 0.5
    golden = (np.sqrt(5.0) - 1.0) / 2.0
    r, angle = radius * np.sqrt(k / count), 2.0 * np.pi * golden * k
    up = height * (2.0 * np.mod(k * golden**2 + 0.5, 1.0) - 1.0)
    return np.stack([r * np.cos(angle), r * np.sin(angle), up], axis=1)
