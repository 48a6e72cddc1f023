"""Learn the star's spikes as they are: narrow strips from the light outwards, as pictures over the constellation.

One law of radius and one width for all spikes and all constellations do not tell how the rims shade the pupil: where
they shorten an edge its spike widens and fades. What that law misses is bright, a few pixels wide and slanted, so that
upright cells would have to be as small as pixels everywhere. Along a spike it changes slowly.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, cos, floor, pi, radians, sin, tan

import numpy as np

from ..model.ghost_model import Star
from ..model.sprite import Sprite, packed
from .numbers import Floats
from .sprite_fit import DIGIT, darkest_noise, drawn, even_knots, pictures_over, points
from .views import Pixels, View

# cells along a spike as long as the picture is wide
_CELLS = 90
# half of a strip's width, part of the picture's; nearer to the light than this strips may overlap, and end
_HALF, _BEGIN = 0.03, 0.055
# cells at each side that tell what lies beside the spike
_SIDE = 2
# views for each picture, and how many pictures there are at most
_VIEWS, _MOST = 2, 25
# rounds: reading between pixels blurs, which the second one mends
_ROUNDS = 2


def spike_sprites(views: Sequence[View], pixels: Sequence[Pixels], star: Star | None) -> tuple[Sprite, ...]:
    """Learn what stands out of its surroundings along the spikes of a star.

    Parameters
    ----------
    views : sequence of View
        By rising constellation.
    pixels : sequence of ndarray, shape (H, W, 3)
        What they show beside everything known, the star's law too; not a number where nothing was measured.
    star : Star or None
        Where spikes are.

    Returns
    -------
    tuple of Sprite
        One for each spike that any view shows, round by round; they add up.
    """
    if star is None:
        return ()
    width = views[0].size_px[0]
    begin = _BEGIN * width
    half = min(_HALF * width, begin * tan(pi / max(star.spikes, 3)))
    if half < 2.0 * _SIDE + 1.0:
        return ()
    angles = even_knots(views, min(_MOST, len(views) // _VIEWS))
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
    """Fit the pictures of one spike, cell by cell; None when no view shows it."""
    cosine, sine = cos(radians(turn_deg)), sin(radians(turn_deg))
    end = max(_reach(view, cosine, sine) for view in views)
    # square pixels across, long cells along
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
    unit, cells = packed(pictures, DIGIT * darkest_noise(views) / stretch**0.5)
    return Sprite(
        follows="light", grain_px=1.0, corner_px=(begin, -0.5 * rows), turn_deg=turn_deg, stretch=float(stretch),
        constellation_deg=angles, rows=rows, columns=columns, unit=unit, cells=cells,
    )  # fmt: skip


def _reach(view: View, cosine: float, sine: float) -> float:
    """Return how far a ray from the light stays in the picture; 0 when it does not begin there."""
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
    value, known = points(picture, x, y)
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
    """Take off what lies beside the spike: a straight line from one side of the strip to the other."""
    rows = pictures.shape[1]
    upper, lower = pictures[:, :_SIDE].mean(axis=1), pictures[:, -_SIDE:].mean(axis=1)
    part = ((np.arange(rows) - 0.5 * (_SIDE - 1)) / (rows - _SIDE)).astype(np.float32)[None, :, None, None]
    return np.asarray(pictures - (1.0 - part) * upper[:, None] - part * lower[:, None], dtype=np.float32)
