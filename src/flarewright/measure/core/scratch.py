"""Working memory that is reused from picture to picture. Allocating it takes as long as drawing a ghost."""

from __future__ import annotations

import threading
from math import prod

import numpy as np

from ...typing import Floats


class ScratchBuffer(threading.local):
    """Working memory, separate for each thread."""

    def __init__(self) -> None:
        self._numbers: Floats = np.empty(0)

    def some(self, size: int) -> Floats:
        """Return uninitialized numbers, shape (size,), valid until the next call in this thread."""
        if self._numbers.size < size:
            self._numbers = np.empty(size)
        return self._numbers[:size]

    def zeros(self, *shape: int) -> Floats:
        """Return zeros, valid until the next call in this thread."""
        found = self.some(prod(shape)).reshape(shape)
        found[...] = 0.0
        return found
