"""Numbers per block of a sprite's cells, for each interval between two of its pictures."""

from __future__ import annotations

from functools import cached_property
from math import prod
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from ..base import Frozen
from ..bytes_text import decode_bytes


class Blocks(Frozen):
    """Bytes per block; blocks tile the cells of a sprite.

    Attributes
    ----------
    block : int
        Cells along each side of a block.
    intervals, rows, columns : int
        Number of the sprite's pictures minus one, and numbers of blocks that cover its cells.
    numbers : str
        Base64 of zlib of bytes in the order interval, row, column, number.
    """

    # bytes per block, and the noun for error messages
    count: ClassVar[int]
    what: ClassVar[str]

    block: int = Field(ge=1)
    intervals: int = Field(ge=1)
    rows: int = Field(ge=1)
    columns: int = Field(ge=1)
    numbers: str

    @model_validator(mode="after")
    def _fits(self) -> Blocks:
        self._check_numbers(self.bytes_of_blocks)
        return self

    def _check_numbers(self, numbers: NDArray[np.uint8]) -> None:
        """Raise ValueError where bytes, shape (intervals, rows, columns, count), are invalid for this class."""

    @cached_property
    def bytes_of_blocks(self) -> NDArray[np.uint8]:
        """Shape (intervals, rows, columns, count)."""
        shape = self.intervals, self.rows, self.columns, self.count
        return np.frombuffer(decode_bytes(self.numbers, prod(shape), self.what), np.uint8).reshape(shape)
