"""Draw a measured ghost from its pupil's mesh: flux-conserving, with exact coverage (derivatives: `jacobian`).

The mesh is a fan of spokes and rings over the open pupil (`kernels.ghost_model.pupil_mesh`). A triangle carries the
flux of its part of the pupil to its place on the sensor, so folds and caustics need no special treatment. Away from
folds, triangles are joined to cells as large as the brightness over the pupil allows, and only edges between cells are
drawn. A fit uses smaller cells than a replay, so that its pictures hardly change when the mesh changes.
"""

from math import ceil, floor, pi, sin, sqrt

import numpy as np

from ..jit.decorators import borrowing, compiled, inner
from .edge_coverage import add_edge
from .gaussian_edges import reach_of, soften, taps_of
from .lateral_colour import beyond, shifts_of
from .pupil_mesh import (
    BLADES,
    FIRST_G,
    FIRST_I,
    SOFT,
    TURN,
    at_field,
    border,
    divisor_at,
    level,
    picture_step,
    place_point,
    rims,
    slopes,
)

# largest distance of a chord from its arc, pixels; least and largest numbers of spokes and rings
_CHORD_PX = 0.05
_LEAST_SPOKES, _MOST_SPOKES = 16, 208
_LEAST_RINGS, _MOST_RINGS = 3, 16
# cells are used if the areas on the sensor have one sign and differ by no more than this factor
_AREA_RATIO = 4.0
# largest relative change of brightness from one cell to the next
_BRIGHTNESS_STEP = 0.05
# least number of edges of a ring between cells, and least number of cells around for a fit
_RING_EDGES, _CELLS_AROUND = 16, 16
# possible numbers of rings of cells
_RINGS = (2, 3, 4, 6, 8, 12, 16)


@inner
def fill_mesh(parameters, disc_count, sigma, frame, spokes, rings, with_changes, pupil, pupil_by):
    """Fill the mesh's pupil points and their derivatives by the discs; return False if the pupil is closed."""
    blades = int(parameters[BLADES])
    turn = parameters[TURN] - np.arctan2(frame[3], frame[2]) if blades > 0 else 0.0
    discs = np.empty((disc_count + 1, 2))
    rims(parameters, disc_count, sigma, discs)
    edge = np.empty((spokes + 1, 2))
    by = np.empty((spokes + 1, 2, 2 * disc_count + 2))
    if not border(discs, disc_count + 1, spokes, blades, turn, with_changes, edge, by):
        return False
    # scale the polygon of spokes to the area of its disc; an iris of blades is a polygon already
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
def safe_divisor(area):
    """Return an area safe to divide by, with the same sign: the areas of a fold's triangles come close to 0."""
    if abs(area) < 1e-7:
        return -1e-7 if area < 0.0 else 1e-7
    return area


@borrowing
def _flux(light, sigma, pupil, ia, ja, ib, jb, ic, jc):
    """Return a triangle's flux: intensity at its centroid, clamped to 0, times its pupil area."""
    xi = (pupil[ia, ja, 0] + pupil[ib, jb, 0] + pupil[ic, jc, 0]) / 3.0
    eta = (pupil[ia, ja, 1] + pupil[ib, jb, 1] + pupil[ic, jc, 1]) / 3.0
    intensity = level(light, xi * xi + eta * eta, xi * sigma)
    part = area_of(
        pupil[ia, ja, 0], pupil[ia, ja, 1], pupil[ib, jb, 0], pupil[ib, jb, 1], pupil[ic, jc, 0], pupil[ic, jc, 1]
    )
    return max(intensity, 0.0) * part


@inner
def place_mesh(parameters, pupil, sigma, frame, spots):
    """Fill the places of the mesh in the picture, pixels; frame: axis x, axis y, cos roll, sin roll, scale."""
    f, g = np.empty(6), np.empty(6)
    at_field(parameters, 0, sigma * sigma, f)
    at_field(parameters, FIRST_G, sigma * sigma, g)
    for i in range(pupil.shape[0]):
        for j in range(pupil.shape[1]):
            xi, eta = pupil[i, j, 0], pupil[i, j, 1]
            u, v = xi * xi + eta * eta, xi * sigma
            value, _ = divisor_at(parameters, v, sigma * sigma)
            spread = level(g, u, v) / value
            along, across = sigma * level(f, u, v) / value + xi * spread, eta * spread
            x, y = picture_step(frame, along, across)
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
            densities[i, j, 0] = -_flux(light, sigma, pupil, i, j, i + 1, j, i + 1, k) / safe_divisor(area)
            if i == 0:
                densities[i, j, 1] = 0.0
                continue
            area = area_of(
                spots[i, j, 0], spots[i, j, 1], spots[i + 1, k, 0], spots[i + 1, k, 1], spots[i, k, 0], spots[i, k, 1]
            )
            densities[i, j, 1] = -_flux(light, sigma, pupil, i, j, i + 1, k, i, k) / safe_divisor(area)


@borrowing
def join_cells(spots, span, densities):
    """Average the density over the triangles of each cell, so that the edges between them need not be drawn."""
    rings, spokes = densities.shape[0], densities.shape[1]
    for i in range(rings):
        for first in range(0, spokes, span):
            light, area = cell_light(spots, span, densities, i, first)
            densities[i, first : first + span, 0] = light / area
            if i > 0:
                densities[i, first : first + span, 1] = light / area


@inner
def fill_cells(parameters, sigma, pupil, spots, span, densities):
    """Fill the densities of cells, flux over area on the sensor, as `fill_densities` and `join_cells` do."""
    rings, spokes = densities.shape[0], densities.shape[1]
    light, wedge = np.empty(6), np.empty(spokes)
    at_field(parameters, FIRST_I, sigma * sigma, light)
    x0, y0 = pupil[0, 0, 0], pupil[0, 0, 1]
    for j in range(spokes):
        k = j + 1 if j + 1 < spokes else 0
        wedge[j] = area_of(x0, y0, pupil[rings, j, 0], pupil[rings, j, 1], pupil[rings, k, 0], pupil[rings, k, 1])
    for i in range(rings):
        wide = _span_of(i, span, spokes, rings)
        # pupil areas of the two triangles between two rings, as parts of the wedge
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
            density = -flux / safe_divisor(area)
            for j in range(first, first + wide):
                densities[i, j, 0], densities[i, j, 1] = density, density if i > 0 else 0.0


@inner
def _span_of(i, span, spokes, rings):
    """Return the number of spokes that a cell of ring i spans: more near the centre, where spokes are closer."""
    wide = max(span, 1)
    for times in range(2, rings // (i + 1) + 1 if span > 0 else 2):
        if spokes % (span * times) == 0:
            wide = span * times
    return wide


@inner
def _chord_of(span, spokes):
    """Return the number of spokes that an edge between rings spans: as a cell, but with enough edges for the ring."""
    chord = max(span, 1)
    while chord > 1 and (spokes < _RING_EDGES * chord or span % chord):
        chord -= 1
    return chord


@borrowing
def cell_light(spots, span, densities, i, first):
    """Return the light and the signed area of the cell of `span` spokes that starts at spoke `first`."""
    light, area = 0.0, 0.0
    for j in range(first, first + span):
        one, other = cell_areas(spots, i, j, densities.shape[1])
        light += densities[i, j, 0] * one
        area += one
        if i > 0:
            light += densities[i, j, 1] * other
            area += other
    # in a ghost of almost no size the areas of triangles have random signs
    return light, safe_divisor(area)


@borrowing
def cell_areas(spots, i, j, spokes):
    """Return the signed areas (`safe_divisor`) of the two triangles between two spokes and two rings."""
    k = j + 1 if j + 1 < spokes else 0
    one = area_of(
        spots[i, j, 0], spots[i, j, 1], spots[i + 1, j, 0], spots[i + 1, j, 1], spots[i + 1, k, 0], spots[i + 1, k, 1]
    )
    other = area_of(
        spots[i, j, 0], spots[i, j, 1], spots[i + 1, k, 0], spots[i + 1, k, 1], spots[i, k, 0], spots[i, k, 1]
    )
    return safe_divisor(one), safe_divisor(other)


@borrowing
def draw_mesh(spots, densities, span, fine, rim, left, top, width, height, plane):
    """Draw every edge once, with the step in density across it; `rim` includes the edges of the outline.

    Unless `fine`, an edge between rings spans several spokes.
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
    """Return the least distance of a mesh's outline from its centre."""
    rings = spots.shape[0] - 1
    least = 1e300
    for j in range(spots.shape[1]):
        dx, dy = spots[rings, j, 0] - spots[0, 0, 0], spots[rings, j, 1] - spots[0, 0, 1]
        least = min(least, dx * dx + dy * dy)
    return sqrt(least)


@inner
def mesh_size(parameters, disc_count, sigma, frame, fine):
    """Return the numbers of spokes and rings for a ghost, and the span of a cell in the outermost ring, in spokes.

    0 spokes: the pupil is closed. Span 0: the map folds, so triangles are not joined to cells.
    """
    pupil, none = np.empty((3, 8, 2)), np.empty((0, 0, 0, 0))
    if not fill_mesh(parameters, disc_count, sigma, frame, 8, 2, False, pupil, none):
        return 0, 0, 0
    reach, least, most = 0.0, 1e300, -1e300
    dark, bright, outwards = 1e300, 0.0, 0.0
    rim_dark, rim_bright = 1e300, 0.0
    seen = np.empty((3, 8))
    x0, y0, _, _, _, _ = place_point(parameters, pupil[0, 0, 0], pupil[0, 0, 1], sigma)
    for i in range(3):
        for j in range(8 if i > 0 else 1):
            xi, eta = pupil[i, j, 0], pupil[i, j, 1]
            x, y, a, b, c, d = place_point(parameters, xi, eta, sigma)
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
    spokes = min(max(pi * sqrt(reach * frame[4] / (2.0 * _CHORD_PX)), _LEAST_SPOKES), _MOST_SPOKES)
    # round up to 16, so that the mesh seldom changes during a fit
    spokes = 16 * int(ceil(spokes / 16.0))
    rings = int(min(max(spokes // 6, _LEAST_RINGS), _MOST_RINGS))
    if not (least * most > 0.0 and max(abs(least), abs(most)) < _AREA_RATIO * min(abs(least), abs(most))):
        return spokes, rings, 0
    step = _BRIGHTNESS_STEP * max(0.5 * (bright + dark), 1e-300)
    if fine:
        outwards = bright - dark
    few = rings
    for trial in _RINGS:
        if trial * step >= outwards:
            few = min(trial, rings)
            break
    # for a sinusoidal variation around the rim the steepest slope is pi times the mean slope
    around = 3.0 * few if fine else pi * (rim_bright - rim_dark) / step
    span = max(int(spokes / max(around, float(_CELLS_AROUND) if fine else 1.0)), 1)
    while spokes % span:
        span -= 1
    return spokes, few, span


@inner
def _landed(parameters, disc_count, sigma, frame):
    """Return a fine mesh's pupil points and their places, (rings + 1, spokes, 2) each; empty for a closed pupil."""
    spokes, rings, _ = mesh_size(parameters, disc_count, sigma, frame, True)
    pupil, spots = np.empty((rings + 1, spokes, 2)), np.empty((rings + 1, spokes, 2))
    if spokes == 0 or not fill_mesh(
        parameters, disc_count, sigma, frame, spokes, rings, False, pupil, np.empty((0, 0, 0, 0))
    ):
        return pupil[:0], spots[:0]
    place_mesh(parameters, pupil, sigma, frame, spots)
    return pupil, spots


@inner
def ghost_window(parameters, disc_count, sigma, frame, width, height):
    """Compute `window_of`, for calls from kernels."""
    pupil, spots = _landed(parameters, disc_count, sigma, frame)
    if spots.shape[0] == 0:
        return 0, 0, 0, 0
    far = shifts_of(parameters, sigma, frame, pupil, np.empty((spots.shape[1], 4)))
    return box_of(spots, reach_of(parameters[SOFT] * frame[4] * frame[4]) + beyond(far), width, height)


@compiled
def window_of(parameters, disc_count, sigma, frame, width, height):
    """Return the window of pixels that a ghost may touch.

    Parameters
    ----------
    parameters : ndarray, shape (N,)
    disc_count : int
    sigma : float
    frame : ndarray, shape (5,)
    width, height : int
        Size of the picture.

    Returns
    -------
    left, top, width, height : int
        The window; width 0 if the ghost touches no pixel.
    """
    return ghost_window(parameters, disc_count, sigma, frame, width, height)


@compiled
def parting_of(parameters, disc_count, sigma, frame):
    """Return the displacement of a ghost's rim by lateral colour, over its least radius.

    Parameters
    ----------
    parameters : ndarray, shape (N,)
    disc_count : int
    sigma : float
    frame : ndarray, shape (5,)

    Returns
    -------
    float
        For one standard deviation of the band; 0 for a closed pupil.
    """
    pupil, spots = _landed(parameters, disc_count, sigma, frame)
    if spots.shape[0] == 0:
        return 0.0
    return shifts_of(parameters, sigma, frame, pupil, np.empty((spots.shape[1], 4))) / max(least_radius(spots), 1e-9)


@inner
def _bounds(spots):
    """Return the least x and y and the largest x and y of a mesh in the picture."""
    x0, y0, x1, y1 = 1e30, 1e30, -1e30, -1e30
    for i in range(spots.shape[0]):
        for j in range(spots.shape[1]):
            x0, x1 = min(x0, spots[i, j, 0]), max(x1, spots[i, j, 0])
            y0, y1 = min(y0, spots[i, j, 1]), max(y1, spots[i, j, 1])
    return x0, y0, x1, y1


@inner
def box_of(spots, reach, width, height):
    """Return left, top, width and height of the pixels that a mesh touches after a blur; width 0: none."""
    x0, y0, x1, y1 = _bounds(spots)
    if not (x1 > -reach and y1 > -reach and x0 < width + reach and y0 < height + reach):
        return 0, 0, 0, 0
    left, top = max(int(floor(x0)) - 1 - reach, 0), max(int(floor(y0)) - 1 - reach, 0)
    right = min(int(ceil(min(x1, width))) + 1 + reach, width)
    bottom = min(int(ceil(min(y1, height))) + 1 + reach, height)
    return left, top, right - left, bottom - top


@inner
def soften_mesh(differences, variance, spots, around, left, top):
    """Blur a mesh drawn into a window, in place; light reaches `around` pixels beyond the mesh before the blur."""
    taps = np.empty(reach_of(variance) + 1)
    taps_of(variance, taps)
    x0, y0, x1, y1 = _bounds(spots)
    far = 1 << 20
    soften(
        differences, taps, int(floor(max(x0, -far))) - left - 1 - around, int(floor(max(y0, -far))) - top - 1 - around,
        int(ceil(min(x1, far))) - left + 2 + around, int(ceil(min(y1, far))) - top + 2 + around,
    )  # fmt: skip
