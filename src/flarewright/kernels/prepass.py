"""The pre-pass: where in the pupil a path accepts light, and roughly how much.

The pupil is the plane of the first vertex in the meridional frame: the light comes along y, so the bundle is mirror
symmetric in x and only x >= 0 is traced (Hullin 2011, section 4.2, "Symmetries").
"""

import numpy as np

from ._jit import borrowing, compiled, inner
from .trace import ALIVE, REL, STOP, STOP_X, WEIGHT, X, Y, trace_lanes

# paths seen by fewer cells of the pre-pass than this are searched for spots between its samples, at most so many a side
FEW_CELLS = 12
PROBES = 8
# where every ray ends, so many cells are searched
LATE_CELLS = 32
# how often the gap between two rays is halved of which one ends, or both at different surfaces
HALVINGS = 5
# where much is kept, light is looked for in gaps of which one ray has met a rim no farther out, of its radius
NEAR = 2.0


@borrowing
def _outside(value_low, value_high, slack):
    """Tell whether a quantity stays above 1 between samples, allowing for `slack` of its range below the least."""
    return value_low - slack * (value_high - value_low) > 1.0


@borrowing
def _stop_outside(data, nodes, crossing, iris_radius, slack):
    """Tell whether a patch misses the iris at one crossing: its widened box in the stop plane lies outside."""
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
    """Tell whether no ray of a patch can pass: all samples dead, all beyond a rim, or all beside the iris."""
    low, high, alive = np.inf, -np.inf, 0
    for k in nodes:
        if data[k, ALIVE] > 0.0:
            alive += 1
            low, high = min(low, data[k, REL]), max(high, data[k, REL])
    if alive == 0 or _outside(low, high, slack):
        return True
    for crossing in range(crossings):
        if _stop_outside(data, nodes, crossing, iris_radius, slack):
            return True
    return False


@compiled
def find_box(
    rows, actions, curvature, conic, z_vertex, inv_semi, n_gap, reflectance, sensor_z, tilt, nearness,
    crossings, iris_radius, view_radius, box, nx, ny, few_cells, slivers, finest_x, finest_y, traced,
):  # fmt: skip
    """Bound the part of the pupil that a path accepts, and estimate what it carries.

    Parameters
    ----------
    rows ... nearness
        As in `trace_lanes`.
    crossings : int
        How often the path crosses the stop.
    iris_radius : float
        Radius of the circle around the iris, mm.
    view_radius : float
        Radius around the axis that the picture covers, mm.
    box : ndarray, shape (4,)
        x0, x1, y0, y1 of the pupil to look at.
    nx, ny : int
        Cells of the pre-pass.
    few_cells : int
        Where fewer than these are kept, spots are looked for between the samples: FEW_CELLS, or 1 where a second spot
        beside what was found is too little.
    slivers : int
        1: gaps between rays are halved however much is kept; 0: only where few cells are.
    finest_x, finest_y : float
        How near to each other samples need to stand where a spot may hide between those of the cells, mm.
    traced : ndarray, shape ((nx + 1) (ny + 1), >= 5 + 2 C)
        The corners of the cells as `trace_lanes` fills them, those of one x after another; without rows where nobody
        has traced them yet.

    Returns
    -------
    found : ndarray, shape (4,)
        The box of all cells that may pass light; x1 < x0 when there is none.
    sums : ndarray, shape (6,)
        Rough estimates from the cells that may pass, both halves, per unit irradiance: flux; flux that lands within
        `view_radius`; the integral of flux times irradiance; cells that may touch the view; cells that may pass; pupil
        area whose samples pass, mm^2.
    spots : ndarray, shape (4,)
        The box of what was found between the samples; x1 < x0 when there is nothing.

    Notes
    -----
    Hullin 2011, section 4.2, "Ray Bounding". A cell is kept unless one of its limits is exceeded at every corner by
    more than half its variation over the cell. Where few cells are kept, cells whose limits change fast are searched
    with a finer grid, and where every ray ends those at which rays end latest. The gaps between neighbours of which
    one ends, or both at different surfaces, are halved again and again: one surface takes the rays on one side, another
    those on the other, and a sliver in between may pass both. Shortly before they are reflected totally, rays run so
    differently from their neighbours that a ring of them may pass around all that passes besides.
    """
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
        trace_lanes(
            rows, actions, curvature, conic, z_vertex, inv_semi, n_gap, reflectance, sensor_z, tilt, nearness,
            px, py, data,
        )  # fmt: skip
    found, spots = _nowhere(), _nowhere()
    sums = np.empty(6)
    for m in range(6):
        sums[m] = 0.0
    nodes = np.empty(4, dtype=np.int64)
    share = hx * hy * np.cos(tilt)
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
            _weigh(data, nodes, share, view_radius, sums)
            kept[a * ny + b] = 1
            accepted += 1
            sums[4] += 1.0
    if accepted < few_cells:
        # a spot smaller than a cell may hide between the samples
        corners = np.empty((nx * ny, 2))
        n_doubtful = 0
        late = _late(data, nx, ny)
        for cell in range(nx * ny):
            _cell_corners(cell // ny, cell % ny, width, nodes)
            if kept[cell] == 0 and _doubtful(data, nodes, nx, ny, crossings, iris_radius, late):
                corners[n_doubtful, 0] = box[0] + (cell // ny) * hx
                corners[n_doubtful, 1] = box[2] + (cell % ny) * hy
                n_doubtful += 1
        corners = corners[:n_doubtful]
        _probe(
            rows, actions, curvature, conic, z_vertex, inv_semi, n_gap, reflectance, sensor_z, tilt, nearness,
            crossings, iris_radius, corners, hx, hy, _probes(hx, finest_x), _probes(hy, finest_y), spots, sums,
        )  # fmt: skip
    if accepted < few_cells or slivers > 0:
        _halve(
            rows, actions, curvature, conic, z_vertex, inv_semi, n_gap, reflectance, sensor_z, tilt, nearness,
            crossings, iris_radius, px, py, data, width, hx, hy, accepted < few_cells, spots, sums,
        )  # fmt: skip
        for m in range(2):
            spots[2 * m] = max(spots[2 * m], box[2 * m])
            spots[2 * m + 1] = min(spots[2 * m + 1], box[2 * m + 1])
            found[2 * m] = min(found[2 * m], spots[2 * m])
            found[2 * m + 1] = max(found[2 * m + 1], spots[2 * m + 1])
    for k in range(count):
        if _passes(data, k, crossings, iris_radius):
            sums[5] += hx * hy
    # the pre-pass sees one wavelength and straight cells: leave a cell of room around
    for m in range(2):
        step = hx if m == 0 else hy
        found[2 * m] = max(found[2 * m] - step, box[2 * m])
        found[2 * m + 1] = min(found[2 * m + 1] + step, box[2 * m + 1])
    return found, sums, spots


@inner
def _nowhere():
    """Make a box that holds nothing."""
    box = np.empty(4)
    for m in range(2):
        box[2 * m], box[2 * m + 1] = np.inf, -np.inf
    return box


@borrowing
def _cell_corners(a, b, width, nodes):
    """Fill in the four samples at the corners of a cell, row by row in x."""
    nodes[0], nodes[1] = a * width + b, a * width + b + 1
    nodes[2], nodes[3] = nodes[0] + width, nodes[1] + width


@inner
def _late(data, nx, ny):
    """Return how many surfaces rays have to pass before they end for the cells around them to be looked into.

    Of cells in which some rays end later than others, those of the latest rays, LATE_CELLS of them or a little fewer;
    infinity where a ray came through.
    """
    last = 0
    for k in range(data.shape[0]):
        if data[k, ALIVE] > 0.0:
            return np.inf
        last = max(last, int(data[k, X]))
    # Numba's own zeros take long to compile
    counts = np.empty(last + 1, dtype=np.int64)
    for k in range(last + 1):
        counts[k] = 0
    nodes = np.empty(4, dtype=np.int64)
    for cell in range(nx * ny):
        _cell_corners(cell // ny, cell % ny, ny + 1, nodes)
        soonest, latest = _ends(data, nodes)
        if soonest < latest:
            counts[int(latest)] += 1
    late, cells = last, counts[last]
    while late > 0 and cells + counts[late - 1] <= LATE_CELLS:
        late -= 1
        cells += counts[late]
    return float(late)


@borrowing
def _ends(data, nodes):
    """Return how many surfaces those rays passed that end first and last, of a cell of which all end."""
    soonest, latest = np.inf, 0.0
    for k in nodes:
        soonest, latest = min(soonest, data[k, X]), max(latest, data[k, X])
    return soonest, latest


@borrowing
def _doubtful(data, nodes, nx, ny, crossings, iris_radius, late):
    """Tell whether a rejected cell may still hold a spot: limits change so fast around it that they may dip below 1.

    Where no ray comes through, that is where rays end late, `late` or more surfaces on, and their neighbours sooner.
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
                # beside a ray that ends, anything may happen
                step = abs(data[i * width + j, REL] - data[k, REL]) if data[i * width + j, ALIVE] > 0.0 else np.inf
                change = max(change, step)
    if alive == 0:
        soonest, latest = _ends(data, nodes)
        return latest >= late and soonest < latest
    if low - 1.5 * change > 1.0:
        return False
    if alive < nodes.size:
        return True
    for crossing in range(crossings):
        if _stop_outside(data, nodes, crossing, iris_radius, 1.5):
            return False
    return True


@borrowing
def _passes(data, k, crossings, iris_radius):
    """Tell whether a ray passes every rim, and the circle around the iris at each crossing."""
    if data[k, ALIVE] == 0.0 or data[k, REL] > 1.0:
        return False
    for c in range(crossings):
        u, v = data[k, STOP_X + 2 * c], data[k, STOP_X + 2 * c + 1]
        if u * u + v * v > iris_radius * iris_radius:
            return False
    return True


@borrowing
def _widen(spots, sums, data, k, x, y, hx, hy, share):
    """Note a passing ray found between the samples: it stands for `share` of both halves of the pupil, mm^2."""
    spots[0], spots[1] = min(spots[0], x - hx), max(spots[1], x + hx)
    spots[2], spots[3] = min(spots[2], y - hy), max(spots[3], y + hy)
    sums[0] += 2.0 * data[k, WEIGHT] * share
    sums[3] += 1.0


@borrowing
def _probes(step, finest):
    """Into how many samples to divide a cell's side: no more than needed, and at most PROBES."""
    return min(max(int(np.ceil(step / finest)), 1), PROBES)


@inner
def _probe(
    rows, actions, curvature, conic, z_vertex, inv_semi, n_gap, reflectance, sensor_z, tilt, nearness,
    crossings, iris_radius, corners, hx, hy, across, along, spots, sums,
):  # fmt: skip
    """Look into doubtful cells with `across` x `along` rays each and note what passes."""
    each = across * along
    px, py = np.empty(corners.shape[0] * each), np.empty(corners.shape[0] * each)
    for k in range(px.size):
        cell, m = k // each, k % each
        px[k] = corners[cell, 0] + (m // along + 0.5) * hx / across
        py[k] = corners[cell, 1] + (m % along + 0.5) * hy / along
    data = np.empty((px.size, STOP_X + 2 * crossings))
    trace_lanes(
        rows, actions, curvature, conic, z_vertex, inv_semi, n_gap, reflectance, sensor_z, tilt, nearness, px, py, data
    )
    for k in range(px.size):
        if _passes(data, k, crossings, iris_radius):
            _widen(spots, sums, data, k, px[k], py[k], hx / across, hy / along, hx * hy / each * np.cos(tilt))


@inner
def _halve(
    rows, actions, curvature, conic, z_vertex, inv_semi, n_gap, reflectance, sensor_z, tilt, nearness,
    crossings, iris_radius, px, py, data, width, hx, hy, few, spots, sums,
):  # fmt: skip
    """Look between neighbours of the grid that end, and not both alike, by halving the gap HALVINGS times."""
    # surfaces before the first crossing of the stop
    before = 0
    while before < actions.size and actions[before] != STOP:
        before += 1
    gaps = np.empty((2 * px.size, 6))
    n_gaps = 0
    for k in range(px.size):
        for along in range(2):
            other = k + 1 if along == 0 else k + width
            if other >= px.size or (along == 0 and other % width == 0):
                continue
            if not _apart(data, k, other, before, crossings, iris_radius, few):
                continue
            gaps[n_gaps, 0], gaps[n_gaps, 1], gaps[n_gaps, 2] = px[k], py[k], _end(data, k)
            gaps[n_gaps, 3], gaps[n_gaps, 4], gaps[n_gaps, 5] = px[other], py[other], _end(data, other)
            n_gaps += 1
    share = hx * hy * np.cos(tilt)
    for _ in range(HALVINGS):
        share *= 0.5
        mx, my = np.empty(n_gaps), np.empty(n_gaps)
        for k in range(n_gaps):
            mx[k], my[k] = 0.5 * (gaps[k, 0] + gaps[k, 3]), 0.5 * (gaps[k, 1] + gaps[k, 4])
        middle = np.empty((n_gaps, STOP_X + 2 * crossings))
        trace_lanes(
            rows, actions, curvature, conic, z_vertex, inv_semi, n_gap, reflectance, sensor_z, tilt, nearness,
            mx, my, middle,
        )  # fmt: skip
        narrower = np.empty((2 * n_gaps, 6))
        count = 0
        for k in range(n_gaps):
            if _passes(middle, k, crossings, iris_radius):
                _widen(spots, sums, middle, k, mx[k], my[k], hx / PROBES, hy / PROBES, share)
                continue
            end = _end(middle, k)
            for side in range(2):
                # the part whose ends still differ
                if end != gaps[k, 3 * side + 2]:
                    for m in range(3):
                        narrower[count, m] = gaps[k, 3 * side + m]
                    narrower[count, 3], narrower[count, 4], narrower[count, 5] = mx[k], my[k], end
                    count += 1
        gaps = narrower
        n_gaps = count


@borrowing
def _end(data, k):
    """Return how many surfaces a ray passed that ended, -1 of one that did not."""
    return -1.0 if data[k, ALIVE] > 0.0 else data[k, X]


@borrowing
def _apart(data, a, b, before, crossings, iris_radius, few):
    """Tell whether two rays end, not both alike, and not both far beyond a rim or beside the iris; none may pass."""
    if _end(data, a) == _end(data, b):
        return False
    low, high = min(data[a, REL], data[b, REL]), max(data[a, REL], data[b, REL])
    if low > NEAR and not (few and not _outside(low, high, 0.5)):
        return False
    if _passes(data, a, crossings, iris_radius) or _passes(data, b, crossings, iris_radius):
        return False
    for k in (a, b):
        # it ended before it could meet the iris
        if data[k, ALIVE] == 0.0 and data[k, X] < before:
            return True
    ua, va, ub, vb = data[a, STOP_X], data[a, STOP_X + 1], data[b, STOP_X], data[b, STOP_X + 1]
    ra, rb = np.sqrt(ua * ua + va * va) / iris_radius, np.sqrt(ub * ub + vb * vb) / iris_radius
    return not _outside(min(ra, rb), max(ra, rb), 0.5)


@borrowing
def _weigh(data, nodes, share, view_radius, sums):
    """Add a pre-pass cell's flux, seen flux, flux times irradiance and visibility, for both halves of the pupil."""
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
