"""Numbers of a sprite's blocks of cells, for each interval between two of its pictures."""

from __future__ import annotations

from math import prod

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from .base import Frozen
from .bytes_text import read_bytes


class Blocks(Frozen):
    """Bytes of blocks of cells that lie side by side.

    Attributes
    ----------
    block : int
        Cells to each side of a block.
    intervals, rows, columns : int
        Pictures of the sprite less one, and blocks that cover its cells.
    numbers : str
        Base64 of zlib of bytes in the order interval, row, column, number.
    """

    block: int = Field(ge=1)
    intervals: int = Field(ge=1)
    rows: int = Field(ge=1)
    columns: int = Field(ge=1)
    numbers: str

    def read(self, count: int, what: str) -> NDArray[np.uint8]:
        """Return the bytes, so many of each block, shape (intervals, rows, columns, count).

        Raises
        ------
        ValueError
            When there are more or fewer; `what` is said of them.
        """
        shape = self.intervals, self.rows, self.columns, count
        return np.frombuffer(read_bytes(self.numbers, prod(shape), what), np.uint8).reshape(shape)
