"""Find ghosts without help: rims that run along the light's line, in all constellations at once.

A ghost of a lens of revolution is mirrored at the line through axis and light, and at small fields its centre runs
along that line in proportion to the field: in the picture of position over field it is a straight band that meets the
axis at field 0. So two numbers, speed and size, describe a candidate, and every constellation votes for it with its
border: a circle, or the iris' polygon, either way round.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..kernels.measure_hough import outline, salient_slopes, search
from ..model.ghost_model import Blades
from .numbers import Floats
from .patches import scaled
from .shared_out import shared_out
from .views import Pixels, View, halved

# slopes, in standard deviations of their noise, that count half
SALIENT = 4.0
# a view whose border is not brighter inside by this much counts against a candidate
LEVEL = 0.16
# points of a rim that are asked
SPOTS = 40
# pieces of a search, one at a time for each thread
_PIECES = 16
# the field by which ghosts are told apart whose place is no proportion of it
USUAL = 0.6


@dataclass(frozen=True)
class Candidate:
    """A ghost that may be there.

    Attributes
    ----------
    speed, radius : float
        Pixels: place of the centre at field 1, and size.
    first, last : int
        Views in which its border was seen.
    score : float
        Sum of the views' votes.
    blades : Blades or None
        Of its rim; None: a circle.
    bend : float
        Pixels: by how much the place at field 1 leaves proportion.
    below : float
        Place and size are divided by 1 + so much of the squared field.
    flat : float
        How long it is along the light's line, part of its height.
    bent : float
        By how much its ends lie nearer to the axis than its middle, part of half its height.
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
        """Return where its centre is at a field, from the axis towards the light, pixels."""
        return sigma * (self.speed + self.bend * sigma**2) / (1.0 + self.below * sigma**2)

    def size(self, sigma: float) -> float:
        """Return its radius, or half its height, at a field, pixels."""
        return self.radius / (1.0 + self.below * sigma**2)

    @property
    def usual(self) -> tuple[float, float]:
        """Place over field, and size, as at `USUAL` when both are divided."""
        by = 1.0 + self.below * USUAL**2
        return self.speed / by, self.radius / by


@dataclass(frozen=True)
class Slopes:
    """Gradients over their noise, of every view at half the resolution."""

    x: Pixels
    y: Pixels
    sigmas: Floats
    frames: Floats


def slopes_of(
    views: Sequence[View],
    pixels: Sequence[Pixels],
    masks: Sequence[NDArray[np.bool_]],
    channel: int = 1,
    pool: ThreadPoolExecutor | None = None,
) -> Slopes:
    """Return the gradients that candidates are looked for in.

    Parameters
    ----------
    views : sequence of View
    pixels : sequence of ndarray, shape (H, W)
        One channel with glow and known ghosts taken off.
    masks : sequence of ndarray of bool, shape (H, W)
        Where to look.
    channel : int
        Whose variance counts.
    pool : executor, optional
    """

    def one(view: View, picture: Pixels, mask: NDArray[np.bool_]) -> tuple[Pixels, Pixels]:
        small = halved(picture, 1).astype(float)
        variance = halved(view.variance[..., channel], 1, variance=True).astype(float)
        variance[~(halved(mask.astype(np.float32), 1) > 0.99)] = np.inf
        sx, sy = np.empty(small.shape, np.float32), np.empty(small.shape, np.float32)
        salient_slopes(np.where(np.isfinite(variance), small, 0.0), variance, SALIENT, sx, sy)
        return sx, sy

    found = shared_out(one, views, pixels, masks, pool=pool)
    frames = np.stack([scaled(view.frame, 1) for view in views])
    return Slopes(
        np.stack([each[0] for each in found]), np.stack([each[1] for each in found]),
        np.array([view.sigma for view in views]), frames,
    )  # fmt: skip


def candidates(
    slopes: Slopes,
    width: int,
    *,
    sign: float = 1.0,
    most: int = 8,
    iris: Blades | None = None,
    pool: ThreadPoolExecutor | None = None,
) -> list[Candidate]:
    """Return the best candidates, best first, none close to a better one.

    Parameters
    ----------
    slopes : Slopes
    width : int
        Of the full picture, pixels.
    sign : float
        -1 looks for dark discs: how well those score tells what chance does.
    most : int
    iris : Blades, optional
        Rims are looked for that have its form, beside circles.
    pool : executor, optional
    """
    kinds = rims_of(iris)
    rims = np.stack([rim_outline(kind) for kind in kinds])
    fine = 0.004 * width
    speeds = np.concatenate([np.arange(-2.6 * width, -1.0 * width, 2.0 * fine), np.arange(-width, width, fine),
                             np.arange(width, 2.6 * width, 2.0 * fine)])  # fmt: skip
    sizes = np.concatenate([np.arange(0.006, 0.06, 0.0028), np.geomspace(0.06, 0.45, 40)]) * width
    scores, runs = searched(slopes, speeds, sizes, rims, sign=sign, pool=pool)
    # what is left, best first
    places = np.argsort(scores, axis=None)[::-1]
    s, r = np.unravel_index(places[: np.count_nonzero(scores > 0.0)], scores.shape)
    best: list[Candidate] = []
    while s.size and len(best) < most:
        found, speed, radius = runs[s[0], r[0]], float(speeds[s[0]]), float(sizes[r[0]])
        first, last, kind = (int(each) for each in found)
        best.append(Candidate(speed, radius, first, last, float(scores[s[0], r[0]]), kinds[kind]))
        reach = 0.3 * sizes[r] + 3.0 * fine
        near = (np.abs(speeds[s] - speed) < reach + 0.3 * radius) & (np.abs(sizes[r] - radius) < 0.5 * reach + fine)
        close = near & (runs[s, r, 1] >= first) & (runs[s, r, 0] <= last)
        # a better one is close to itself
        close[0] = True
        s, r = s[~close], r[~close]
    return best


def searched(
    slopes: Slopes,
    speeds: Floats,
    sizes: Floats,
    rims: Floats,
    *,
    turning: bool = False,
    sign: float = 1.0,
    pool: ThreadPoolExecutor | None = None,
) -> tuple[Floats, NDArray[np.int64]]:
    """Return what outlines of all speeds and sizes score over their best run of views, and these runs.

    Parameters
    ----------
    slopes : Slopes
    speeds : ndarray, shape (S,)
    sizes : ndarray, shape (R,)
    rims : ndarray, shape (K, P, 4)
    turning : bool
        Rims turn with the light's direction.
    sign : float
        -1 looks for dark ones.
    pool : executor, optional

    Returns
    -------
    scores : ndarray, shape (S, R)
    runs : ndarray, shape (S, R, 3)
        First and last view, and which rim.
    """

    def one(part: Floats) -> tuple[Floats, NDArray[np.int64]]:
        scores, runs = np.zeros((part.size, sizes.size)), np.zeros((part.size, sizes.size, 3), np.int64)
        search(slopes.x, slopes.y, slopes.sigmas, slopes.frames, part, sizes, rims, turning, LEVEL, sign, scores, runs)
        return scores, runs

    parts = np.array_split(speeds, _PIECES)
    found = [one(part) for part in parts] if pool is None else list(pool.map(one, parts))
    return np.concatenate([each[0] for each in found]), np.concatenate([each[1] for each in found])


def rims_of(iris: Blades | None) -> list[Blades | None]:
    """Return the kinds of rims that ghosts may have: round, the iris', and one of odd blades upside down."""
    if iris is None:
        return [None]
    turned = Blades(count=iris.count, first_deg=iris.first_deg + 180.0)
    return [None, iris, turned] if iris.count % 2 else [None, iris]


def rim_outline(kind: Blades | None) -> Floats:
    """Return the border along which `kernels.measure_hough.search` votes, shape (P, 4): a circle or a polygon."""
    spots = np.empty((SPOTS, 4))
    outline(0 if kind is None else kind.count, 0.0 if kind is None else np.radians(kind.first_deg), spots)
    return spots
