"""Find the ghosts of one picture by their borders, and list the ghosts of a model at one position of the light.

One constellation cannot distinguish a ghost from another bright disc. The result is a proposal for
`flarewright design target`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil

import numpy as np

from ...errors import FlarewrightError
from ...kernels.ghost_model.hough import search
from ...model.measurement.ghost_model import AberrationGhost, GhostModel
from ...typing import Floats, Mask, Pixels
from ..core.neighbourhood import brightest
from ..core.parameter_vector import bezier_numbers, denominator, field, frame, ten_terms, visible
from ..core.pose_curves import pose_at
from ..core.views import View, pixel_distances
from .rim_voting import Slopes, candidates, rim_outline, slopes_of
from .settings import DetectionSettings, PictureSettings


@dataclass(frozen=True)
class Spot:
    """A ghost in one picture.

    Attributes
    ----------
    name : str
    place_px : float
        Distance of its centre from the axis, towards the light.
    radius_px : float
    rgb : tuple of float
        Radiance above its surroundings.
    score : float
        Visible fraction of its border, at most 1; 1 for a ghost of a model.
    """

    name: str
    place_px: float
    radius_px: float
    rgb: tuple[float, float, float]
    score: float


def spots_of_picture(
    pixels: Pixels, axis_px: tuple[float, float], toward_deg: float, *, hidden: Mask | None = None,
    settings: DetectionSettings = DetectionSettings(),
) -> tuple[Spot, ...]:  # fmt: skip
    """Find the ghosts of one picture.

    Parameters
    ----------
    pixels : ndarray, shape (H, W, 3), float32
        Linear radiance.
    axis_px : tuple of float
        Position of the optical axis.
    toward_deg : float
        Direction of the light, counterclockwise from the right in the upright picture.
    hidden : ndarray of bool, shape (H, W), optional
        Pixels to ignore.
    settings : DetectionSettings

    Returns
    -------
    tuple of Spot
        In order of falling score.
    """
    grey = np.asarray(pixels.mean(axis=2), dtype=np.float32)
    noise = _noise(grey, settings.picture)
    variance = np.asarray(noise**2 + (settings.picture.own_noise * grey) ** 2, dtype=np.float32)
    if hidden is not None:
        variance[hidden] = np.inf
    width = grey.shape[1]
    view = View(
        0.0, 1.0, frame(axis_px, toward_deg, 0.0, 1.0), axis_px, pixels, np.repeat(variance[..., None], 3, axis=2)
    )
    seen = np.isfinite(variance)
    slopes = slopes_of([view], [grey], [seen], settings=settings.rims)
    near = _near_hidden(seen, slopes.x.shape[1:], settings.picture)
    slopes = _cleared(slopes, near)
    # with this much noise no gradient saturates, so that the response peaks exactly at the border
    even = np.full_like(view.variance, max(float(grey.max()), noise) ** 2)
    steep = _cleared(slopes_of([replace(view, variance=even)], [grey], [seen], settings=settings.rims), near)
    chance = max(
        (one.score for one in candidates(slopes, width, sign=-1.0, most=1, settings=settings.rims)), default=0.0
    )
    enough = max(settings.picture.enough, settings.picture.above_chance * chance)
    found: list[Spot] = []
    while len(found) < settings.picture.most:
        best = candidates(slopes, width, most=1, settings=settings.rims)
        if not best or best[0].score < enough:
            break
        place, radius = _refined(steep, best[0].speed, best[0].radius, width, settings)
        score = min(best[0].score / (1.0 - settings.rims.level), 1.0)
        found.append(_spot(f"{len(found) + 1}", view, place, radius, score, settings.picture))
        slopes = _without(slopes, view, place, radius, settings.picture)
    return tuple(one for one in found if sum(one.rgb) > 3.0 * settings.picture.body * noise)


def _near_hidden(seen: Mask, shape: tuple[int, ...], settings: PictureSettings) -> Mask:
    """Return the mask of gradients near hidden pixels, whose edge would look like the border of a dark circle."""
    if seen.all():
        return np.zeros(shape, np.bool_)
    reach = ceil(0.5 * settings.smoothed_px)
    return brightest(~seen[::2, ::2], reach)[: shape[0], : shape[1]]


def _cleared(slopes: Slopes, gone: Mask) -> Slopes:
    """Return the gradients of one picture with some removed."""
    x, y = slopes.x.copy(), slopes.y.copy()
    x[0][gone], y[0][gone] = np.nan, np.nan
    return Slopes(x, y, slopes.sigmas, slopes.frames)


def _noise(grey: Pixels, settings: PictureSettings) -> float:
    """Return the standard deviation of a pixel, estimated from differences between neighbours."""
    across = np.diff(grey, axis=1)
    sigma = float(np.median(np.abs(across - np.median(across)))) / 0.6745
    return max(sigma / float(np.sqrt(2.0)), settings.least_noise * float(np.percentile(grey, 99.0)), 1e-20)


def _refined(
    steep: Slopes, place: float, radius: float, width: int, settings: DetectionSettings
) -> tuple[float, float]:
    """Return the nearby position and radius with the steepest border."""
    circle = rim_outline(None, settings.rims)[None]
    for finer in settings.picture.finer:
        moves = finer * (settings.rims.step * width) * np.arange(-4, 5)
        speeds, sizes = place + moves, np.maximum(radius + moves, 1.0)
        scores, runs = np.zeros((9, 9)), np.zeros((9, 9, 3), np.int64)
        search(steep.x, steep.y, steep.sigmas, steep.frames, speeds, sizes, circle, False, 0.0, 1.0, scores, runs)
        s, r = np.unravel_index(int(np.argmax(scores)), scores.shape)
        if scores[s, r] > 0.0:
            place, radius = float(speeds[s]), float(sizes[r])
    return place, radius


def _without(slopes: Slopes, view: View, place: float, radius: float, settings: PictureSettings) -> Slopes:
    """Return the gradients without those near the border of a ghost."""
    away = np.abs(pixel_distances(view, place, 0.5) - radius)[: slopes.x.shape[1], : slopes.x.shape[2]]
    return _cleared(slopes, away < settings.border * radius + settings.smoothed_px)


def _spot(name: str, view: View, place: float, radius: float, score: float, settings: PictureSettings) -> Spot:
    away = pixel_distances(view, place)
    (low, high), (near, far), (near_px, far_px) = settings.ring_inside, settings.ring_outside, settings.ring_outside_px
    inside = (away < high * radius) & (away > low * radius)
    outside = (away > near * radius + near_px) & (away < far * radius + far_px)
    if not (inside.any() and outside.any()):
        return Spot(name, place, radius, (0.0, 0.0, 0.0), score)
    # medians reject other ghosts that cross
    red, green, blue = (
        max(float(np.median(view.pixels[inside, c]) - np.median(view.pixels[outside, c])), 0.0) for c in range(3)
    )
    return Spot(name, place, radius, (red, green, blue), score)


def spots_of_model(model: GhostModel, constellation_deg: float) -> tuple[Spot, ...]:
    """Return the ghosts of a model at one constellation as discs.

    Returns
    -------
    tuple of Spot
        The visible ghosts; an aberrated ghost as its best-fitting disc.

    Raises
    ------
    FlarewrightError
        When the constellation is outside the measured range.
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
    """Return the disc that fits the mapped pupil of a ghost best, by least squares of position + radius p."""
    # places count towards the light, on either side of the axis
    s = abs(field(constellation_deg, model.largest_deg))
    rings, turns = np.sqrt((np.arange(8) + 0.5) / 8.0), 2.0 * np.pi * np.arange(24) / 24.0
    px, py = (np.outer(rings, part(turns)).ravel() for part in (np.cos, np.sin))
    u, v, w = px * px + py * py, px * s, np.full(px.size, s * s)
    terms = ten_terms(u, v, w)
    # the shape of green, the brightness of each colour
    below = denominator(*ghost.green.below, v, w)
    f, g = (np.array(numbers) @ terms / below for numbers in (ghost.green.f, ghost.green.g))
    radius = float(((px * (s * f + px * g) + py * py * g).sum()) / u.sum())
    pose = pose_at(ghost.curves, constellation_deg, ghost.visible_deg)
    radius *= pose.size
    area = max(radius * radius, 1e-12)
    light = [pose.brightness * max(float((np.array(colour.intensity) @ terms).mean()), 0.0) / area
             for colour in (ghost.red, ghost.green, ghost.blue)]  # fmt: skip
    # a photograph does not show the orientation of the pupil, so the radius is positive
    place = float((s * f + pose.size * px * g).mean()) + pose.along_px
    return Spot(ghost.name, place, abs(radius), (light[0], light[1], light[2]), 1.0)


def _bezier_disc(name: str, numbers: Floats) -> Spot:
    """Return the disc with the height of a Bezier ghost, at the centre of its width."""
    red, green, blue = (float(level) for level in numbers[16:19])
    place = float(numbers[0] + 0.5 * (numbers[4] - numbers[3]))
    return Spot(name, place, float(numbers[2]), (red, green, blue), 1.0)
