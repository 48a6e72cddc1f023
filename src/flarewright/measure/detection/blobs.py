"""Find ghosts too small to show a rim: bright blobs that move along the line through axis and light.

Some ghosts are images of the light source rather than of the iris: a few pixels wide, and often the brightest of all.
In a lens of revolution every ghost is centred on the line through axis and light. Every position on this line gets
votes for a blob that is brighter than its surroundings on all sides.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from ...kernels.ghost_model.strip_means import means_along
from ...typing import Floats, Indices, Mask, Pixels
from ..core.neighbourhood import brightest
from ..core.parallel import map_batched
from ..core.views import View
from .rim_voting import RimCandidate
from .settings import BlobSettings

_SIDES = 4


def blobs(
    views: Sequence[View], pixels: Sequence[Pixels], masks: Sequence[Mask], *, most: int = 8,
    pool: ThreadPoolExecutor | None = None, settings: BlobSettings = BlobSettings(),
) -> list[RimCandidate]:  # fmt: skip
    """Return the best small candidates, best first, without candidates close to a better one.

    Parameters
    ----------
    views : sequence of View
        In order of rising constellation.
    pixels : sequence of ndarray, shape (H, W)
        One channel with glow and known ghosts subtracted.
    masks : sequence of ndarray of bool, shape (H, W)
        Pixels to search.
    most : int
        Maximum number of candidates.
    pool : executor, optional
    settings : BlobSettings
    """
    reach = 2.0 * views[0].size_px[0]
    places = np.arange(-reach, reach + 0.5 * settings.step_px, settings.step_px)

    def one(view: View, picture: Pixels, mask: Mask) -> Floats:
        return _votes(view, np.where(mask, picture, np.nan), view.variance[..., 1], places, settings)

    votes = np.stack(map_batched(one, views, pixels, masks, pool=pool))
    sigmas = np.array([view.sigma for view in views])
    speeds = np.arange(-reach, reach, 1.0)
    # shape (views, speeds): index of the position that a blob of each speed would have
    at = np.clip(np.rint((sigmas[:, None] * speeds + reach) / settings.step_px).astype(np.int64), 0, len(places) - 1)
    near = brightest(votes, round(settings.stray_px / settings.step_px), axes=[2])
    followed = np.take_along_axis(
        near, np.broadcast_to(at[:, None], (len(views), len(settings.radii_px), len(speeds))), axis=2
    )
    followed[sigmas < settings.least_sigma] = 0.0
    scores, first, last = _best_runs(followed)
    best: list[RimCandidate] = []
    for place in np.argsort(scores, axis=None)[::-1][: settings.trials]:
        r, s = np.unravel_index(place, scores.shape)
        if scores[r, s] <= 0.0 or len(best) == most:
            break
        run = slice(int(first[r, s]), int(last[r, s]) + 1)
        speed, bend = float(speeds[s]), 0.0
        for _ in range(settings.refits):
            speed, bend = _law(
                votes[run, r], sigmas[run] * (speed + bend * sigmas[run] ** 2), sigmas[run], places, settings
            )
        blob = RimCandidate(speed, settings.radii_px[r], run.start, run.stop - 1, float(scores[r, s]), bend=bend)
        if not any(_same(blob, other, sigmas, settings) for other in best):
            best.append(blob)
    return best


def _same(a: RimCandidate, b: RimCandidate, sigmas: Floats, settings: BlobSettings) -> bool:
    """Return whether the positions of two blobs agree in the views that show both."""
    both = sigmas[max(a.first, b.first) : min(a.last, b.last) + 1]
    apart = np.abs(a.speed - b.speed + (a.bend - b.bend) * both**2) * both
    return both.size > 0 and float(np.median(apart)) < 2.0 * settings.stray_px


def _votes(view: View, picture: Floats, variance: Pixels, places: Floats, settings: BlobSettings) -> Floats:
    """Return the votes of a view for blobs along its line, shape (radii, positions); 0 outside the picture."""
    reach = np.ceil(settings.radii_px[-1] + settings.outer_px)
    across = np.arange(-reach, reach + 0.5)
    x0, y0, cosine, sine, _ = view.frame
    columns = x0 + cosine * places - sine * across[:, None] - 0.5
    rows = y0 - sine * places - cosine * across[:, None] - 0.5
    # only a few of the positions lie in the picture
    height, width = picture.shape
    seen = ((columns > 0) & (columns < width - 1) & (rows > 0) & (rows < height - 1)).any(axis=0)
    votes = np.zeros((len(settings.radii_px), len(places)))
    if not seen.any():
        return votes
    part = slice(int(np.argmax(seen)), len(seen) - int(np.argmax(seen[::-1])))
    strip, noise = _sampled(picture, variance, rows[:, part], columns[:, part])
    for r, radius in enumerate(settings.radii_px):
        votes[r, part] = _contrast(strip, noise, radius, across, settings)
    return votes


def _sampled(picture: Floats, variance: Pixels, rows: Floats, columns: Floats) -> tuple[Floats, Floats]:
    """Return a picture interpolated between pixels, NaN outside, and the nearest variance, infinite outside."""
    height, width = picture.shape
    outside = (rows < 0.0) | (rows > height - 1.0) | (columns < 0.0) | (columns > width - 1.0)
    rows, columns = np.clip(rows, 0.0, height - 1.0), np.clip(columns, 0.0, width - 1.0)
    i, j = np.minimum(rows.astype(np.int64), height - 2), np.minimum(columns.astype(np.int64), width - 2)
    down, right = rows - i, columns - j
    upper = (1.0 - right) * picture[i, j] + right * picture[i, j + 1]
    lower = (1.0 - right) * picture[i + 1, j] + right * picture[i + 1, j + 1]
    noise = variance[np.rint(rows).astype(np.int64), np.rint(columns).astype(np.int64)].astype(np.float64)
    return np.where(outside, np.nan, (1.0 - down) * upper + down * lower), np.where(outside, np.inf, noise)


def _contrast(strip: Floats, noise: Floats, radius: float, across: Floats, settings: BlobSettings) -> Floats:
    """Return the vote at every position of a strip: significance times uniformity of the contrast, minus `level`."""
    reach = round((radius + settings.outer_px) / settings.step_px)
    along = np.arange(-reach, reach + 1) * settings.step_px
    away = np.hypot(along, across[:, None])
    inside = away <= radius
    ring = (away >= radius + settings.inner_px) & (away <= radius + settings.outer_px)
    side = np.floor(np.arctan2(across[:, None], along) / (2.0 * np.pi / _SIDES) + 0.5) % _SIDES
    middle, *sides = _means(strip, inside, *(ring & (side == k) for k in range(_SIDES)))
    contrast, most = middle - np.max(sides, axis=0), middle - np.min(sides, axis=0)
    within, around = _means(noise, inside, ring)
    doubt = within / (np.pi * radius**2) + around / (ring.sum() * settings.step_px / _SIDES)
    with np.errstate(invalid="ignore", divide="ignore"):
        # inside a larger ghost, next to its rim, only one side is darker: uneven contrast lowers the vote
        even = np.maximum(contrast, 0.0) / most
        vote = even * contrast / np.sqrt(contrast**2 + settings.salient**2 * doubt) - settings.level
    return np.where(np.isfinite(vote), vote, 0.0)


def _means(strip: Floats, *weights: Mask) -> Floats:
    """Return the means of a strip over some masks, at every position along it; NaN at the ends."""
    means = np.full((len(weights), strip.shape[1]), np.nan)
    if strip.shape[1] >= weights[0].shape[1]:
        means_along(strip, np.array(weights), means)
    return means


def _best_runs(votes: Floats) -> tuple[Floats, Indices, Indices]:
    """Return the largest sum of votes over consecutive views, and its first and last view."""
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


def _law(
    votes: Floats, predicted: Floats, sigmas: Floats, places: Floats, settings: BlobSettings
) -> tuple[float, float]:
    """Fit speed and bend of position = sigma (speed + bend sigma^2) to the best votes near predicted positions."""
    lows = np.searchsorted(places, predicted - settings.stray_px)
    highs = np.searchsorted(places, predicted + settings.stray_px, side="right")
    # shape (views, positions near the predicted one)
    at = lows[:, None] + np.arange(int(2.0 * settings.stray_px / settings.step_px) + 2)
    there = at < highs[:, None]
    at = np.minimum(at, len(places) - 1)
    near = np.where(there, np.take_along_axis(votes, at, axis=1), 0.0)
    best = near.max(axis=1)
    seen = best > 0.0
    if np.count_nonzero(seen) < 2:
        return float(predicted[-1] / max(sigmas[-1], 1e-9)), 0.0
    # centre of the positions whose votes are near the best
    good = near[seen] > settings.near_best * best[seen, None]
    place = (places[at[seen]] * good).sum(axis=1) / good.sum(axis=1)
    sigma = sigmas[seen]
    basis = np.stack([sigma, sigma**3], axis=1)[:, : 2 if len(sigma) >= settings.cubic_views else 1]
    law = np.linalg.lstsq(basis, place, rcond=None)[0]
    return float(law[0]), float(law[1]) if len(law) > 1 else 0.0
