"""Turns of requests on a few threads: a bound on what waits, and an end for what no page awaits any more."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable, Coroutine
from typing import Any, TypeVar

from anyio import CapacityLimiter, to_thread

T = TypeVar("T")


class Crowded(Exception):  # noqa: N818 (a state of the server, not a mistake)
    """Raised when too many requests wait already."""


class Turns:
    """Run the work of requests on threads, in the order in which they came.

    Parameters
    ----------
    threads : int
        Number of works at the same time.
    waiting : int
        Number of further ones that may wait; more are refused, so that no client fills the memory.
    """

    def __init__(self, threads: int, waiting: int) -> None:
        self._slots, self._most, self._asked = asyncio.Semaphore(threads), threads + waiting, 0
        # a thread of a cancelled work runs to its end beside the next one
        self._limiter: CapacityLimiter | None = None
        self._awaited: set[threading.Event] = set()

    def end(self) -> None:
        """Report to all works that no client awaits them any more."""
        for left in tuple(self._awaited):
            left.set()

    async def run(self, work: Callable[[], T]) -> T:
        """Wait for a turn, and return the result of the work.

        A cancelled work that waits is dropped. One that runs is left to itself, as threads cannot be ended: cancel it
        only when the server ends.
        """
        if self._asked >= self._most:
            raise Crowded
        self._asked += 1
        try:
            async with self._slots:
                self._limiter = self._limiter or CapacityLimiter(1000)
                return await to_thread.run_sync(work, abandon_on_cancel=True, limiter=self._limiter)
        finally:
            self._asked -= 1

    async def run_for(
        self, work: Callable[[threading.Event], T], gone: Callable[[], Coroutine[Any, Any, None]]
    ) -> T | None:
        """Run a work unless its client leaves before its turn.

        Parameters
        ----------
        work : callable
            Given an event that is set when the client leaves, or the server ends.
        gone : callable
            Coroutine function that returns when the client leaves.

        Returns
        -------
        object
            Result of the work; None: the client left first.
        """
        left, started = threading.Event(), threading.Event()
        self._awaited.add(left)

        def begin() -> T:
            started.set()
            return work(left)

        answer = asyncio.ensure_future(self.run(begin))
        watch = asyncio.ensure_future(gone())
        try:
            await asyncio.wait((answer, watch), return_when=asyncio.FIRST_COMPLETED)
            if not answer.done():
                left.set()
                if not started.is_set():
                    return None
            return await asyncio.shield(answer)
        finally:
            left.set()
            self._awaited.discard(left)
            watch.cancel()
            answer.cancel()
