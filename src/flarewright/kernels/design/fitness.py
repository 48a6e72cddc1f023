"""Fitness of genes: numbers from 0 to 1 that encode a whole lens, including its sequence of glass and air.

General-purpose solvers (`design.solvers.solvers`) see only genes. Gene 0 chooses the row of the stop; the others are
the search variables in the order of `kernels.design.local_search`. The gene of an index also decides between glass and
air.
"""

import numpy as np

from ..jit.decorators import compiled, inner
from .arguments import room_to_match, unmatch
from .cost import light_counts, rematch, total_cost
from .ghosts import COLUMNS, PLACE, RADIUS, REACH_THESIS, WORK_ROWS, light_values, list_ghosts
from .local_search import LIMITS, limit_values, to_prescription

# kinds of fitness
OURS, ALGORITHM_1 = 0, 1
# radius given to a hidden ghost so that sorting puts it last (the thesis' program), mm
HIDDEN = 100000.0
# where glass or air is free, an index gene below this means air: the thesis' 1 to 1.25 of 1 to 1.75
AIR_PART = 1.0 / 3.0


@inner
def decode(gene, code, full, x, glass):
    """Decode genes to search variables and a pattern of glass; return the row of the stop.

    Parameters
    ----------
    gene : ndarray, shape (D,)
    code : GeneCode
    full : ndarray, shape (2 + 3 K,)
        Scratch.
    x : ndarray, shape (1 + 3 K,)
        Filled: search variables.
    glass : ndarray, shape (K,), bool
        Filled.

    Notes
    -----
    Where the pattern is free, the nearest pattern without a surface between air and air is used: a group begins with
    glass, ends with air, and has no two adjacent gaps of air.
    """
    stops, pattern, places, low, high = code
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
            # rescale the gene to 0 ... 1 by its distance from the border, on either side
            u = (u - AIR_PART) / (1.0 - AIR_PART) if u >= AIR_PART else (AIR_PART - u) / AIR_PART
        side = 1 if glass[k] else 0
        for kind in range(3):
            v = 1 + kind * rows + k
            least, most = low[side, v], high[side, v]
            if kind == 0:
                value = least + full[1 + v] * (most - least)
            elif kind == 1:
                # the cube makes weak curvatures more frequent
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
    """Fill whether each row reflects: rows with glass on either side do."""
    for k in range(glass.size):
        mirrors[k] = k != stop and (glass[k] or (k > 0 and glass[k - 1]))


@compiled
def decode_many(genes, code, xs, rows_of_stop, glasses):
    """Decode many genes to search variables.

    Parameters
    ----------
    genes : ndarray, shape (B, D)
    code : GeneCode
    xs : ndarray, shape (B, 1 + 3 K)
        Filled.
    rows_of_stop : ndarray, shape (B,), int64
        Filled.
    glasses : ndarray, shape (B, K), bool
        Filled.
    """
    full = np.empty(xs.shape[1] + 1)
    for b in range(genes.shape[0]):
        rows_of_stop[b] = decode(genes[b], code, full, xs[b], glasses[b])


@inner
def ascending(keys):
    """Return the indices that sort an array of some hundred numbers; stable insertion sort."""
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
    """Return the squared errors of ghosts sorted by size plus the cost of extra ghosts, over the number of targets.

    Parameters
    ----------
    sizes, places : ndarray, shape (N,)
        Unsigned radii and places of the targets.
    found : ndarray, shape (G, 2)
        Places and radii of the ghosts; G >= N.

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
def fitness_of_genes(genes, code, kind, entrance, aims, limits, out):
    """Compute the fitness of many genes.

    Parameters
    ----------
    genes : ndarray, shape (B, D), float64
    code : GeneCode
    kind : int
        OURS: the cost that `kernels.design.local_search.polish_many` minimises, at the best matching. ALGORITHM_1: the
        mean of `sorted_misfit` over the lights, plus the squares of the exceeded limits.
    entrance : float
        Diameter, mm.
    aims : GhostAims
    limits
        As in `polish_many`.
    out : ndarray, shape (B,)
        Filled; an impossible lens costs 1e30.
    """
    stops, rows, most = code.stops, code.pattern.size, 0
    for s in range(stops.size):
        front, rear = stops[s], rows - 1 - stops[s]
        most = max(most, front * (front - 1) // 2 + rear * (rear - 1) // 2)
    full, x, q = np.empty(2 + 3 * rows), np.empty(1 + 3 * rows), np.empty(1 + 3 * rows)
    glass, mirrors, work = np.empty(rows, np.bool_), np.empty(rows, np.bool_), np.empty((WORK_ROWS, rows))
    values, light = np.empty((most, COLUMNS)), np.zeros(most)
    missed, beam = np.empty(LIMITS + 2 * rows), np.empty(rows + 2)
    matching = room_to_match(aims.targets.shape[0], most, aims.slopes.size, kind == OURS)
    found = np.empty((most, 2))
    lit = light_counts(aims.weights)
    for b in range(genes.shape[0]):
        stop = decode(genes[b], code, full, x, glass)
        fill_mirrors(stop, glass, mirrors)
        to_prescription(x, 1 + rows, q)
        ghosts = list_ghosts(q, rows, stop, mirrors, entrance, work, values)
        limit_values(q, rows, stop, entrance, work, limits, beam, missed)
        total = 0.0
        if kind == OURS:
            if lit:
                light_values(q, rows, stop, mirrors, values, light)
            unmatch(matching)
            rematch(ghosts, aims, values, light, matching)
            total = total_cost(ghosts, aims, values, light, matching, missed)
        else:
            total = _algorithm_1(ghosts, aims, values, found)
            for m in range(missed.size):
                total += missed[m] * missed[m]
        # NaN means an impossible lens
        out[b] = min(total, 1e30) if total == total else 1e30


@inner
def _algorithm_1(ghosts, aims, values, found):
    """Return the mean of `sorted_misfit` over the lights; `found` is a working array, shape (G, 2)."""
    slopes, total = aims.slopes, 0.0
    for s in range(slopes.size):
        for g in range(ghosts):
            found[g, 0] = values[g, PLACE] * slopes[s]
            found[g, 1] = HIDDEN if slopes[s] > values[g, REACH_THESIS] else values[g, RADIUS]
        span = aims.targets[aims.spans[s] : aims.spans[s + 1]]
        total += sorted_misfit(np.abs(span[:, 1]), span[:, 0], found[:ghosts]) / slopes.size
    return total
