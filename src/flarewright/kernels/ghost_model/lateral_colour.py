"""Lateral colour within a channel: a ghost's rim, drawn at several wavelengths of the channel's band.

Each wavelength of a channel draws the ghost at a different place and in a different size. A pupil point p that lands at
X for the centre of the band lands at X + t D + (t^2 - 1) E for a wavelength t standard deviations away, with
D = s f' + p g', E = s f" + p g"; f' and g' grow with w = s.s. f' and g' make a rim sharp on one side of the ghost and
soft on the other. f" and g" make it asymmetrically soft: glass deflects short wavelengths farther than long ones, and
in a lens corrected for colour both may land on the same side.

Inside the ghost, light that moves in from one side replaces light that moves out on the other. So only the rim is drawn
again for each t, and the area between the rim and its displaced copy gets the density of the adjacent cell. Folds are
not spread by colour.
"""

from math import ceil, exp, sqrt

import numpy as np

from ..jit.decorators import borrowing, inner
from .edge_coverage import add_edge, add_edge_changes
from .pupil_mesh import FIRST_DISC, LATERAL, LATERAL_NUMBERS, SOFT, picture_step, pupil_change

# the band is modelled as a Gaussian: half width in standard deviations, spacing of the rims in pixels, least and
# largest number of wavelengths
_HALF_BAND, _STEP_PX, _FEWEST, _MOST = 2.2, 0.8, 3, 15
# displacement at the ends of the band by E over that by D of the same length
_BENT = 1.75


@borrowing
def _length(x, y):
    return sqrt(x * x + y * y)


@borrowing
def _parting(parameters, m, sigma):
    """Return f' and g' for m = 0, f" and g" for m = 1, at a field."""
    f, g = parameters[LATERAL + 2 * m], parameters[LATERAL + 2 * m + 1]
    if m == 0:
        w = sigma * sigma
        f += w * parameters[LATERAL + 4]
        g += w * parameters[LATERAL + 5]
    return f, g


@inner
def shifts_of(parameters, sigma, frame, pupil, shifts):
    """Fill D and E of the rim, pixels, (spokes, 4); return the largest displacement by one standard deviation."""
    shifts[:] = 0.0
    last, far = pupil.shape[0] - 1, 0.0
    for j in range(shifts.shape[0] if parameters[LATERAL : LATERAL + LATERAL_NUMBERS].any() else 0):
        for m in range(2):
            f, g = _parting(parameters, m, sigma)
            along, across = sigma * f + pupil[last, j, 0] * g, pupil[last, j, 1] * g
            shifts[j, 2 * m], shifts[j, 2 * m + 1] = picture_step(frame, along, across)
        far = max(far, _length(shifts[j, 0], shifts[j, 1]) + _BENT * _length(shifts[j, 2], shifts[j, 3]))
    return far


@inner
def beyond(far):
    """Return how many pixels beyond its place at the centre of the band a rim is drawn."""
    return int(ceil(1.2 * _HALF_BAND * far)) if far > 0.0 else 0


@inner
def wavelengths_of(far):
    """Return samples of the band, shape (K, 2): place in standard deviations and weight; sum 1, variance 1."""
    count = min(max(int(ceil(2.0 * _HALF_BAND * far / _STEP_PX)) + 1, _FEWEST), _MOST)
    found = np.empty((count, 2))
    total, square = 0.0, 0.0
    for k in range(count):
        t = _HALF_BAND * (2.0 * k / (count - 1.0) - 1.0)
        found[k, 0], found[k, 1] = t, exp(-0.5 * t * t)
        total += found[k, 1]
        square += found[k, 1] * t * t
    # a loop: an assignment of whole columns compiles Numba's text of its error message as well
    width = sqrt(square / total)
    for k in range(count):
        found[k, 0] /= width
        found[k, 1] /= total
    return found


@borrowing
def _moved(place, t, by, bent):
    """Return one coordinate of a point at wavelength t, from that coordinate of D and E."""
    return place + t * by + (t * t - 1.0) * bent


@inner
def draw_rims(spots, shifts, band, densities, left, top, width, height, plane):
    """Draw a mesh's outline once for each sample (t, weight) of a band, displaced by `shifts`."""
    rings, spokes = densities.shape[0], densities.shape[1]
    for n in range(band.shape[0]):
        t, part = band[n, 0], band[n, 1]
        for j in range(spokes):
            k = j + 1 if j + 1 < spokes else 0
            before = j - 1 if j > 0 else spokes - 1
            x = _moved(spots[rings, j, 0], t, shifts[j, 0], shifts[j, 2])
            y = _moved(spots[rings, j, 1], t, shifts[j, 1], shifts[j, 3])
            next_x = _moved(spots[rings, k, 0], t, shifts[k, 0], shifts[k, 2])
            next_y = _moved(spots[rings, k, 1], t, shifts[k, 1], shifts[k, 3])
            add_edge(
                x, y, next_x, next_y, part * densities[rings - 1, j, 0], left, top, width, height, plane,
            )  # fmt: skip
            # extend the edge between two cells to the displaced outline
            step = part * (densities[rings - 1, j, 0] - densities[rings - 1, before, 0])
            add_edge(spots[rings, j, 0], spots[rings, j, 1], x, y, step, left, top, width, height, plane)


@inner
def _shift_changes(parameters, sigma, free, frame, pupil, pupil_by, shifts_by):
    """Fill the derivatives of `shifts_of`, (spokes, 4, Q), by the free parameters."""
    last, w = pupil.shape[0] - 1, sigma * sigma
    for m in range(2):
        first = LATERAL + 2 * m
        _, g = _parting(parameters, m, sigma)
        for j in range(shifts_by.shape[0]):
            for q in range(free.size):
                n = free[q]
                along, across = 0.0, 0.0
                # only f' and g' grow with w
                grows = m == 0 and n >= LATERAL + 4
                if n == first or (grows and n == LATERAL + 4):
                    along = sigma
                elif n == first + 1 or (grows and n == LATERAL + 5):
                    along, across = pupil[last, j, 0], pupil[last, j, 1]
                elif FIRST_DISC <= n < SOFT:
                    dxi, deta = pupil_change(n, sigma, pupil_by, last, j)
                    along, across = g * dxi, g * deta
                part = w if grows else 1.0
                shifts_by[j, 2 * m, q], shifts_by[j, 2 * m + 1, q] = picture_step(frame, part * along, part * across)


@inner
def draw_rim_changes(
    parameters, sigma, free, frame, pupil, pupil_by, spots, spots_by, shifts, band, densities, changes, span, left, top,
    width, height, out,
):  # fmt: skip
    """Draw the derivatives of `draw_rims` by the free parameters."""
    rings, spokes, count = densities.shape[0], densities.shape[1], free.size
    shifts_by = np.empty((spokes, 4, count))
    _shift_changes(parameters, sigma, free, frame, pupil, pupil_by, shifts_by)
    moved, moved_by = np.empty((spokes, 2)), np.empty((spokes, 2, count))
    step, sweep = np.empty(count), np.empty((2, count))
    for n in range(band.shape[0]):
        t, part = band[n, 0], band[n, 1]
        for j in range(spokes):
            for m in range(2):
                moved[j, m] = _moved(spots[rings, j, m], t, shifts[j, m], shifts[j, 2 + m])
                for q in range(count):
                    by, bent = shifts_by[j, m, q], shifts_by[j, 2 + m, q]
                    moved_by[j, m, q] = _moved(spots_by[rings, j, m, q], t, by, bent)
        for j in range(spokes):
            k = j + 1 if j + 1 < spokes else 0
            before = j - 1 if j > 0 else spokes - 1
            for q in range(count):
                step[q] = part * changes[rings - 1, j, 0, q]
            add_edge_changes(
                moved[j, 0], moved[j, 1], moved[k, 0], moved[k, 1], part * densities[rings - 1, j, 0], step,
                moved_by[j], moved_by[k], left, top, width, height, sweep, out,
            )  # fmt: skip
            # no step in density inside a cell
            if span > 0 and j % span != 0:
                continue
            for q in range(count):
                step[q] = part * (changes[rings - 1, j, 0, q] - changes[rings - 1, before, 0, q])
            light = part * (densities[rings - 1, j, 0] - densities[rings - 1, before, 0])
            add_edge_changes(
                spots[rings, j, 0], spots[rings, j, 1], moved[j, 0], moved[j, 1], light, step, spots_by[rings, j],
                moved_by[j], left, top, width, height, sweep, out,
            )  # fmt: skip
