"""Ghosts of one picture, by their borders along the light's line, and the ghosts of a model at one light.

One constellation cannot tell a ghost from another bright disc, so what is found is a proposal, for
`flarewright design target`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil

import numpy as np
from numpy.typing import NDArray

from ..errors import FlarewrightError
from ..kernels.measure_hough import search
from ..model.ghost_model import AberrationGhost, GhostModel
from .curves import pose_at
from .find import LEVEL, Slopes, candidates, rim_outline, slopes_of
from .numbers import Floats, bezier_numbers, divided_by, field, frame, ten_terms, visible
from .views import Pixels, View, distances

# of the best possible vote, what a circle needs to be proposed, and how far above chance
ENOUGH, ABOVE_CHANCE = 0.25, 1.25
# a border that was found is not voted with again: this part of the radius to both sides, and as many pixels as it is
# smoothed
BORDER, SMOOTHED = 0.06, 7.0
# a body that is not brighter than what surrounds it by this part of the noise is none
BODY = 0.5
# noise that is assumed at least: of the picture's brightest hundredth, and of every pixel, whose own slow change would
# look like a border otherwise
LEAST_NOISE, OWN_NOISE = 1e-4, 0.04


@dataclass(frozen=True)
class Spot:
    """A ghost in one picture.

    Attributes
    ----------
    name : str
    place_px : float
        Of its centre on the line from the axis towards the light.
    radius_px : float
    rgb : tuple of float
        Radiance of its body above what surrounds it.
    score : float
        Up to 1: how much of its border is seen; 1 for a model's.
    """

    name: str
    place_px: float
    radius_px: float
    rgb: tuple[float, float, float]
    score: float


def spots_of_picture(
    pixels: Pixels,
    axis_px: tuple[float, float],
    toward_deg: float,
    *,
    most: int = 20,
    hidden: NDArray[np.bool_] | None = None,
) -> tuple[Spot, ...]:
    """Find the ghosts of one picture.

    Parameters
    ----------
    pixels : ndarray, shape (H, W, 3), float32
        Linear.
    axis_px : tuple of float
        Where the optical axis meets the picture.
    toward_deg : float
        Direction of the light, counterclockwise from the right in the upright picture.
    most : int
    hidden : ndarray of bool, shape (H, W), optional
        Where not to look.

    Returns
    -------
    tuple of Spot
        The clearest first.
    """
    grey = np.asarray(pixels.mean(axis=2), dtype=np.float32)
    noise = _noise(grey)
    variance = np.asarray(noise**2 + (OWN_NOISE * grey) ** 2, dtype=np.float32)
    if hidden is not None:
        variance[hidden] = np.inf
    width = grey.shape[1]
    view = View(
        0.0, 1.0, frame(axis_px, toward_deg, 0.0, 1.0), axis_px, pixels, np.repeat(variance[..., None], 3, axis=2)
    )
    seen = np.isfinite(variance)
    slopes = slopes_of([view], [grey], [seen])
    near = _beside(seen, slopes.x.shape[1:])
    slopes = _cleared(slopes, near)
    # so much noise that no slope is shortened: these are steepest at the very border
    even = np.full_like(view.variance, max(float(grey.max()), noise) ** 2)
    steep = _cleared(slopes_of([replace(view, variance=even)], [grey], [seen]), near)
    chance = max((one.score for one in candidates(slopes, width, sign=-1.0, most=1)), default=0.0)
    enough = max(ENOUGH, ABOVE_CHANCE * chance)
    found: list[Spot] = []
    while len(found) < most:
        best = candidates(slopes, width, most=1)
        if not best or best[0].score < enough:
            break
        place, radius = _sharper(steep, best[0].speed, best[0].radius, 0.004 * width)
        score = min(best[0].score / (1.0 - LEVEL), 1.0)
        found.append(_spot(f"{len(found) + 1}", view, place, radius, score))
        slopes = _without(slopes, view, place, radius)
    return tuple(one for one in found if sum(one.rgb) > 3.0 * BODY * noise)


def _beside(seen: NDArray[np.bool_], shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """Mark the slopes next to what is hidden: its edge would pass for a dark circle's border."""
    if seen.all():
        return np.zeros(shape, np.bool_)
    reach = ceil(0.5 * SMOOTHED)
    hidden = np.pad(~seen[::2, ::2], reach)
    windows = np.lib.stride_tricks.sliding_window_view(hidden, (2 * reach + 1, 2 * reach + 1))
    return np.asarray(windows.any(axis=(2, 3)))[: shape[0], : shape[1]]


def _cleared(slopes: Slopes, gone: NDArray[np.bool_]) -> Slopes:
    """Return the slopes of one picture without some."""
    x, y = slopes.x.copy(), slopes.y.copy()
    x[0][gone], y[0][gone] = np.nan, np.nan
    return Slopes(x, y, slopes.sigmas, slopes.frames)


def _noise(grey: Pixels) -> float:
    """Return the standard deviation of a pixel, from what differs between neighbours."""
    across = np.diff(grey, axis=1)
    sigma = float(np.median(np.abs(across - np.median(across)))) / 0.6745
    return max(sigma / float(np.sqrt(2.0)), LEAST_NOISE * float(np.percentile(grey, 99.0)), 1e-20)


def _sharper(steep: Slopes, place: float, radius: float, step: float) -> tuple[float, float]:
    """Return the place and radius nearby whose border is steepest."""
    circle = rim_outline(None)[None]
    for finer in (0.5, 0.125, 0.03):
        moves = finer * step * np.arange(-4, 5)
        speeds, sizes = place + moves, np.maximum(radius + moves, 1.0)
        scores, runs = np.zeros((9, 9)), np.zeros((9, 9, 3), np.int64)
        search(steep.x, steep.y, steep.sigmas, steep.frames, speeds, sizes, circle, False, 0.0, 1.0, scores, runs)
        s, r = np.unravel_index(int(np.argmax(scores)), scores.shape)
        if scores[s, r] > 0.0:
            place, radius = float(speeds[s]), float(sizes[r])
    return place, radius


def _without(slopes: Slopes, view: View, place: float, radius: float) -> Slopes:
    """Return the slopes with a ghost's border taken out."""
    away = np.abs(distances(view, place, 0.5) - radius)[: slopes.x.shape[1], : slopes.x.shape[2]]
    return _cleared(slopes, away < BORDER * radius + SMOOTHED)


def _spot(name: str, view: View, place: float, radius: float, score: float) -> Spot:
    away = distances(view, place)
    inside = (away < 0.93 * radius) & (away > 0.7 * radius)
    outside = (away > 1.07 * radius + 2.0) & (away < 1.3 * radius + 3.0)
    if not (inside.any() and outside.any()):
        return Spot(name, place, radius, (0.0, 0.0, 0.0), score)
    # medians, for other ghosts cross
    red, green, blue = (
        max(float(np.median(view.pixels[inside, c]) - np.median(view.pixels[outside, c])), 0.0) for c in range(3)
    )
    return Spot(name, place, radius, (red, green, blue), score)


def spots_of_model(model: GhostModel, constellation_deg: float) -> tuple[Spot, ...]:
    """Return the ghosts of a measured flare at one light as discs.

    Parameters
    ----------
    model : GhostModel
    constellation_deg : float

    Returns
    -------
    tuple of Spot
        Those that are visible there; of an aberrated one the disc that fits best.

    Raises
    ------
    FlarewrightError
        Where nothing was measured.
    """
    low, high = model.constellation_deg
    if not low <= constellation_deg <= high:
        raise FlarewrightError(
            f"nothing was measured at {constellation_deg:g} degrees; the model holds {low:g} to {high:g} degrees"
        )
    seen = visible(model.ghosts, constellation_deg)
    return tuple(
        _disc(ghost, model, constellation_deg)
        if isinstance(ghost, AberrationGhost)
        else _bezier_disc(ghost.name, bezier_numbers(ghost, constellation_deg))
        for ghost, part in zip(model.ghosts, seen, strict=True)
        if part > 0.5
    )


def _disc(ghost: AberrationGhost, model: GhostModel, constellation_deg: float) -> Spot:
    """Return the disc onto which a ghost's pupil is mapped on average: the least squares of place + radius p."""
    s = field(constellation_deg, model.largest_deg)
    rings, turns = np.sqrt((np.arange(8) + 0.5) / 8.0), 2.0 * np.pi * np.arange(24) / 24.0
    px, py = (np.outer(rings, part(turns)).ravel() for part in (np.cos, np.sin))
    u, v, w = px * px + py * py, px * s, np.full(px.size, s * s)
    terms = ten_terms(u, v, w)
    # green tells the shape, every colour its light
    below = divided_by(*ghost.green.below, v, w)
    f, g = (np.array(numbers) @ terms / below for numbers in (ghost.green.f, ghost.green.g))
    radius = float(((px * (s * f + px * g) + py * py * g).sum()) / u.sum())
    pose = pose_at(ghost.curves, constellation_deg, ghost.visible_deg)
    radius *= pose.size
    area = max(radius * radius, 1e-12)
    light = [pose.brightness * max(float((np.array(colour.intensity) @ terms).mean()), 0.0) / area
             for colour in (ghost.red, ghost.green, ghost.blue)]  # fmt: skip
    # which end of the pupil is up is not measured, so no ghost is upside down
    place = float((s * f + pose.size * px * g).mean()) + pose.along_px
    return Spot(ghost.name, place, abs(radius), (light[0], light[1], light[2]), 1.0)


def _bezier_disc(name: str, numbers: Floats) -> Spot:
    """Return a Bezier ghost as the disc as high as it, in the middle of its width."""
    red, green, blue = (float(level) for level in numbers[16:19])
    place = float(numbers[0] + 0.5 * (numbers[4] - numbers[3]))
    return Spot(name, place, float(numbers[2]), (red, green, blue), 1.0)
