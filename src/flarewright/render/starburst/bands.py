"""Work on a picture in bands of rows, on several threads.

A float64 copy of a whole picture costs more time to clear than to fill, and the copies of a band stay in the cache.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor

BAND = 64
"""Rows of pixels that a thread draws at a time."""


def in_threads(work: Callable[[int], None], items: Iterable[int], threads: int | None) -> None:
    """Apply a function to every item: in this thread if `threads` is 1, else in several; None: all cores."""
    if threads == 1:
        for item in items:
            work(item)
        return
    with ThreadPoolExecutor(threads) as pool:
        for _ in pool.map(work, items):
            pass
