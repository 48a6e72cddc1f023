"""Draw all ghosts of one colour for a replay: sharp ones at full resolution, soft ones as coarsely as possible.

A ghost blurred over several pixels has no finer detail. It is therefore drawn and blurred on a grid of larger pixels
and added to the picture by linear interpolation. The means over larger pixels and the interpolation also blur, and this
part is subtracted from the blur.
"""

from math import floor, sqrt

import numpy as np

from ..jit.decorators import compiled, inner
from .gaussian_edges import reach_of, taps_of
from .ghost_mesh import (
    box_of,
    draw_mesh,
    fill_cells,
    fill_densities,
    fill_mesh,
    least_radius,
    mesh_size,
    place_mesh,
    soften_mesh,
)
from .lateral_colour import beyond, draw_rims, shifts_of, wavelengths_of
from .pupil_mesh import LATERAL, SOFT

# least radius in standard deviations of the blur for which only the outline is blurred, and least weight drawn for it
_WIDE, _FAINT = 12.0, 5e-4
# least standard deviation of the blur in pixels of the coarse grid
_FINE_ENOUGH = 2.5


@compiled
def draw_ghosts(parameters, disc_counts, visible, sigma, frame, plane):
    """Draw the ghosts of one channel on one plane, for a replay.

    Parameters
    ----------
    parameters : ndarray, shape (G, N), float64
        Padded; see `pupil_mesh`.
    disc_counts : ndarray, shape (G,), int64
    visible : ndarray, shape (G,), float64
        Gain of each ghost at this field; 0 for a hidden ghost.
    sigma : float
        The field over the model's largest field.
    frame : ndarray, shape (5,)
        Axis x and y in pixels, cosine and sine of the roll, picture pixels per model pixel.
    plane : ndarray, shape (H, W + 1), float64
        Added to: differences along rows (`edge_coverage.sum_along_rows`), flux per pixel.
    """
    height, width = plane.shape[0], plane.shape[1] - 1
    none = np.empty((0, 0, 0, 0))
    for g in range(parameters.shape[0]):
        if visible[g] == 0.0:
            continue
        spokes, rings, span = mesh_size(parameters[g], disc_counts[g], sigma, frame, False)
        if spokes == 0:
            continue
        pupil, spots = np.empty((rings + 1, spokes, 2)), np.empty((rings + 1, spokes, 2))
        if not fill_mesh(parameters[g], disc_counts[g], sigma, frame, spokes, rings, False, pupil, none):
            continue
        place_mesh(parameters[g], pupil, sigma, frame, spots)
        densities = np.empty((rings, spokes, 2))
        if span > 0:
            fill_cells(parameters[g], sigma, pupil, spots, span, densities)
        else:
            fill_densities(parameters[g], sigma, pupil, spots, densities)
        # convert the irradiance from per model pixel to per picture pixel
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
            # wide and without folds: the blur is visible only at the outline
            draw_mesh(spots, densities, span, False, False, 0, 0, width, height, plane)
            _draw_soft_rim(spots, densities, variance, shifts, far, width, height, plane)
            continue
        # draw and blur the ghost alone, then add it to the others
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
    """Draw and blur one ghost in `own`, differences along rows of a window whose first pixel is (left, top)."""
    height, width = own.shape[0], own.shape[1] - 1
    draw_mesh(spots, densities, span, False, far == 0.0, left, top, width, height, own)
    if far > 0.0:
        draw_rims(spots, shifts, wavelengths_of(far), densities, left, top, width, height, own)
    if variance > 0.0:
        soften_mesh(own.reshape((height, width + 1, 1)), variance, spots, beyond(far), left, top)


@inner
def _draw_coarse(spots, densities, variance, shifts, far, span, times, width, height, plane):
    """Draw a soft ghost on a grid of pixels `times` times larger, and add it to the picture.

    The mean over n pixels adds a variance of n n / 12, and linear interpolation n n / 6; both are subtracted from the
    variance of the blur. The picture's own pixel mean, 1 / 12, is included in either case.
    """
    less = (variance + 1.0 / 12.0) / (times * times) - 0.25
    parted, part = shifts / times, far / times
    # a margin around the picture for light that is blurred into it
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
    # rows and columns of the picture between the first and the last pixel centre of the grid
    y0, y1 = max((top - margin - 1) * times, 0), min((top + h - margin + 1) * times, height)
    x0, x1 = max((left - margin - 1) * times, 0), min((left + w - margin + 1) * times, width)
    if y1 <= y0 or x1 <= x0:
        return
    # for each column of the picture: the grid column to its left, and the fraction of a column from there
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
    """Draw an outline many times, moved outwards and inwards, weighted by its blur.

    The moves are whole pixels where the blur is largest. `shifts` and `far` are those of `lateral_colour.shifts_of`.
    """
    rings, spokes = densities.shape[0], densities.shape[1]
    most = variance + far * far
    taps = np.empty(reach_of(most) + 1)
    taps_of(most, taps)
    # the unit normals of the sides, and for each corner the displacement that moves both of its sides by one
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
    # drop the faintest steps and normalise the others to a sum of 1
    last = 0
    total = taps[0]
    while last + 1 < taps.size and taps[last + 1] >= _FAINT:
        last += 1
        total += 2.0 * taps[last]
    moves = np.empty((2 * last + 1, 2))
    for n in range(-last, last + 1):
        moves[n + last, 0], moves[n + last, 1] = n, taps[abs(n)] / total
    draw_rims(spots, away, moves, densities, 0, 0, width, height, plane)
