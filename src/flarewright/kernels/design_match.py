"""Which ghost stands for which target: the assignment of least cost."""

import numpy as np

from ._jit import compiled, inner

# times that ghosts are fought for before paths are looked for, for each target
_FIGHTS = 4


@inner
def assign(cost, count, ghosts, chosen, price, held, way, least, seen):
    """Give each target a ghost of its own so that the sum of costs is least.

    Parameters
    ----------
    cost : ndarray, shape (>= count, >= ghosts)
        Finite.
    count, ghosts : int
        Targets and ghosts; count <= ghosts.
    chosen : ndarray, shape (>= count,), int64
        Filled: the ghost of each target.
    price : ndarray, shape (>= ghosts,)
        What each ghost costs less at the end; where there are as many targets as ghosts, those of a similar assignment
        make this one quicker.
    held, way : ndarray, shape (>= ghosts,), int64
    least : ndarray, shape (>= ghosts,)
    seen : ndarray, shape (>= ghosts,), bool
        Working space.

    Notes
    -----
    Augmenting row reduction, then shortest augmenting paths (Jonker and Volgenant 1987). Compared with scipy's
    `linear_sum_assignment` in tests/design/test_match.py.
    """
    for g in range(ghosts):
        held[g] = -1
        if count < ghosts:
            # a ghost that nobody takes must be free
            price[g] = 0.0
    for t in range(count):
        chosen[t] = -1
    # each takes its best ghost, whoever has it, and makes it as dear as its second best
    fights = 0
    for first in range(count):
        t = first
        while t >= 0 and fights < _FIGHTS * count:
            fights += 1
            best, second, at, other = np.inf, np.inf, 0, -1
            for g in range(ghosts):
                away = cost[t, g] - price[g]
                if away < second:
                    if away < best:
                        second, other = best, at
                        best, at = away, g
                    else:
                        second, other = away, g
            if best < second < np.inf:
                price[at] -= second - best
            elif held[at] >= 0:
                # two are as good: a fight would have no end
                if other < 0 or held[other] >= 0:
                    break
                at = other
            t, held[at] = held[at], t
            chosen[held[at]] = at
            if t >= 0:
                chosen[t] = -1
    for t in range(count):
        if chosen[t] < 0:
            _augment(t, cost, ghosts, chosen, price, held, way, least, seen)


@inner
def _augment(target, cost, ghosts, chosen, price, held, way, least, seen):
    """Find a ghost for one target at least cost, others making room."""
    for g in range(ghosts):
        least[g], way[g], seen[g] = cost[target, g] - price[g], target, False
    while True:
        here, shortest = -1, np.inf
        for g in range(ghosts):
            if not seen[g] and least[g] < shortest:
                shortest, here = least[g], g
        if held[here] < 0:
            break
        seen[here] = True
        t = held[here]
        offset = shortest - (cost[t, here] - price[here])
        for g in range(ghosts):
            away = cost[t, g] - price[g] + offset
            if not seen[g] and away < least[g]:
                least[g], way[g] = away, t
    for g in range(ghosts):
        if seen[g]:
            price[g] += least[g] - shortest
    while True:
        t = way[here]
        held[here] = t
        here, chosen[t] = chosen[t], here
        if t == target:
            break


@compiled
def match(cost, chosen):
    """Give each target a ghost of its own so that the sum of costs is least.

    Parameters
    ----------
    cost : ndarray, shape (N, G), float64
        Finite, N <= G.
    chosen : ndarray, shape (N,), int64
        Filled: the ghost of each target.
    """
    count, ghosts = cost.shape
    assign(
        cost, count, ghosts, chosen, np.zeros(ghosts), np.empty(ghosts, np.int64), np.empty(ghosts, np.int64),
        np.empty(ghosts), np.empty(ghosts, np.bool_),
    )  # fmt: skip
