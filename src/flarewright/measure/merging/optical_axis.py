"""Locate the optical axis across the light's path: a flare is mirror symmetric about the line from axis to light.

The light's path alone does not determine this offset, because a nodding camera moves the path beside the axis. The
common mirror line of the ghosts does: it turns about the light when the axis moves.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot, sqrt

import numpy as np

from ...typing import Floats, Pixels
from ..core.binning import binned
from ..core.robust import MAD_TO_SIGMA
from .settings import GeometrySettings


@dataclass(frozen=True)
class Reduced:
    """A frame, reduced for comparing its halves.

    Attributes
    ----------
    light, variance : ndarray, shape (height, width)
        Mean of the channels and its variance; the variance is infinite where clipped.
    light_px : tuple of float
        In pixels of the reduced frame.
    block : int
        Side of the block of frame pixels that became one pixel.
    """

    light: Floats
    variance: Floats
    light_px: tuple[float, float]
    block: int


def reduced_frame(
    radiance: Pixels, variance: Pixels, light_px: tuple[float, float], settings: GeometrySettings = GeometrySettings()
) -> Reduced:
    """Average blocks of pixels to a frame about 360 pixels wide.

    Parameters
    ----------
    radiance, variance : ndarray, shape (height, width, 3)
    light_px : tuple of float
    settings : GeometrySettings
    """
    block = max(1, round(radiance.shape[1] / settings.axis_width_px))

    def mean(values: Pixels) -> Floats:
        return binned(values.mean(axis=2, dtype=np.float64), block)

    return Reduced(mean(radiance), mean(variance) / (3 * block**2), (light_px[0] / block, light_px[1] / block), block)


def _aligned_star(frames: Sequence[Reduced]) -> tuple[Floats, tuple[int, int]]:
    """Return a low quantile of the frames aligned at the light, NaN where none reaches, and its row and column."""
    height, width = frames[0].light.shape
    stack = np.full((len(frames), 2 * height + 1, 2 * width + 1), np.nan, np.float32)
    for k, frame in enumerate(frames):
        column, row = round(frame.light_px[0] - 0.5), round(frame.light_px[1] - 0.5)
        if 0 <= row < height and 0 <= column < width:
            stack[k, height - row : 2 * height - row, width - column : 2 * width - column] = frame.light
    with np.errstate(invalid="ignore"):
        ordered = np.sort(stack, axis=0)  # not-a-numbers go last
    count = np.isfinite(stack).sum(axis=0)
    at = np.maximum((0.25 * (count - 1)).astype(np.int64), 0)
    return np.take_along_axis(ordered, at[None], axis=0)[0].astype(np.float64), (height, width)


def axis_beside_path(
    frames: Sequence[Reduced], foot: tuple[float, float], normal: tuple[float, float],
    settings: GeometrySettings = GeometrySettings(),
) -> tuple[float, float] | None:  # fmt: skip
    """Find the offset of the axis from a point of the light's path, across the path.

    Parameters
    ----------
    frames : sequence of Reduced
        At least three, with the light well off the axis.
    foot : tuple of float
        The path's nearest point to the axis, in pixels of the full frames.
    normal : tuple of float
        Unit vector across the path.
    settings : GeometrySettings

    Returns
    -------
    offset, error : float
        Along `normal`, in pixels of the full frames; None when the frames do not determine it.
    """
    if len(frames) < 3:
        return None
    star, middle = _aligned_star(frames)
    block = frames[0].block
    reach = max(settings.axis_reach * frames[0].light.shape[1], 4.0)
    offsets = np.arange(-reach, reach + 0.5 * settings.axis_step_px, settings.axis_step_px)
    found = []
    for frame in frames:
        one = _of_frame(frame, (star, middle), (foot[0] / block, foot[1] / block), normal, offsets, settings)
        if one is not None:
            arm = hypot(frame.light_px[0] - foot[0] / block, frame.light_px[1] - foot[1] / block)
            found.append((*one, arm))
    if len(found) < 3:
        return None
    values, errors, arms = np.array(found).T
    # limit the influence of a bad frame, such as one with a ghost that the border cuts
    typical = float(np.median(values))
    scatter = max(MAD_TO_SIGMA * float(np.median(np.abs(values - typical))), 0.02)
    kept = np.abs(values - typical) < 4.0 * np.maximum(scatter, errors)
    # asymmetry turns the line by some angle, so the weight of a frame grows with the distance of its light
    weight = (arms[kept] / arms[kept].max()) ** 2 / (errors[kept] ** 2 + scatter**2)
    offset = float(np.average(values[kept], weights=weight))
    return offset * block, hypot(sqrt(1.0 / float(weight.sum())), settings.systematic) * block


def _of_frame(
    frame: Reduced, star: tuple[Floats, tuple[int, int]], foot: tuple[float, float], normal: tuple[float, float],
    offsets: Floats, settings: GeometrySettings,
) -> tuple[float, float] | None:  # fmt: skip
    """Return the offset with the least asymmetry in one frame, and its error."""
    height, width = frame.light.shape
    pattern, middle = star
    column, row = round(frame.light_px[0] - 0.5), round(frame.light_px[1] - 0.5)
    window = pattern[middle[0] - row : middle[0] - row + height, middle[1] - column : middle[1] - column + width]
    known = np.where(np.isfinite(window), window, 0.0)
    rest = np.where(np.isfinite(frame.variance), frame.light - known, 0.0)
    variance = np.where(np.isfinite(frame.variance), frame.variance, 1e30) + (settings.star_error * known) ** 2
    costs = np.array([_cost(rest, variance, frame.light_px, foot, normal, offset, settings) for offset in offsets])
    best = int(costs.argmin())
    if not 2 <= best < offsets.size - 2:
        return None
    a, b, c = np.polyfit(offsets[best - 2 : best + 3], costs[best - 2 : best + 3], 2)
    if a <= 0.0:
        return None
    where = -b / (2.0 * a)
    # the cost is a mean of squares over their expectation: its minimum shows by how much errors are underestimated
    least = max(c - b**2 / (4.0 * a), 1e-12)
    error = sqrt(least / (a * _samples(height, width)))
    return (float(where), error) if abs(where - offsets[best]) <= 2.0 * settings.axis_step_px else None


def _samples(height: int, width: int) -> float:
    """Return the number of independent comparisons: pixels within three pixels are correlated."""
    return max(height * width / 2.0 / 9.0, 1.0)


def _cost(
    rest: Floats, variance: Floats, light: tuple[float, float], foot: tuple[float, float], normal: tuple[float, float],
    offset: float, settings: GeometrySettings,
) -> float:  # fmt: skip
    """Return the mean weighted squared difference between the two sides of the line from axis to light."""
    height, width = rest.shape
    axis = foot[0] + offset * normal[0], foot[1] + offset * normal[1]
    length = hypot(axis[0] - light[0], axis[1] - light[1])
    if length < 0.05 * width:
        return 0.0
    u = (axis[0] - light[0]) / length, (axis[1] - light[1]) / length
    x, y = np.arange(width) + 0.5 - light[0], (np.arange(height) + 0.5 - light[1])[:, None]
    along, across = x * u[0] + y * u[1], y * u[0] - x * u[1]
    chosen = (across > 0.0) & (along**2 + across**2 > (settings.near_light * width) ** 2)
    s, p = along[chosen], across[chosen]
    here = light[0] + s * u[0] - p * u[1] - 0.5, light[1] + s * u[1] + p * u[0] - 0.5
    there = light[0] + s * u[0] + p * u[1] - 0.5, light[1] + s * u[1] - p * u[0] - 0.5
    inside = np.ones(s.size, np.bool_)
    for a, b in (here, there):
        inside &= (a >= 0) & (b >= 0) & (a < width - 1.001) & (b < height - 1.001)
    if inside.sum() < 100:
        return 0.0
    first, second = (_bilinear(rest, a[inside], b[inside]) for a, b in (here, there))
    expected = sum(variance[b[inside].astype(np.int64), a[inside].astype(np.int64)] for a, b in (here, there))
    expected = expected + (settings.ghost_asymmetry * (np.abs(first) + np.abs(second))) ** 2
    squares = (first - second) ** 2 / expected
    # beyond three standard deviations the cost grows linearly
    return float(np.mean(np.where(squares > 9.0, 6.0 * np.sqrt(squares) - 9.0, squares)))


def _bilinear(picture: Floats, u: Floats, v: Floats) -> Floats:
    i, j = u.astype(np.int64), v.astype(np.int64)
    a, b = u - i, v - j
    top = picture[j, i] * (1 - a) + picture[j, i + 1] * a
    bottom = picture[j + 1, i] * (1 - a) + picture[j + 1, i + 1] * a
    return top * (1 - b) + bottom * b
