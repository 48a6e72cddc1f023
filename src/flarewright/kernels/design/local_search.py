"""Local search for a prescription: Levenberg-Marquardt with bounds; ghosts are rematched to targets at intervals.

The variables of a search are log stop diameter, log thicknesses, curvatures and indices, in the order of `q` in
`kernels.design.ghosts`.
"""

import numpy as np

from ..jit.decorators import compiled, inner
from .cost import T_LIGHT, T_PLACE, T_RADIUS, TINY, hidden_weight, light_counts, rematch, total_cost
from .edge_thickness import edge_row, edge_values, fill_beam
from .ghosts import (
    COLUMNS,
    PLACE,
    RADIUS,
    REACH,
    TRAIL,
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
from .vignetting import beyond, fill_mirrors_of_ghosts, sight_row

# rows of `ghost_targets` for the lens itself: least and largest value, and weight, of 1/efl (1/mm), 1/f-number and
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
def limit_values(q, rows, stop, entrance, work, ghost_targets, beam, out):
    """Fill the weighted distances of the prescription from the limits of its targets; 0 inside the limits."""
    _, power, a = system_matrix(rows, stop, work)
    # 1 / f-number is stop diameter over |Ma00| efl
    speed = -power * q[0] / max(abs(a), 1e-12)
    length = 0.0
    for k in range(rows - 1):
        length += q[1 + k]
    for m in range(LIMITS):
        value = -power if m == 0 else (speed if m == 1 else length)
        over = max(value - ghost_targets[m, 1], 0.0) - max(ghost_targets[m, 0] - value, 0.0)
        out[m] = ghost_targets[m, 2] * over
    if ghost_targets[LIMITS, 2] == 0.0:
        for m in range(LIMITS, out.size):
            out[m] = 0.0
        return
    fill_beam(q, rows, stop, entrance, work, beam)
    edge_values(q, rows, stop, ghost_targets[LIMITS], beam, out[LIMITS:])
    for m in range(LIMITS, out.size):
        out[m] *= ghost_targets[LIMITS, 2]


@compiled
def limit_excess(q, stop, entrance, ghost_targets, out):
    """Compute the weighted distances of a prescription from the limits of its targets.

    Parameters
    ----------
    q : ndarray, shape (1 + 3 K,)
        The prescription.
    stop, entrance, ghost_targets
        As in `polish_many`.
    out : ndarray, shape (GHOST_TARGETS + 2 K,)
        Filled.
    """
    rows = (q.size - 1) // 3
    work, beam = np.empty((WORK_ROWS, rows)), np.empty(rows + 2)
    reduce_rows(q, rows, work)
    limit_values(q, rows, stop, entrance, work, ghost_targets, beam, out)


@inner
def _row(system, residual, m, weight, by, free, scale):
    """Write row m of a system: one residual, and its derivatives by the free variables times a weight."""
    for v in range(free.size):
        system[m, v] = weight * by[free[v]] * scale[v]
    system[m, free.size] = residual


@inner
def fill_system(
    q, rows, stop, entrance, ghosts, spans, slopes, signed, targets, weights, values, jacobian, light, light_by, extra,
    chosen, taken, ghost_targets, wanted, free, scale, work, beam, trail, partial, row, system, between,
):  # fmt: skip
    """Fill the residuals (last column) and their derivatives; return the number of rows."""
    m = 0
    for s in range(slopes.size):
        for g in range(ghosts):
            taken[g] = False
        for t in range(spans[s], spans[s + 1]):
            g = chosen[t]
            taken[g] = True
            flip = 1.0 if signed or values[g, RADIUS] >= 0.0 else -1.0
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
                _row(system, w * (light[g] - targets[t, T_LIGHT]), m, w, light_by[g], free, scale)
                m += 1
            away, w = beyond(g, slopes[s], values), hidden_weight(t, targets, weights)
            if away > 0.0 and w > 0.0:
                sight_row(q, rows, stop, between[g, 0], between[g, 1], entrance, work, trail, partial, row)
                _row(system, w * away, m, w * slopes[s], row, free, scale)
                m += 1
        if extra > 0.0:
            for g in range(ghosts):
                radius = values[g, RADIUS]
                if not taken[g] and abs(radius) > TINY and slopes[s] <= values[g, REACH]:
                    r = np.sqrt(extra / abs(radius))
                    _row(system, r, m, -0.5 * r / radius, jacobian[1, g], free, scale)
                    m += 1
    return fill_ghost_target_rows(
        q, rows, stop, entrance, ghost_targets, wanted, free, scale, work, beam, trail, partial, row, system, m
    )


@inner
def fill_ghost_target_rows(
    q, rows, stop, entrance, ghost_targets, wanted, free, scale, work, beam, trail, partial, row, system, m
):  # fmt: skip
    """Append the missed lens targets and their derivatives to a system from row `m`; return its number of rows."""
    limit_values(q, rows, stop, entrance, work, ghost_targets, beam, wanted)
    for ghost_target in range(LIMITS):
        if wanted[ghost_target] != 0.0:
            _ghost_target_row(q, rows, stop, ghost_target, work, trail, partial, row)
            _row(system, wanted[ghost_target], m, ghost_targets[ghost_target, 2], row, free, scale)
            m += 1
    for number in range(wanted.size - LIMITS):
        if wanted[LIMITS + number] != 0.0:
            edge_row(q, rows, stop, number, ghost_targets[LIMITS], work, beam, trail, partial, row)
            _row(system, wanted[LIMITS + number], m, ghost_targets[LIMITS, 2], row, free, scale)
            m += 1
    return m


@inner
def _ghost_target_row(q, rows, stop, ghost_target, work, trail, partial, row):
    """Differentiate one lens target, 1/efl, 1/f-number or length, by the prescription."""
    for v in range(row.size):
        row[v] = 0.0
    if ghost_target == 2:
        for k in range(rows - 1):
            row[1 + k] = 1.0
        return
    _, power, a0 = system_matrix(rows, stop, work)
    _, _, g, h = fill_suffix(stop, rows, work)
    a, _, c, _ = fill_suffix(0, stop, work)
    factor = -1.0 if ghost_target == 0 else -q[0] / abs(a0)
    add_gradient(0, stop, -1, -1, 1.0, 0.0, g, h, work, trail, partial)
    add_by_prescription(q, rows, 0, stop, partial, factor, row)
    add_gradient(stop, rows, -1, -1, a, c, 0.0, 1.0, work, trail, partial)
    add_by_prescription(q, rows, stop, rows, partial, factor, row)
    if ghost_target == 1:
        add_gradient(0, stop, -1, -1, 1.0, 0.0, 1.0, 0.0, work, trail, partial)
        add_by_prescription(q, rows, 0, stop, partial, power * q[0] / (abs(a0) * a0), row)
        row[0] -= power / abs(a0)


@inner
def normal_equations(system, count, unknowns, normal):
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


@compiled
def polish_many(
    starts, stop, mirrors, entrance, low, high, free, reach, slopes, spans, targets, weights, signed, extra,
    ghost_targets, steps, patience, enough, ends, costs, matches,
):  # fmt: skip
    """Run one local search from each of several starting points.

    Parameters
    ----------
    starts : ndarray, shape (B, 1 + 3 K), float64
        Search variables: log stop diameter, log thicknesses, curvatures, indices.
    stop, mirrors, entrance
        As in `kernels.design.ghosts.ghosts_of_many`.
    low, high : ndarray, shape (1 + 3 K,)
        Bounds of the search variables, never exceeded.
    free : ndarray, shape (F,), int64
        Indices of the variables that may change.
    reach : ndarray, shape (F,)
        Largest change of each free variable in one step.
    slopes : ndarray, shape (L,)
        Slope of each light.
    spans : ndarray, shape (L + 1,), int64
        First target of each light, and the end of the last.
    targets, weights : ndarray, shape (N, 3)
        Place, radius and log irradiance; a weight of 0 ignores the value.
    signed : bool
        Whether the radii of targets have a sign.
    extra : float
        Cost of an extra ghost times its radius.
    ghost_targets : ndarray, shape (GHOST_TARGETS + 1, 3)
        Least, largest and weight of 1/efl, 1/f-number and length; least edge, steepest surface and their weight.
    steps : int
        Largest number of steps of a search.
    patience : int
        Steps before ghosts are first rematched; the intervals grow.
    enough : float
        Cost at which a search ends.
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
    size, count, lights = starts.shape[1], targets.shape[0], slopes.size
    rows = (size - 1) // 3
    logs = 1 + rows
    most = ghosts_of_structure(stop, rows, mirrors)
    work, trail, partial = np.empty((WORK_ROWS, rows)), np.empty(TRAIL * rows), np.zeros((4, rows))
    common, jacobian = np.empty((6, size)), np.empty((3, most, size))
    values, light, light_by = np.empty((most, COLUMNS)), np.zeros(most), np.zeros((most, size))
    unknowns = free.size
    between = np.empty((most, 2), np.int64)
    fill_mirrors_of_ghosts(stop, rows, mirrors, between)
    system = np.empty((4 * count + lights * most + LIMITS + 2 * rows + 4, unknowns + 1))
    normal, factor = np.empty((unknowns + 1, unknowns + 1)), np.empty((unknowns, unknowns))
    step, scale, held = np.empty(unknowns), np.empty(unknowns), np.empty(unknowns, np.bool_)
    cost_table, small = np.empty((count, most)), np.empty((3, max(most, count)), np.int64)
    prices, parts = np.empty((lights, most)), np.empty((4, most))
    flags, taken = np.empty(most, np.bool_), np.empty(most, np.bool_)
    wanted, beam, row = np.empty(LIMITS + 2 * rows), np.empty(rows + 2), np.empty(size)
    x, trial, q = np.empty(size), np.empty(size), np.empty(size)
    chosen = np.empty(count, np.int64)
    lit = light_counts(weights)
    for b in range(starts.shape[0]):
        clip_start(starts[b], low, high, x)
        for t in range(count):
            chosen[t] = -1
        # reset the prices so that a search does not depend on the one before
        prices[:] = 0.0
        to_prescription(x, logs, q)
        list_ghosts(q, rows, stop, mirrors, entrance, work, values)
        if lit:
            light_values(q, rows, stop, mirrors, values, light)
        rematch(most, spans, slopes, signed, targets, weights, values, light, extra, chosen, cost_table, prices,
                small, parts, flags)  # fmt: skip
        limit_values(q, rows, stop, entrance, work, ghost_targets, beam, wanted)
        cost = total_cost(most, spans, slopes, signed, targets, weights, values, light, extra, chosen, taken, wanted)
        damping, pause, since = 1e-2, patience, 0
        for _ in range(steps):
            to_prescription(x, logs, q)
            differentiate_ghosts(q, rows, stop, mirrors, entrance, lit, work, trail, partial, common, values, jacobian)
            if lit:
                brightness_of_ghosts(q, rows, stop, mirrors, values, jacobian, light, light_by)
            fill_scale(q, free, logs, scale)
            filled = fill_system(
                q, rows, stop, entrance, most, spans, slopes, signed, targets, weights, values, jacobian, light,
                light_by, extra, chosen, taken, ghost_targets, wanted, free, scale, work, beam, trail, partial, row,
                system, between,
            )  # fmt: skip
            normal_equations(system, filled, unknowns, normal)
            hold_at_bounds(normal[unknowns], x, free, low, high, held)
            better = cost
            for _ in range(8):
                if damped_step(normal, unknowns, damping, held, factor, step):
                    step_within(x, step, 1.0, reach, free, low, high, trial)
                    to_prescription(trial, logs, q)
                    list_ghosts(q, rows, stop, mirrors, entrance, work, values)
                    if lit:
                        light_values(q, rows, stop, mirrors, values, light)
                    limit_values(q, rows, stop, entrance, work, ghost_targets, beam, wanted)
                    better = total_cost(
                        most, spans, slopes, signed, targets, weights, values, light, extra, chosen, taken, wanted
                    )
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
                list_ghosts(q, rows, stop, mirrors, entrance, work, values)
                if lit:
                    light_values(q, rows, stop, mirrors, values, light)
                limit_values(q, rows, stop, entrance, work, ghost_targets, beam, wanted)
            if cost <= enough:
                break
            if since >= pause or stalled:
                since = 0
                pause += pause // 2 + 1
                changed = rematch(most, spans, slopes, signed, targets, weights, values, light, extra, chosen,
                                  cost_table, prices, small, parts, flags)  # fmt: skip
                if changed:
                    cost = total_cost(
                        most, spans, slopes, signed, targets, weights, values, light, extra, chosen, taken, wanted
                    )
                    damping = max(damping, 1e-4)
                elif stalled:
                    break
        for v in range(size):
            ends[b, v] = x[v]
        for t in range(count):
            matches[b, t] = chosen[t]
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
