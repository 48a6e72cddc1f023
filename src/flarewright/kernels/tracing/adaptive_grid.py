"""The adaptive grid of a ray bundle: trace the accepted part of the pupil on a quadtree and triangulate it."""

import numpy as np

from ..jit.decorators import borrowing, compiled, inlined, inner
from .cell_neighbours import EMPTY, FLAT, LEAF, SPLIT, UNKNOWN, halve_neighbours, has_lit_side, known_level, quarter_of
from .lens_arrays import at_wavelength
from .ray_failures import rejected, stop_outside
from .sequential import ALIVE, REL, STOP_X, WEIGHT, X, Y, trace_lanes

# why a cell is halved, in bits above those of its verdict: `REASON * k + SPLIT` for the k-th of `REASONS`
REASON = 8
REASONS = (
    "all rays end", "near a rim", "some rays end", "corners of a rim", "bend of a rim", "fringes", "bend of places",
    "fold", "bend of areas", "bend of weights",
)  # fmt: skip
ALL_END, NEAR_RIM, SOME_END, RIM_CORNERS, RIM_BEND, FRINGES, PLACE_BEND, FOLD, AREA_BEND, WEIGHT_BEND = range(10)
# folds are invisible in a cell whose image lies within this part of the tolerance on either side of a line
THIN = 0.1
# a cell is rejected if all its nine rays exceed a limit by more than this part of its variation between them
REJECTING = 0.25
# largest cell in fringes, pixels: the pattern of a small cell usually depends on a single edge
FRINGE_CELL = 128.0
# number of halvings of cells whose rays all end, at different surfaces. For a path that passes slivers of light beside
# rays that end: one more, and the same for cells in which some rays end and the others do not pass
SLIVER_LEVEL = 3
# a rejected cell is halved if its least r / semi-diameter is below this, because a narrow horn may pass between two
# rims: CLOSE for coarsest cells, CLOSE_BESIDE_ENDED for cells below SLIVER_LEVEL in which some rays end
CLOSE, CLOSE_BESIDE_ENDED = 1.05, 1.25
# light is narrow if it passes beside rays that end, or is so small a part of the box that the flux tolerance is below
# NARROW. Then a coarsest cell is halved if some of its rays end and the others do not pass. A cell whose rays all lie
# beyond a rim is halved if r / semi-diameter bends between them by more than KINK of its variation: two rims that leave
# a gap between the rays bend it by up to half of the variation, the curvature of one rim by a few hundredths
NARROW, KINK = 6e-5, 0.2
# halvings beyond the limit of a cell in which the rim bends by so much that it takes more than RIM_MISSED of the flux
# tolerance, where light passes slivers: in a thin arc between two rims. A grid with such cells costs memory and time
RIM_LEVELS, RIM_MISSED = 1, 2.0
# a cell of at least level FAR_LEVEL is left out if at least FAR_RAYS of its nine rays land beyond FAR_RADII times the
# picture's radius and the others end
FAR_RAYS, FAR_RADII, FAR_LEVEL = 3, 2.0, 2


@borrowing
def _classify(data, nodes, crossings, iris, level, h, limits, passing, values):
    """Classify a cell of 3 x 3 nodes as EMPTY, LEAF, FLAT or SPLIT with its reason; `values`, shape (9,), is scratch.

    `passing` is the weight at the centre of the cell, averaged over the wavelengths. The triangle fan of a LEAF uses
    the midpoints of its edges, which leaves a quarter of the measured error.
    """
    iris_radius, iris_inner = iris
    tolerance, fringe_tolerance, scale, view_radius = (
        limits.tolerance, limits.fringe_tolerance, limits.scale, limits.view_radius
    )  # fmt: skip
    narrow = limits.slivers > 0 or limits.flux_tolerance < NARROW
    gap_level = limits.max_level if narrow else limits.rim_level
    if rejected(data, nodes, crossings, iris_radius, REJECTING):
        # a sliver may pass between rays that end at different surfaces
        beside = narrow and (level == 0 or limits.slivers > 0)
        if level < SLIVER_LEVEL + limits.slivers and _ends_differ(data, nodes, beside):
            return _split(ALL_END)
        if _may_hide_horn(data, nodes, level):
            return _split(NEAR_RIM)
        gap = level < gap_level and _may_hide_gap(data, nodes, crossings, iris_radius, view_radius, values)
        return _split(NEAR_RIM) if gap else EMPTY
    last = level >= limits.max_level
    if level >= limits.max_level + (RIM_LEVELS if limits.slivers > 0 else 0):
        return LEAF
    x_low, x_high, y_low, y_high = np.inf, -np.inf, np.inf, -np.inf
    alive = 0
    for k in nodes:
        if data[k, ALIVE] > 0.0:
            alive += 1
            x_low, x_high = min(x_low, data[k, X]), max(x_high, data[k, X])
            y_low, y_high = min(y_low, data[k, Y]), max(y_high, data[k, Y])
    # light outside the picture needs no refinement
    out_x, out_y = max(max(x_low, -x_high), 0.0), max(max(y_low, -y_high), 0.0)
    out2 = out_x * out_x + out_y * out_y
    if last and (alive < nodes.size or out2 > view_radius * view_radius):
        return LEAF
    if alive < nodes.size:
        # if the landing rays lie far outside the picture, assume the same of the light beside the rays that end, whose
        # place is unknown
        far = FAR_RADII * view_radius
        return EMPTY if alive >= FAR_RAYS and level >= FAR_LEVEL and out2 > far * far else _split(SOME_END)
    if out2 > view_radius * view_radius:
        return FLAT
    if level < gap_level and _may_hide_gap(data, nodes, crossings, iris_radius, view_radius, values):
        return _split(NEAR_RIM)
    extent = max(x_high - x_low, y_high - y_low) * scale
    error, reason = 0.0, RIM_BEND
    at_rim, at_fringes = False, False
    # the rim of the bundle determines its flux, so resolve it even for a small ghost
    for limit in range(crossings, -1, -1):
        low, high, bend = _limit_range(data, nodes, limit, iris_radius, values)
        # the blades lie between the inscribed and the circumscribed circle of the iris
        if limit > 0 and low * iris_radius > limits.faint_radius:
            return FLAT
        if low < 1.0 and high > (1.0 if limit == 0 else iris_inner / iris_radius):
            if limit > 0 and fringe_tolerance > 0.0:
                at_fringes = True
                continue
            # a rim formed by several surfaces has corners that a coarse cell misses
            if level < limits.rim_level:
                return _split(RIM_CORNERS)
            at_rim = True
            part = bend / max(high - low, 1e-12)
            if last and part * h > RIM_MISSED * limits.flux_tolerance:
                return _split(RIM_BEND)
            error = max(error, part * h / limits.flux_tolerance, part * extent / tolerance)
    if last:
        return LEAF
    if at_fringes and extent > FRINGE_CELL:
        return _split(FRINGES)
    if extent >= 1.0:
        bend_x, bend_y = _bend(data, nodes, np.int64(X)), _bend(data, nodes, np.int64(Y))
        # away from the rim an error that is small compared with the cell is invisible
        allowed = tolerance
        if not at_rim:
            allowed = max(tolerance, min(limits.inner_bend * extent, fringe_tolerance if at_fringes else np.inf))
        error, reason = _worse(error, reason, np.sqrt(bend_x * bend_x + bend_y * bend_y) * scale / allowed, PLACE_BEND)
    # what lies on a line folds and crowds across it, where nothing is seen of that
    if extent > limits.fold_px and not _thin(data, nodes, THIN * tolerance / scale):
        area_low, area_high = _fan_areas(data, nodes)
        if area_low * area_high <= 0.0:
            return _split(FOLD)
        if extent > limits.area_px:
            ratio = max(abs(area_low), abs(area_high)) / max(min(abs(area_low), abs(area_high)), 1e-300)
            error, reason = _worse(error, reason, 4.0 * (ratio - 1.0) / limits.area_ratio, AREA_BEND)
    # errors in flux count for cells of any size; those of a dark wavelength are invisible beside the light of others
    allowed = limits.weight_bend * max(abs(data[nodes[4], WEIGHT]), passing) + 1e-300
    bend = _bend(data, nodes, np.int64(WEIGHT)) / allowed
    error, reason = _worse(error, reason, bend, WEIGHT_BEND)
    if error > 4.0:
        return _split(reason)
    return LEAF if error > 1.0 else FLAT


@inlined
def _split(reason):
    """Return the verdict on a cell that is halved for this reason."""
    return REASON * reason + SPLIT


@inlined
def _worse(error, reason, other, its_reason):
    """Return the larger of two errors and its reason."""
    return (other, its_reason) if other > error else (error, reason)


@borrowing
def _thin(data, nodes, width):
    """Return whether a cell's image lies within a width, mm, of the line through its middle and its farthest node."""
    x, y = data[nodes[4], X], data[nodes[4], Y]
    ux, uy, longest = 0.0, 0.0, 0.0
    for k in nodes:
        dx, dy = data[k, X] - x, data[k, Y] - y
        if dx * dx + dy * dy > longest:
            ux, uy, longest = dx, dy, dx * dx + dy * dy
    allowed = width * width * longest
    for k in nodes:
        off = ux * (data[k, Y] - y) - uy * (data[k, X] - x)
        if off * off > allowed:
            return False
    return True


@borrowing
def _ends_differ(data, nodes, beside):
    """Return whether all rays of a cell end, at different surfaces; with `beside` also whether some of them end."""
    low, high, alive = np.inf, -np.inf, 0
    for k in nodes:
        if data[k, ALIVE] > 0.0:
            alive += 1
        else:
            low, high = min(low, data[k, X]), max(high, data[k, X])
    return low < high if alive == 0 else beside and alive < nodes.size


@borrowing
def _may_hide_horn(data, nodes, level):
    """Return whether a rejected cell's rays come so near to a rim that a horn between two rims may pass.

    If some rays lie within all rims, the iris rejected the cell; a single limit has no horns.
    """
    low, alive = np.inf, 0
    for k in nodes:
        if data[k, ALIVE] > 0.0:
            alive += 1
            low = min(low, data[k, REL])
    if level < SLIVER_LEVEL and alive < nodes.size and low < CLOSE_BESIDE_ENDED:
        return True
    return level == 0 and 1.0 < low < CLOSE


@borrowing
def _may_hide_gap(data, nodes, crossings, iris_radius, view_radius, values):
    """Return whether all rays of a cell lie beyond a rim and a gap between two rims may pass light between them.

    Light that misses the iris or the picture does not count.

    Notes
    -----
    On a line across a gap between two rims r / semi-diameter falls and rises again. If it does so equally fast, its
    least value is below that of three equidistant rays by their bend at most.
    """
    for k in nodes:
        if data[k, ALIVE] == 0.0 or data[k, REL] <= 1.0:
            return False
    low, high, bend = _limit_range(data, nodes, np.int64(0), 1.0, values)
    if bend <= KINK * (high - low) or low - bend > 1.0:
        return False
    for crossing in range(crossings):
        if stop_outside(data, nodes, crossing, iris_radius, REJECTING):
            return False
    x_low, x_high, y_low, y_high = np.inf, -np.inf, np.inf, -np.inf
    for k in nodes:
        x_low, x_high = min(x_low, data[k, X]), max(x_high, data[k, X])
        y_low, y_high = min(y_low, data[k, Y]), max(y_high, data[k, Y])
    out_x, out_y = max(max(x_low, -x_high), 0.0), max(max(y_low, -y_high), 0.0)
    return out_x * out_x + out_y * out_y <= view_radius * view_radius


@borrowing
def _mean_weight(data, node):
    """Return the weight of a node's rays averaged over the wavelengths; a ray that ends has none."""
    total = 0.0
    for v in range(data.shape[0]):
        if data[v, node, ALIVE] > 0.0:
            total += abs(data[v, node, WEIGHT])
    return total / data.shape[0]


@borrowing
def _limit_range(data, nodes, limit, iris_radius, values):
    """Return least value, largest value and nonlinearity of a limit over a cell; limit 0: rims, k: k-th crossing."""
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


@borrowing
def _bend(data, nodes, column):
    """Return the largest departure of a quantity from its bilinear interpolation between the corners."""
    a, b, c, d = data[nodes[0], column], data[nodes[2], column], data[nodes[6], column], data[nodes[8], column]
    bend = max(abs(data[nodes[1], column] - 0.5 * (a + b)), abs(data[nodes[7], column] - 0.5 * (c + d)))
    bend = max(bend, max(abs(data[nodes[3], column] - 0.5 * (a + c)), abs(data[nodes[5], column] - 0.5 * (b + d))))
    return max(bend, abs(data[nodes[4], column] - 0.25 * (a + b + c + d)))


@inlined
def _around(m):
    """Return the m-th node around the centre of 3 x 3 nodes, counter-clockwise: 0 3 6 7 8 5 2 1 and 0 again."""
    # packed in an integer: a tuple would take longer to compile than the functions that use it
    return (0x012587630 >> (4 * m)) & 15


@borrowing
def _fan_areas(data, nodes):
    """Return the least and largest signed area on the sensor of the eight triangles around a cell's centre."""
    cx, cy = data[nodes[4], X], data[nodes[4], Y]
    low, high = np.inf, -np.inf
    for m in range(8):
        a, b = nodes[_around(m)], nodes[_around(m + 1)]
        area = (data[a, X] - cx) * (data[b, Y] - cy) - (data[a, Y] - cy) * (data[b, X] - cx)
        low, high = min(low, area), max(high, area)
    return low, high


@compiled
def build_mesh(steps, lens, light, crossings, iris, box, coarse, limits):
    """Trace a path on a grid that is refined where the map bends, folds or is cut, and triangulate it without cracks.

    Parameters
    ----------
    steps, light, crossings
        As in `kernels.tracing.pupil_prepass.find_box`.
    lens : ConicLens or ShapedLens
        At the V wavelengths for which the grid is built: a cell is left out if it is empty at all of them, and halved
        if it has to be at any of them.
    iris : tuple of float
        Radii of the circles around and within the iris, mm.
    box : ndarray, shape (4,)
        Pupil region, mm.
    coarse : tuple of int
        Number of coarsest cells in x and in y.
    limits : GridLimits

    Returns
    -------
    pupil : ndarray, shape (N, 2)
        Nodes, mm.
    data : ndarray, shape (V, N, 5 + 2 C)
        Traced nodes (`kernels.tracing.sequential`).
    triangles : ndarray, shape (T, 3), int64
        Counter-clockwise in the pupil. Neighbouring cells differ by one halving at most and share all their nodes.
    halved : ndarray, shape (10,), int64
        Number of cells that were halved for each of `REASONS`.
    """
    (nx, ny), max_level = coarse, limits.max_level + RIM_LEVELS
    # the lattice of all possible nodes has room for `depth` halvings, and grows when a cell needs more
    depth = min(max_level, 2)
    # entries: node number + 1, 0 for none
    lattice = _empty_lattice((nx << (depth + 1)) + 1, (ny << (depth + 1)) + 1)
    offsets = np.empty(max_level + 2, dtype=np.int64)
    offsets[0] = 0
    for level in range(max_level + 1):
        offsets[level + 1] = offsets[level] + (nx << level) * (ny << level)
    state = np.empty(offsets[depth + 1], dtype=np.int8)
    for k in range(state.size):
        state[k] = UNKNOWN
    columns = STOP_X + 2 * crossings
    pupil = np.empty((2048, 2))
    data = np.empty((lens.n_gap.shape[0], 2048, columns))
    # an int literal has another type and would compile the callees a second time
    n_nodes = np.int64(0)
    nodes, values = np.empty(9, dtype=np.int64), np.empty(9)
    halved = np.empty(len(REASONS), dtype=np.int64)
    for k in range(halved.size):
        halved[k] = 0
    # levels and numbers of cells to classify: the coarsest, then quarters of left-out cells that light enters
    entered, n_entered = np.empty((nx * ny, 2), dtype=np.int64), nx * ny
    for k in range(nx * ny):
        entered[k, 0], entered[k, 1] = 0, k
    beside_light = False
    while n_entered > 0:
        start, n_start = entered, n_entered
        entered, n_entered = np.empty((64, 2), dtype=np.int64), 0
        children, n_children = np.empty(0, dtype=np.int64), 0
        for level in range(max_level + 1):
            cells = _with_started(children, n_children, start, n_start, level)
            n_children = 0
            if cells.size == 0:
                continue
            if level > depth:
                depth = level
                lattice, state = _enlarged(lattice, state, offsets[depth + 1])
            first = n_nodes
            pupil, data, n_nodes = _add_nodes(lattice, pupil, data, n_nodes, cells, level, depth, ny, box)
            _trace(steps, lens, light, pupil, data, first, n_nodes)
            children = np.empty(4 * cells.size, dtype=np.int64)
            height = ny << level
            h = 1.0 / height
            for cell in cells:
                a, b = cell // height, cell % height
                _cell_nodes(lattice, a, b, level, depth, nodes)
                passing = _mean_weight(data, nodes[4])
                verdict = EMPTY
                for v in range(data.shape[0]):
                    found = _classify(data[v], nodes, crossings, iris, level, h, limits, passing, values)
                    if found % REASON == SPLIT:
                        verdict = SPLIT
                        halved[found // REASON] += 1
                        break
                    if found == LEAF or (found == FLAT and verdict == EMPTY):
                        verdict = found
                if (
                    beside_light and verdict == EMPTY and level < limits.max_level
                    and has_lit_side(data, lattice, a, b, level, depth, crossings, iris[0], limits)
                ):  # fmt: skip
                    verdict = SPLIT
                    halved[NEAR_RIM] += 1
                state[offsets[level] + cell] = verdict
                if verdict == SPLIT:
                    for m in range(4):
                        children[n_children] = quarter_of(a, b, height, m)
                        n_children += 1
            for cell in cells:
                if state[offsets[level] + cell] == LEAF or state[offsets[level] + cell] == FLAT:
                    entered, n_entered = halve_neighbours(
                        state, offsets, data, lattice, cell, level, depth, nx, ny, crossings, iris[0], limits, entered,
                        n_entered,
                    )  # fmt: skip
        halved[NEAR_RIM] += n_entered // 4
        beside_light = True
    _balance(state, offsets, nx, ny, depth)
    first = n_nodes
    for level in range(1, depth + 1):
        forced = _leaves(state, offsets, level)
        pupil, data, n_nodes = _add_nodes(lattice, pupil, data, n_nodes, forced, level, depth, ny, box)
    _trace(steps, lens, light, pupil, data, first, n_nodes)
    pupil, data = _resized(pupil, data, n_nodes, n_nodes)
    return pupil, data, _triangulate(state, offsets, lattice, nx, ny, depth), halved


@inner
def _with_started(children, n_children, start, n_start, level):
    """Return cells of a level and those that start at it."""
    count = n_children
    for k in range(n_start):
        count += 1 if start[k, 0] == level else 0
    cells = np.empty(count, dtype=np.int64)
    for k in range(n_children):
        cells[k] = children[k]
    count = n_children
    for k in range(n_start):
        if start[k, 0] == level:
            cells[count] = start[k, 1]
            count += 1
    return cells


@inner
def _empty_lattice(width, height):
    """Return a lattice without nodes; `np.zeros` takes eight times as long to compile."""
    lattice = np.empty((width, height), dtype=np.int32)
    for i in range(width):
        for j in range(height):
            lattice[i, j] = 0
    return lattice


@inner
def _enlarged(lattice, state, cells):
    """Return lattice and cell states enlarged for one more halving."""
    finer = _empty_lattice(2 * lattice.shape[0] - 1, 2 * lattice.shape[1] - 1)
    for i in range(lattice.shape[0]):
        for j in range(lattice.shape[1]):
            finer[2 * i, 2 * j] = lattice[i, j]
    longer = np.empty(cells, dtype=np.int8)
    for k in range(cells):
        longer[k] = state[k] if k < state.size else UNKNOWN
    return finer, longer


@borrowing
def _cell_nodes(lattice, a, b, level, depth, nodes):
    """Fill `nodes` with the 3 x 3 nodes of a cell, row by row in x."""
    half = 1 << (depth - level)
    for m in range(9):
        nodes[m] = lattice[(2 * a + m // 3) * half, (2 * b + m % 3) * half] - 1


@inner
def _resized(pupil, data, n_nodes, room):
    """Return copies of the nodes in arrays of another size; loops compile in a tenth of the time of slices."""
    new_pupil, new_data = np.empty((room, 2)), np.empty((data.shape[0], room, data.shape[2]))
    for k in range(n_nodes):
        new_pupil[k, 0], new_pupil[k, 1] = pupil[k, 0], pupil[k, 1]
        for v in range(data.shape[0]):
            for m in range(data.shape[2]):
                new_data[v, k, m] = data[v, k, m]
    return new_pupil, new_data


@inner
def _trace(steps, lens, light, pupil, data, first, end):
    """Trace new nodes at every wavelength for which the grid is built."""
    px, py = np.empty(end - first), np.empty(end - first)
    for k in range(first, end):
        px[k - first], py[k - first] = pupil[k, 0], pupil[k, 1]
    for v in range(lens.n_gap.shape[0]):
        trace_lanes(steps, at_wavelength(lens, v), light, px, py, data[v, first:end])


@inner
def _add_nodes(lattice, pupil, data, n_nodes, cells, level, depth, ny, box):
    """Add the nodes of cells that do not exist yet; return the arrays, enlarged as needed, and the number of nodes."""
    half = 1 << (depth - level)
    da, db = (box[1] - box[0]) / (lattice.shape[0] - 1), (box[3] - box[2]) / (lattice.shape[1] - 1)
    height = ny << level
    for cell in cells:
        a, b = cell // height, cell % height
        if n_nodes + 9 > pupil.shape[0]:
            pupil, data = _resized(pupil, data, n_nodes, 2 * pupil.shape[0])
        for m in range(9):
            i, j = (2 * a + m // 3) * half, (2 * b + m % 3) * half
            if lattice[i, j] == 0:
                pupil[n_nodes, 0] = box[0] + i * da
                pupil[n_nodes, 1] = box[2] + j * db
                n_nodes += 1
                lattice[i, j] = n_nodes
    return pupil, data, n_nodes


@inner
def _leaves(state, offsets, level):
    """Return the leaf cells of a level."""
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


@borrowing
def _balance(state, offsets, nx, ny, depth):
    """Split leaves until neighbours differ by at most one level, from the finest level up."""
    for level in range(depth - 1, 0, -1):
        width, height = nx << level, ny << level
        for cell in range(width * height):
            if state[offsets[level] + cell] != SPLIT:
                continue
            a, b = cell // height, cell % height
            for m in range(4):
                i = a + (1 if m == 0 else (-1 if m == 1 else 0))
                j = b + (1 if m == 2 else (-1 if m == 3 else 0))
                if 0 <= i < width and 0 <= j < height:
                    _split_down_to(state, offsets, ny, level, i, j)


@borrowing
def _split_down_to(state, offsets, ny, level, a, b):
    """Create a cell by splitting the leaf that covers it downwards, if there is one."""
    up = known_level(state, offsets, ny, level, a, b)
    if up < 0 or up == level:
        return
    kind = state[offsets[up] + (a >> (level - up)) * (ny << up) + (b >> (level - up))]
    if kind != LEAF and kind != FLAT:
        return
    for mid in range(up, level):
        i, j = a >> (level - mid), b >> (level - mid)
        state[offsets[mid] + i * (ny << mid) + j] = SPLIT
        for m in range(4):
            state[offsets[mid + 1] + quarter_of(i, j, ny << mid, m)] = kind


@inner
def _triangulate(state, offsets, lattice, nx, ny, depth):
    """Return triangle fans around the centres of all leaves; halve an edge if one side needs it and none is coarser."""
    total = 0
    for level in range(depth + 1):
        for k in range(offsets[level], offsets[level + 1]):
            if state[k] == LEAF or state[k] == FLAT:
                total += 8
    triangles = np.empty((total, 3), dtype=np.int64)
    count = 0
    nodes = np.empty(9, dtype=np.int64)
    for level in range(depth + 1):
        width, height = nx << level, ny << level
        for cell in range(width * height):
            kind = state[offsets[level] + cell]
            if kind != LEAF and kind != FLAT:
                continue
            a, b = cell // height, cell % height
            _cell_nodes(lattice, a, b, level, depth, nodes)
            for edge in range(4):
                # counter-clockwise from the edge towards lower b
                i = a + (1 if edge == 1 else (-1 if edge == 3 else 0))
                j = b + (1 if edge == 2 else (-1 if edge == 0 else 0))
                halved = kind == LEAF
                if 0 <= i < width and 0 <= j < height:
                    beyond = state[offsets[level] + i * height + j]
                    # symmetric: both sides of an edge decide alike
                    halved = beyond != UNKNOWN if kind == LEAF else beyond in (LEAF, SPLIT)
                step = 1 if halved else 2
                for m in range(2 * edge, 2 * edge + 2, step):
                    triangles[count, 0] = nodes[4]
                    triangles[count, 1] = nodes[_around(m)]
                    triangles[count, 2] = nodes[_around(m + step)]
                    count += 1
    kept = np.empty((count, 3), dtype=np.int64)
    for t in range(count):
        kept[t, 0], kept[t, 1], kept[t, 2] = triangles[t, 0], triangles[t, 1], triangles[t, 2]
    return kept
