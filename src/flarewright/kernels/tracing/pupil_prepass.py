"""The pre-pass: bound the part of the pupil from which a path accepts light, and estimate its flux.

The pupil is the plane of the first vertex in the meridional frame. The light comes along y, so the bundle is mirror
symmetric in x and only x >= 0 is traced (Hullin 2011, section 4.2, "Symmetries").
"""

import numpy as np

from ..jit.decorators import borrowing, compiled, inner
from .gap_search import ON_AXIS, PROBES, add_spot, search_axis, search_gaps
from .ray_failures import passes, rejected, stop_outside
from .samples import Samples
from .sequential import ALIVE, REL, STOP_X, WEIGHT, X, Y, trace_lanes

# a path that passes light in fewer pre-pass cells than this is searched for spots between the samples
FEW_CELLS = 12
# number of cells searched if every ray ends in the lens
LATE_CELLS = 32


@compiled
def find_box(steps, lens, light, crossings, iris_radius, view_radius, box, cells, few_cells, slivers, finest, traced):
    """Bound the part of the pupil that a path accepts, and estimate what it carries.

    Parameters
    ----------
    steps, lens, light
        As in `trace_lanes`.
    crossings : int
        Number of times the path crosses the stop.
    iris_radius : float
        Radius of the circle around the iris, mm.
    view_radius : float
        Radius around the axis that the picture covers, mm.
    box : ndarray, shape (4,)
        x0, x1, y0, y1 of the pupil region to search.
    cells : tuple of int
        Number of cells of the pre-pass in x and in y.
    few_cells : int
        If fewer cells are kept, search for spots between the samples: FEW_CELLS, or 1 where a second spot beside the
        kept cells would be too faint to matter.
    slivers : int
        1: halve gaps between rays however many cells are kept; 2: also search the mirror axis; 0: both only if few
        cells are kept.
    finest : tuple of float
        Sample spacing in x and in y that suffices to find a spot between the samples of a cell, mm.
    traced : ndarray, shape ((nx + 1) (ny + 1), >= 5 + 2 C)
        Rays at the corners of the cells as filled by `trace_lanes`, y fastest; no rows if they are not traced yet.

    Returns
    -------
    found : ndarray, shape (4,)
        Box of all cells that may pass light; x1 < x0 if there is none.
    sums : ndarray, shape (6,)
        Rough estimates from the cells that may pass, both halves, per unit irradiance: flux; flux that lands within
        `view_radius`; integral of flux times irradiance; number of cells that may touch the view; number of cells that
        may pass; pupil area whose samples pass, mm^2.
    spots : ndarray, shape (4,)
        Box of the spots found between the samples; x1 < x0 if there is none.

    Notes
    -----
    Hullin 2011, section 4.2, "Ray Bounding". A cell is kept unless one of its limits is exceeded at every corner by
    more than half its variation over the cell. If few cells are kept, cells whose limits change fast are searched with
    a finer grid; if every ray ends, the cells whose rays end latest are searched. A spot that is not one of a pair lies
    on the mirror axis, even where all rays of the cells beside it end at one surface.

    Gaps between neighbouring rays of which one ends, or both at different surfaces, are halved repeatedly: one surface
    blocks the rays on one side, another surface those on the other side, and both may pass a sliver in between. The
    halves kept are those whose rays fail differently, as between a ray beyond a rim and one beyond the iris. Close
    to total reflection ray paths change so fast that a narrow ring of rays may pass around the kept region.
    """
    nx, ny = cells
    width = ny + 1
    count = (nx + 1) * width
    hx, hy = (box[1] - box[0]) / nx, (box[3] - box[2]) / ny
    px, py = np.empty(count), np.empty(count)
    for a in range(nx + 1):
        for b in range(width):
            px[a * width + b] = box[0] + a * hx
            py[a * width + b] = box[2] + b * hy
    data = traced
    if traced.shape[0] == 0:
        data = np.empty((count, STOP_X + 2 * crossings))
        trace_lanes(steps, lens, light, px, py, data)
    found, spots = _empty_box(), _empty_box()
    sums = np.empty(6)
    for m in range(6):
        sums[m] = 0.0
    nodes = np.empty(4, dtype=np.int64)
    share = hx * hy * np.cos(light.tilt)
    accepted = 0
    kept = np.empty(nx * ny, dtype=np.int64)
    for a in range(nx):
        for b in range(ny):
            kept[a * ny + b] = 0
            _cell_corners(a, b, width, nodes)
            if rejected(data, nodes, crossings, iris_radius, 0.5):
                continue
            found[0], found[1] = min(found[0], box[0] + a * hx), max(found[1], box[0] + (a + 1) * hx)
            found[2], found[3] = min(found[2], box[2] + b * hy), max(found[3], box[2] + (b + 1) * hy)
            _add_cell(data, nodes, share, view_radius, sums)
            kept[a * ny + b] = 1
            accepted += 1
            sums[4] += 1.0
    if accepted < few_cells:
        # a spot smaller than a cell may hide between the samples
        corners = np.empty((nx * ny, 2))
        n_doubtful = 0
        late = _late_threshold(data, nx, ny)
        for cell in range(nx * ny):
            _cell_corners(cell // ny, cell % ny, width, nodes)
            if kept[cell] == 0 and _is_doubtful_cell(data, nodes, nx, ny, crossings, iris_radius, late):
                corners[n_doubtful, 0] = box[0] + (cell // ny) * hx
                corners[n_doubtful, 1] = box[2] + (cell % ny) * hy
                n_doubtful += 1
        corners = corners[:n_doubtful]
        _search_cells(
            steps, lens, light, crossings, iris_radius, corners, hx, hy, _samples_per_side(hx, finest[0]),
            _samples_per_side(hy, finest[1]), spots, sums,
        )  # fmt: skip
    if accepted < few_cells or slivers > 0:
        samples = Samples(px, py, data, width, hx, hy)
        search_gaps(steps, lens, light, crossings, iris_radius, samples, accepted < few_cells, spots, sums)
        lost = accepted == 0 and few_cells == FEW_CELLS and spots[1] < spots[0]
        if box[0] == 0.0 and (lost or slivers > 1):
            each = ON_AXIS if lost else 1
            search_axis(steps, lens, light, crossings, iris_radius, samples, kept, each, spots, sums)
        for m in range(2):
            spots[2 * m] = max(spots[2 * m], box[2 * m])
            spots[2 * m + 1] = min(spots[2 * m + 1], box[2 * m + 1])
            found[2 * m] = min(found[2 * m], spots[2 * m])
            found[2 * m + 1] = max(found[2 * m + 1], spots[2 * m + 1])
    for k in range(count):
        if passes(data, k, crossings, iris_radius):
            sums[5] += hx * hy
    # the pre-pass uses one wavelength and linear cells: add a margin of one cell
    for m in range(2):
        step = hx if m == 0 else hy
        found[2 * m] = max(found[2 * m] - step, box[2 * m])
        found[2 * m + 1] = min(found[2 * m + 1] + step, box[2 * m + 1])
    return found, sums, spots


@inner
def _empty_box():
    """Return an empty box."""
    box = np.empty(4)
    for m in range(2):
        box[2 * m], box[2 * m + 1] = np.inf, -np.inf
    return box


@borrowing
def _cell_corners(a, b, width, nodes):
    """Fill `nodes` with the four samples at the corners of a cell, row by row in x."""
    nodes[0], nodes[1] = a * width + b, a * width + b + 1
    nodes[2], nodes[3] = nodes[0] + width, nodes[1] + width


@inner
def _late_threshold(data, nx, ny):
    """Return the number of surfaces that a cell's latest ray must pass for the cell to be searched.

    The threshold selects at most about LATE_CELLS of the cells whose rays end at different surfaces, those with the
    latest rays. It is infinite if any ray passes the lens.
    """
    last = 0
    for k in range(data.shape[0]):
        if data[k, ALIVE] > 0.0:
            return np.inf
        last = max(last, int(data[k, X]))
    # a loop compiles faster than `np.zeros`
    counts = np.empty(last + 1, dtype=np.int64)
    for k in range(last + 1):
        counts[k] = 0
    nodes = np.empty(4, dtype=np.int64)
    for cell in range(nx * ny):
        _cell_corners(cell // ny, cell % ny, ny + 1, nodes)
        soonest, latest = _range_of_ends(data, nodes)
        if soonest < latest:
            counts[int(latest)] += 1
    late, cells = last, counts[last]
    while late > 0 and cells + counts[late - 1] <= LATE_CELLS:
        late -= 1
        cells += counts[late]
    return float(late)


@borrowing
def _range_of_ends(data, nodes):
    """Return the least and largest number of surfaces that the rays of a cell passed; all of them end."""
    soonest, latest = np.inf, 0.0
    for k in nodes:
        soonest, latest = min(soonest, data[k, X]), max(latest, data[k, X])
    return soonest, latest


@borrowing
def _is_doubtful_cell(data, nodes, nx, ny, crossings, iris_radius, late):
    """Return whether a rejected cell may still hold a spot: its limits change so fast that they may fall below 1.

    If all rays of the cell end, return whether they end at different surfaces, the latest after `late` or more.
    """
    low, change, alive = np.inf, 0.0, 0
    width = ny + 1
    for k in nodes:
        if data[k, ALIVE] == 0.0:
            continue
        alive += 1
        low = min(low, data[k, REL])
        a, b = k // width, k % width
        for m in range(4):
            i = a + (1 if m == 0 else (-1 if m == 1 else 0))
            j = b + (1 if m == 2 else (-1 if m == 3 else 0))
            if 0 <= i <= nx and 0 <= j <= ny:
                # the change towards a ray that ends is unknown
                step = abs(data[i * width + j, REL] - data[k, REL]) if data[i * width + j, ALIVE] > 0.0 else np.inf
                change = max(change, step)
    if alive == 0:
        soonest, latest = _range_of_ends(data, nodes)
        return latest >= late and soonest < latest
    if low - 1.5 * change > 1.0:
        return False
    if alive < nodes.size:
        return True
    for crossing in range(crossings):
        if stop_outside(data, nodes, crossing, iris_radius, 1.5):
            return False
    return True


@borrowing
def _samples_per_side(step, finest):
    """Return the number of samples on a cell's side: as few as needed, and at most PROBES."""
    return min(max(int(np.ceil(step / finest)), 1), PROBES)


@inner
def _search_cells(steps, lens, light, crossings, iris_radius, corners, hx, hy, across, along, spots, sums):
    """Trace `across` x `along` rays in each cell and add the passing ones to `spots` and `sums`.

    Cells at the mirror axis x = 0 have rays on it: a spot that is not one of a pair is widest there.
    """
    each = across * along
    px, py = np.empty(corners.shape[0] * each), np.empty(corners.shape[0] * each)
    for k in range(px.size):
        cell, m = k // each, k % each
        inset = 0.5 if corners[cell, 0] != 0.0 else 0.0
        px[k] = corners[cell, 0] + (m // along + inset) * hx / across
        py[k] = corners[cell, 1] + (m % along + 0.5) * hy / along
    data = np.empty((px.size, STOP_X + 2 * crossings))
    trace_lanes(steps, lens, light, px, py, data)
    for k in range(px.size):
        if passes(data, k, crossings, iris_radius):
            add_spot(spots, sums, data, k, px[k], py[k], hx / across, hy / along, hx * hy / each * np.cos(light.tilt))


@borrowing
def _add_cell(data, nodes, share, view_radius, sums):
    """Add a cell's flux, visible flux, flux times irradiance and visibility to `sums`, for both halves of the pupil."""
    weight, alive = 0.0, 0
    x_low, x_high, y_low, y_high = np.inf, -np.inf, np.inf, -np.inf
    for k in nodes:
        if data[k, ALIVE] > 0.0:
            alive += 1
            weight += data[k, WEIGHT]
            x_low, x_high = min(x_low, data[k, X]), max(x_high, data[k, X])
            y_low, y_high = min(y_low, data[k, Y]), max(y_high, data[k, Y])
    flux = 2.0 * weight * 0.25 * share
    sums[0] += flux
    out_x, out_y = max(max(x_low, -x_high), 0.0), max(max(y_low, -y_high), 0.0)
    if out_x * out_x + out_y * out_y > view_radius * view_radius:
        return
    sums[3] += 1.0
    # the part of the cell's box on the sensor that the view can hold
    width, height = x_high - x_low, y_high - y_low
    part = min(1.0, 2.0 * view_radius / max(width, 1e-9)) * min(1.0, 2.0 * view_radius / max(height, 1e-9))
    sums[1] += flux * part
    if alive == 4:
        a, b, c, d = nodes[0], nodes[1], nodes[3], nodes[2]
        area = (data[c, X] - data[a, X]) * (data[d, Y] - data[b, Y]) - (data[c, Y] - data[a, Y]) * (
            data[d, X] - data[b, X]
        )
        sums[2] += flux * flux / max(abs(area), 1e-6)
