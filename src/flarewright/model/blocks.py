"""Numbers of a sprite's blocks of cells, for each interval between two of its pictures."""

from __future__ import annotations

from functools import cached_property
from math import prod
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

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

    # bytes of each block, and what is said of them when there are more or fewer
    count: ClassVar[int]
    what: ClassVar[str]

    block: int = Field(ge=1)
    intervals: int = Field(ge=1)
    rows: int = Field(ge=1)
    columns: int = Field(ge=1)
    numbers: str

    @model_validator(mode="after")
    def _fits(self) -> Blocks:
        self._sound(self.bytes_of_blocks)
        return self

    def _sound(self, numbers: NDArray[np.uint8]) -> None:
        """Raise ValueError where bytes, shape (intervals, rows, columns, count), are none of this kind."""

    @cached_property
    def bytes_of_blocks(self) -> NDArray[np.uint8]:
        """Shape (intervals, rows, columns, count)."""
        shape = self.intervals, self.rows, self.columns, self.count
        return np.frombuffer(read_bytes(self.numbers, prod(shape), self.what), np.uint8).reshape(shape)
