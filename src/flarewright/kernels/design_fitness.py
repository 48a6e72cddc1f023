"""Fitness of genes: numbers from 0 to 1 that stand for a whole lens, its pattern of glass and air included.

Genes are what solvers see that know nothing of lenses (`design.solvers`). Gene 0 chooses the row of the stop; then come
the search variables in the order of `kernels.design_search`. A gene of an index says as well whether there is glass.
"""

import numpy as np

from ._jit import compiled, inner
from .design_cost import light_counts, rematch, total_cost
from .design_ghosts import COLUMNS, PLACE, RADIUS, REACH_THESIS, WORK_ROWS, light_values, list_ghosts
from .design_search import WISHES, to_prescription, wish_values

# which fitness
OURS, ALGORITHM_1 = 0, 1
# half a ghost's height where it cannot be seen, so that sorting puts it last (the thesis' program)
HIDDEN = 100000.0
# an index gene below this is air where the pattern is free: the thesis' 1 to 1.25 of 1 to 1.75
AIR_PART = 1.0 / 3.0


@inner
def decode(gene, stops, pattern, places, low, high, full, x, glass):
    """Turn genes into search variables and a pattern of glass; return the row of the stop.

    Parameters
    ----------
    gene : ndarray, shape (D,)
    stops : ndarray, shape (S,), int64
        Rows where the stop may be.
    pattern : ndarray, shape (K,), int64
        1 glass, 0 air, -1 the genes' choice.
    places : ndarray, shape (D,), int64
        What each gene is: 0 the stop, 1 + v search variable v.
    low, high : ndarray, shape (2, 1 + 3 K)
        Bounds of the search variables where a row's gap is air, and where it is glass.
    full : ndarray, shape (2 + 3 K,)
        Working space.
    x : ndarray, shape (1 + 3 K,)
        Filled: search variables.
    glass : ndarray, shape (K,), bool
        Filled.

    Notes
    -----
    Where the pattern is free, the nearest is taken that has no surface between air and air: a group begins with glass,
    ends with air, and has no two gaps of air in a row.
    """
    rows = pattern.size
    for v in range(full.size):
        full[v] = 0.5
    for v in range(places.size):
        # NaN becomes 0
        full[places[v]] = min(1.0, max(0.0, gene[v])) if gene[v] == gene[v] else 0.0
    stop = stops[min(int(full[0] * stops.size), stops.size - 1)]
    for k in range(rows):
        u = full[2 + 2 * rows + k]
        if pattern[k] >= 0:
            glass[k] = pattern[k] == 1
        else:
            group = stop if k < stop else rows
            begins = k in (0, stop + 1)
            glass[k] = k != stop and k != group - 1 and (
                u >= AIR_PART or begins or k == group - 2 or not glass[k - 1]
            )  # fmt: skip
            # as far into the glass as the gene is from the border, on either side
            u = (u - AIR_PART) / (1.0 - AIR_PART) if u >= AIR_PART else (AIR_PART - u) / AIR_PART
        side = 1 if glass[k] else 0
        for kind in range(3):
            v = 1 + kind * rows + k
            least, most = low[side, v], high[side, v]
            if kind == 0:
                value = least + full[1 + v] * (most - least)
            elif kind == 1:
                # weak curvatures are the usual ones
                bend = 2.0 * full[1 + v] - 1.0
                value = 0.5 * (least + most) + 0.5 * (most - least) * bend * bend * bend
                value = 0.0 if k == stop else value
            else:
                value = least + u * (most - least)
            x[v] = min(max(value, least), most)
    x[0] = min(max(low[0, 0] + full[1] * (high[0, 0] - low[0, 0]), low[0, 0]), high[0, 0])
    return stop


@inner
def fill_mirrors(stop, glass, mirrors):
    """Mark the rows that touch glass."""
    for k in range(glass.size):
        mirrors[k] = k != stop and (glass[k] or (k > 0 and glass[k - 1]))


@compiled
def decode_many(genes, stops, pattern, places, low, high, xs, rows_of_stop, glasses):
    """Turn many genes into search variables.

    Parameters
    ----------
    genes : ndarray, shape (B, D)
    stops, pattern, places, low, high
        As in `decode`.
    xs : ndarray, shape (B, 1 + 3 K)
        Filled.
    rows_of_stop : ndarray, shape (B,), int64
        Filled.
    glasses : ndarray, shape (B, K), bool
        Filled.
    """
    full = np.empty(xs.shape[1] + 1)
    for b in range(genes.shape[0]):
        rows_of_stop[b] = decode(genes[b], stops, pattern, places, low, high, full, xs[b], glasses[b])


@inner
def ascending(keys):
    """Return the order of some hundreds of numbers, equal ones as they come (insertion)."""
    order = np.empty(keys.size, np.int64)
    for k in range(keys.size):
        m = k
        while m > 0 and keys[order[m - 1]] > keys[k]:
            order[m] = order[m - 1]
            m -= 1
        order[m] = k
    return order


@compiled
def sorted_misfit(sizes, places, found):
    """Sum the squared errors of ghosts sorted by size, and what extra ghosts cost, over the number of targets.

    Parameters
    ----------
    sizes, places : ndarray, shape (N,)
        Of the targets; radii without sign.
    found : ndarray, shape (G, 2)
        Places and radii; G >= N.

    Returns
    -------
    float
        Algorithm 1 of Van Acoleyen 2025.
    """
    count = places.size
    radii = np.abs(found[:, 1])
    by_target, by_ghost = ascending(sizes), ascending(radii)
    total = 0.0
    for m in range(radii.size):
        g = by_ghost[m]
        if m < count:
            place, size = places[by_target[m]] - found[g, 0], sizes[by_target[m]] - radii[g]
            total += place * place + size * size
        else:
            total += 500.0 / max(radii[g], 1e-300)
    return total / count


@compiled
def fitness_of_genes(
    genes, stops, pattern, places, low, high, kind, entrance, slopes, spans, targets, weights, signed, extra, wishes,
    out,
):  # fmt: skip
    """Compute the fitness of many genes.

    Parameters
    ----------
    genes : ndarray, shape (B, D), float64
    stops, pattern, places, low, high
        As in `decode`.
    kind : int
        OURS: the cost that `kernels.design_search.polish_many` makes least, at the best matching; ALGORITHM_1:
        `sorted_misfit`, the mean over the lights, and the wishes.
    entrance, slopes, spans, targets, weights, signed, extra, wishes
        As in `polish_many`.
    out : ndarray, shape (B,)
        Filled; what is no lens costs 1e30.
    """
    rows, count, most = pattern.size, targets.shape[0], 0
    for s in range(stops.size):
        front, rear = stops[s], rows - 1 - stops[s]
        most = max(most, front * (front - 1) // 2 + rear * (rear - 1) // 2)
    full, x, q = np.empty(2 + 3 * rows), np.empty(1 + 3 * rows), np.empty(1 + 3 * rows)
    glass, mirrors, work = np.empty(rows, np.bool_), np.empty(rows, np.bool_), np.empty((WORK_ROWS, rows))
    values, light = np.empty((most, COLUMNS)), np.zeros(most)
    wished, beam = np.empty(WISHES + 2 * rows), np.empty(rows + 2)
    chosen, small = np.empty(count, np.int64), np.empty((3, max(most, count)), np.int64)
    table = np.empty((count, most) if kind == OURS else (1, 1))
    prices, parts = np.empty((slopes.size, most)), np.empty((4, most))
    flags, taken = np.empty(most, np.bool_), np.empty(most, np.bool_)
    found = np.empty((most, 2))
    lit = light_counts(weights)
    for b in range(genes.shape[0]):
        stop = decode(genes[b], stops, pattern, places, low, high, full, x, glass)
        fill_mirrors(stop, glass, mirrors)
        to_prescription(x, 1 + rows, q)
        ghosts = list_ghosts(q, rows, stop, mirrors, entrance, work, values)
        wish_values(q, rows, stop, entrance, work, wishes, beam, wished)
        total = 0.0
        if kind == OURS:
            if lit:
                light_values(q, rows, stop, mirrors, values, light)
            for t in range(count):
                chosen[t] = -1
            prices[:] = 0.0
            rematch(ghosts, spans, slopes, signed, targets, weights, values, light, extra, chosen, table, prices,
                    small, parts, flags)  # fmt: skip
            total = total_cost(ghosts, spans, slopes, signed, targets, weights, values, light, extra, chosen, taken,
                               wished)  # fmt: skip
        else:
            for s in range(slopes.size):
                for g in range(ghosts):
                    found[g, 0] = values[g, PLACE] * slopes[s]
                    found[g, 1] = HIDDEN if slopes[s] > values[g, REACH_THESIS] else values[g, RADIUS]
                span = targets[spans[s] : spans[s + 1]]
                total += sorted_misfit(np.abs(span[:, 1]), span[:, 0], found[:ghosts]) / slopes.size
            for m in range(wished.size):
                total += wished[m] * wished[m]
        # not a number is no lens
        out[b] = min(total, 1e30) if total == total else 1e30
