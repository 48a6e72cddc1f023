"""Blocks of memory that hold many tables, so that a kernel reads several of them from one array."""

from __future__ import annotations

import threading
from collections.abc import Sequence

import numpy as np

from ...typing import Pixels


class TableBlocks:
    """Memory for tables, one after another in a block; safe to share between threads.

    A block is freed with the last table in it. The system gives it memory as tables fill it.

    Parameters
    ----------
    capacity : int
        Number of values in a block; a larger table gets a block of its size.
    """

    def __init__(self, capacity: int) -> None:
        self._capacity, self._used = capacity, 0
        self._block = np.empty(0, dtype=np.float32)
        self._lock = threading.Lock()

    def joined(self, parts: Sequence[Pixels]) -> Pixels:
        """Copy arrays, one after another, into a block; return their values, shape (V,), a view of the block."""
        count = sum(part.size for part in parts)
        with self._lock:
            if self._used + count > self._block.size:
                self._block, self._used = np.empty(max(count, self._capacity), dtype=np.float32), 0
            values = self._block[self._used : self._used + count]
            self._used += count
        # no other caller has this part of the block
        np.concatenate([part.ravel() for part in parts], out=values)
        return values


def common_block(tables: Sequence[Pixels]) -> tuple[Pixels, list[int]] | None:
    """Return the block that holds all of some tables, and the index of the first value of each.

    Parameters
    ----------
    tables : sequence of ndarray, shape (V,), float32

    Returns
    -------
    tuple of (ndarray, list of int), or None
        None if they lie in several blocks, or in none.

    Examples
    --------
    >>> blocks = TableBlocks(100)
    >>> one, two = blocks.joined([np.ones(3, np.float32)]), blocks.joined([np.zeros(2, np.float32)])
    >>> block, starts = common_block([two, one])
    >>> starts
    [3, 0]
    """
    block = tables[0].base
    # tables of a picture are views too, of rows and columns that are no block
    if not isinstance(block, np.ndarray) or block.ndim != 1 or any(table.base is not block for table in tables):
        return None
    first = _address(block)
    return block, [(_address(table) - first) // block.itemsize for table in tables]


def _address(values: Pixels) -> int:
    return int(values.__array_interface__["data"][0])
