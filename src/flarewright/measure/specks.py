"""Find ghosts that are too small to show a rim: bright specks that run along the light's line, in all constellations.

Some ghosts are images of the light rather than of the iris: a few pixels wide, and often the brightest of all. On the
line through axis and light, where every ghost of a lens of revolution has its middle, such a speck is brighter than
what lies around it on every side.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ..kernels.measure_strip import means_along
from .find import Candidate
from .numbers import Floats
from .shared_out import shared_out
from .views import Pixels, View

Kind = TypeVar("Kind", bound=np.floating)

# radii that are looked for, pixels, and from where to where, beyond a speck's rim, its surroundings are looked at
RADII = (1.0, 1.8, 3.0)
_FROM, _TO = 1.0, 3.5
# samples along the line and across it, pixels
_STEP = 0.5
# brighter than the brightest side of the surroundings by so many standard deviations counts half
SALIENT = 5.0
# a view without a speck counts against a candidate by this much
LEVEL = 0.3
# how far from proportion a speck may run, pixels
STRAY = 1.5
# fields below which every speck is near the axis, whatever its speed
_LEAST_SIGMA = 0.03
_SIDES = 4
# how often the places of a speck are looked up, each time around where they were foretold
_LOOKS = 3
# the best speeds that are looked at closely
_TRIALS = 80
# views in which a speck has to be seen for its way to be bent
_BENT = 6


def specks(
    views: Sequence[View],
    pixels: Sequence[Pixels],
    masks: Sequence[NDArray[np.bool_]],
    *,
    most: int = 8,
    channel: int = 1,
    pool: ThreadPoolExecutor | None = None,
) -> list[Candidate]:
    """Return the best small candidates, best first, none close to a better one.

    Parameters
    ----------
    views : sequence of View
        By rising constellation.
    pixels : sequence of ndarray, shape (H, W)
        One channel with glow and known ghosts taken off.
    masks : sequence of ndarray of bool, shape (H, W)
        Where to look.
    most : int
    channel : int
        Whose variance counts.
    pool : executor, optional

    Returns
    -------
    list of Candidate
    """
    reach = 2.0 * views[0].size_px[0]
    places = np.arange(-reach, reach + 0.5 * _STEP, _STEP)

    def one(view: View, picture: Pixels, mask: NDArray[np.bool_]) -> Floats:
        return _votes(view, np.where(mask, picture, np.nan), view.variance[..., channel], places)

    votes = np.stack(shared_out(one, views, pixels, masks, pool=pool))
    sigmas = np.array([view.sigma for view in views])
    speeds = np.arange(-reach, reach, 1.0)
    # shape (views, speeds): where among the places a speck of each speed would be
    at = np.clip(np.rint((sigmas[:, None] * speeds + reach) / _STEP).astype(np.int64), 0, len(places) - 1)
    near = highest_near(votes, round(STRAY / _STEP), axis=2)
    told = np.take_along_axis(near, np.broadcast_to(at[:, None], (len(views), len(RADII), len(speeds))), axis=2)
    told[sigmas < _LEAST_SIGMA] = 0.0
    scores, first, last = _best_runs(told)
    best: list[Candidate] = []
    for place in np.argsort(scores, axis=None)[::-1][:_TRIALS]:
        r, s = np.unravel_index(place, scores.shape)
        if scores[r, s] <= 0.0 or len(best) == most:
            break
        run = slice(int(first[r, s]), int(last[r, s]) + 1)
        speed, bend = float(speeds[s]), 0.0
        for _ in range(_LOOKS):
            speed, bend = _law(votes[run, r], sigmas[run] * (speed + bend * sigmas[run] ** 2), sigmas[run], places)
        speck = Candidate(speed, RADII[r], run.start, run.stop - 1, float(scores[r, s]), bend=bend)
        if not any(_same(speck, other, sigmas) for other in best):
            best.append(speck)
    return best


def _same(a: Candidate, b: Candidate, sigmas: Floats) -> bool:
    """Tell whether two specks are one wherever both were seen."""
    both = sigmas[max(a.first, b.first) : min(a.last, b.last) + 1]
    apart = np.abs(a.speed - b.speed + (a.bend - b.bend) * both**2) * both
    return both.size > 0 and float(np.median(apart)) < 2.0 * STRAY


def _votes(view: View, picture: Floats, variance: Pixels, places: Floats) -> Floats:
    """Return what a view says of specks of each radius along its line, shape (radii, places); 0 where it sees none."""
    across = np.arange(-np.ceil(RADII[-1] + _TO), np.ceil(RADII[-1] + _TO) + 0.5)
    x0, y0, cosine, sine, _ = view.frame
    columns = x0 + cosine * places - sine * across[:, None] - 0.5
    rows = y0 - sine * places - cosine * across[:, None] - 0.5
    # few of the places lie in the picture
    height, width = picture.shape
    seen = ((columns > 0) & (columns < width - 1) & (rows > 0) & (rows < height - 1)).any(axis=0)
    votes = np.zeros((len(RADII), len(places)))
    if not seen.any():
        return votes
    part = slice(int(np.argmax(seen)), len(seen) - int(np.argmax(seen[::-1])))
    strip, noise = _sampled(picture, variance, rows[:, part], columns[:, part])
    for r, radius in enumerate(RADII):
        votes[r, part] = _contrast(strip, noise, radius, across)
    return votes


def _sampled(picture: Floats, variance: Pixels, rows: Floats, columns: Floats) -> tuple[Floats, Floats]:
    """Return a picture between its pixels, and the nearest pixels' variance; not a number, and infinite, beside it."""
    height, width = picture.shape
    outside = (rows < 0.0) | (rows > height - 1.0) | (columns < 0.0) | (columns > width - 1.0)
    rows, columns = np.clip(rows, 0.0, height - 1.0), np.clip(columns, 0.0, width - 1.0)
    i, j = np.minimum(rows.astype(np.int64), height - 2), np.minimum(columns.astype(np.int64), width - 2)
    down, right = rows - i, columns - j
    upper = (1.0 - right) * picture[i, j] + right * picture[i, j + 1]
    lower = (1.0 - right) * picture[i + 1, j] + right * picture[i + 1, j + 1]
    noise = variance[np.rint(rows).astype(np.int64), np.rint(columns).astype(np.int64)].astype(np.float64)
    return np.where(outside, np.nan, (1.0 - down) * upper + down * lower), np.where(outside, np.inf, noise)


def highest_near(values: NDArray[Kind], reach: int, axis: int) -> NDArray[Kind]:
    """Return the largest value within so many places along an axis."""
    out = values.copy()
    here, there = [slice(None)] * values.ndim, [slice(None)] * values.ndim
    for away in range(1, reach + 1):
        here[axis], there[axis] = slice(None, -away), slice(away, None)
        a, b = tuple(here), tuple(there)
        np.maximum(out[a], values[b], out=out[a])
        np.maximum(out[b], values[a], out=out[b])
    return out


def _contrast(strip: Floats, noise: Floats, radius: float, across: Floats) -> Floats:
    """Return how surely, and how evenly, the middle of a strip is brighter than all sides around, less `LEVEL`."""
    along = np.arange(-round((radius + _TO) / _STEP), round((radius + _TO) / _STEP) + 1) * _STEP
    away = np.hypot(along, across[:, None])
    inside = away <= radius
    ring = (away >= radius + _FROM) & (away <= radius + _TO)
    side = np.floor(np.arctan2(across[:, None], along) / (2.0 * np.pi / _SIDES) + 0.5) % _SIDES
    middle, *sides = _means(strip, inside, *(ring & (side == k) for k in range(_SIDES)))
    contrast, most = middle - np.max(sides, axis=0), middle - np.min(sides, axis=0)
    within, around = _means(noise, inside, ring)
    doubt = within / (np.pi * radius**2) + around / (ring.sum() * _STEP / _SIDES)
    with np.errstate(invalid="ignore", divide="ignore"):
        # within a larger ghost, next to its rim, only one side is darker
        even = np.maximum(contrast, 0.0) / most
        vote = even * contrast / np.sqrt(contrast**2 + SALIENT**2 * doubt) - LEVEL
    return np.where(np.isfinite(vote), vote, 0.0)


def _means(strip: Floats, *weights: NDArray[np.bool_]) -> Floats:
    """Return the means of a strip under some weights, at every place along it; not a number at the ends."""
    means = np.full((len(weights), strip.shape[1]), np.nan)
    if strip.shape[1] >= weights[0].shape[1]:
        means_along(strip, np.array(weights), means)
    return means


def _best_runs(votes: Floats) -> tuple[Floats, NDArray[np.int64], NDArray[np.int64]]:
    """Return the largest sum of votes over views that follow each other, and its first and last view."""
    shape = votes.shape[1:]
    run, start = np.zeros(shape), np.zeros(shape, np.int64)
    score, first, last = np.zeros(shape), np.zeros(shape, np.int64), np.zeros(shape, np.int64)
    for k, vote in enumerate(votes):
        run = run + vote
        lost = run <= 0.0
        run[lost], start[lost] = 0.0, k + 1
        better = run > score
        score[better], first[better], last[better] = run[better], start[better], k
    return score, first, last


def _law(votes: Floats, foretold: Floats, sigmas: Floats, places: Floats) -> tuple[float, float]:
    """Return speed and bend, place = sigma (speed + bend sigma^2), of the specks that are seen near foretold places."""
    lows, highs = np.searchsorted(places, foretold - STRAY), np.searchsorted(places, foretold + STRAY, side="right")
    # shape (views, places near the foretold one)
    at = lows[:, None] + np.arange(int(2.0 * STRAY / _STEP) + 2)
    there = at < highs[:, None]
    at = np.minimum(at, len(places) - 1)
    near = np.where(there, np.take_along_axis(votes, at, axis=1), 0.0)
    best = near.max(axis=1)
    seen = best > 0.0
    if np.count_nonzero(seen) < 2:
        return float(foretold[-1] / max(sigmas[-1], 1e-9)), 0.0
    # the middle of what is as good as the best
    good = near[seen] > 0.9 * best[seen, None]
    place = (places[at[seen]] * good).sum(axis=1) / good.sum(axis=1)
    sigma = sigmas[seen]
    basis = np.stack([sigma, sigma**3], axis=1)[:, : 2 if len(sigma) >= _BENT else 1]
    law = np.linalg.lstsq(basis, place, rcond=None)[0]
    return float(law[0]), float(law[1]) if len(law) > 1 else 0.0
