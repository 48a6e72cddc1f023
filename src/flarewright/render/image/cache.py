"""Caches between pictures: results by key, and arrays joined in one block of memory."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable, Sequence
from typing import Any, TypeVar, cast

import numpy as np

from ...typing import Pixels

T = TypeVar("T")


class Kept:
    """A cache of results by key with least-recently-used eviction; safe to share between threads.

    Its content depends on the order of the calls, its return values do not.

    Parameters
    ----------
    most : int
        Largest total size, in the unit of the `size` argument of `made`.
    """

    def __init__(self, capacity: int) -> None:
        self._capacity, self._size = capacity, 0
        self._held: OrderedDict[Hashable, tuple[Any, int]] = OrderedDict()
        self._lock = threading.Lock()

    def made(self, key: Hashable, make: Callable[[], T], size: Callable[[T], int] = lambda _: 1) -> T:
        """Return the cached value of a key, or compute and cache it; then evict the least recently used values.

        Parameters
        ----------
        key : hashable
            Determines the value.
        make : callable
            Computes the value. Concurrent threads may each compute it; all get the first result.
        size : callable
            Returns the size of the value.
        """
        with self._lock:
            if key in self._held:
                self._held.move_to_end(key)
                return cast(T, self._held[key][0])
        new = make()
        with self._lock:
            if key not in self._held:
                self._held[key] = (new, size(new))
                self._size += self._held[key][1]
            found = cast(T, self._held[key][0])
            while self._size > self._capacity and len(self._held) > 1:
                _, (_, freed) = self._held.popitem(last=False)
                self._size -= freed
        return found


class BufferPool:
    """Arrays joined in one block, each once, so that a kernel reads all of them from one array; safe to share.

    Parameters
    ----------
    most : int
        Length of a block. When it is full, a new one is allocated; earlier return values stay valid.
    """

    def __init__(self, capacity: int) -> None:
        self._capacity, self._used = capacity, 0
        self._block = np.empty(0, dtype=np.float32)
        # holding the arrays keeps their ids from being reused
        self._places: dict[int, tuple[int, Pixels]] = {}
        self._lock = threading.Lock()

    def laid(self, parts: Sequence[Pixels]) -> tuple[Pixels, list[int]]:
        """Return a block that contains the given arrays, shape (P,) each and constant, and the start of each."""
        with self._lock:
            new = {id(part): part for part in parts if id(part) not in self._places}
            if self._used + sum(part.size for part in new.values()) > self._block.size:
                new = {id(part): part for part in parts}
                count = sum(part.size for part in new.values())
                self._block, self._used, self._places = np.empty(max(count, self._capacity), dtype=np.float32), 0, {}
            for number, part in new.items():
                # no caller has been given this part of the block yet
                self._block[self._used : self._used + part.size] = part
                self._places[number] = self._used, part
                self._used += part.size
            return self._block, [self._places[id(part)][0] for part in parts]
