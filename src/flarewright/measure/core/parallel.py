"""Run work in threads. Small pieces are grouped into one task per thread, as submitting a task costs as much as one."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

Result = TypeVar("Result")


def map_batched(work: Callable[..., Result], *given: Sequence[Any], pool: ThreadPoolExecutor | None) -> list[Result]:
    """Apply a function to many small pieces of work, in one task per thread; return the results in order.

    Parameters
    ----------
    work : callable
        Takes one item of each sequence in `given`.
    *given : sequence
        All of equal length.
    pool : executor or None
        None: run in the calling thread.
    """
    if pool is None:
        return list(map(work, *given))
    pieces = list(zip(*given, strict=True))
    # neighbours are about equally large: strided tasks share small and large pieces evenly
    tasks = min(os.cpu_count() or 1, len(pieces))
    parts = pool.map(lambda first: [work(*piece) for piece in pieces[first::tasks]], range(tasks))
    out: list[Result | None] = [None] * len(pieces)
    for first, made in enumerate(parts):
        out[first::tasks] = made
    return out  # type: ignore[return-value]


def done_by(pool: ThreadPoolExecutor, work: Callable[..., Result], *given: Sequence[Any]) -> list[Result]:
    """Apply a function to large pieces of work, one task each; return the results in order."""
    return list(pool.map(work, *given))


def dealt_out(work: Callable[[int, int], None], count: int, pool: ThreadPoolExecutor | None) -> None:
    """Run a kernel that loops over pieces itself, in one task per thread; each task takes every n-th piece.

    Parameters
    ----------
    work : callable
        Takes the index of the first piece and the stride to the next.
    count : int
        Number of pieces.
    pool : executor or None
        None: one call in the calling thread.
    """
    tasks = 1 if pool is None else min(os.cpu_count() or 1, count)
    if pool is None or tasks < 2:
        work(0, 1)
        return
    for _ in pool.map(lambda first: work(first, tasks), range(tasks)):
        pass


def run_concurrently(*works: Callable[[], Result], pool: ThreadPoolExecutor | None) -> list[Result]:
    """Run some large pieces of work concurrently; return their results in order.

    While one waits for the last of its small pieces, the pool works on those of the others.

    Parameters
    ----------
    *works : callable
        Each may submit small pieces to the pool.
    pool : executor or None
        None: run one after the other.
    """
    if pool is None:
        return [work() for work in works]
    # in separate threads: in threads of the pool they would deadlock with the pieces that they submit
    with ThreadPoolExecutor(len(works)) as beside:
        return list(beside.map(lambda work: work(), works))
