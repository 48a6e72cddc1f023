"""Find the light in a merged frame.

The light is where the picture is brightest, and clipped if anything is. Its star is the diffraction pattern of the
iris, which is the same when turned by half a turn about the light, so the light is found to a part of a pixel even
where its middle is clipped: by the point about which the neighbourhood is symmetric.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot, sqrt

import numpy as np
from numpy.typing import NDArray

from ..errors import FlarewrightError

Floats = NDArray[np.float64]
Band = NDArray[np.float32]

# what counts as another light: part of the first's clipped area, or of its flux when nothing is clipped
_RIVAL = 0.25
# a clipped area smaller than this may be a hot pixel
_LEAST_AREA = 4
# what may be another light, fainter than the first: clipped over so many pixels, or this part of it as far as it is not
# clipped; so far from it, part of the width, and pixels
_OTHER_AREA, _OTHER, _OTHER_FAR, _OTHER_PX = 9, 0.01, 0.1, 15.0
# around it, so many pixels from its rim, there is less than this part of its light
_RING, _DARK = (3.0, 6.0), 0.1
# how far beyond the clipped area the star is compared with itself, pixels
_RIM = 14
# how much the star may differ from its turned self for other reasons than noise, as part of it
_ASYMMETRY = 0.02
# and how much ghosts beside it may add on one side, as a multiple of how uneven the outer half of what is compared is
_STRAY = 2.0
# pixels of a star do not differ from each other by chance: so many count as one. And no light is known better than this
_COUNT_AS_ONE, _LEAST_ERROR = 16.0, 0.02


@dataclass(frozen=True)
class Sighting:
    """The light as one frame shows it.

    Attributes
    ----------
    position_px : tuple of float
        (x, y).
    error_px : float
        Standard error along an axis.
    flux : float
        Of the 15 x 15 pixels around it, clipped ones counted at the level of clipping: at least.
    contrast : float
        Brightest pixel over the frame's median.
    at_border : bool
        Whether the picture cuts the star's middle.
    rival_px : tuple of float or None
        Where another light seems to be.
    clipped_share : float
        Part of the pixels that every exposure clipped.
    other_px : tuple of float or None
        The brightest spot far from it, a light or a ghost: which shows in the run (`second_light`).
    """

    position_px: tuple[float, float]
    error_px: float
    flux: float
    contrast: float
    at_border: bool
    rival_px: tuple[float, float] | None
    clipped_share: float
    other_px: tuple[float, float] | None = None


def find_light(radiance: Band, variance: Band) -> Sighting:
    """Find the light in a frame; whether it is one shows in the run (`geometry.believable`).

    Parameters
    ----------
    radiance, variance : ndarray, shape (height, width, 3)
        As of `MergedFrame`.

    Returns
    -------
    Sighting
    """
    clipped: NDArray[np.bool_] = np.asarray(np.isinf(variance).any(axis=2))
    light = radiance.mean(axis=2, dtype=np.float64)
    height, width = light.shape
    blobs = [blob for blob in _blobs(clipped) if blob.area >= _LEAST_AREA]
    if blobs:
        first = blobs[0]
        (x, y), radius = first.middle, first.radius
        rivals = [
            blob.middle
            for blob in blobs[1:]
            if blob.area > max(9.0, _RIVAL * first.area) and _apart(blob.middle, (x, y)) > 3.0 * (radius + blob.radius)
        ]
    else:
        x, y, rivals = *_brightest(light), _second(light)
        radius = 2.0
    other = _other(light, blobs, (x, y), radius)
    reach = radius + _RIM
    at_border = not (reach / 2 < x < width - reach / 2 and reach / 2 < y < height - reach / 2)
    (x, y), error = _symmetric(light, variance.mean(axis=2, dtype=np.float64), clipped, (x, y), reach)
    median = max(float(np.median(light[~clipped])) if not clipped.all() else 0.0, 1e-30)
    contrast = float(light.max()) / median
    row, column = (min(max(int(value) - 7, 0), side) for value, side in ((y, height), (x, width)))
    flux = float(light[row : row + 15, column : column + 15].sum())
    rival = rivals[0] if rivals else None
    return Sighting((x, y), error, flux, contrast, at_border, rival, float(clipped.mean()), other)


def two_lights(sighting: Sighting, other: tuple[float, float] | None, where: str) -> FlarewrightError:
    """Return what to say of two lights: `where` both are."""
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


def _blobs(flags: NDArray[np.bool_]) -> list[_Blob]:
    """Return the connected areas (8 neighbours), the largest first: runs of each row joined with those above."""
    parent: list[int] = []
    sums: list[tuple[int, float, float]] = []

    def root(k: int) -> int:
        while parent[k] != k:
            parent[k] = parent[parent[k]]
            k = parent[k]
        return k

    above: list[tuple[int, int, int]] = []
    last = -2
    for row in np.flatnonzero(flags.any(axis=1)):
        edges = np.flatnonzero(np.diff(np.concatenate([[0], flags[row].astype(np.int8), [0]])))
        above = above if row == last + 1 else []
        current = []
        for start, end in edges.reshape(-1, 2).tolist():
            label = len(parent)
            parent.append(label)
            count = end - start
            sums.append((count, count * 0.5 * (start + end), count * (row + 0.5)))
            for other_start, other_end, other in above:
                if other_start <= end and start <= other_end:
                    parent[root(other)] = root(label)
            current.append((start, end, label))
        above, last = current, int(row)
    total: dict[int, list[float]] = {}
    for k, one in enumerate(sums):
        entry = total.setdefault(root(k), [0.0, 0.0, 0.0])
        for part in range(3):
            entry[part] += one[part]
    blobs = [_Blob(int(area), (x / area, y / area)) for area, x, y in total.values()]
    return sorted(blobs, key=lambda blob: -blob.area)


def _apart(a: tuple[float, float], b: tuple[float, float]) -> float:
    return hypot(a[0] - b[0], a[1] - b[1])


def _boxed(light: Floats) -> Floats:
    """Return sums over 3 x 3 pixels, so that one hot pixel is no light."""
    padded = np.pad(light, 1)
    height, width = light.shape
    total = np.zeros_like(light)
    for i in range(3):
        for j in range(3):
            total += padded[i : i + height, j : j + width]
    return total


def _brightest(light: Floats) -> tuple[float, float]:
    y, x = np.unravel_index(int(_boxed(light).argmax()), light.shape)
    return float(x) + 0.5, float(y) + 0.5


def _second(light: Floats) -> list[tuple[float, float]]:
    """Return where nearly as much light comes from, far from the brightest place."""
    boxes = _boxed(light)
    height, width = light.shape
    y, x = np.unravel_index(int(boxes.argmax()), light.shape)
    far = (np.arange(width) - x) ** 2 + (np.arange(height)[:, None] - y) ** 2 > max(15.0, 0.05 * width) ** 2
    rest = np.where(far, boxes, 0.0)
    if not far.any() or rest.max() < _RIVAL * boxes.max():
        return []
    b, a = np.unravel_index(int(rest.argmax()), light.shape)
    return [(float(a) + 0.5, float(b) + 0.5)]


def _other(
    light: Floats, blobs: Sequence[_Blob], first: tuple[float, float], radius: float
) -> tuple[float, float] | None:
    """Return the brightest spot far from the light that may be another: clipped, or the top of a little star."""
    height, width = light.shape
    away = max(_OTHER_PX, _OTHER_FAR * width)
    for blob in blobs[1:]:
        if blob.area >= _OTHER_AREA and _apart(blob.middle, first) > max(away, 3.0 * (radius + blob.radius)):
            return blob.middle if _alone(light, blob.middle, blob.radius) else None
    boxes = _boxed(light)
    least = _OTHER * float(boxes[min(int(first[1]), height - 1), min(int(first[0]), width - 1)])
    far = (np.arange(width) + 0.5 - first[0]) ** 2 + (np.arange(height)[:, None] + 0.5 - first[1]) ** 2 > away**2
    rest = np.where(far, boxes, 0.0)
    row, column = np.unravel_index(int(rest.argmax()), light.shape)
    top = rest[row, column]
    around = boxes[max(row - 3, 0) : row + 4, max(column - 3, 0) : column + 4]
    spot = light[max(row - 1, 0) : row + 2, max(column - 1, 0) : column + 2]
    # the first one's star has no top of its own there, and a hot pixel has dark neighbours
    if top < max(least, 1e-30) or top < around.max() or np.median(spot) < 0.1 * spot.max():
        return None
    found = float(column) + 0.5, float(row) + 0.5
    return found if _alone(light, found, 2.0) else None


def _alone(light: Floats, middle: tuple[float, float], radius: float) -> bool:
    """Tell whether a spot is dark all around, as lights are, and bright places in a ghost are not."""
    reach = int(radius + _RING[1]) + 1
    left, top = max(int(middle[0]) - reach, 0), max(int(middle[1]) - reach, 0)
    part = light[top : int(middle[1]) + reach + 1, left : int(middle[0]) + reach + 1]
    x, y = np.arange(part.shape[1]) + left + 0.5, np.arange(part.shape[0])[:, None] + top + 0.5
    r = np.hypot(x - middle[0], y - middle[1])
    ring = part[(r > radius + _RING[0]) & (r < radius + _RING[1])]
    return bool(np.median(ring) < _DARK * np.median(part[r < radius])) if ring.size else False


def _symmetric(
    light: Floats, variance: Floats, clipped: NDArray[np.bool_], start: tuple[float, float], reach: float
) -> tuple[tuple[float, float], float]:
    """Find the point about which the neighbourhood is symmetric, by Gauss-Newton on logarithms; also its error.

    Ghosts that go along with the light lie on one side of it more than on the other, and fade into the star towards its
    middle, for the star falls steeply. How uneven the light is farther out tells how far in it counts.
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
        stray = _STRAY * float(np.median(uneven)) if uneven.size else 0.0
        J = np.stack([(one[1] - other[1])[usable], (one[2] - other[2])[usable]], axis=1)
        sigma = np.sqrt((one[3] + other[3])[usable] + _ASYMMETRY**2 + stray**2 * (1.0 / here**2 + 1.0 / there**2))
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
    error = scale * sqrt(_COUNT_AS_ONE * 0.5 * float(np.trace(np.linalg.pinv(normal))))
    return found, max(error, _LEAST_ERROR)


def _sampled(fields: tuple[Floats, ...], x: Floats, y: Floats) -> list[Floats]:
    """Interpolate pictures linearly at (x, y); outside, the last one is 1 and the others what the border has."""
    height, width = fields[0].shape
    u, v = x - 0.5, y - 0.5
    outside = (u < 0) | (v < 0) | (u > width - 1) | (v > height - 1)
    u, v = np.clip(u, 0.0, width - 1.001), np.clip(v, 0.0, height - 1.001)
    i, j = u.astype(np.int64), v.astype(np.int64)
    a, b = u - i, v - j
    corners = (((1 - a) * (1 - b), j, i), (a * (1 - b), j, i + 1), ((1 - a) * b, j + 1, i), (a * b, j + 1, i + 1))
    found = [np.asarray(sum(weight * field[row, column] for weight, row, column in corners)) for field in fields]
    found[-1] = np.where(outside, 1.0, found[-1])
    return found
