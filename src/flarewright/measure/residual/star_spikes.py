"""Learn the star's spikes: narrow strips from the light outwards, as images over the constellation.

The star's law has one radial profile and one width for all spikes and constellations. It does not describe how rims
vignette the pupil: where a rim shortens an edge, the edge's spike widens and fades. This residual is bright, slanted
and a few pixels wide, so that upright cells would have to be as small as pixels everywhere. Along a spike it changes
slowly.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, cos, floor, pi, radians, sin, tan

import numpy as np

from ...model.measurement.ghost_model import Star
from ...model.measurement.sprite import Sprite, encode_pictures
from ...typing import Floats, Pixels
from ..core.views import View
from .sprite_fit import DIGIT, cell_points, darkest_noise, drawn, even_knots, pictures_over

# cells per spike as long as the picture's width
_CELLS = 90
# half width of a strip and its start, part of the picture's width; closer to the light strips can overlap
_HALF, _BEGIN = 0.03, 0.055
# cells at each side of a strip that measure the light beside the spike
_SIDE = 2
# views per image, and largest number of images
_VIEWS, _MOST = 2, 25
# the second round corrects the blur of interpolation between pixels
_ROUNDS = 2


def spike_sprites(
    views: Sequence[View], pixels: Sequence[Pixels], star: Star | None, series: int = 1
) -> tuple[Sprite, ...]:
    """Learn the light above its surroundings along the spikes of a star.

    Parameters
    ----------
    views : sequence of View
        Sorted by constellation.
    pixels : sequence of ndarray, shape (H, W, 3)
        Residual of the views, after the star's law too; NaN where nothing was measured.
    star : Star or None
        Gives the directions of the spikes.
    series : int
        As for `sprite_fit.light_sprites`.

    Returns
    -------
    tuple of Sprite
        One for each visible spike and round; they are summed.
    """
    if star is None:
        return ()
    width = views[0].size_px[0]
    begin = _BEGIN * width
    half = min(_HALF * width, begin * tan(pi / max(star.spikes, 3)))
    if half < 2.0 * _SIDE + 1.0:
        return ()
    angles = even_knots(views, min(_MOST // series, len(views) // _VIEWS))
    left, found = list(pixels), []
    for _ in range(_ROUNDS):
        strips = [
            strip
            for k in range(star.spikes)
            if (strip := _strip(views, left, star.first_deg + 360.0 * k / star.spikes, begin, half, angles)) is not None
        ]
        found += strips
        left = [each - drawn(strips, view) for each, view in zip(left, views, strict=True)]
    return tuple(found)


def _strip(
    views: Sequence[View],
    pixels: Sequence[Pixels],
    turn_deg: float,
    begin: float,
    half: float,
    angles: tuple[float, ...],
) -> Sprite | None:
    """Fit the images of one spike, cell by cell; None when no view shows it."""
    cosine, sine = cos(radians(turn_deg)), sin(radians(turn_deg))
    end = max(_reach(view, cosine, sine) for view in views)
    # single pixels across the strip, long cells along it
    stretch = max(1, round(views[0].size_px[0] / _CELLS))
    rows, columns = 2 * floor(half), ceil((end - begin) / stretch)
    if columns < 2:
        return None
    at = np.arange(columns * stretch) + 0.5
    along, down = np.meshgrid(begin + at, np.arange(rows) + 0.5 - 0.5 * rows)
    values = np.zeros((len(views), rows, columns, 3), np.float32)
    weights, noise = np.zeros_like(values), np.zeros((rows, columns, 3))
    for k, (view, picture) in enumerate(zip(views, pixels, strict=True)):
        x = view.light_px[0] + cosine * along + sine * down
        y = view.light_px[1] - sine * along + cosine * down
        values[k], variance, weights[k] = _cells(picture, view, x, y, stretch)
        noise += weights[k] ** 2 * variance
    pictures = _above_sides(pictures_over(angles, views, values, weights, noise))
    unit, cells = encode_pictures(pictures, DIGIT * darkest_noise(views) / stretch**0.5)
    return Sprite(
        follows="light", grain_px=1.0, corner_px=(begin, -0.5 * rows), turn_deg=turn_deg, stretch=float(stretch),
        constellation_deg=angles, rows=rows, columns=columns, unit=unit, cells=cells,
    )  # fmt: skip


def _reach(view: View, cosine: float, sine: float) -> float:
    """Return the length of a ray from the light inside the picture; 0 when it starts outside."""
    (x, y), (width, height) = view.light_px, view.size_px
    low, high = 0.0, float(width + height) * 4.0
    for at, step, side in ((x, cosine, width), (y, -sine, height)):
        if abs(step) < 1e-9:
            if not 0.0 <= at <= side:
                return 0.0
            continue
        ends = sorted((-at / step, (side - at) / step))
        low, high = max(low, ends[0]), min(high, ends[1])
    return high if high > low else 0.0


def _cells(picture: Pixels, view: View, x: Floats, y: Floats, stretch: int) -> tuple[Floats, Floats, Floats]:
    """Return light, its variance and its weight (0: not measured), shape (rows, columns, 3) each."""
    value, known = cell_points(picture, x, y)
    row = np.clip(y.astype(np.int64), 0, picture.shape[0] - 1)
    column = np.clip(x.astype(np.int64), 0, picture.shape[1] - 1)
    variance = view.variance[row, column].astype(np.float64)
    known = np.where(np.isfinite(variance), known, 0.0)
    sums = [
        each.reshape(x.shape[0], -1, stretch, 3).sum(axis=2)
        for each in (known * value, np.where(known > 0.0, variance, 0.0), known)
    ]
    count = np.maximum(sums[2], 1e-9)
    return sums[0] / count, sums[1] / count**2, sums[2] / stretch


def _above_sides(pictures: Pixels) -> Pixels:
    """Subtract the light beside the spike: a linear ramp from one side of the strip to the other."""
    rows = pictures.shape[1]
    upper, lower = pictures[:, :_SIDE].mean(axis=1), pictures[:, -_SIDE:].mean(axis=1)
    part = ((np.arange(rows) - 0.5 * (_SIDE - 1)) / (rows - _SIDE)).astype(np.float32)[None, :, None, None]
    return np.asarray(pictures - (1.0 - part) * upper[:, None] - part * lower[:, None], dtype=np.float32)
