"""Which ghost stands for which target: the assignment of least cost."""

import numpy as np

from ._jit import compiled, inner


@inner
def assign(cost, count, ghosts, chosen, potential, held, way, least, seen):
    """Give each target a ghost of its own so that the sum of costs is least.

    Parameters
    ----------
    cost : ndarray, shape (>= count, >= ghosts)
        Finite.
    count, ghosts : int
        Targets and ghosts; count <= ghosts.
    chosen : ndarray, shape (>= count,), int64
        Filled: the ghost of each target.
    potential : ndarray, shape (2, >= ghosts + 1)
    held, way : ndarray, shape (>= ghosts + 1,), int64
    least : ndarray, shape (>= ghosts + 1,)
    seen : ndarray, shape (>= ghosts + 1,), bool
        Working space.

    Notes
    -----
    Shortest augmenting paths with potentials (Kuhn 1955; Munkres 1957; Jonker and Volgenant 1987), count^2 ghosts
    steps. Compared with scipy's `linear_sum_assignment` in tests/design/test_match.py.
    """
    for g in range(ghosts + 1):
        potential[0, g], potential[1, g] = 0.0, 0.0
        # 0 is nobody: targets and ghosts are counted from 1
        held[g] = 0
    for t in range(1, count + 1):
        held[0] = t
        here = 0
        for g in range(ghosts + 1):
            least[g], seen[g] = np.inf, False
        while True:
            seen[here] = True
            target, nearest, step = held[here], 0, np.inf
            for g in range(1, ghosts + 1):
                if not seen[g]:
                    away = cost[target - 1, g - 1] - potential[0, target] - potential[1, g]
                    if away < least[g]:
                        least[g], way[g] = away, here
                    if least[g] < step:
                        step, nearest = least[g], g
            for g in range(ghosts + 1):
                if seen[g]:
                    potential[0, held[g]] += step
                    potential[1, g] -= step
                else:
                    least[g] -= step
            here = nearest
            if held[here] == 0:
                break
        while here != 0:
            before = way[here]
            held[here] = held[before]
            here = before
    for g in range(1, ghosts + 1):
        if held[g] > 0:
            chosen[held[g] - 1] = g - 1


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
        cost, count, ghosts, chosen, np.empty((2, ghosts + 1)), np.empty(ghosts + 1, np.int64),
        np.empty(ghosts + 1, np.int64), np.empty(ghosts + 1), np.empty(ghosts + 1, np.bool_),
    )  # fmt: skip
