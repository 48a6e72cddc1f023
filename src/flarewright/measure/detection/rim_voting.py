"""Find candidates by votes for their borders along the line through axis and light, in all constellations at once.

A ghost of a lens of revolution is symmetric about the line through axis and light. At small fields its centre moves
along that line in proportion to the field. Two parameters, speed and size, thus describe a candidate (a Hough
transform). Every constellation votes with the gradients along the border: a circle, or the iris polygon in either
orientation.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from ...kernels.ghost_model.hough import rim_outline_points, salient_slopes, search
from ...model.measurement.ghost_model import Blades
from ...typing import Floats, Indices, Mask, Pixels
from ..core.checkpoint import recorded
from ..core.parallel import map_batched
from ..core.rim_kinds import rims_of
from ..core.views import View, halved_pixels
from ..fitting.patches import scaled
from .settings import RimSettings

# number of tasks of a search
_TASKS = 16
# field at which candidates are compared whose position is not proportional to the field
USUAL = 0.6


@recorded
@dataclass(frozen=True)
class RimCandidate:
    """Candidate of a ghost.

    Attributes
    ----------
    speed, radius : float
        Position of the centre at field 1, and size, pixels.
    first, last : int
        First and last view with votes for its border.
    score : float
        Sum of the votes of these views.
    blades : Blades or None
        Blades of its rim; None: a circle.
    bend : float
        Cubic term of the position at field 1, pixels.
    below : float
        Coefficient c of the denominator 1 + c sigma^2 of position and size.
    flat : float
        Length along the line through axis and light, over the height.
    bent : float
        Distance by which the ends lie nearer to the axis than the middle, over half the height.
    """

    speed: float
    radius: float
    first: int
    last: int
    score: float
    blades: Blades | None = None
    bend: float = 0.0
    below: float = 0.0
    flat: float = 1.0
    bent: float = 0.0

    def place(self, sigma: float) -> float:
        """Return the position of its centre at a field, from the axis towards the light, pixels."""
        return sigma * (self.speed + self.bend * sigma**2) / (1.0 + self.below * sigma**2)

    def size(self, sigma: float) -> float:
        """Return its radius, or half its height, at a field, pixels."""
        return self.radius / (1.0 + self.below * sigma**2)

    @property
    def usual(self) -> tuple[float, float]:
        """Position over field, and size, at field `USUAL`, without the cubic term."""
        by = 1.0 + self.below * USUAL**2
        return self.speed / by, self.radius / by


@dataclass(frozen=True)
class Slopes:
    """Gradients over their noise, for every view at half the resolution."""

    x: Pixels
    y: Pixels
    sigmas: Floats
    frames: Floats


def slopes_of(
    views: Sequence[View], pixels: Sequence[Pixels], masks: Sequence[Mask], channel: int = 1,
    pool: ThreadPoolExecutor | None = None, settings: RimSettings = RimSettings(),
) -> Slopes:  # fmt: skip
    """Return the gradients for the search for candidates.

    Parameters
    ----------
    views : sequence of View
    pixels : sequence of ndarray, shape (H, W)
        One channel with glow and known ghosts subtracted.
    masks : sequence of ndarray of bool, shape (H, W)
        Pixels to search.
    channel : int
        Channel of the variance.
    pool : executor, optional
    settings : RimSettings
    """

    def one(view: View, picture: Pixels, mask: Mask) -> tuple[Pixels, Pixels]:
        small = halved_pixels(picture, 1).astype(float)
        variance = halved_pixels(view.variance[..., channel], 1, variance=True).astype(float)
        variance[~(halved_pixels(mask.astype(np.float32), 1) > 0.99)] = np.inf
        sx, sy = np.empty(small.shape, np.float32), np.empty(small.shape, np.float32)
        salient_slopes(np.where(np.isfinite(variance), small, 0.0), variance, settings.salient, sx, sy)
        return sx, sy

    found = map_batched(one, views, pixels, masks, pool=pool)
    frames = np.stack([scaled(view.frame, 1) for view in views])
    return Slopes(
        np.stack([each[0] for each in found]), np.stack([each[1] for each in found]),
        np.array([view.sigma for view in views]), frames,
    )  # fmt: skip


def candidates(
    slopes: Slopes, width: int, *, sign: float = 1.0, most: int = 8, iris: Blades | None = None,
    pool: ThreadPoolExecutor | None = None, settings: RimSettings = RimSettings(),
) -> list[RimCandidate]:  # fmt: skip
    """Return the best candidates, best first, without candidates close to a better one.

    Parameters
    ----------
    slopes : Slopes
    width : int
        Width of the full picture, pixels.
    sign : float
        1: bright discs; -1: dark discs, whose scores show the level of chance.
    most : int
        Maximum number of candidates.
    iris : Blades, optional
        Search for rims of this iris beside circles.
    pool : executor, optional
    settings : RimSettings
    """
    kinds = rims_of(iris)
    rims = np.stack([rim_outline(kind, settings) for kind in kinds])
    fine = settings.step * width
    usual, most_speed = settings.usual_speed * width, settings.most_speed * width
    speeds = np.concatenate([np.arange(-most_speed, -usual, 2.0 * fine), np.arange(-usual, usual, fine),
                             np.arange(usual, most_speed, 2.0 * fine)])  # fmt: skip
    small = np.arange(settings.least_size, settings.usual_size, settings.size_step)
    sizes = np.concatenate([small, np.geomspace(settings.usual_size, settings.most_size, settings.sizes)]) * width
    scores, runs = searched(slopes, speeds, sizes, rims, sign=sign, pool=pool, settings=settings)
    # remaining candidates, best first
    places = np.argsort(scores, axis=None)[::-1]
    s, r = np.unravel_index(places[: np.count_nonzero(scores > 0.0)], scores.shape)
    best: list[RimCandidate] = []
    while s.size and len(best) < most:
        found, speed, radius = runs[s[0], r[0]], float(speeds[s[0]]), float(sizes[r[0]])
        first, last, kind = (int(each) for each in found)
        best.append(RimCandidate(speed, radius, first, last, float(scores[s[0], r[0]]), kinds[kind]))
        reach = settings.same_place * sizes[r] + settings.same_steps * fine
        near = np.abs(speeds[s] - speed) < reach + settings.same_place * radius
        near &= np.abs(sizes[r] - radius) < settings.same_size * reach + fine
        close = near & (runs[s, r, 1] >= first) & (runs[s, r, 0] <= last)
        # the candidate itself must be removed, too
        close[0] = True
        s, r = s[~close], r[~close]
    return best


def searched(
    slopes: Slopes, speeds: Floats, sizes: Floats, rims: Floats, *, turning: bool = False, sign: float = 1.0,
    pool: ThreadPoolExecutor | None = None, settings: RimSettings = RimSettings(),
) -> tuple[Floats, Indices]:  # fmt: skip
    """Score outlines of all speeds and sizes over their best run of consecutive views.

    Parameters
    ----------
    slopes : Slopes
    speeds : ndarray, shape (S,)
    sizes : ndarray, shape (R,)
    rims : ndarray, shape (K, P, 4)
        Outlines to try.
    turning : bool
        The outlines turn with the direction of the light.
    sign : float
        1: bright; -1: dark.
    pool : executor, optional
    settings : RimSettings

    Returns
    -------
    scores : ndarray, shape (S, R)
    runs : ndarray, shape (S, R, 3)
        First and last view, and index of the outline.
    """

    def one(part: Floats) -> tuple[Floats, Indices]:
        scores, runs = np.zeros((part.size, sizes.size)), np.zeros((part.size, sizes.size, 3), np.int64)
        search(
            slopes.x, slopes.y, slopes.sigmas, slopes.frames, part, sizes, rims, turning, settings.level, sign, scores,
            runs,
        )  # fmt: skip
        return scores, runs

    parts = np.array_split(speeds, _TASKS)
    found = [one(part) for part in parts] if pool is None else list(pool.map(one, parts))
    return np.concatenate([each[0] for each in found]), np.concatenate([each[1] for each in found])


def rim_outline(kind: Blades | None, settings: RimSettings = RimSettings()) -> Floats:
    """Return the outline for `kernels.ghost_model.hough.search`, shape (P, 4): a circle or the polygon of an iris."""
    spots = np.empty((settings.points, 4))
    rim_outline_points(0 if kind is None else kind.count, 0.0 if kind is None else np.radians(kind.first_deg), spots)
    return spots
