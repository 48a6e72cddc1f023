"""Draw a measured ghost from its pupil's mesh: flux-conserving, with exact coverage (derivatives: `measure_changes`).

The mesh is a fan of spokes and rings over the open pupil (`kernels.measure_pupil`). A triangle carries the flux of its
part of the pupil wherever it lands, so folds and caustics need no special care. Far from folds, triangles are joined to
cells as large as the brightness over the pupil allows: only borders between cells are drawn. A fit draws with smaller
cells than a replay, so that its pictures hardly jump where the mesh changes.
"""

from math import ceil, floor, pi, sin, sqrt

import numpy as np

from ._jit import borrowing, compiled, inner
from .measure_edges import add_edge
from .measure_lateral import beyond, shifts_of
from .measure_pupil import (
    BLADES,
    FIRST_G,
    FIRST_I,
    SOFT,
    TURN,
    at_field,
    below,
    border,
    level,
    place,
    rims,
    slopes,
    turned,
)
from .measure_soft import reach_of, soften, taps_of

# pixels by which a chord may leave its arc, up to so many spokes
_CHORD = 0.05
_LEAST_SPOKES, _MOST_SPOKES = 16, 208
_LEAST_RINGS, _MOST_RINGS = 3, 16
# without folds: areas on the sensor that differ by no more than this factor, the part of the brightness that may change
# from one cell to the next, outwards and around, how many edges a ring has at
# least, and how many rings of cells there may be
_EVEN, _STEP = 4.0, 0.05
_ROUND, _AROUND = 16, 16
_RINGS = (2, 3, 4, 6, 8, 12, 16)


@inner
def fill_mesh(parameters, disc_count, sigma, frame, spokes, rings, with_changes, pupil, pupil_by):
    """Fill the mesh's pupil points and their derivatives by the discs; False: it is shut."""
    blades = int(parameters[BLADES])
    turn = parameters[TURN] - np.arctan2(frame[3], frame[2]) if blades > 0 else 0.0
    discs = np.empty((disc_count + 1, 2))
    rims(parameters, disc_count, sigma, discs)
    edge = np.empty((spokes + 1, 2))
    by = np.empty((spokes + 1, 2, 2 * disc_count + 2))
    if not border(discs, disc_count + 1, spokes, blades, turn, with_changes, edge, by):
        return False
    # a polygon as large as the disc it stands for; an iris of blades is one
    swell = sqrt((2.0 * pi / spokes) / sin(2.0 * pi / spokes)) if blades == 0 else 1.0
    for i in range(rings + 1):
        t = swell * i / rings
        for j in range(spokes):
            for m in range(2):
                pupil[i, j, m] = edge[spokes, m] + t * (edge[j, m] - edge[spokes, m])
                if with_changes:
                    for q in range(by.shape[2]):
                        pupil_by[i, j, m, q] = by[spokes, m, q] + t * (by[j, m, q] - by[spokes, m, q])
    return True


@inner
def area_of(ax, ay, bx, by, cx, cy):
    """Return a triangle's signed area."""
    return 0.5 * ((bx - ax) * (cy - ay) - (cx - ax) * (by - ay))


@inner
def steadied(area):
    """Return an area that may be divided by: a fold's triangles come close to 0 and keep their sign."""
    if abs(area) < 1e-7:
        return -1e-7 if area < 0.0 else 1e-7
    return area


@borrowing
def _flux(light, sigma, pupil, ia, ja, ib, jb, ic, jc):
    """Return a triangle's flux: intensity at its middle, never below 0, times its part of the pupil."""
    xi = (pupil[ia, ja, 0] + pupil[ib, jb, 0] + pupil[ic, jc, 0]) / 3.0
    eta = (pupil[ia, ja, 1] + pupil[ib, jb, 1] + pupil[ic, jc, 1]) / 3.0
    intensity = level(light, xi * xi + eta * eta, xi * sigma)
    part = area_of(
        pupil[ia, ja, 0], pupil[ia, ja, 1], pupil[ib, jb, 0], pupil[ib, jb, 1], pupil[ic, jc, 0], pupil[ic, jc, 1]
    )
    return max(intensity, 0.0) * part


@inner
def land(parameters, pupil, sigma, frame, spots):
    """Fill where the mesh lands in pixels; frame: axis x, axis y, cos roll, sin roll, scale."""
    f, g = np.empty(6), np.empty(6)
    at_field(parameters, 0, sigma * sigma, f)
    at_field(parameters, FIRST_G, sigma * sigma, g)
    for i in range(pupil.shape[0]):
        for j in range(pupil.shape[1]):
            xi, eta = pupil[i, j, 0], pupil[i, j, 1]
            u, v = xi * xi + eta * eta, xi * sigma
            value, _ = below(parameters, v, sigma * sigma)
            spread = level(g, u, v) / value
            along, across = sigma * level(f, u, v) / value + xi * spread, eta * spread
            x, y = turned(frame, along, across)
            spots[i, j, 0], spots[i, j, 1] = frame[0] + x, frame[1] + y


@inner
def fill_densities(parameters, sigma, pupil, spots, densities):
    """Fill the signed density of each triangle, shape (rings, spokes, 2)."""
    rings, spokes = densities.shape[0], densities.shape[1]
    light = np.empty(6)
    at_field(parameters, FIRST_I, sigma * sigma, light)
    for i in range(rings):
        for j in range(spokes):
            k = j + 1 if j + 1 < spokes else 0
            area = area_of(
                spots[i, j, 0], spots[i, j, 1], spots[i + 1, j, 0], spots[i + 1, j, 1], spots[i + 1, k, 0],
                spots[i + 1, k, 1],
            )  # fmt: skip
            densities[i, j, 0] = -_flux(light, sigma, pupil, i, j, i + 1, j, i + 1, k) / steadied(area)
            if i == 0:
                densities[i, j, 1] = 0.0
                continue
            area = area_of(
                spots[i, j, 0], spots[i, j, 1], spots[i + 1, k, 0], spots[i + 1, k, 1], spots[i, k, 0], spots[i, k, 1]
            )
            densities[i, j, 1] = -_flux(light, sigma, pupil, i, j, i + 1, k, i, k) / steadied(area)


@borrowing
def join(spots, span, densities):
    """Give all triangles of each cell one density, so that the edges between them need not be drawn."""
    rings, spokes = densities.shape[0], densities.shape[1]
    for i in range(rings):
        for first in range(0, spokes, span):
            light, area = cell_light(spots, span, densities, i, first)
            densities[i, first : first + span, 0] = light / area
            if i > 0:
                densities[i, first : first + span, 1] = light / area


@inner
def fill_cells(parameters, sigma, pupil, spots, span, densities):
    """Fill what `fill_densities` and `join` would: light of a cell's part of the pupil over its area on the sensor."""
    rings, spokes = densities.shape[0], densities.shape[1]
    light, wedge = np.empty(6), np.empty(spokes)
    at_field(parameters, FIRST_I, sigma * sigma, light)
    x0, y0 = pupil[0, 0, 0], pupil[0, 0, 1]
    for j in range(spokes):
        k = j + 1 if j + 1 < spokes else 0
        wedge[j] = area_of(x0, y0, pupil[rings, j, 0], pupil[rings, j, 1], pupil[rings, k, 0], pupil[rings, k, 1])
    for i in range(rings):
        wide = _span_of(i, span, spokes, rings)
        # parts of a wedge that the two triangles between rings are
        outer, inner_part = (i + 1.0) / (rings * rings), float(i) / (rings * rings)
        for first in range(0, spokes, wide):
            flux, area = 0.0, 0.0
            for j in range(first, first + wide):
                k = j + 1 if j + 1 < spokes else 0
                one, other = cell_areas(spots, i, j, spokes)
                ax, ay, bx, by = pupil[i, j, 0], pupil[i, j, 1], pupil[i + 1, j, 0], pupil[i + 1, j, 1]
                cx, cy = pupil[i + 1, k, 0], pupil[i + 1, k, 1]
                x, y = (ax + bx + cx) / 3.0, (ay + by + cy) / 3.0
                flux += max(level(light, x * x + y * y, x * sigma), 0.0) * outer * wedge[j]
                area += one
                if i > 0:
                    x, y = (ax + cx + pupil[i, k, 0]) / 3.0, (ay + cy + pupil[i, k, 1]) / 3.0
                    flux += max(level(light, x * x + y * y, x * sigma), 0.0) * inner_part * wedge[j]
                    area += other
            density = -flux / steadied(area)
            for j in range(first, first + wide):
                densities[i, j, 0], densities[i, j, 1] = density, density if i > 0 else 0.0


@inner
def _span_of(i, span, spokes, rings):
    """Return how many spokes a cell of ring i spans: inside, where spokes are closer, more than at the rim."""
    wide = max(span, 1)
    for times in range(2, rings // (i + 1) + 1 if span > 0 else 2):
        if spokes % (span * times) == 0:
            wide = span * times
    return wide


@inner
def _chord_of(span, spokes):
    """Return how many spokes an edge between two rings of cells spans: as many as a cell, but a ring stays round."""
    chord = max(span, 1)
    while chord > 1 and (spokes < _ROUND * chord or span % chord):
        chord -= 1
    return chord


@borrowing
def cell_light(spots, span, densities, i, first):
    """Return the light and the signed area of a cell of `span` spokes that begins at one of them."""
    light, area = 0.0, 0.0
    for j in range(first, first + span):
        one, other = cell_areas(spots, i, j, densities.shape[1])
        light += densities[i, j, 0] * one
        area += one
        if i > 0:
            light += densities[i, j, 1] * other
            area += other
    # triangles of a ghost that has shrunk to nothing have either sign
    return light, steadied(area)


@borrowing
def cell_areas(spots, i, j, spokes):
    """Return the signed areas of the two triangles between two spokes and two rings, as they are divided by."""
    k = j + 1 if j + 1 < spokes else 0
    one = area_of(
        spots[i, j, 0], spots[i, j, 1], spots[i + 1, j, 0], spots[i + 1, j, 1], spots[i + 1, k, 0], spots[i + 1, k, 1]
    )
    other = area_of(
        spots[i, j, 0], spots[i, j, 1], spots[i + 1, k, 0], spots[i + 1, k, 1], spots[i, k, 0], spots[i, k, 1]
    )
    return steadied(one), steadied(other)


@borrowing
def draw_mesh(spots, densities, span, fine, rim, left, top, width, height, plane):
    """Draw every edge once, with the step in density across it; unless fine, one between rings spans several spokes.

    Without `rim` the outline is left out.
    """
    rings, spokes = densities.shape[0], densities.shape[1]
    for i in range(rings):
        wide = max(span, 1) if fine else _span_of(i, span, spokes, rings)
        for j in range(0, spokes, wide):
            before = j - 1 if j > 0 else spokes - 1
            ax, ay = spots[i, j, 0], spots[i, j, 1]
            bx, by = spots[i + 1, j, 0], spots[i + 1, j, 1]
            other = densities[i, before, 1] if i > 0 else densities[i, before, 0]
            add_edge(ax, ay, bx, by, densities[i, j, 0] - other, left, top, width, height, plane)
            if i > 0 and span == 0:
                k = j + 1 if j + 1 < spokes else 0
                cx, cy = spots[i + 1, k, 0], spots[i + 1, k, 1]
                step = densities[i, j, 1] - densities[i, j, 0]
                add_edge(ax, ay, cx, cy, step, left, top, width, height, plane)
        if i + 1 == rings and not rim:
            continue
        chord = _chord_of(span, spokes) if i + 1 < rings and not fine else 1
        for j in range(0, spokes, chord):
            k = j + chord if j + chord < spokes else 0
            outer = densities[i + 1, j, 1] if i + 1 < rings else 0.0
            add_edge(
                spots[i + 1, j, 0], spots[i + 1, j, 1], spots[i + 1, k, 0], spots[i + 1, k, 1],
                densities[i, j, 0] - outer, left, top, width, height, plane,
            )  # fmt: skip


@borrowing
def least_radius(spots):
    """Return how far the nearest point of a mesh's outline is from its middle."""
    rings = spots.shape[0] - 1
    least = 1e300
    for j in range(spots.shape[1]):
        dx, dy = spots[rings, j, 0] - spots[0, 0, 0], spots[rings, j, 1] - spots[0, 0, 1]
        least = min(least, dx * dx + dy * dy)
    return sqrt(least)


@inner
def grain(parameters, disc_count, sigma, frame, fine):
    """Return spokes and rings fine enough for a ghost, and how many spokes a cell of the outermost ring spans.

    0 spokes: nothing is open; a span of 0: there are folds, and every triangle stays alone.
    """
    pupil, none = np.empty((3, 8, 2)), np.empty((0, 0, 0, 0))
    if not fill_mesh(parameters, disc_count, sigma, frame, 8, 2, False, pupil, none):
        return 0, 0, 0
    reach, least, most = 0.0, 1e300, -1e300
    dark, bright, outwards = 1e300, 0.0, 0.0
    rim_dark, rim_bright = 1e300, 0.0
    seen = np.empty((3, 8))
    x0, y0, _, _, _, _ = place(parameters, pupil[0, 0, 0], pupil[0, 0, 1], sigma)
    for i in range(3):
        for j in range(8 if i > 0 else 1):
            xi, eta = pupil[i, j, 0], pupil[i, j, 1]
            x, y, a, b, c, d = place(parameters, xi, eta, sigma)
            reach = max(reach, sqrt((x - x0) ** 2 + (y - y0) ** 2))
            area = a * d - b * c
            least, most = min(least, area), max(most, area)
            intensity, _, _ = slopes(parameters, FIRST_I, xi * xi + eta * eta, xi * sigma, sigma * sigma)
            density = max(intensity, 0.0) / max(abs(area), 1e-9)
            dark, bright = min(dark, density), max(bright, density)
            seen[i, j] = density
            if i == 2:
                rim_dark, rim_bright = min(rim_dark, density), max(rim_bright, density)
                outwards = max(outwards, abs(seen[1, j] - seen[0, 0]) + abs(density - seen[1, j]))
    spokes = min(max(pi * sqrt(reach * frame[4] / (2.0 * _CHORD)), _LEAST_SPOKES), _MOST_SPOKES)
    # coarse steps: while a ghost is fitted its mesh had better stay the same
    spokes = 16 * int(ceil(spokes / 16.0))
    rings = int(min(max(spokes // 6, _LEAST_RINGS), _MOST_RINGS))
    if not (least * most > 0.0 and max(abs(least), abs(most)) < _EVEN * min(abs(least), abs(most))):
        return spokes, rings, 0
    step = _STEP * max(0.5 * (bright + dark), 1e-300)
    if fine:
        outwards = bright - dark
    few = rings
    for trial in _RINGS:
        if trial * step >= outwards:
            few = min(trial, rings)
            break
    # from the brightest to the darkest place and back, steepest midway
    around = 3.0 * few if fine else pi * (rim_bright - rim_dark) / step
    span = max(int(spokes / max(around, float(_AROUND) if fine else 1.0)), 1)
    while spokes % span:
        span -= 1
    return spokes, few, span


@inner
def _landed(parameters, disc_count, sigma, frame):
    """Return a fine mesh's pupil points and where they land, (rings + 1, spokes, 2) each; of a shut ghost none."""
    spokes, rings, _ = grain(parameters, disc_count, sigma, frame, True)
    pupil, spots = np.empty((rings + 1, spokes, 2)), np.empty((rings + 1, spokes, 2))
    if spokes == 0 or not fill_mesh(
        parameters, disc_count, sigma, frame, spokes, rings, False, pupil, np.empty((0, 0, 0, 0))
    ):
        return pupil[:0], spots[:0]
    land(parameters, pupil, sigma, frame, spots)
    return pupil, spots


@inner
def touched(parameters, disc_count, sigma, frame, width, height):
    """Do what `window_of` does, for kernels."""
    pupil, spots = _landed(parameters, disc_count, sigma, frame)
    if spots.shape[0] == 0:
        return 0, 0, 0, 0
    far = shifts_of(parameters, sigma, frame, pupil, np.empty((spots.shape[1], 4)))
    return box_of(spots, reach_of(parameters[SOFT] * frame[4] * frame[4]) + beyond(far), width, height)


@compiled
def window_of(parameters, disc_count, sigma, frame, width, height):
    """Return the pixels that a ghost may touch.

    Parameters
    ----------
    parameters : ndarray, shape (N,)
    disc_count : int
    sigma : float
    frame : ndarray, shape (5,)
    width, height : int
        Of the picture.

    Returns
    -------
    left, top, width, height : int
        Of the window; width 0 when it touches none.
    """
    return touched(parameters, disc_count, sigma, frame, width, height)


@compiled
def parting_of(parameters, disc_count, sigma, frame):
    """Return how far a ghost's wavelengths part, as part of its least radius.

    Parameters
    ----------
    parameters : ndarray, shape (N,)
    disc_count : int
    sigma : float
    frame : ndarray, shape (5,)

    Returns
    -------
    float
        One standard deviation of the band; 0 for a ghost that is shut.
    """
    pupil, spots = _landed(parameters, disc_count, sigma, frame)
    if spots.shape[0] == 0:
        return 0.0
    return shifts_of(parameters, sigma, frame, pupil, np.empty((spots.shape[1], 4))) / max(least_radius(spots), 1e-9)


@inner
def _bounds(spots):
    """Return the least and greatest x and y where a mesh lands."""
    x0, y0, x1, y1 = 1e30, 1e30, -1e30, -1e30
    for i in range(spots.shape[0]):
        for j in range(spots.shape[1]):
            x0, x1 = min(x0, spots[i, j, 0]), max(x1, spots[i, j, 0])
            y0, y1 = min(y0, spots[i, j, 1]), max(y1, spots[i, j, 1])
    return x0, y0, x1, y1


@inner
def box_of(spots, reach, width, height):
    """Return left, top, width and height of the pixels that a mesh touches when it is spread; width 0: none."""
    x0, y0, x1, y1 = _bounds(spots)
    if not (x1 > -reach and y1 > -reach and x0 < width + reach and y0 < height + reach):
        return 0, 0, 0, 0
    left, top = max(int(floor(x0)) - 1 - reach, 0), max(int(floor(y0)) - 1 - reach, 0)
    right = min(int(ceil(min(x1, width))) + 1 + reach, width)
    bottom = min(int(ceil(min(y1, height))) + 1 + reach, height)
    return left, top, right - left, bottom - top


@inner
def soften_mesh(differences, variance, spots, around, left, top):
    """Spread a mesh that was drawn into a window, and `around` pixels beyond where it lands, in place."""
    taps = np.empty(reach_of(variance) + 1)
    taps_of(variance, taps)
    x0, y0, x1, y1 = _bounds(spots)
    far = 1 << 20
    soften(
        differences, taps, int(floor(max(x0, -far))) - left - 1 - around, int(floor(max(y0, -far))) - top - 1 - around,
        int(ceil(min(x1, far))) - left + 2 + around, int(ceil(min(y1, far))) - top + 2 + around,
    )  # fmt: skip
