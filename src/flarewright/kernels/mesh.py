"""The adaptive grid of a ray bundle: where in the pupil a path accepts light, and how finely to trace it.

The pupil is the plane of the first vertex in the meridional frame: the light comes along y, so the bundle is mirror
symmetric in x and only x >= 0 is traced (Hullin 2011, section 4.2, "Symmetries").
"""

import numpy as np

from ._jit import compiled
from .trace import ALIVE, REL, STOP_X, WEIGHT, X, Y, trace_nodes

# a FLAT leaf is good enough without its edges' middles, a LEAF needs them
UNKNOWN, LEAF, SPLIT, EMPTY, FLAT = 0, 1, 2, 3, 4
# paths seen by fewer cells of the pre-pass than this are searched for spots between its samples
FEW_CELLS = 12
PROBES = 8
# cells that the rim crosses are halved at least this often
RIM_LEVEL = 2


@compiled
def _outside(value_low, value_high, slack):
    """Tell whether a quantity stays above 1 between samples, allowing for `slack` of its range below the least sample."""
    return value_low - slack * (value_high - value_low) > 1.0


@compiled
def _stop_outside(data, nodes, crossing, iris_radius, slack):
    """Tell whether a patch misses the iris at one crossing: its box in the stop plane, widened, lies outside the circle."""
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


@compiled
def _rejected(data, nodes, crossings, iris_radius, slack):
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
    rows, actions, curvature, conic, z_vertex, inv_semi, n_gap, reflectance, sensor_z, tilt,
    crossings, iris_radius, view_radius, box, nx, ny,
):  # fmt: skip
    """Bound the part of the pupil that a path accepts, and estimate what it carries.

    Parameters
    ----------
    rows ... tilt
        As in `trace_nodes`.
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

    Returns
    -------
    found : ndarray, shape (4,)
        The box of all cells that may pass light; x1 < x0 when there is none.
    sums : ndarray, shape (4,)
        Rough estimates from the cells that may pass, both halves, per unit irradiance: flux; flux that lands within
        `view_radius`; the integral of flux times irradiance; cells that may touch the view.

    Notes
    -----
    Hullin 2011, section 4.2, "Ray Bounding". A cell is kept unless one of its limits is exceeded at every corner by
    more than half its variation over the cell. Where few cells are kept, cells whose limits change fast are searched
    with a finer grid, so that spots between the samples are found too.
    """
    width = ny + 1
    count = (nx + 1) * width
    hx, hy = (box[1] - box[0]) / nx, (box[3] - box[2]) / ny
    px, py = np.empty(count), np.empty(count)
    for a in range(nx + 1):
        for b in range(width):
            px[a * width + b] = box[0] + a * hx
            py[a * width + b] = box[2] + b * hy
    data = np.empty((count, STOP_X + 2 * crossings))
    trace_nodes(rows, actions, curvature, conic, z_vertex, inv_semi, n_gap, reflectance, sensor_z, tilt, px, py, data)
    found = np.array([np.inf, -np.inf, np.inf, -np.inf])
    sums = np.zeros(4)
    nodes = np.empty(4, dtype=np.int64)
    share = hx * hy * np.cos(tilt)
    accepted = 0
    doubtful = np.empty(nx * ny, dtype=np.int64)
    n_doubtful = 0
    for a in range(nx):
        for b in range(ny):
            nodes[0], nodes[1] = a * width + b, a * width + b + 1
            nodes[2], nodes[3] = nodes[0] + width, nodes[1] + width
            if not _rejected(data, nodes, crossings, iris_radius, 0.5):
                found[0], found[1] = min(found[0], box[0] + a * hx), max(found[1], box[0] + (a + 1) * hx)
                found[2], found[3] = min(found[2], box[2] + b * hy), max(found[3], box[2] + (b + 1) * hy)
                _weigh(data, nodes, share, view_radius, sums)
                accepted += 1
            elif _doubtful(data, nodes, nx, ny, crossings, iris_radius):
                doubtful[n_doubtful] = a * ny + b
                n_doubtful += 1
    if accepted < FEW_CELLS and n_doubtful > 0:
        # a spot smaller than a cell may hide between the samples
        corners = np.empty((n_doubtful, 2))
        for k in range(n_doubtful):
            corners[k, 0] = box[0] + (doubtful[k] // ny) * hx
            corners[k, 1] = box[2] + (doubtful[k] % ny) * hy
        _probe(
            rows, actions, curvature, conic, z_vertex, inv_semi, n_gap, reflectance, sensor_z, tilt,
            crossings, iris_radius, corners, hx, hy, found, sums,
        )  # fmt: skip
    # the pre-pass sees one wavelength and straight cells: leave a cell of room around
    for m in range(2):
        step = hx if m == 0 else hy
        found[2 * m] = max(found[2 * m] - step, box[2 * m])
        found[2 * m + 1] = min(found[2 * m + 1] + step, box[2 * m + 1])
    return found, sums


@compiled
def _doubtful(data, nodes, nx, ny, crossings, iris_radius):
    """Tell whether a rejected cell may still hold a spot: its limits change so fast around it that they may dip below 1."""
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
    if alive == 0 or low - 1.5 * change > 1.0:
        return False
    if alive < nodes.size:
        return True
    for crossing in range(crossings):
        if _stop_outside(data, nodes, crossing, iris_radius, 1.5):
            return False
    return True


@compiled
def _probe(
    rows, actions, curvature, conic, z_vertex, inv_semi, n_gap, reflectance, sensor_z, tilt,
    crossings, iris_radius, corners, hx, hy, found, sums,
):  # fmt: skip
    """Look into doubtful cells with PROBES x PROBES rays each and widen the box by what passes."""
    each = PROBES * PROBES
    px, py = np.empty(corners.shape[0] * each), np.empty(corners.shape[0] * each)
    for k in range(px.size):
        cell, m = k // each, k % each
        px[k] = corners[cell, 0] + (m // PROBES + 0.5) * hx / PROBES
        py[k] = corners[cell, 1] + (m % PROBES + 0.5) * hy / PROBES
    data = np.empty((px.size, STOP_X + 2 * crossings))
    trace_nodes(rows, actions, curvature, conic, z_vertex, inv_semi, n_gap, reflectance, sensor_z, tilt, px, py, data)
    for k in range(px.size):
        passes = data[k, ALIVE] > 0.0 and data[k, REL] <= 1.0
        for c in range(crossings):
            u, v = data[k, STOP_X + 2 * c], data[k, STOP_X + 2 * c + 1]
            passes = passes and u * u + v * v <= iris_radius * iris_radius
        if passes:
            found[0], found[1] = min(found[0], px[k] - hx / PROBES), max(found[1], px[k] + hx / PROBES)
            found[2], found[3] = min(found[2], py[k] - hy / PROBES), max(found[3], py[k] + hy / PROBES)
            sums[0] += 2.0 * data[k, WEIGHT] * hx * hy / each * np.cos(tilt)
            sums[3] += 1.0


@compiled
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
        area = (data[c, X] - data[a, X]) * (data[d, Y] - data[b, Y]) - (data[c, Y] - data[a, Y]) * (data[d, X] - data[b, X])
        sums[2] += flux * flux / max(abs(area), 1e-6)


@compiled
def _judge(data, nodes, crossings, iris_radius, level, max_level, h, tolerance, flux_tolerance, scale, view_radius):
    """Decide whether a cell of 3 x 3 nodes is EMPTY, to be SPLIT, a LEAF, or a FLAT one.

    The fan of a LEAF uses the middles of its edges, which leaves a quarter of the measured error.
    """
    if _rejected(data, nodes, crossings, iris_radius, 0.25):
        return EMPTY
    if level >= max_level:
        return LEAF
    x_low, x_high, y_low, y_high = np.inf, -np.inf, np.inf, -np.inf
    for k in nodes:
        if data[k, ALIVE] == 0.0:
            return SPLIT
        x_low, x_high = min(x_low, data[k, X]), max(x_high, data[k, X])
        y_low, y_high = min(y_low, data[k, Y]), max(y_high, data[k, Y])
    # what falls outside the picture is not seen, however rough
    out_x = max(x_low, 0.0)
    out_y = max(max(y_low, -y_high), 0.0)
    if out_x * out_x + out_y * out_y > view_radius * view_radius:
        return FLAT
    extent = max(x_high - x_low, y_high - y_low) * scale
    error = 0.0
    # the rim of the bundle decides its flux, so it is resolved however small the ghost is
    for limit in range(1 + crossings):
        low, high, bend = _limit_range(data, nodes, limit, iris_radius)
        if low < 1.0 < high:
            # a rim met by several surfaces has corners that a coarse cell cannot tell
            if level < RIM_LEVEL:
                return SPLIT
            part = bend / (high - low)
            error = max(error, part * h / flux_tolerance, part * extent / tolerance)
    if extent >= 1.0:
        bend_x, bend_y = _bend(data, nodes, X), _bend(data, nodes, Y)
        error = max(error, np.sqrt(bend_x * bend_x + bend_y * bend_y) * scale / tolerance)
    if extent > 2.0:
        area_low, area_high = _fan_areas(data, nodes)
        if area_low * area_high <= 0.0:
            return SPLIT
        if extent > 5.0:
            ratio = max(abs(area_low), abs(area_high)) / max(min(abs(area_low), abs(area_high)), 1e-300)
            error = max(error, 4.0 * (ratio - 1.0))
    if extent > 5.0 or level <= RIM_LEVEL:
        error = max(error, _bend(data, nodes, WEIGHT) / (0.005 * abs(data[nodes[4], WEIGHT]) + 1e-300))
    if error > 4.0:
        return SPLIT
    return LEAF if error > 1.0 else FLAT


@compiled
def _limit_range(data, nodes, limit, iris_radius):
    """Return the least and largest value of a limit over a cell and how much it bends: 0 the rims, then each crossing."""
    values = np.empty(9)
    low, high = np.inf, -np.inf
    for m in range(9):
        k = nodes[m]
        if limit == 0:
            values[m] = data[k, REL]
        else:
            u, v = data[k, STOP_X + 2 * limit - 2], data[k, STOP_X + 2 * limit - 1]
            values[m] = np.sqrt(u * u + v * v) / iris_radius
        low, high = min(low, values[m]), max(high, values[m])
    bend = max(
        max(abs(values[1] - 0.5 * (values[0] + values[2])), abs(values[7] - 0.5 * (values[6] + values[8]))),
        max(abs(values[3] - 0.5 * (values[0] + values[6])), abs(values[5] - 0.5 * (values[2] + values[8]))),
    )
    bend = max(bend, abs(values[4] - 0.25 * (values[0] + values[2] + values[6] + values[8])))
    return low, high, bend


@compiled
def _bend(data, nodes, column):
    """Return the largest departure of a quantity from its bilinear interpolation between the corners."""
    a, b, c, d = data[nodes[0], column], data[nodes[2], column], data[nodes[6], column], data[nodes[8], column]
    bend = max(abs(data[nodes[1], column] - 0.5 * (a + b)), abs(data[nodes[7], column] - 0.5 * (c + d)))
    bend = max(bend, max(abs(data[nodes[3], column] - 0.5 * (a + c)), abs(data[nodes[5], column] - 0.5 * (b + d))))
    return max(bend, abs(data[nodes[4], column] - 0.25 * (a + b + c + d)))


@compiled
def _fan_areas(data, nodes):
    """Return the least and largest signed area on the sensor of the eight triangles around a cell's centre."""
    ring = (0, 3, 6, 7, 8, 5, 2, 1, 0)
    cx, cy = data[nodes[4], X], data[nodes[4], Y]
    low, high = np.inf, -np.inf
    for m in range(8):
        a, b = nodes[ring[m]], nodes[ring[m + 1]]
        area = (data[a, X] - cx) * (data[b, Y] - cy) - (data[a, Y] - cy) * (data[b, X] - cx)
        low, high = min(low, area), max(high, area)
    return low, high


@compiled
def build_mesh(
    rows, actions, curvature, conic, z_vertex, inv_semi, n_gap, reflectance, sensor_z, tilt,
    crossings, iris_radius, box, nx, ny, max_level, tolerance, flux_tolerance, scale, view_radius,
):  # fmt: skip
    """Trace a path on a grid that is refined where the map bends, folds or is cut, and triangulate it without cracks.

    Parameters
    ----------
    rows ... iris_radius
        As in `find_box`, but `n_gap` (V, K + 1) and `reflectance` (V, K, M) at the few wavelengths that the grid shall fit:
        a cell is left out when none of them passes and refined when one of them asks for it.
    box : ndarray, shape (4,)
        Pupil region, mm.
    nx, ny : int
        Coarsest cells; each may be halved `max_level` times.
    tolerance : float
        Largest error of interpolated positions, pixels.
    flux_tolerance : float
        Largest part of the bundle's flux that the rim's interpolation may get wrong.
    scale : float
        Pixels per mm on the sensor.
    view_radius : float
        Radius around the axis that the picture covers, mm; inf for all.

    Returns
    -------
    pupil : ndarray, shape (N, 2)
        Nodes, mm.
    data : ndarray, shape (V, N, 5 + 2 C)
        Traced nodes (`kernels.trace`).
    triangles : ndarray, shape (T, 3), int64
        Counter-clockwise in the pupil. Neighbouring cells differ by one halving at most and share all their nodes.
    """
    size_a, size_b = nx << (max_level + 1), ny << (max_level + 1)
    da, db = (box[1] - box[0]) / size_a, (box[3] - box[2]) / size_b
    lattice = np.full((size_a + 1, size_b + 1), -1, dtype=np.int32)
    offsets = np.zeros(max_level + 2, dtype=np.int64)
    for level in range(max_level + 1):
        offsets[level + 1] = offsets[level] + (nx << level) * (ny << level)
    state = np.zeros(offsets[max_level + 1], dtype=np.int8)
    columns = STOP_X + 2 * crossings
    pupil = np.empty((2048, 2))
    data = np.empty((n_gap.shape[0], 2048, columns))
    n_nodes = 0
    nodes = np.empty(9, dtype=np.int64)
    cells = np.empty(nx * ny, dtype=np.int64)
    for k in range(nx * ny):
        cells[k] = k
    for level in range(max_level + 1):
        first = n_nodes
        pupil, data, n_nodes = _add_nodes(lattice, pupil, data, n_nodes, cells, level, max_level, ny, da, db, box)
        for v in range(n_gap.shape[0]):
            trace_nodes(
                rows, actions, curvature, conic, z_vertex, inv_semi, n_gap[v], reflectance[v], sensor_z, tilt,
                pupil[first:n_nodes, 0].copy(), pupil[first:n_nodes, 1].copy(), data[v, first:n_nodes],
            )  # fmt: skip
        children = np.empty(4 * cells.size, dtype=np.int64)
        n_children = 0
        height = ny << level
        h = 1.0 / height
        for cell in cells:
            a, b = cell // height, cell % height
            _cell_nodes(lattice, a, b, level, max_level, nodes)
            verdict = EMPTY
            for v in range(n_gap.shape[0]):
                found = _judge(
                    data[v], nodes, crossings, iris_radius, level, max_level, h,
                    tolerance, flux_tolerance, scale, view_radius,
                )  # fmt: skip
                if found == SPLIT:
                    verdict = SPLIT
                    break
                if found == LEAF or (found == FLAT and verdict == EMPTY):
                    verdict = found
            state[offsets[level] + cell] = verdict
            if verdict == SPLIT:
                for m in range(4):
                    children[n_children] = (2 * a + m // 2) * (2 * height) + 2 * b + m % 2
                    n_children += 1
        cells = children[:n_children]
        if n_children == 0:
            break
    _balance(state, offsets, nx, ny, max_level)
    first = n_nodes
    for level in range(1, max_level + 1):
        forced = _leaves(state, offsets, level)
        pupil, data, n_nodes = _add_nodes(lattice, pupil, data, n_nodes, forced, level, max_level, ny, da, db, box)
    for v in range(n_gap.shape[0]):
        trace_nodes(
            rows, actions, curvature, conic, z_vertex, inv_semi, n_gap[v], reflectance[v], sensor_z, tilt,
            pupil[first:n_nodes, 0].copy(), pupil[first:n_nodes, 1].copy(), data[v, first:n_nodes],
        )  # fmt: skip
    return pupil[:n_nodes].copy(), data[:, :n_nodes].copy(), _triangulate(state, offsets, lattice, nx, ny, max_level)


@compiled
def _cell_nodes(lattice, a, b, level, max_level, nodes):
    """Look up the 3 x 3 nodes of a cell, row by row in x."""
    half = 1 << (max_level - level)
    for m in range(9):
        nodes[m] = lattice[(2 * a + m // 3) * half, (2 * b + m % 3) * half]


@compiled
def _add_nodes(lattice, pupil, data, n_nodes, cells, level, max_level, ny, da, db, box):
    """Number the nodes of cells that have none yet; the arrays grow as needed."""
    half = 1 << (max_level - level)
    height = ny << level
    for cell in cells:
        a, b = cell // height, cell % height
        if n_nodes + 9 > pupil.shape[0]:
            grown = np.empty((2 * pupil.shape[0], 2))
            grown[:n_nodes] = pupil[:n_nodes]
            pupil = grown
            more = np.empty((data.shape[0], 2 * data.shape[1], data.shape[2]))
            more[:, :n_nodes] = data[:, :n_nodes]
            data = more
        for m in range(9):
            i, j = (2 * a + m // 3) * half, (2 * b + m % 3) * half
            if lattice[i, j] < 0:
                lattice[i, j] = n_nodes
                pupil[n_nodes, 0] = box[0] + i * da
                pupil[n_nodes, 1] = box[2] + j * db
                n_nodes += 1
    return pupil, data, n_nodes


@compiled
def _leaves(state, offsets, level):
    """List the leaf cells of a level."""
    part = state[offsets[level] : offsets[level + 1]]
    count = 0
    for k in range(part.size):
        if part[k] == LEAF or part[k] == FLAT:
            count += 1
    found = np.empty(count, dtype=np.int64)
    count = 0
    for k in range(part.size):
        if part[k] == LEAF or part[k] == FLAT:
            found[count] = k
            count += 1
    return found


@compiled
def _balance(state, offsets, nx, ny, max_level):
    """Split leaves until neighbours differ by one level at most, from the finest cells up."""
    for level in range(max_level - 1, 0, -1):
        width, height = nx << level, ny << level
        for cell in range(width * height):
            if state[offsets[level] + cell] != SPLIT:
                continue
            a, b = cell // height, cell % height
            for m in range(4):
                i = a + (1 if m == 0 else (-1 if m == 1 else 0))
                j = b + (1 if m == 2 else (-1 if m == 3 else 0))
                if 0 <= i < width and 0 <= j < height:
                    _ensure(state, offsets, ny, level, i, j)


@compiled
def _ensure(state, offsets, ny, level, a, b):
    """Make a cell exist by splitting the leaf that covers it, if there is one."""
    # find the ancestor that is settled, then split downwards
    up = level
    while up >= 0 and state[offsets[up] + (a >> (level - up)) * (ny << up) + (b >> (level - up))] == UNKNOWN:
        up -= 1
    if up < 0 or up == level:
        return
    kind = state[offsets[up] + (a >> (level - up)) * (ny << up) + (b >> (level - up))]
    if kind != LEAF and kind != FLAT:
        return
    for mid in range(up, level):
        i, j = a >> (level - mid), b >> (level - mid)
        state[offsets[mid] + i * (ny << mid) + j] = SPLIT
        for m in range(4):
            child = (2 * i + m // 2) * (ny << (mid + 1)) + 2 * j + m % 2
            state[offsets[mid + 1] + child] = kind


@compiled
def _triangulate(state, offsets, lattice, nx, ny, max_level):
    """Fan every leaf around its centre; an edge is halved where one side asks for it and none is coarser."""
    total = 0
    for level in range(max_level + 1):
        for k in range(offsets[level], offsets[level + 1]):
            if state[k] == LEAF or state[k] == FLAT:
                total += 8
    triangles = np.empty((total, 3), dtype=np.int64)
    count = 0
    nodes = np.empty(9, dtype=np.int64)
    # corner, middle, corner of each edge, counter-clockwise, and where its neighbour lies
    edges = ((0, 3, 6, 0, -1), (6, 7, 8, 1, 0), (8, 5, 2, 0, 1), (2, 1, 0, -1, 0))
    for level in range(max_level + 1):
        width, height = nx << level, ny << level
        for cell in range(width * height):
            kind = state[offsets[level] + cell]
            if kind != LEAF and kind != FLAT:
                continue
            a, b = cell // height, cell % height
            _cell_nodes(lattice, a, b, level, max_level, nodes)
            for edge in edges:
                i, j = a + edge[3], b + edge[4]
                halved = kind == LEAF
                if 0 <= i < width and 0 <= j < height:
                    beyond = state[offsets[level] + i * height + j]
                    # both sides of an edge come to the same answer
                    halved = beyond != UNKNOWN if kind == LEAF else (beyond == LEAF or beyond == SPLIT)
                if halved:
                    triangles[count, 0], triangles[count, 1], triangles[count, 2] = nodes[4], nodes[edge[0]], nodes[edge[1]]
                    count += 1
                    triangles[count, 0], triangles[count, 1], triangles[count, 2] = nodes[4], nodes[edge[1]], nodes[edge[2]]
                else:
                    triangles[count, 0], triangles[count, 1], triangles[count, 2] = nodes[4], nodes[edge[0]], nodes[edge[2]]
                count += 1
    return triangles[:count].copy()
