"""Memory that is kept from one picture to the next: to get it anew takes the system as long as a ghost to be drawn."""

from __future__ import annotations

import threading
from math import prod

import numpy as np

from .numbers import Floats


class Room(threading.local):
    """Every thread's own memory."""

    def __init__(self) -> None:
        self._numbers: Floats = np.empty(0)

    def some(self, size: int) -> Floats:
        """Return so many numbers, whatever they are, that hold until the thread asks again."""
        if self._numbers.size < size:
            self._numbers = np.empty(size)
        return self._numbers[:size]

    def zeros(self, *shape: int) -> Floats:
        """Return zeros that hold until the thread asks again."""
        found = self.some(prod(shape)).reshape(shape)
        found[...] = 0.0
        return found
