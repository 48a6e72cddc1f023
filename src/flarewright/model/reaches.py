"""How far light goes between the pictures of a sprite that follows ghosts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .blocks import Blocks
from .bytes_text import told_bytes

ANYWHERE = 255
"""Reach of light that may come from anywhere."""


class Reaches(Blocks):
    """How far one has to look, in the pictures before and after, for light as dark and for light as bright.

    Attributes
    ----------
    block, intervals, rows, columns
        As of `Blocks`.
    numbers : str
        As of `Blocks`: cells to each side, of what is darker than around and of what is brighter, from one picture to
        the next; 255: it may come from anywhere.
    """

    count = 2
    what = "the reaches of a sprite"

    def within(self, interval: int) -> NDArray[np.uint8]:
        """Return the reaches of an interval, shape (rows, columns, 2): cells, or `ANYWHERE`."""
        return np.asarray(self.bytes_of_blocks[interval])


def packed_reaches(block: int, cells: NDArray[np.int64]) -> Reaches:
    """Return reaches as a file holds them.

    Parameters
    ----------
    block : int
        Cells.
    cells : ndarray, shape (intervals, rows, columns, 2)
        As `Reaches.within`.
    """
    intervals, rows, columns, _ = cells.shape
    text = told_bytes(cells.astype(np.uint8).tobytes())
    return Reaches(block=block, intervals=intervals, rows=rows, columns=columns, numbers=text)
