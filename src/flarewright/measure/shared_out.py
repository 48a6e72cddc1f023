"""Pieces of work in threads: small ones one task a thread, for to hand a task over takes as long as some pieces do."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

Made = TypeVar("Made")


def shared_out(work: Callable[..., Made], *given: Sequence[Any], pool: ThreadPoolExecutor | None) -> list[Made]:
    """Return what is made of each piece, in their order.

    Parameters
    ----------
    work : callable
        Takes one piece of each of `given`.
    *given : sequence
        As long as each other.
    pool : executor or None
        None: everything is done here.
    """
    if pool is None:
        return list(map(work, *given))
    pieces = list(zip(*given, strict=True))
    # neighbours are about as large as each other: every task gets its share of small and large ones
    tasks = min(os.cpu_count() or 1, len(pieces))
    parts = pool.map(lambda first: [work(*piece) for piece in pieces[first::tasks]], range(tasks))
    out: list[Made | None] = [None] * len(pieces)
    for first, made in enumerate(parts):
        out[first::tasks] = made
    return out  # type: ignore[return-value]


def done_by(pool: ThreadPoolExecutor, work: Callable[..., Made], *given: Sequence[Any]) -> list[Made]:
    """Return what is made of each piece, in their order: large ones, one task each."""
    return list(pool.map(work, *given))


def dealt_out(work: Callable[[int, int], None], count: int, pool: ThreadPoolExecutor | None) -> None:
    """Have pieces of work done by kernels that are told which: from the first one on, every so many.

    Parameters
    ----------
    work : callable
        Takes the first piece and how many it is to the next.
    count : int
        Pieces.
    pool : executor or None
        None: everything is done here, in one call.
    """
    tasks = 1 if pool is None else min(os.cpu_count() or 1, count)
    if pool is None or tasks < 2:
        work(0, 1)
        return
    for _ in pool.map(lambda first: work(first, tasks), range(tasks)):
        pass


def side_by_side(*works: Callable[[], Made], pool: ThreadPoolExecutor | None) -> list[Made]:
    """Return what some large pieces of work make, in their order.

    While one waits for the last of the small pieces that it shares out, the others' are done.

    Parameters
    ----------
    *works : callable
        Each may share out small pieces to the pool.
    pool : executor or None
        None: one after the other.
    """
    if pool is None:
        return [work() for work in works]
    # in threads of their own: in the pool's they would wait for pieces that wait for them
    with ThreadPoolExecutor(len(works)) as beside:
        return list(beside.map(lambda work: work(), works))
