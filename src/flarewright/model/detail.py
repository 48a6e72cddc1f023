"""What a sprite that follows ghosts is too coarse for: its cells divided, and how far that is carried."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from .blocks import Blocks
from .bytes_text import read_bytes, told_bytes

# how fast steps between the numbers of bright detail grow
_RATIO = 0.15
# a share of 1
_WHOLE = 255.0
# ways to go from one picture to the next: it stays, it goes with what is left, or with all light
WAYS = 3


class Detail(Blocks):
    """What is finer than a sprite's cells, for each of its pictures.

    Attributes
    ----------
    block, intervals, rows, columns
        As of `Blocks`, in cells of the sprite; the blocks of its `Moves`.
    parts : int
        Cells of detail along each side of a cell of the sprite.
    unit : float
        Radiance of a faint cell's step.
    cells : tuple of str
        Of each picture base64 of zlib of signed bytes in the order row, column, red-green-blue. n stands for
        unit (exp(0.15 n) - 1) / 0.15, and -n for as much below 0.
    numbers : str
        As of `Blocks`: in which way detail goes from one picture to the next (0: it stays; 1, 2: as the `Moves` of what
        is left, of all light, tell), and how much of it is there halfway, of 255.
    """

    count = 2
    what = "the blocks of a sprite's detail"

    parts: int = Field(ge=2)
    unit: float = Field(gt=0.0)
    cells: tuple[str, ...]

    def _sound(self, numbers: NDArray[np.uint8]) -> None:
        if len(self.cells) != self.intervals + 1:
            raise ValueError("the detail of a sprite must have one picture more than intervals")
        if (numbers[..., 0] >= WAYS).any():
            raise ValueError(f"ways in the detail of a sprite must be below {WAYS}")

    def check(self, rows: int, columns: int) -> None:
        """Raise ValueError unless the pictures divide so many cells of a sprite."""
        for picture in range(len(self.cells)):
            self._bytes_of(picture, rows, columns)

    def ways(self, interval: int) -> NDArray[np.int64]:
        """Return in which way each block's detail goes, shape (rows, columns)."""
        return self.bytes_of_blocks[interval, ..., 0].astype(np.int64)

    def shares(self, interval: int) -> NDArray[np.float64]:
        """Return how much of each block's detail is there halfway, shape (rows, columns)."""
        return np.asarray(self.bytes_of_blocks[interval, ..., 1] / _WHOLE)

    def picture(self, index: int, rows: int, columns: int) -> NDArray[np.float32]:
        """Return the detail of one picture of a sprite of so many cells, shape (parts rows, parts columns, 3)."""
        table = _values(np.arange(256, dtype=np.uint8).view(np.int8), self.unit)
        found: NDArray[np.float32] = table[self._bytes_of(index, rows, columns)]
        return found.reshape(self.parts * rows, self.parts * columns, 3)

    def _bytes_of(self, index: int, rows: int, columns: int) -> NDArray[np.uint8]:
        size = 3 * self.parts**2 * rows * columns
        return np.frombuffer(read_bytes(self.cells[index], size, "the detail of a sprite"), np.uint8)


def _values(numbers: NDArray[np.int8], unit: float) -> NDArray[np.float32]:
    signed = numbers.astype(np.float64)
    return np.asarray(np.sign(signed) * np.expm1(_RATIO * np.abs(signed)) * (unit / _RATIO), dtype=np.float32)


def told_detail(picture: NDArray[np.float32], unit: float) -> tuple[str, NDArray[np.float32]]:
    """Return detail as a file holds it, and what that stands for.

    Parameters
    ----------
    picture : ndarray, shape (parts rows, parts columns, 3)
        Radiance.
    unit : float
    """
    size = np.log1p(np.abs(picture) * (_RATIO / unit)) / _RATIO
    numbers = np.rint(np.copysign(np.minimum(size, 127.0), picture)).astype(np.int8)
    return told_bytes(numbers.tobytes()), _values(numbers, unit)


def packed_detail(
    block: int, parts: int, unit: float, cells: tuple[str, ...], ways: NDArray[np.int64], shares: NDArray[np.float64]
) -> Detail:
    """Return detail as a file holds it.

    Parameters
    ----------
    block : int
        Cells of the sprite.
    parts : int
    unit : float
    cells : tuple of str
        From `told_detail`.
    ways, shares : ndarray, shape (intervals, rows, columns)
        As `Detail.ways` and `Detail.shares`.
    """
    intervals, rows, columns = ways.shape
    numbers = np.stack([ways, np.rint(_WHOLE * shares)], axis=-1).astype(np.uint8)
    return Detail(
        block=block, intervals=intervals, rows=rows, columns=columns, numbers=told_bytes(numbers.tobytes()),
        parts=parts, unit=unit, cells=cells,
    )  # fmt: skip
