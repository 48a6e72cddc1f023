"""Local search for a prescription: Levenberg-Marquardt with bounds; ghosts are rematched to targets at intervals.

The variables of a search are log stop diameter, log thicknesses, curvatures and indices, in the order of `q` in
`kernels.design.ghosts`.
"""

import numpy as np

from ..jit.decorators import compiled, inner
from .arguments import room_for_derivatives, room_for_ghosts, room_to_match, unmatch
from .cost import T_LIGHT, T_PLACE, T_RADIUS, TINY, hidden_weight, light_counts, rematch, total_cost
from .edge_thickness import edge_row, edge_values, fill_beam
from .ghosts import (
    PLACE,
    RADIUS,
    REACH,
    WORK_ROWS,
    add_by_prescription,
    add_gradient,
    brightness_of_ghosts,
    differentiate_ghosts,
    fill_suffix,
    light_values,
    list_ghosts,
    reduce_rows,
)
from .vignetting import beyond_sight, fill_mirrors_of_ghosts, sight_row

# rows of the lens' limits: least and largest value, and weight, of 1/efl (1/mm), 1/f-number and
# length from the first vertex to the last (mm). A further row holds the least edge (mm), the steepest surface and the
# weight of both (`kernels.design.edge_thickness`)
LIMITS = 3


@inner
def to_prescription(x, logs, q):
    """Convert search variables to a prescription; the first `logs` of them are logarithms."""
    for v in range(x.size):
        q[v] = np.exp(x[v]) if v < logs else x[v]


@inner
def system_matrix(rows, stop, work):
    """Return the upper and lower left items of the whole lens' matrix, and Ma00."""
    e, f, g, h = fill_suffix(stop, rows, work)
    a, _, c, _ = fill_suffix(0, stop, work)
    return e * a + f * c, g * a + h * c, a


@inner
def limit_values(q, rows, stop, entrance, work, limits, beam, out):
    """Fill the weighted distances of the prescription from its limits; 0 inside them."""
    _, power, a = system_matrix(rows, stop, work)
    # 1 / f-number is stop diameter over |Ma00| efl
    speed = -power * q[0] / max(abs(a), 1e-12)
    length = 0.0
    for k in range(rows - 1):
        length += q[1 + k]
    for m in range(LIMITS):
        value = -power if m == 0 else (speed if m == 1 else length)
        over = max(value - limits[m, 1], 0.0) - max(limits[m, 0] - value, 0.0)
        out[m] = limits[m, 2] * over
    if limits[LIMITS, 2] == 0.0:
        for m in range(LIMITS, out.size):
            out[m] = 0.0
        return
    fill_beam(q, rows, stop, entrance, work, beam)
    edge_values(q, rows, stop, limits[LIMITS], beam, out[LIMITS:])
    for m in range(LIMITS, out.size):
        out[m] *= limits[LIMITS, 2]


@compiled
def limit_excess(q, stop, entrance, limits, out):
    """Compute the weighted distances of a prescription from its limits.

    Parameters
    ----------
    q : ndarray, shape (1 + 3 K,)
        The prescription.
    stop : int
    entrance : float
    limits
        As in `polish_many`.
    out : ndarray, shape (LIMITS + 2 K,)
        Filled.
    """
    rows = (q.size - 1) // 3
    work, beam = np.empty((WORK_ROWS, rows)), np.empty(rows + 2)
    reduce_rows(q, rows, work)
    limit_values(q, rows, stop, entrance, work, limits, beam, out)


@inner
def _row(system, residual, m, weight, by, free, scale):
    """Write row m of a system: one residual, and its derivatives by the free variables times a weight."""
    for v in range(free.size):
        system[m, v] = weight * by[free[v]] * scale[v]
    system[m, free.size] = residual


@inner
def fill_system(q, lens, aims, ghosts, found, matching, between, limits, missed, free, scale, room, system):
    """Fill the residuals (last column) and their derivatives; return the number of rows.

    Parameters
    ----------
    q : ndarray, shape (1 + 3 K,)
    lens : LensStructure
    aims : GhostAims
    ghosts : int
        Number of ghosts.
    found : GhostValues
    matching : Matching
    between : ndarray, shape (G, 2), int64
        Mirrors of every ghost.
    limits
        As in `polish_many`.
    missed : ndarray, shape (LIMITS + 2 K,)
        Filled by `limit_values`.
    free, scale : ndarray, shape (F,)
        Free variables, and the derivative of the prescription by each.
    room : DerivativeRoom
    system : ndarray, shape (M, F + 1)
    """
    slopes, targets, weights, taken = aims.slopes, aims.targets, aims.weights, matching.taken
    values, jacobian, light, row = found.values, found.jacobian, found.light, room.row
    m = 0
    for s in range(slopes.size):
        for g in range(ghosts):
            taken[g] = False
        for t in range(aims.spans[s], aims.spans[s + 1]):
            g = matching.chosen[t]
            taken[g] = True
            flip = 1.0 if aims.signed or values[g, RADIUS] >= 0.0 else -1.0
            if weights[t, T_PLACE] > 0.0:
                w = weights[t, T_PLACE]
                _row(system, w * (values[g, PLACE] * slopes[s] - targets[t, T_PLACE]), m, w * slopes[s],
                     jacobian[0, g], free, scale)  # fmt: skip
                m += 1
            if weights[t, T_RADIUS] > 0.0:
                w = weights[t, T_RADIUS]
                _row(system, w * (flip * values[g, RADIUS] - targets[t, T_RADIUS]), m, w * flip, jacobian[1, g],
                     free, scale)  # fmt: skip
                m += 1
            if weights[t, T_LIGHT] > 0.0:
                w = weights[t, T_LIGHT]
                _row(system, w * (light[g] - targets[t, T_LIGHT]), m, w, found.light_by[g], free, scale)
                m += 1
            away, w = beyond_sight(g, slopes[s], values), hidden_weight(t, targets, weights)
            if away > 0.0 and w > 0.0:
                sight_row(q, lens.mirrors.size, lens.stop, between[g, 0], between[g, 1], lens.entrance, room.work,
                          room.trail, room.partial, row)  # fmt: skip
                _row(system, w * away, m, w * slopes[s], row, free, scale)
                m += 1
        if aims.extra > 0.0:
            for g in range(ghosts):
                radius = values[g, RADIUS]
                if not taken[g] and abs(radius) > TINY and slopes[s] <= values[g, REACH]:
                    r = np.sqrt(aims.extra / abs(radius))
                    _row(system, r, m, -0.5 * r / radius, jacobian[1, g], free, scale)
                    m += 1
    return fill_limit_rows(q, lens, limits, missed, free, scale, room, system, m)


@inner
def fill_limit_rows(q, lens, limits, missed, free, scale, room, system, m):
    """Append the exceeded limits and their derivatives to a system from row `m`; return its number of rows."""
    rows, stop, row = lens.mirrors.size, lens.stop, room.row
    limit_values(q, rows, stop, lens.entrance, room.work, limits, room.beam, missed)
    for limit in range(LIMITS):
        if missed[limit] != 0.0:
            _limit_row(q, rows, stop, limit, room, row)
            _row(system, missed[limit], m, limits[limit, 2], row, free, scale)
            m += 1
    for number in range(missed.size - LIMITS):
        if missed[LIMITS + number] != 0.0:
            edge_row(q, rows, stop, number, limits[LIMITS], room.work, room.beam, room.trail, room.partial, row)
            _row(system, missed[LIMITS + number], m, limits[LIMITS, 2], row, free, scale)
            m += 1
    return m


@inner
def _limit_row(q, rows, stop, limit, room, row):
    """Differentiate what one limit restricts, 1/efl, 1/f-number or length, by the prescription."""
    work, trail, partial = room.work, room.trail, room.partial
    for v in range(row.size):
        row[v] = 0.0
    if limit == 2:
        for k in range(rows - 1):
            row[1 + k] = 1.0
        return
    _, power, a0 = system_matrix(rows, stop, work)
    _, _, g, h = fill_suffix(stop, rows, work)
    a, _, c, _ = fill_suffix(0, stop, work)
    factor = -1.0 if limit == 0 else -q[0] / abs(a0)
    add_gradient(0, stop, -1, -1, 1.0, 0.0, g, h, work, trail, partial)
    add_by_prescription(q, rows, 0, stop, partial, factor, row)
    add_gradient(stop, rows, -1, -1, a, c, 0.0, 1.0, work, trail, partial)
    add_by_prescription(q, rows, stop, rows, partial, factor, row)
    if limit == 1:
        add_gradient(0, stop, -1, -1, 1.0, 0.0, 1.0, 0.0, work, trail, partial)
        add_by_prescription(q, rows, 0, stop, partial, power * q[0] / (abs(a0) * a0), row)
        row[0] -= power / abs(a0)


@inner
def fill_normal_equations(system, count, unknowns, normal):
    """Fill the lower triangle of J'J and, as last row, J'r; sum four rows at a time to keep the sums in registers."""
    for a in range(unknowns + 1):
        for b in range(a + 1):
            normal[a, b] = 0.0
    padded = (count + 3) // 4 * 4
    for m in range(count, padded):
        for v in range(unknowns + 1):
            system[m, v] = 0.0
    for m in range(0, padded, 4):
        for a in range(unknowns + 1):
            p, q, r, s = system[m, a], system[m + 1, a], system[m + 2, a], system[m + 3, a]
            for b in range(a + 1):
                normal[a, b] += p * system[m, b] + q * system[m + 1, b] + r * system[m + 2, b] + s * system[m + 3, b]


@inner
def damped_step(normal, unknowns, damping, held, factor, step):
    """Solve (J'J + damping diag) step = -J'r for the variables that are not held; return whether it has a solution."""
    largest = 0.0
    for a in range(unknowns):
        largest = max(largest, normal[a, a])
    for a in range(unknowns):
        for b in range(a + 1):
            factor[a, b] = 0.0 if held[a] or held[b] else normal[a, b]
        factor[a, a] = 1.0 if held[a] else normal[a, a] + damping * max(normal[a, a], 1e-9 * largest) + 1e-300
        step[a] = 0.0 if held[a] else -normal[unknowns, a]
    for a in range(unknowns):
        for b in range(a):
            total = factor[a, b]
            for m in range(b):
                total -= factor[a, m] * factor[b, m]
            factor[a, b] = total / factor[b, b]
        total = factor[a, a]
        for m in range(a):
            total -= factor[a, m] * factor[a, m]
        if not total > 0.0:
            return False
        factor[a, a] = np.sqrt(total)
        total = step[a]
        for m in range(a):
            total -= factor[a, m] * step[m]
        step[a] = total / factor[a, a]
    for a in range(unknowns - 1, -1, -1):
        total = step[a] / factor[a, a]
        step[a] = total
        for m in range(a):
            step[m] -= factor[a, m] * total
    return True


@inner
def clip_start(start, low, high, x):
    """Fill a point with a start moved within the bounds."""
    for v in range(start.size):
        x[v] = min(max(start[v], low[v]), high[v])


@inner
def fill_scale(q, free, logs, scale):
    """Fill the derivative of the prescription by each free search variable."""
    for v in range(free.size):
        scale[v] = q[free[v]] if free[v] < logs else 1.0


@inner
def hold_at_bounds(gradient, x, free, low, high, held):
    """Fill whether each free variable is at a bound and the gradient pushes it outward."""
    for v in range(free.size):
        push, at = gradient[v], x[free[v]]
        held[v] = (at <= low[free[v]] and push > 0.0) or (at >= high[free[v]] and push < 0.0)


@inner
def step_within(x, step, stretch, reach, free, low, high, trial):
    """Fill the point after a step that is stretched, limited in each variable and clipped to the bounds."""
    # loops: an assignment of whole arrays compiles Numba's text of its error message as well
    for v in range(x.size):
        trial[v] = x[v]
    for v in range(free.size):
        move = min(max(step[v] * stretch, -reach[v]), reach[v])
        trial[free[v]] = min(max(x[free[v]] + move, low[free[v]]), high[free[v]])


@inner
def fill_ghosts(q, lens, lit, work, found):
    """Fill the ghosts of a prescription, and their brightness if any target has one."""
    rows = lens.mirrors.size
    list_ghosts(q, rows, lens.stop, lens.mirrors, lens.entrance, work, found.values)
    if lit:
        light_values(q, rows, lens.stop, lens.mirrors, found.values, found.light)


@inner
def fill_derivatives(q, lens, lit, room, found):
    """Fill the ghosts of a prescription and their derivatives, those of their brightness if any target has one."""
    rows, stop, mirrors = lens.mirrors.size, lens.stop, lens.mirrors
    differentiate_ghosts(q, rows, stop, mirrors, lens.entrance, lit, room.work, room.trail, room.partial, room.common,
                         found.values, found.jacobian)  # fmt: skip
    if lit:
        brightness_of_ghosts(q, rows, stop, mirrors, found.values, found.jacobian, found.light, found.light_by)


@compiled
def polish_many(starts, lens, space, aims, limits, effort, ends, costs, matches):
    """Run one local search from each of several starting points.

    Parameters
    ----------
    starts : ndarray, shape (B, 1 + 3 K), float64
        Search variables: log stop diameter, log thicknesses, curvatures, indices.
    lens : LensStructure
    space : FreeVariables
    aims : GhostAims
    limits : ndarray, shape (LIMITS + 1, 3)
        Least, largest and weight of 1/efl, 1/f-number and length; least edge, steepest surface and their weight.
    effort : Effort
    ends : ndarray, shape (B, 1 + 3 K)
        Filled: search variables at the end of each search.
    costs : ndarray, shape (B,)
        Filled.
    matches : ndarray, shape (B, N), int64
        Filled: the ghost of each target.

    Notes
    -----
    Levenberg 1944, Marquardt 1963, with damping relative to the diagonal. A variable at a bound that the gradient
    pushes outward is held for that step (active set); the step is then clipped to the bounds.
    """
    size, count, lights = starts.shape[1], aims.targets.shape[0], aims.slopes.size
    rows = (size - 1) // 3
    logs = 1 + rows
    stop, entrance = lens.stop, lens.entrance
    low, high, free, reach = space
    most = ghosts_of_structure(stop, rows, lens.mirrors)
    room, found = room_for_derivatives(rows), room_for_ghosts(most, size)
    values, light = found.values, found.light
    unknowns = free.size
    between = np.empty((most, 2), np.int64)
    fill_mirrors_of_ghosts(stop, rows, lens.mirrors, between)
    system = np.empty((4 * count + lights * most + LIMITS + 2 * rows + 4, unknowns + 1))
    normal, factor = np.empty((unknowns + 1, unknowns + 1)), np.empty((unknowns, unknowns))
    step, scale, held = np.empty(unknowns), np.empty(unknowns), np.empty(unknowns, np.bool_)
    matching = room_to_match(count, most, lights, True)
    missed = np.empty(LIMITS + 2 * rows)
    x, trial, q = np.empty(size), np.empty(size), np.empty(size)
    lit = light_counts(aims.weights)
    for b in range(starts.shape[0]):
        clip_start(starts[b], low, high, x)
        unmatch(matching)
        to_prescription(x, logs, q)
        fill_ghosts(q, lens, lit, room.work, found)
        rematch(most, aims, values, light, matching)
        limit_values(q, rows, stop, entrance, room.work, limits, room.beam, missed)
        cost = total_cost(most, aims, values, light, matching, missed)
        damping, pause, since = 1e-2, effort.patience, 0
        for _ in range(effort.steps):
            to_prescription(x, logs, q)
            fill_derivatives(q, lens, lit, room, found)
            fill_scale(q, free, logs, scale)
            filled = fill_system(q, lens, aims, most, found, matching, between, limits, missed, free, scale, room,
                                 system)  # fmt: skip
            fill_normal_equations(system, filled, unknowns, normal)
            hold_at_bounds(normal[unknowns], x, free, low, high, held)
            better = cost
            for _ in range(8):
                if damped_step(normal, unknowns, damping, held, factor, step):
                    step_within(x, step, 1.0, reach, free, low, high, trial)
                    to_prescription(trial, logs, q)
                    fill_ghosts(q, lens, lit, room.work, found)
                    limit_values(q, rows, stop, entrance, room.work, limits, room.beam, missed)
                    better = total_cost(most, aims, values, light, matching, missed)
                    if better < cost:
                        break
                damping = max(damping, 1e-8) * 5.0
            since += 1
            if better < cost:
                stalled = cost - better < 1e-4 * cost
                cost = better
                damping = max(damping * 0.2, 1e-12)
                for v in range(size):
                    x[v] = trial[v]
            else:
                stalled = True
                to_prescription(x, logs, q)
                fill_ghosts(q, lens, lit, room.work, found)
                limit_values(q, rows, stop, entrance, room.work, limits, room.beam, missed)
            if cost <= effort.enough:
                break
            if since >= pause or stalled:
                since = 0
                pause += pause // 2 + 1
                if rematch(most, aims, values, light, matching):
                    cost = total_cost(most, aims, values, light, matching, missed)
                    damping = max(damping, 1e-4)
                elif stalled:
                    break
        for v in range(size):
            ends[b, v] = x[v]
        for t in range(count):
            matches[b, t] = matching.chosen[t]
        costs[b] = cost


@inner
def ghosts_of_structure(stop, rows, mirrors):
    """Return the number of ghosts: pairs of mirrors on the same side of the stop."""
    front, rear = 0, 0
    for k in range(rows):
        if mirrors[k] and k < stop:
            front += 1
        elif mirrors[k] and k > stop:
            rear += 1
    return front * (front - 1) // 2 + rear * (rear - 1) // 2
