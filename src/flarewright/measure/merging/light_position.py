"""Locate the light in a merged frame.

The light is the brightest area of the picture, clipped if anything is. Its star is the diffraction pattern of the iris,
which is symmetric under a half turn about the light. The centre of symmetry of the neighbourhood therefore gives the
light's position to a fraction of a pixel, even where its middle is clipped.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot, sqrt

import numpy as np
from scipy import ndimage

from ...errors import FlarewrightError
from ...typing import Floats, Mask, Pixels
from .settings import LightSettings


@dataclass(frozen=True)
class LightSighting:
    """Position and properties of the light in one frame.

    Attributes
    ----------
    position_px : tuple of float
        (x, y).
    error_px : float
        Standard error per axis.
    flux : float
        Sum over the 15 x 15 pixels around it, a lower bound where pixels are clipped.
    contrast : float
        Brightest pixel over the frame's median, or over the noise of a pixel where that is more: a picture of noise
        has a median near 0.
    at_border : bool
        Whether the picture's border cuts the star's middle.
    rival_px : tuple of float or None
        Position of a possible other light.
    clipped_share : float
        Part of the pixels that are clipped in every exposure.
    other_px : tuple of float or None
        Brightest spot far from the light. Only the whole run shows whether it is a light or a ghost (`second_light`).
    given : bool
        The user gives the position.
    """

    position_px: tuple[float, float]
    error_px: float
    flux: float
    contrast: float
    at_border: bool
    rival_px: tuple[float, float] | None
    clipped_share: float
    other_px: tuple[float, float] | None = None
    given: bool = False


def find_light(radiance: Pixels, variance: Pixels, settings: LightSettings = LightSettings()) -> LightSighting:
    """Locate the light in a frame; only the whole run shows whether it is one (`camera_geometry.believable`).

    Parameters
    ----------
    radiance, variance : ndarray, shape (height, width, 3)
        As in `MergedFrame`.
    settings : LightSettings
    """
    clipped: Mask = np.asarray(np.isinf(variance).any(axis=2))
    light = radiance.mean(axis=2, dtype=np.float64)
    height, width = light.shape
    blobs = [blob for blob in _blobs(clipped) if blob.area >= settings.least_area_px]
    if blobs:
        first = blobs[0]
        (x, y), radius = first.middle, first.radius
        rivals = [
            blob.middle for blob in blobs[1:] if blob.area > max(9.0, settings.rival * first.area)
            and _apart(blob.middle, (x, y)) > 3.0 * (radius + blob.radius)
        ]  # fmt: skip
    else:
        x, y, rivals = *_brightest(light), _second(light, settings)
        radius = 2.0
    other = _other(light, blobs, (x, y), radius, settings)
    reach = radius + settings.rim_px
    at_border = not (reach / 2 < x < width - reach / 2 and reach / 2 < y < height - reach / 2)
    of_channels = variance.mean(axis=2, dtype=np.float64)
    (x, y), error = _symmetric(light, of_channels, clipped, (x, y), reach, settings)
    known = ~clipped
    # the mean of three channels
    noise = float(np.sqrt(np.median(of_channels[known]) / 3.0)) if known.any() else 0.0
    median = float(np.median(light[known])) if known.any() else 0.0
    contrast = float(light.max()) / max(median, noise, 1e-30)
    row, column = (min(max(int(value) - 7, 0), side) for value, side in ((y, height), (x, width)))
    flux = float(light[row : row + 15, column : column + 15].sum())
    rival = rivals[0] if rivals else None
    return LightSighting((x, y), error, flux, contrast, at_border, rival, float(clipped.mean()), other)


def two_lights(sighting: LightSighting, other: tuple[float, float] | None, where: str) -> FlarewrightError:
    """Return the error for two lights; `where` names the frame or frames that show both."""
    (x, y), (other_x, other_y) = sighting.position_px, other or (0.0, 0.0)
    return FlarewrightError(
        f"two lights were found, at ({x:.0f}, {y:.0f}) and ({other_x:.0f}, {other_y:.0f}) of {where}: cover one of "
        "them, or give light_x_px and light_y_px in captures.csv"
    )


@dataclass(frozen=True)
class _Blob:
    """A connected clipped area."""

    area: int
    middle: tuple[float, float]

    @property
    def radius(self) -> float:
        return sqrt(self.area / np.pi)


def _blobs(flags: Mask) -> list[_Blob]:
    """Return the connected areas (8 neighbours), largest first."""
    # most of a frame is not clipped
    boxes = ndimage.find_objects(flags.view(np.uint8))
    if not boxes:
        return []
    labels, _ = ndimage.label(flags[boxes[0]], np.ones((3, 3)))
    row, column = np.nonzero(labels)
    at = labels[row, column] - 1
    area = np.bincount(at)
    y, x = (
        np.bincount(at, place) / area + side.start + 0.5 for place, side in zip((row, column), boxes[0], strict=True)
    )
    blobs = [_Blob(int(count), (float(a), float(b))) for count, a, b in zip(area, x, y, strict=True)]
    return sorted(blobs, key=lambda blob: -blob.area)


def _apart(a: tuple[float, float], b: tuple[float, float]) -> float:
    return hypot(a[0] - b[0], a[1] - b[1])


def _boxed(light: Floats) -> Floats:
    """Return sums over 3 x 3 pixels, so that a single hot pixel is not taken as a light."""
    total: Floats = ndimage.correlate1d(light, np.ones(3), 0, mode="constant")
    return np.asarray(ndimage.correlate1d(total, np.ones(3), 1, mode="constant"))


def _brightest(light: Floats) -> tuple[float, float]:
    y, x = np.unravel_index(int(_boxed(light).argmax()), light.shape)
    return float(x) + 0.5, float(y) + 0.5


def _second(light: Floats, settings: LightSettings) -> list[tuple[float, float]]:
    """Return a place far from the brightest one with nearly as much light, if there is one."""
    boxes = _boxed(light)
    height, width = light.shape
    y, x = np.unravel_index(int(boxes.argmax()), light.shape)
    far = (np.arange(width) - x) ** 2 + (np.arange(height)[:, None] - y) ** 2 > max(15.0, 0.05 * width) ** 2
    rest = np.where(far, boxes, 0.0)
    if not far.any() or rest.max() < settings.rival * boxes.max():
        return []
    b, a = np.unravel_index(int(rest.argmax()), light.shape)
    return [(float(a) + 0.5, float(b) + 0.5)]


def _other(
    light: Floats, blobs: Sequence[_Blob], first: tuple[float, float], radius: float, settings: LightSettings
) -> tuple[float, float] | None:
    """Return the brightest spot far from the light that can be another light: clipped, or a small star's peak."""
    height, width = light.shape
    away = max(settings.other_far_px, settings.other_far * width)
    for blob in blobs[1:]:
        if blob.area >= settings.other_area_px and _apart(blob.middle, first) > max(away, 3.0 * (radius + blob.radius)):
            return blob.middle if _alone(light, blob.middle, blob.radius, settings) else None
    boxes = _boxed(light)
    least = settings.other * float(boxes[min(int(first[1]), height - 1), min(int(first[0]), width - 1)])
    far = (np.arange(width) + 0.5 - first[0]) ** 2 + (np.arange(height)[:, None] + 0.5 - first[1]) ** 2 > away**2
    rest = np.where(far, boxes, 0.0)
    row, column = np.unravel_index(int(rest.argmax()), light.shape)
    top = rest[row, column]
    around = boxes[max(row - 3, 0) : row + 4, max(column - 3, 0) : column + 4]
    spot = light[max(row - 1, 0) : row + 2, max(column - 1, 0) : column + 2]
    # reject slopes of the first light's star, which have no peak, and hot pixels, which have dark neighbours
    if top < max(least, 1e-30) or top < around.max() or np.median(spot) < 0.1 * spot.max():
        return None
    found = float(column) + 0.5, float(row) + 0.5
    return found if _alone(light, found, 2.0, settings) else None


def _alone(light: Floats, middle: tuple[float, float], radius: float, settings: LightSettings) -> bool:
    """Return whether a spot is surrounded by darkness, as lights are and bright parts of ghosts are not."""
    reach = int(radius + settings.ring_px[1]) + 1
    left, top = max(int(middle[0]) - reach, 0), max(int(middle[1]) - reach, 0)
    part = light[top : int(middle[1]) + reach + 1, left : int(middle[0]) + reach + 1]
    x, y = np.arange(part.shape[1]) + left + 0.5, np.arange(part.shape[0])[:, None] + top + 0.5
    r = np.hypot(x - middle[0], y - middle[1])
    ring = part[(r > radius + settings.ring_px[0]) & (r < radius + settings.ring_px[1])]
    return bool(np.median(ring) < settings.dark * np.median(part[r < radius])) if ring.size else False


def _symmetric(
    light: Floats, variance: Floats, clipped: Mask, start: tuple[float, float], reach: float, settings: LightSettings
) -> tuple[tuple[float, float], float]:
    """Find the centre of symmetry of a neighbourhood, by Gauss-Newton on logarithms, and its standard error.

    Ghosts that move with the light make one side brighter. They matter less towards the star's middle, where the star
    rises steeply. The asymmetry farther out therefore sets the weights farther in.
    """
    height, width = light.shape
    pad = int(reach) + 6
    left, top = int(start[0]) - pad, int(start[1]) - pad
    right, bottom = min(left + 2 * pad + 1, width), min(top + 2 * pad + 1, height)
    left, top = max(left, 0), max(top, 0)
    part = light[top:bottom, left:right]
    known = ~clipped[top:bottom, left:right]
    floor = max(float(np.percentile(np.abs(part), 5)), 1e-30)
    f = np.log(np.maximum(part, floor))
    spread = np.where(known, variance[top:bottom, left:right], 0.0) / np.maximum(part, floor) ** 2
    gy, gx = np.gradient(f)
    span = np.arange(-int(reach), int(reach) + 1)
    dx, dy = (grid.ravel().astype(np.float64) for grid in np.meshgrid(span, span))
    half = (dx**2 + dy**2 <= reach**2) & ((dy > 0) | ((dy == 0) & (dx > 0)))
    dx, dy = dx[half], dy[half]
    outer = dx**2 + dy**2 > 0.25 * reach**2
    unknown = (~known).astype(np.float64)
    centre = np.array([start[0] - left, start[1] - top])
    normal, scale = np.eye(2), 1.0
    for _ in range(30):
        fields = (f, gx, gy, spread, unknown)
        one = _sampled(fields, centre[0] + dx, centre[1] + dy)
        other = _sampled(fields, centre[0] - dx, centre[1] - dy)
        usable = (one[4] < 1e-9) & (other[4] < 1e-9)
        if usable.sum() < 12:
            return start, reach
        e = (one[0] - other[0])[usable]
        here, there = np.exp(one[0][usable]), np.exp(other[0][usable])
        uneven = np.abs(here - there)[outer[usable]]
        stray = settings.stray * float(np.median(uneven)) if uneven.size else 0.0
        J = np.stack([(one[1] - other[1])[usable], (one[2] - other[2])[usable]], axis=1)
        sigma = np.sqrt(
            (one[3] + other[3])[usable] + settings.asymmetry**2 + stray**2 * (1.0 / here**2 + 1.0 / there**2)
        )
        weight = 1.0 / sigma**2 / np.maximum(1.0, np.abs(e) / sigma / 2.0)
        normal = (J.T * weight) @ J
        step = -np.linalg.pinv(normal) @ (J.T * weight) @ e
        scale = max(1.0, float(np.sqrt(np.mean((e / sigma) ** 2))))
        length = float(np.hypot(*step))
        centre = centre + step * min(1.0, 1.0 / max(length, 1e-12))
        if length < 1e-4:
            break
    found = (float(centre[0]) + left, float(centre[1]) + top)
    if _apart(found, start) > reach:
        return start, reach
    error = scale * sqrt(settings.correlated_px * 0.5 * float(np.trace(np.linalg.pinv(normal))))
    return found, max(error, settings.least_error_px)


def _sampled(fields: tuple[Floats, ...], x: Floats, y: Floats) -> list[Floats]:
    """Interpolate images linearly at (x, y); outside, the last one is 1 and the others repeat the border."""
    height, width = fields[0].shape
    u, v = x - 0.5, y - 0.5
    outside = (u < 0) | (v < 0) | (u > width - 1) | (v > height - 1)
    found = [np.asarray(ndimage.map_coordinates(field, [v, u], order=1, mode="nearest")) for field in fields]
    found[-1] = np.where(outside, 1.0, found[-1])
    return found
