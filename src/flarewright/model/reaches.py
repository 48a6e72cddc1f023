"""How far light goes between the pictures of a sprite that follows ghosts."""

from __future__ import annotations

from math import prod

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from .base import Frozen
from .bytes_text import read_bytes, told_bytes

ANYWHERE = 255
"""Reach of light that may come from anywhere."""


class Reaches(Frozen):
    """How far one has to look, in the pictures before and after, for light as dark and for light as bright.

    Attributes
    ----------
    block : int
        Cells to each side of a block.
    intervals, rows, columns : int
        Pictures of the sprite less one, and blocks that cover its cells.
    numbers : str
        Base64 of zlib of bytes in the order interval, row, column, number: cells to each side, of what is darker than
        around and of what is brighter, from one picture to the next; 255: it may come from anywhere.
    """

    block: int = Field(ge=1)
    intervals: int = Field(ge=1)
    rows: int = Field(ge=1)
    columns: int = Field(ge=1)
    numbers: str

    @model_validator(mode="after")
    def _fits(self) -> Reaches:
        self._read()
        return self

    def _read(self) -> NDArray[np.uint8]:
        shape = self.intervals, self.rows, self.columns, 2
        return np.frombuffer(read_bytes(self.numbers, prod(shape), "the reaches of a sprite"), np.uint8).reshape(shape)

    def within(self, interval: int) -> NDArray[np.uint8]:
        """Return the reaches of an interval, shape (rows, columns, 2): cells, or `ANYWHERE`."""
        return np.asarray(self._read()[interval])


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
