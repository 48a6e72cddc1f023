"""Small pieces of work in threads: one task a thread, for to hand a task over takes as long as some pieces do."""

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
