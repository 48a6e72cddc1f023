"""The pre-pass: bound the part of the pupil from which a path accepts light, and estimate its flux.

The pupil is the plane of the first vertex in the meridional frame. The light comes along y, so the bundle is mirror
symmetric in x and only x >= 0 is traced (Hullin 2011, section 4.2, "Symmetries").
"""

import numpy as np

from ..jit.decorators import borrowing, compiled, inner
from .samples import Samples
from .sequential import ALIVE, REL, STOP, STOP_X, WEIGHT, X, Y, trace_lanes

# a path that passes light in fewer pre-pass cells than this is searched for spots between the samples
FEW_CELLS = 12
# most samples per side of a searched cell
PROBES = 8
# number of cells searched if every ray ends in the lens
LATE_CELLS = 32
# number of halvings of the gap between two rays if one of them ends, or if both end at different surfaces
HALVINGS = 5
# samples of the mirror axis along a cell where nothing else was found; numbers of halvings of the gap between two rays
# that end at different surfaces there, and of the intervals beside the best rays
ON_AXIS, ENDED_HALVINGS, NARROWINGS = 4, 3, 6
# largest r / semi-diameter of a ray that passes: the box around the front touches its rim, and so may a sample
RIM = 1.0 + 1e-6
# where many cells pass, a gap is searched only if one of its rays has a largest r / semi-diameter of at most this
NEAR = 2.0


@borrowing
def _outside(value_low, value_high, slack):
    """Return whether a quantity stays above RIM between samples, with a margin of `slack` times its range."""
    return value_low - slack * (value_high - value_low) > RIM


@borrowing
def stop_outside(data, nodes, crossing, iris_radius, slack):
    """Return whether a patch misses the iris at one crossing: its widened box in the stop plane lies outside."""
    u_low, u_high, v_low, v_high = np.inf, -np.inf, np.inf, -np.inf
    for k in nodes:
        if data[k, ALIVE] > 0.0:
            u = data[k, STOP_X + 2 * crossing]
            v = data[k, STOP_X + 2 * crossing + 1]
            u_low, u_high = min(u_low, u), max(u_high, u)
            v_low, v_high = min(v_low, v), max(v_high, v)
    u_wide, v_wide = slack * (u_high - u_low), slack * (v_high - v_low)
    du = max(max(u_low - u_wide, -u_high - u_wide), 0.0)
    dv = max(max(v_low - v_wide, -v_high - v_wide), 0.0)
    return du * du + dv * dv > iris_radius * iris_radius


@borrowing
def rejected(data, nodes, crossings, iris_radius, slack):
    """Return whether no ray of a patch can pass: all samples end, all lie beyond a rim, or all miss the iris."""
    low, high, alive = np.inf, -np.inf, 0
    for k in nodes:
        if data[k, ALIVE] > 0.0:
            alive += 1
            low, high = min(low, data[k, REL]), max(high, data[k, REL])
    if alive == 0 or _outside(low, high, slack):
        return True
    for crossing in range(crossings):
        if stop_outside(data, nodes, crossing, iris_radius, slack):
            return True
    return False


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
        _search_gaps(steps, lens, light, crossings, iris_radius, samples, accepted < few_cells, spots, sums)
        lost = accepted == 0 and few_cells == FEW_CELLS and spots[1] < spots[0]
        if box[0] == 0.0 and (lost or slivers > 1):
            each = ON_AXIS if lost else 1
            places = np.empty(ny * each + 1)
            for k in range(places.size):
                places[k] = box[2] + k * (hy / each)
            # the first rays of the grid lie on the axis
            rays = _axis_rays(steps, lens, light, crossings, places) if lost else data
            _search_axis(steps, lens, light, crossings, iris_radius, kept, ny, each, hx, hy, places, rays, spots, sums)
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
def passes(data, k, crossings, iris_radius):
    """Return whether a ray passes every rim, and the circle around the iris at each crossing."""
    return not (data[k, ALIVE] == 0.0 or data[k, REL] > RIM or _beyond_iris(data, k, crossings, iris_radius))


@borrowing
def _beyond_iris(data, k, crossings, iris_radius):
    """Return whether a ray that did not end crosses the stop outside the circle around the iris, at any crossing."""
    for c in range(crossings):
        u, v = data[k, STOP_X + 2 * c], data[k, STOP_X + 2 * c + 1]
        if u * u + v * v > iris_radius * iris_radius:
            return True
    return False


@borrowing
def _add_spot(spots, sums, data, k, x, y, hx, hy, share):
    """Add a passing ray between the samples to `spots` and `sums`; it represents `share` mm^2 in each pupil half."""
    spots[0], spots[1] = min(spots[0], x - hx), max(spots[1], x + hx)
    spots[2], spots[3] = min(spots[2], y - hy), max(spots[3], y + hy)
    sums[0] += 2.0 * data[k, WEIGHT] * share
    sums[3] += 1.0


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
            _add_spot(spots, sums, data, k, px[k], py[k], hx / across, hy / along, hx * hy / each * np.cos(light.tilt))


@inner
def _search_gaps(steps, lens, light, crossings, iris_radius, samples, few, spots, sums):
    """Search between grid neighbours that end differently by halving the gap HALVINGS times.

    In the halves rays that do not end differ too, if they fail at different limits: light passes between a ray beyond a
    rim and one beyond the iris.
    """
    px, py, data, width, hx, hy = samples
    # surfaces before the first crossing of the stop
    before = 0
    while before < steps.actions.size and steps.actions[before] != STOP:
        before += 1
    gaps = np.empty((2 * px.size, 6))
    n_gaps = 0
    for k in range(px.size):
        for along in range(2):
            other = k + 1 if along == 0 else k + width
            if other >= px.size or (along == 0 and other % width == 0):
                continue
            if not _is_doubtful_gap(data, k, other, before, crossings, iris_radius, few):
                continue
            end, its_end = _failure(data, k, crossings, iris_radius), _failure(data, other, crossings, iris_radius)
            gaps[n_gaps, 0], gaps[n_gaps, 1], gaps[n_gaps, 2] = px[k], py[k], end
            gaps[n_gaps, 3], gaps[n_gaps, 4], gaps[n_gaps, 5] = px[other], py[other], its_end
            n_gaps += 1
    share = hx * hy * np.cos(light.tilt)
    for _ in range(HALVINGS):
        share *= 0.5
        mx, my = np.empty(n_gaps), np.empty(n_gaps)
        for k in range(n_gaps):
            mx[k], my[k] = 0.5 * (gaps[k, 0] + gaps[k, 3]), 0.5 * (gaps[k, 1] + gaps[k, 4])
        middle = np.empty((n_gaps, STOP_X + 2 * crossings))
        trace_lanes(steps, lens, light, mx, my, middle)
        narrower = np.empty((2 * n_gaps, 6))
        count = 0
        for k in range(n_gaps):
            if passes(middle, k, crossings, iris_radius):
                _add_spot(spots, sums, middle, k, mx[k], my[k], hx / PROBES, hy / PROBES, share)
                continue
            end = _failure(middle, k, crossings, iris_radius)
            for side in range(2):
                # keep the half whose rays still fail differently
                if end != gaps[k, 3 * side + 2]:
                    for m in range(3):
                        narrower[count, m] = gaps[k, 3 * side + m]
                    narrower[count, 3], narrower[count, 4], narrower[count, 5] = mx[k], my[k], end
                    count += 1
        gaps = narrower
        n_gaps = count


@inner
def _search_axis(steps, lens, light, crossings, iris_radius, kept, ny, each, hx, hy, places, data, spots, sums):
    """Search the mirror axis beside the kept cells, with `each` rays a cell; add passing ones to `spots` and `sums`.

    Light may lie beside a ray that comes nearer to its limits than its neighbours, or whose neighbours end. Such a ray
    may hide between two that end at different surfaces.
    """
    count, step = places.size, hy / each
    width, share = hx / PROBES, hx * np.cos(light.tilt) / PROBES
    excess = np.empty(count)
    for k in range(count):
        excess[k] = _excess(data, k, crossings, iris_radius)
        if kept[min(k // each, ny - 1)] == 1 or kept[max(k - 1, 0) // each] == 1:
            # in the region that is known
            excess[k] = 0.0
        elif excess[k] <= RIM:
            _add_spot(spots, sums, data, k, 0.0, places[k], width, step, share * step)
    # place, excess and distance of neighbours; place of a gap's middle, and where the rays on both sides end
    best, gaps = np.empty((count << ENDED_HALVINGS, 3)), np.empty((count, 3))
    n_best, n_gaps = 0, 0
    for k in range(count - 1):
        if k > 0 and RIM < excess[k] < np.inf and excess[k] <= min(excess[k - 1], excess[k + 1]):
            best[n_best, 0], best[n_best, 1], best[n_best, 2] = places[k], excess[k], step
            n_best += 1
        if excess[k] == np.inf and excess[k + 1] == np.inf and data[k, X] != data[k + 1, X]:
            gaps[n_gaps, 0], gaps[n_gaps, 1], gaps[n_gaps, 2] = places[k] + 0.5 * step, data[k, X], data[k + 1, X]
            n_gaps += 1
    for _ in range(ENDED_HALVINGS):
        step *= 0.5
        places = np.empty(n_gaps)
        for k in range(n_gaps):
            places[k] = gaps[k, 0]
        data = _axis_rays(steps, lens, light, crossings, places)
        narrower, count = np.empty((2 * n_gaps, 3)), 0
        for k in range(n_gaps):
            far = _excess(data, k, crossings, iris_radius)
            if far <= RIM:
                _add_spot(spots, sums, data, k, 0.0, places[k], width, step, share * step)
            elif far < np.inf:
                best[n_best, 0], best[n_best, 1], best[n_best, 2] = places[k], far, step
                n_best += 1
            for side in range(2):
                if far == np.inf and data[k, X] != gaps[k, side + 1]:
                    narrower[count, 0] = places[k] + (side - 0.5) * step
                    narrower[count, side + 1], narrower[count, 2 - side] = gaps[k, side + 1], data[k, X]
                    count += 1
        gaps, n_gaps = narrower, count
    _narrow(steps, lens, light, crossings, iris_radius, best, n_best, width, share, spots, sums)


@inner
def _narrow(steps, lens, light, crossings, iris_radius, best, n_best, width, share, spots, sums):
    """Halve the intervals beside each of the `best` rays on the mirror axis, around the best of its three each time.

    `best`, changed, holds places, excesses and distances of the neighbours; a ray that passes ends its search.
    """
    for _ in range(NARROWINGS):
        places = np.empty(2 * n_best)
        for k in range(n_best):
            best[k, 2] *= 0.5
            places[2 * k], places[2 * k + 1] = best[k, 0] - best[k, 2], best[k, 0] + best[k, 2]
        data = _axis_rays(steps, lens, light, crossings, places)
        count = 0
        for k in range(n_best):
            place, least, step = best[k, 0], best[k, 1], best[k, 2]
            for m in range(2 * k, 2 * k + 2):
                far = _excess(data, m, crossings, iris_radius)
                if far <= RIM:
                    _add_spot(spots, sums, data, m, 0.0, places[m], width, step, share * step)
                if far < least:
                    place, least = places[m], far
            if least > RIM:
                best[count, 0], best[count, 1], best[count, 2] = place, least, step
                count += 1
        n_best = count


@inner
def _axis_rays(steps, lens, light, crossings, places):
    """Trace rays through places on the mirror axis, shape (N,)."""
    px = np.empty(places.size)
    for k in range(places.size):
        px[k] = 0.0
    data = np.empty((places.size, STOP_X + 2 * crossings))
    trace_lanes(steps, lens, light, px, places, data)
    return data


@borrowing
def _excess(data, k, crossings, iris_radius):
    """Return how far out a ray comes: the largest r / semi-diameter of rims and iris; infinite for a ray that ends."""
    if data[k, ALIVE] == 0.0:
        return np.inf
    far = data[k, REL]
    for c in range(crossings):
        u, v = data[k, STOP_X + 2 * c], data[k, STOP_X + 2 * c + 1]
        far = max(far, np.sqrt(u * u + v * v) / iris_radius)
    return far


@borrowing
def _end(data, k):
    """Return the number of surfaces that a ray passed before it ended, -1 for a ray that did not end."""
    return -1.0 if data[k, ALIVE] > 0.0 else data[k, X]


@borrowing
def _failure(data, k, crossings, iris_radius):
    """Return the number of surfaces that a ray passed before it ended; -1: beyond a rim, -2: the iris, -3: both."""
    if data[k, ALIVE] == 0.0:
        return data[k, X]
    if not _beyond_iris(data, k, crossings, iris_radius):
        return -1.0
    return -3.0 if data[k, REL] > RIM else -2.0


@borrowing
def _is_doubtful_gap(data, a, b, before, crossings, iris_radius, few):
    """Return whether to search between two rays: both fail, end differently, and not both far beyond rim or iris."""
    if _end(data, a) == _end(data, b):
        return False
    low, high = min(data[a, REL], data[b, REL]), max(data[a, REL], data[b, REL])
    if low > NEAR and not (few and not _outside(low, high, 0.5)):
        return False
    if passes(data, a, crossings, iris_radius) or passes(data, b, crossings, iris_radius):
        return False
    for k in (a, b):
        # the ray ended in front of the iris, so its place there is unknown
        if data[k, ALIVE] == 0.0 and data[k, X] < before:
            return True
    ua, va, ub, vb = data[a, STOP_X], data[a, STOP_X + 1], data[b, STOP_X], data[b, STOP_X + 1]
    ra, rb = np.sqrt(ua * ua + va * va) / iris_radius, np.sqrt(ub * ub + vb * vb) / iris_radius
    return not _outside(min(ra, rb), max(ra, rb), 0.5)


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
