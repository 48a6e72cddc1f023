"""Assign ghosts to targets at least total cost."""

import numpy as np

from ..jit.decorators import compiled, inner

# bids per target in the row reduction before the search for augmenting paths
_BIDS = 4


@inner
def assign(cost, count, ghosts, chosen, price, held, way, least, seen):
    """Assign each target a different ghost so that the sum of costs is least.

    Parameters
    ----------
    cost : ndarray, shape (>= count, >= ghosts)
        Finite.
    count, ghosts : int
        Targets and ghosts; count <= ghosts.
    chosen : ndarray, shape (>= count,), int64
        Filled: the ghost of each target.
    price : ndarray, shape (>= ghosts,)
        Dual price of each ghost, changed. With as many targets as ghosts, the prices of a similar assignment speed up
        this one.
    held, way : ndarray, shape (>= ghosts,), int64
    least : ndarray, shape (>= ghosts,)
    seen : ndarray, shape (>= ghosts,), bool
        Working space.

    Notes
    -----
    Augmenting row reduction, then shortest augmenting paths (Jonker and Volgenant 1987). Compared with scipy's
    `linear_sum_assignment` in tests/kernels/design/test_assignment.py.
    """
    for g in range(ghosts):
        held[g] = -1
        if count < ghosts:
            # the price of an unassigned ghost must be 0
            price[g] = 0.0
    for t in range(count):
        chosen[t] = -1
    # each target bids for its best ghost, even if assigned, and raises its price to that of its second best
    bids = 0
    for first in range(count):
        t = first
        while t >= 0 and bids < _BIDS * count:
            bids += 1
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
                # best and second best are equal: bidding on would not terminate
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
    """Assign one more target by a shortest augmenting path."""
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
    """Assign each target a different ghost so that the sum of costs is least (`assign`, for Python).

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
