"""Search a camera position with less flare near a given one, with the same aim point."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from math import inf, nan

import numpy as np

from ..errors import ProjectError
from ..typing import Floats, Mask, Progress
from .pictures import PictureRequest, Spread, draw_all
from .plan import Plan, requests_of
from .tracks import CameraSighting, CameraTrack, camera_track, moved_by, sightings

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
    around = _around(plan, camera)
    known, offsets = around.known, [np.zeros(3)]
    if not known.any():
        return BestPosition(camera, radius_m, height_m, np.array(offsets), np.array([nan]), 0, 0, len(known))
    veils = [around.veil(*around.seen_from(offsets[0]))]
    count = FIRST + ROUNDS * LATER
    centre, reach, high = np.zeros(3), radius_m, height_m
    for turn in range(ROUNDS + 1):
        near = list(_sunflower(FIRST if turn == 0 else LATER, reach, high) + centre)
        for offset in near:
            flat = float(np.hypot(offset[0], offset[1]))
            if flat > radius_m:
                offset[:2] *= radius_m / flat
            offset[2] = np.clip(offset[2], -height_m, height_m)
        looks = [around.seen_from(offset) for offset in near]
        if spread is not None:
            draw_all([request for _, seen in looks for request in around.requests(seen)], spread)
        for offset, look in zip(near, looks, strict=True):
            offsets.append(offset)
            veils.append(around.veil(*look))
            if progress is not None:
                progress((len(veils) - 1) / count, f"position {len(veils) - 1} of {count}")
        best = _least(veils)
        centre, reach, high = offsets[best], SMALLER * reach, SMALLER * high
    looked = int(known.sum())
    return BestPosition(
        camera, radius_m, height_m, np.array(offsets), np.array(veils), _least(veils), looked, len(known) - looked
    )


@dataclass(frozen=True)
class _Around:
    """The veil of a camera at positions around its own.

    Attributes
    ----------
    plan : Plan
    camera : int
    times_s : ndarray, shape (T,)
        Evaluated times.
    dates : tuple of datetime or None
    known : ndarray of bool, shape (T,)
        Times at which the flare at the camera's own position is known.
    track : CameraTrack
        The camera at its own position.
    """

    plan: Plan
    camera: int
    times_s: Floats
    dates: tuple[datetime, ...] | None
    known: Mask
    track: CameraTrack

    def seen_from(self, offset: Floats) -> tuple[float, Sequence[CameraSighting]]:
        """Return the veil without the lights, and those to add to it."""
        one, scene = self.plan.scene.cameras[self.camera], self.plan.scene
        try:
            moved = moved_by(self.track, offset, one, self.times_s, one.name)
            seen = sightings(scene, [moved], self.times_s, self.dates)[0]
        except ProjectError:
            # the position is on a lamp or on the aim point
            return inf, ()
        for table, sighting in zip(self.plan.tables[self.camera], seen, strict=True):
            lit = self.known & (sighting.illuminance_lx > 0.0)
            if not table.flare.dark_beyond and (lit & ~table.flare.covers(sighting.constellation_deg)).any():
                return nan, ()
        return 0.0, seen

    def veil(self, total: float, seen: Sequence[CameraSighting]) -> float:
        """Return the mean veil over the known times, cd/m2, of what `seen_from` returned."""
        for table, sighting in zip(self.plan.tables[self.camera], seen, strict=False):
            lit = self.known & (sighting.illuminance_lx > 0.0)
            for t in np.flatnonzero(lit & table.flare.covers(sighting.constellation_deg)):
                mean = table.mean_between(float(sighting.constellation_deg[t]), float(sighting.roll_deg[t]))
                total += mean * float(sighting.illuminance_lx[t])
        return total / self.plan.scene_scale(self.camera) / int(self.known.sum())

    def requests(self, seen: Sequence[CameraSighting]) -> list[PictureRequest]:
        """Return the pictures that the veil of some lights needs."""
        pairs = zip(self.plan.tables[self.camera], seen, strict=False)
        return [request for table, sighting in pairs for request in requests_of(table, sighting, self.known)]


def _around(plan: Plan, camera: int) -> _Around:
    """Return the positions around a camera, at a few times of the plan."""
    chosen = np.unique(np.round(np.linspace(0, len(plan.times_s) - 1, MOMENTS)).astype(np.int64))
    times_s, one = plan.times_s[chosen], plan.scene.cameras[camera]
    dates = None if plan.dates is None else tuple(plan.dates[t] for t in chosen)
    # compare positions only at times at which the current flare is known
    known = np.all([pair.known[chosen] for pair in plan.pairs[camera]], axis=0)
    return _Around(plan, camera, times_s, dates, known, camera_track(one, times_s, one.name))


def _least(veils: list[float]) -> int:
    return int(np.argmin(np.where(np.isnan(veils), inf, veils)))


def _sunflower(count: int, radius: float, height: float) -> Floats:
    """Distribute points evenly over a disc, with heights by the golden ratio, shape (count, 3)."""
    k = np.arange(count) + 0.5
    golden = (np.sqrt(5.0) - 1.0) / 2.0
    r, angle = radius * np.sqrt(k / count), 2.0 * np.pi * golden * k
    up = height * (2.0 * np.mod(k * golden**2 + 0.5, 1.0) - 1.0)
    return np.stack([r * np.cos(angle), r * np.sin(angle), up], axis=1)
