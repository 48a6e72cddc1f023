"""Search a camera position with less flare near a given one, with the same aim point."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, nan

import numpy as np

from ..errors import ProjectError
from ..typing import Floats, Progress
from .pictures import Spread, draw_all
from .plan import Plan, requests_of
from .tracks import CameraSighting, camera_track, moved_by, sightings

# least reduction of the veil for a position to count as better
WORTH = 0.02
# positions over the whole disc; then rounds around the best, positions per round, and factor of the radius per round
FIRST, ROUNDS, LATER, SMALLER = 61, 4, 16, 0.4
# largest number of times that are evaluated, evenly chosen
MOMENTS = 24


@dataclass(frozen=True)
class BestPosition:
    """Result of a search.

    Attributes
    ----------
    camera : int
    radius_m, height_m : float
    offsets_m : ndarray, shape (N, 3)
        Offsets of the tried positions; the first is 0, the current position.
    veils_cd_m2 : ndarray, shape (N,)
        Mean over the evaluated times of the veil of all lights; infinite at invalid positions, NaN where the flare is
        unknown at any of these times.
    best : int
        Index of the least known veil; 0 if there is none.
    moments : int
        Number of evaluated times.
    unknown : int
        Number of skipped times, at which the flare at the current position is unknown.
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
        """Whether a position is better by at least `WORTH`."""
        return bool(self.veils_cd_m2[self.best] < (1.0 - WORTH) * self.veils_cd_m2[0])


def best_position(
    plan: Plan,
    camera: int,
    radius_m: float,
    height_m: float = 0.0,
    progress: Progress | None = None,
    spread: Spread | None = None,
) -> BestPosition:
    """Search less flare within a disc, or a flat cylinder, around a camera's position.

    Parameters
    ----------
    plan : Plan
    camera : int
    radius_m : float
        Radius of the horizontal disc.
    height_m : float
        Largest change of height.
    progress : callable, optional
    spread : callable, optional
        Draws the pictures of several positions by other processes; the result does not depend on it.

    Notes
    -----
    Points in a sunflower spiral over the disc, then over smaller discs around the best one. A moving camera is shifted
    as a whole and keeps its aim points. Flare has narrow valleys, so a better position between the points can be
    missed: the result is not a global optimum.
    """
    scene = plan.scene
    chosen = np.unique(np.round(np.linspace(0, len(plan.times_s) - 1, MOMENTS)).astype(np.int64))
    times = plan.times_s[chosen]
    dates = None if plan.dates is None else tuple(plan.dates[t] for t in chosen)
    one = scene.cameras[camera]
    track = camera_track(one, times, one.name)
    # compare positions only at times at which the current flare is known
    known = np.all([pair.known[chosen] for pair in plan.pairs[camera]], axis=0)

    tables = plan.tables[camera]

    def seen_from(offset: Floats) -> tuple[float, Sequence[CameraSighting]]:
        """Return the veil without the lights, and those to add to it."""
        try:
            moved = moved_by(track, offset, one, times, one.name)
            seen = sightings(scene, [moved], times, dates)[0]
        except ProjectError:
            # the position is on a lamp or on the aim point
            return inf, ()
        for table, sighting in zip(tables, seen, strict=True):
            lit = known & (sighting.illuminance_lx > 0.0)
            if not table.flare.dark_beyond and (lit & ~table.flare.covers(sighting.constellation_deg)).any():
                return nan, ()
        return 0.0, seen

    def veil(total: float, seen: Sequence[CameraSighting]) -> float:
        for table, sighting in zip(tables, seen, strict=False):
            lit = known & (sighting.illuminance_lx > 0.0)
            for t in np.flatnonzero(lit & table.flare.covers(sighting.constellation_deg)):
                mean = table.mean_between(float(sighting.constellation_deg[t]), float(sighting.roll_deg[t]))
                total += mean * float(sighting.illuminance_lx[t])
        return total / plan.scene_scale(camera) / int(known.sum())

    offsets = [np.zeros(3)]
    if not known.any():
        return BestPosition(camera, radius_m, height_m, np.array(offsets), np.array([nan]), 0, 0, len(times))
    veils = [veil(*seen_from(offsets[0]))]
    count = FIRST + ROUNDS * LATER
    centre, reach, high = np.zeros(3), radius_m, height_m
    for turn in range(ROUNDS + 1):
        near = list(_sunflower(FIRST if turn == 0 else LATER, reach, high) + centre)
        for offset in near:
            flat = float(np.hypot(offset[0], offset[1]))
            if flat > radius_m:
                offset[:2] *= radius_m / flat
            offset[2] = np.clip(offset[2], -height_m, height_m)
        looks = [seen_from(offset) for offset in near]
        if spread is not None:
            pairs = [pair for _, seen in looks for pair in zip(tables, seen, strict=False)]
            draw_all([request for table, sighting in pairs for request in requests_of(table, sighting, known)], spread)
        for offset, look in zip(near, looks, strict=True):
            offsets.append(offset)
            veils.append(veil(*look))
            if progress is not None:
                progress((len(veils) - 1) / count, f"position {len(veils) - 1} of {count}")
        best = _least(veils)
        centre, reach, high = offsets[best], SMALLER * reach, SMALLER * high
    looked = int(known.sum())
    return BestPosition(
        camera, radius_m, height_m, np.array(offsets), np.array(veils), _least(veils), looked, len(times) - looked
    )


def _least(veils: list[float]) -> int:
    return int(np.argmin(np.where(np.isnan(veils), inf, veils)))


def _sunflower(count: int, radius: float, height: float) -> Floats:
    """Distribute points evenly over a disc, with heights by the golden ratio, shape (count, 3)."""
    k = np.arange(count) + 0.5
    golden = (np.sqrt(5.0) - 1.0) / 2.0
    r, angle = radius * np.sqrt(k / count), 2.0 * np.pi * golden * k
    up = height * (2.0 * np.mod(k * golden**2 + 0.5, 1.0) - 1.0)
    return np.stack([r * np.cos(angle), r * np.sin(angle), up], axis=1)
