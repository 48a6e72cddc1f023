"""Local search for a prescription: Levenberg-Marquardt with bounds, ghosts matched to targets anew now and then.

The variables of a search are log stop diameter, log thicknesses, curvatures and indices, in the order of `q` in
`kernels.design_ghosts`.
"""

import numpy as np

from ._jit import compiled, inner
from .design_cost import (
    T_LIGHT,
    T_PLACE,
    T_RADIUS,
    TINY,
    hidden_weight,
    light_counts,
    rematch,
    total_cost,
)
from .design_edges import edge_row, edge_values, fill_beam
from .design_ghosts import (
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
from .design_sight import beyond, fill_mirrors_of_ghosts, sight_row

# wishes: least and largest 1/efl (1/mm), 1/f-number, length from the first vertex to the last (mm), and their weights;
# then least edge (mm), steepest surface and the weight of both, for every row (`design_edges`)
WISHES = 3


@inner
def to_prescription(x, logs, q):
    """Turn a search's variables into a prescription; the first `logs` of them are logarithms."""
    for v in range(x.size):
        q[v] = np.exp(x[v]) if v < logs else x[v]


@inner
def system_matrix(rows, stop, work):
    """Return upper and lower left of the direct system's matrix, and Ma00."""
    e, f, g, h = fill_suffix(stop, rows, work)
    a, _, c, _ = fill_suffix(0, stop, work)
    return e * a + f * c, g * a + h * c, a


@inner
def wish_values(q, rows, stop, entrance, work, wishes, beam, out):
    """Fill how far the prescription is off its wishes, weighted; 0 inside their limits."""
    _, power, a = system_matrix(rows, stop, work)
    # 1 / f-number is stop diameter over |Ma00| efl
    speed = -power * q[0] / max(abs(a), 1e-12)
    length = 0.0
    for k in range(rows - 1):
        length += q[1 + k]
    for m in range(WISHES):
        value = -power if m == 0 else (speed if m == 1 else length)
        over = max(value - wishes[m, 1], 0.0) - max(wishes[m, 0] - value, 0.0)
        out[m] = wishes[m, 2] * over
    if wishes[WISHES, 2] == 0.0:
        for m in range(WISHES, out.size):
            out[m] = 0.0
        return
    fill_beam(q, rows, stop, entrance, work, beam)
    edge_values(q, rows, stop, wishes[WISHES], beam, out[WISHES:])
    for m in range(WISHES, out.size):
        out[m] *= wishes[WISHES, 2]


@compiled
def wishes_missed(q, stop, entrance, wishes, out):
    """Tell how far a prescription is off its wishes.

    Parameters
    ----------
    q, stop, entrance, wishes
        As in `polish_many`.
    out : ndarray, shape (WISHES + 2 K,)
        Filled, times the weights.
    """
    rows = (q.size - 1) // 3
    work, beam = np.empty((WORK_ROWS, rows)), np.empty(rows + 2)
    reduce_rows(q, rows, work)
    wish_values(q, rows, stop, entrance, work, wishes, beam, out)


@inner
def _row(system, residual, m, weight, by, free, scale):
    """Write one residual's derivatives by the free variables, times a weight."""
    for v in range(free.size):
        system[m, v] = weight * by[free[v]] * scale[v]
    system[m, free.size] = residual


@inner
def fill_system(
    q, rows, stop, entrance, ghosts, spans, slopes, signed, targets, weights, values, jacobian, light, light_by, extra,
    chosen, taken, wishes, wished, free, scale, work, beam, trail, partial, row, system, between,
):  # fmt: skip
    """Fill the residuals (last column) and their derivatives; return how many."""
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
    return fill_wish_rows(
        q, rows, stop, entrance, wishes, wished, free, scale, work, beam, trail, partial, row, system, m
    )


@inner
def fill_wish_rows(
    q, rows, stop, entrance, wishes, wished, free, scale, work, beam, trail, partial, row, system, m
):  # fmt: skip
    """Add what is off the wishes and its derivatives from row `m` of a system on; return how many rows it has then."""
    wish_values(q, rows, stop, entrance, work, wishes, beam, wished)
    for wish in range(WISHES):
        if wished[wish] != 0.0:
            _wish_row(q, rows, stop, wish, work, trail, partial, row)
            _row(system, wished[wish], m, wishes[wish, 2], row, free, scale)
            m += 1
    for number in range(wished.size - WISHES):
        if wished[WISHES + number] != 0.0:
            edge_row(q, rows, stop, number, wishes[WISHES], work, beam, trail, partial, row)
            _row(system, wished[WISHES + number], m, wishes[WISHES, 2], row, free, scale)
            m += 1
    return m


@inner
def _wish_row(q, rows, stop, wish, work, trail, partial, row):
    """Differentiate 1/efl, 1/f-number or the length by the prescription."""
    for v in range(row.size):
        row[v] = 0.0
    if wish == 2:
        for k in range(rows - 1):
            row[1 + k] = 1.0
        return
    _, power, a0 = system_matrix(rows, stop, work)
    _, _, g, h = fill_suffix(stop, rows, work)
    a, _, c, _ = fill_suffix(0, stop, work)
    factor = -1.0 if wish == 0 else -q[0] / abs(a0)
    add_gradient(0, stop, -1, -1, 1.0, 0.0, g, h, work, trail, partial)
    add_by_prescription(q, rows, 0, stop, partial, factor, row)
    add_gradient(stop, rows, -1, -1, a, c, 0.0, 1.0, work, trail, partial)
    add_by_prescription(q, rows, stop, rows, partial, factor, row)
    if wish == 1:
        add_gradient(0, stop, -1, -1, 1.0, 0.0, 1.0, 0.0, work, trail, partial)
        add_by_prescription(q, rows, 0, stop, partial, power * q[0] / (abs(a0) * a0), row)
        row[0] -= power / abs(a0)


@inner
def normal_equations(system, count, unknowns, normal):
    """Fill the lower triangle of J'J and, as its last row, J'r; four rows at a time, so that sums stay in registers."""
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
    """Solve (J'J + damping diag) step = -J'r over the variables that are not held; return whether it has a solution."""
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


@compiled
def polish_many(
    starts, stop, mirrors, entrance, low, high, free, reach, slopes, spans, targets, weights, signed, extra, wishes,
    steps, patience, enough, ends, costs, matches,
):  # fmt: skip
    """Run one local search from each of several starting points.

    Parameters
    ----------
    starts : ndarray, shape (B, 1 + 3 K), float64
        Search variables: log stop diameter, log thicknesses, curvatures, indices.
    stop, mirrors, entrance
        As in `kernels.design_ghosts.ghosts_of_many`.
    low, high : ndarray, shape (1 + 3 K,)
        Bounds of the search variables; never left.
    free : ndarray, shape (F,), int64
        Which variables may change.
    reach : ndarray, shape (F,)
        Longest change of each in one step.
    slopes : ndarray, shape (L,)
        Slope of each light.
    spans : ndarray, shape (L + 1,), int64
        Where each light's targets begin.
    targets, weights : ndarray, shape (N, 3)
        Place, radius and log irradiance; a weight of 0 leaves one out.
    signed : bool
        Whether radii have a sign.
    extra : float
        An extra ghost costs this over its radius.
    wishes : ndarray, shape (WISHES + 1, 3)
        Least, largest and weight of 1/efl, 1/f-number and length; least edge, steepest surface and their weight.
    steps : int
        Most steps of a search.
    patience : int
        Steps after which ghosts are first matched anew; the pauses grow.
    enough : float
        A cost at which a search ends.
    ends : ndarray, shape (B, 1 + 3 K)
        Filled: where each search ended.
    costs : ndarray, shape (B,)
        Filled.
    matches : ndarray, shape (B, N), int64
        Filled: the ghost of each target.

    Notes
    -----
    Levenberg 1944, Marquardt 1963, with damping relative to the diagonal. A variable at a bound that the gradient
    pushes outward is held for that step (active set); the step is then cut to the bounds.
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
    system = np.empty((4 * count + lights * most + WISHES + 2 * rows + 4, unknowns + 1))
    normal, factor = np.empty((unknowns + 1, unknowns + 1)), np.empty((unknowns, unknowns))
    step, scale, held = np.empty(unknowns), np.empty(unknowns), np.empty(unknowns, np.bool_)
    cost_table, small = np.empty((count, most)), np.empty((3, max(most, count)), np.int64)
    prices, parts = np.empty((lights, most)), np.empty((4, most))
    flags, taken = np.empty(most, np.bool_), np.empty(most, np.bool_)
    wished, beam, row = np.empty(WISHES + 2 * rows), np.empty(rows + 2), np.empty(size)
    x, trial, q = np.empty(size), np.empty(size), np.empty(size)
    chosen = np.empty(count, np.int64)
    lit = light_counts(weights)
    for b in range(starts.shape[0]):
        for v in range(size):
            x[v] = min(max(starts[b, v], low[v]), high[v])
        for t in range(count):
            chosen[t] = -1
        # a search does not depend on the one before
        prices[:] = 0.0
        to_prescription(x, logs, q)
        list_ghosts(q, rows, stop, mirrors, entrance, work, values)
        if lit:
            light_values(q, rows, stop, mirrors, values, light)
        rematch(most, spans, slopes, signed, targets, weights, values, light, extra, chosen, cost_table, prices,
                small, parts, flags)  # fmt: skip
        wish_values(q, rows, stop, entrance, work, wishes, beam, wished)
        cost = total_cost(most, spans, slopes, signed, targets, weights, values, light, extra, chosen, taken, wished)
        damping, pause, since = 1e-2, patience, 0
        for _ in range(steps):
            to_prescription(x, logs, q)
            differentiate_ghosts(q, rows, stop, mirrors, entrance, lit, work, trail, partial, common, values, jacobian)
            if lit:
                brightness_of_ghosts(q, rows, stop, mirrors, values, jacobian, light, light_by)
            for v in range(unknowns):
                scale[v] = q[free[v]] if free[v] < logs else 1.0
            filled = fill_system(
                q, rows, stop, entrance, most, spans, slopes, signed, targets, weights, values, jacobian, light,
                light_by, extra, chosen, taken, wishes, wished, free, scale, work, beam, trail, partial, row, system,
                between,
            )  # fmt: skip
            normal_equations(system, filled, unknowns, normal)
            for v in range(unknowns):
                push = normal[unknowns, v]
                at = x[free[v]]
                held[v] = (at <= low[free[v]] and push > 0.0) or (at >= high[free[v]] and push < 0.0)
            better = cost
            for _ in range(8):
                if damped_step(normal, unknowns, damping, held, factor, step):
                    for v in range(size):
                        trial[v] = x[v]
                    for v in range(unknowns):
                        move = min(max(step[v], -reach[v]), reach[v])
                        trial[free[v]] = min(max(x[free[v]] + move, low[free[v]]), high[free[v]])
                    to_prescription(trial, logs, q)
                    list_ghosts(q, rows, stop, mirrors, entrance, work, values)
                    if lit:
                        light_values(q, rows, stop, mirrors, values, light)
                    wish_values(q, rows, stop, entrance, work, wishes, beam, wished)
                    better = total_cost(
                        most, spans, slopes, signed, targets, weights, values, light, extra, chosen, taken, wished
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
                wish_values(q, rows, stop, entrance, work, wishes, beam, wished)
            if cost <= enough:
                break
            if since >= pause or stalled:
                since = 0
                pause += pause // 2 + 1
                changed = rematch(most, spans, slopes, signed, targets, weights, values, light, extra, chosen,
                                  cost_table, prices, small, parts, flags)  # fmt: skip
                if changed:
                    cost = total_cost(
                        most, spans, slopes, signed, targets, weights, values, light, extra, chosen, taken, wished
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
    """Count the pairs of mirrors on one side of the stop."""
    front, rear = 0, 0
    for k in range(rows):
        if mirrors[k] and k < stop:
            front += 1
        elif mirrors[k] and k > stop:
            rear += 1
    return front * (front - 1) // 2 + rear * (rear - 1) // 2
