"""What pictures keep for the next one: things by key, and arrays laid side by side in one block of memory."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable, Sequence
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

Singles = NDArray[np.float32]
T = TypeVar("T")


class Kept:
    """The last things that were made, by key, up to a size; threads may share it.

    What it holds depends on the order of the work, what it returns does not.

    Parameters
    ----------
    most : int
        Of the sizes of all that is held, in whatever unit `made` is told.
    """

    def __init__(self, most: int) -> None:
        self._most, self._size = most, 0
        self._held: OrderedDict[Hashable, tuple[Any, int]] = OrderedDict()
        self._lock = threading.Lock()

    def made(self, key: Hashable, make: Callable[[], T], size: Callable[[T], int] = lambda _: 1) -> T:
        """Return what is held under a key, or make and hold it, and let go of what was asked for longest ago.

        Parameters
        ----------
        key : hashable
            Stands for one thing.
        make : callable
            Threads that ask at once may each make one; all get the first.
        size : callable
            Of what was made.
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
            while self._size > self._most and len(self._held) > 1:
                _, (_, freed) = self._held.popitem(last=False)
                self._size -= freed
        return found


class Shelf:
    """Arrays laid one after the other, each once, so that a kernel finds any of them in one; threads may share it.

    Parameters
    ----------
    most : int
        Numbers that a block holds. When it is full the next one is begun; what was handed out stays as it is.
    """

    def __init__(self, most: int) -> None:
        self._most, self._used = most, 0
        self._block = np.empty(0, dtype=np.float32)
        # what lies there is held here too, so that no other array gets its number
        self._places: dict[int, tuple[int, Singles]] = {}
        self._lock = threading.Lock()

    def laid(self, parts: Sequence[Singles]) -> tuple[Singles, list[int]]:
        """Return a block that holds some arrays, shape (P,) each, never changed, and where each of them begins."""
        with self._lock:
            new = {id(part): part for part in parts if id(part) not in self._places}
            if self._used + sum(part.size for part in new.values()) > self._block.size:
                new = {id(part): part for part in parts}
                count = sum(part.size for part in new.values())
                self._block, self._used, self._places = np.empty(max(count, self._most), dtype=np.float32), 0, {}
            for number, part in new.items():
                # what is written here nobody has been told of yet
                self._block[self._used : self._used + part.size] = part
                self._places[number] = self._used, part
                self._used += part.size
            return self._block, [self._places[id(part)][0] for part in parts]
