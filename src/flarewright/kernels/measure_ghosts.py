"""Draw all ghosts of one colour as a replay needs them: sharp ones, and soft ones as coarsely as their softness allows.

A picture that is spread by some pixels holds nothing finer than these. So a soft ghost is drawn on a grid of larger
pixels, spread there, and laid over the picture by linear interpolation. Means over larger pixels and interpolation
spread light too, which its softness has less to do then.
"""

from math import floor, sqrt

import numpy as np

from ._jit import compiled, inner
from .measure_lateral import beyond, draw_rims, shifts_of, wavelengths_of
from .measure_mesh import (
    box_of,
    draw_mesh,
    fill_cells,
    fill_densities,
    fill_mesh,
    grain,
    land,
    least_radius,
    soften_mesh,
)
from .measure_pupil import LATERAL, SOFT
from .measure_soft import reach_of, taps_of

# from how many standard deviations of softness a radius is wide, and what weight is none
_WIDE, _FAINT = 12.0, 5e-4
# how soft a ghost is at least in pixels of the grid that it is drawn on
_FINE_ENOUGH = 2.5


@compiled
def draw_ghosts(parameters, disc_counts, visible, sigma, frame, plane):
    """Draw ghosts of one channel on one plane, as a replay needs them.

    Parameters
    ----------
    parameters : ndarray, shape (G, N), float64
        Padded; see `measure_pupil`.
    disc_counts : ndarray, shape (G,), int64
    visible : ndarray, shape (G,), float64
        Gain of each ghost at this field; 0 leaves it out.
    sigma : float
        The field over the model's largest.
    frame : ndarray, shape (5,)
        Axis x and y in pixels, cosine and sine of the roll, pixels per pixel of the model.
    plane : ndarray, shape (H, W + 1), float64
        Added to: differences along rows (`measure_edges.sum_along_rows`), flux per pixel.
    """
    height, width = plane.shape[0], plane.shape[1] - 1
    none = np.empty((0, 0, 0, 0))
    for g in range(parameters.shape[0]):
        if visible[g] == 0.0:
            continue
        spokes, rings, span = grain(parameters[g], disc_counts[g], sigma, frame, False)
        if spokes == 0:
            continue
        pupil, spots = np.empty((rings + 1, spokes, 2)), np.empty((rings + 1, spokes, 2))
        if not fill_mesh(parameters[g], disc_counts[g], sigma, frame, spokes, rings, False, pupil, none):
            continue
        land(parameters[g], pupil, sigma, frame, spots)
        densities = np.empty((rings, spokes, 2))
        if span > 0:
            fill_cells(parameters[g], sigma, pupil, spots, span, densities)
        else:
            fill_densities(parameters[g], sigma, pupil, spots, densities)
        # the model's irradiance is per pixel of the model: a finer picture keeps it
        densities *= visible[g] * frame[4] * frame[4]
        variance = parameters[g, SOFT] * frame[4] * frame[4]
        shifts = np.empty((spokes, 4))
        far = shifts_of(parameters[g], sigma, frame, pupil, shifts)
        if not (variance > 0.0 or far > 0.0):
            draw_mesh(spots, densities, span, False, True, 0, 0, width, height, plane)
            continue
        times = int(sqrt(variance) / _FINE_ENOUGH)
        if times > 1:
            _draw_coarse(spots, densities, variance, shifts, far, span, times, width, height, plane)
            continue
        even = parameters[g, LATERAL + 2] == 0.0 and parameters[g, LATERAL + 3] == 0.0
        if even and span > 0 and least_radius(spots) > _WIDE * sqrt(variance + far * far):
            # without folds, and wide: only the outline's step is steep enough to be seen spread
            draw_mesh(spots, densities, span, False, False, 0, 0, width, height, plane)
            _draw_soft_rim(spots, densities, variance, shifts, far, width, height, plane)
            continue
        # spread alone, and then laid over the others
        left, top, w, h = box_of(spots, reach_of(variance) + beyond(far), width, height)
        if w == 0:
            continue
        own = np.zeros((h, w + 1))
        _spread(spots, densities, variance, shifts, far, span, left, top, own)
        for y in range(h):
            for c in range(w):
                plane[top + y, left + c] += own[y, c]


@inner
def _spread(spots, densities, variance, shifts, far, span, left, top, own):
    """Draw a ghost alone and spread it; `own` are differences along rows of the window that begins at left, top."""
    height, width = own.shape[0], own.shape[1] - 1
    draw_mesh(spots, densities, span, False, far == 0.0, left, top, width, height, own)
    if far > 0.0:
        draw_rims(spots, shifts, wavelengths_of(far), densities, left, top, width, height, own)
    if variance > 0.0:
        soften_mesh(own.reshape((height, width + 1, 1)), variance, spots, beyond(far), left, top)


@inner
def _draw_coarse(spots, densities, variance, shifts, far, span, times, width, height, plane):
    """Draw a soft ghost on a grid whose pixels are so many times larger, and lay it over the picture.

    A mean over n pixels has a variance of n n / 12, and linear interpolation between them adds n n / 6: so much less is
    left to be spread, of which the pixel's own mean has a twelfth in any case.
    """
    less = (variance + 1.0 / 12.0) / (times * times) - 0.25
    parted, part = shifts / times, far / times
    # around the picture lies what is spread into it
    reach = reach_of(less)
    margin = reach + 1
    small = spots / times + margin
    across, down = (width + times - 1) // times + 2 * margin, (height + times - 1) // times + 2 * margin
    left, top, w, h = box_of(small, reach + beyond(part), across, down)
    if w == 0:
        return
    own = np.zeros((h, w + 1))
    _spread(small, densities, less, parted, part, span, left, top, own)
    for y in range(h):
        for c in range(1, w):
            own[y, c] += own[y, c - 1]
    # rows and columns of the picture that lie between the first and the last middle of the grid's pixels
    y0, y1 = max((top - margin - 1) * times, 0), min((top + h - margin + 1) * times, height)
    x0, x1 = max((left - margin - 1) * times, 0), min((left + w - margin + 1) * times, width)
    if y1 <= y0 or x1 <= x0:
        return
    # between which of the grid's columns each of the picture's lies, and where
    column, share = np.empty(x1 - x0, np.int64), np.empty(x1 - x0)
    for x in range(x0, x1):
        at = (x + 0.5) / times + 1.5 + margin - left
        column[x - x0] = int(at)
        share[x - x0] = at - int(at)
    row, light = np.zeros(w + 4), np.empty(x1 - x0)
    for y in range(y0, y1):
        at = (y + 0.5) / times - 0.5 + margin - top
        above = int(floor(at))
        part = at - above
        first, second = own[min(max(above, 0), h - 1)], own[min(max(above + 1, 0), h - 1)]
        upper, lower = 1.0 - part if 0 <= above < h else 0.0, part if 0 <= above + 1 < h else 0.0
        for c in range(w):
            row[c + 2] = upper * first[c] + lower * second[c]
        for i in range(light.size):
            c = column[i]
            light[i] = row[c] + share[i] * (row[c + 1] - row[c])
        plane[y, x0] += light[0]
        for i in range(1, light.size):
            plane[y, x0 + i] += light[i] - light[i - 1]
        plane[y, x1] -= light[light.size - 1]


@inner
def _draw_soft_rim(spots, densities, variance, shifts, far, width, height, plane):
    """Draw an outline many times, moved outwards and inwards, by the weights of its spread.

    Where it is softest by whole pixels; `shifts` and `far` as `measure_lateral.shifts_of` fills and returns them.
    """
    rings, spokes = densities.shape[0], densities.shape[1]
    most = variance + far * far
    taps = np.empty(reach_of(most) + 1)
    taps_of(most, taps)
    # the unit normals of the sides, and of each corner the way that moves both of its sides by one
    sides, away = np.empty((spokes, 2)), np.zeros((spokes, 4))
    turn = 0.0
    for j in range(spokes):
        k = j + 1 if j + 1 < spokes else 0
        ax, ay, bx, by = spots[rings, j, 0], spots[rings, j, 1], spots[rings, k, 0], spots[rings, k, 1]
        turn += ax * by - ay * bx
        length = max(sqrt((bx - ax) ** 2 + (by - ay) ** 2), 1e-12)
        sides[j, 0], sides[j, 1] = (by - ay) / length, (ax - bx) / length
    if turn < 0.0:
        sides *= -1.0
    for j in range(spokes):
        before = j - 1 if j > 0 else spokes - 1
        x, y = sides[j, 0] + sides[before, 0], sides[j, 1] + sides[before, 1]
        stretch = 2.0 / max(x * x + y * y, 1.0)
        if far > 0.0:
            outwards = (x * shifts[j, 0] + y * shifts[j, 1]) ** 2 / max(x * x + y * y, 1.0)
            stretch *= sqrt(min((variance + outwards) / most, 1.0))
        away[j, 0], away[j, 1] = stretch * x, stretch * y
    # what is too faint to be drawn is shared by the others: the steps shall add up to the whole
    last = 0
    total = taps[0]
    while last + 1 < taps.size and taps[last + 1] >= _FAINT:
        last += 1
        total += 2.0 * taps[last]
    moves = np.empty((2 * last + 1, 2))
    for n in range(-last, last + 1):
        moves[n + last, 0], moves[n + last, 1] = n, taps[abs(n)] / total
    draw_rims(spots, away, moves, densities, 0, 0, width, height, plane)
