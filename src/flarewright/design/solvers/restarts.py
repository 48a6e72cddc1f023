"""Independent searches of one problem: their seeds, and the state that holds the best minima of all."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .polish import merge_pools
from .pool_search import KEPT, PoolState


def restart_seed(seed: int, number: int) -> int:
    """Return the seed of an independent search.

    Parameters
    ----------
    seed : int
    number : int
        From 0; the first one is the search without restarts.

    Examples
    --------
    >>> restart_seed(7, 0), restart_seed(7, 1) != restart_seed(7, 2)
    (7, True)
    """
    return int(np.random.SeedSequence([seed, number]).generate_state(1)[0]) if number else seed


def merged(seed: int, states: Sequence[PoolState]) -> PoolState:
    """Return one state with the best minima of several searches.

    Parameters
    ----------
    seed : int
    states : sequence of PoolState
        In the order of their numbers, so that equal minima are those of the first one, whichever ended first.

    Returns
    -------
    PoolState
        Searches and seconds are sums.
    """
    best = merge_pools((), [one for state in states for one in state.ended], KEPT)
    for state in states:
        for run in state.runs:
            best = merge_pools(best, run.members, KEPT)
    return PoolState(
        seed, ended=best, searches=sum(one.searches for one in states), seconds=sum(one.seconds for one in states),
        restarts=len(states),
    )  # fmt: skip


def so_far(seed: int, states: Sequence[PoolState]) -> PoolState:
    """Return the sums of several searches with the best minimum only, to show while they run."""
    found = [one.best for one in states if one.best is not None]
    return PoolState(
        seed, ended=(min(found, key=lambda one: one.cost),) if found else (),
        searches=sum(one.searches for one in states), seconds=sum(one.seconds for one in states), restarts=len(states),
    )  # fmt: skip
