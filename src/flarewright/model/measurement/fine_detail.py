"""Detail finer than the cells of a ghost-following sprite, and how it moves between pictures."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from ...typing import Floats, Indices, Pixels
from ..bytes_text import decode_bytes, encode_bytes
from .block_values import Blocks

# growth rate of the quantization steps with brightness
_GROWTH = 0.15
# byte that encodes a share of 1
_FULL_SHARE = 255.0
# interpolation modes: static, moving with the residual, moving with all light
WAYS = 3


class Detail(Blocks):
    """Detail finer than a sprite's cells, for each of its pictures.

    Attributes
    ----------
    block, intervals, rows, columns
        As in `Blocks`, in cells of the sprite; the same blocks as its `Moves`.
    parts : int
        Detail cells along each side of a sprite cell.
    unit : float
        Radiance of the smallest quantization step.
    cells : tuple of str
        One per picture: base64 of zlib of signed bytes in the order row, column, red-green-blue. n encodes
        unit (exp(0.15 n) - 1) / 0.15, and -n its negative.
    numbers : str
        As in `Blocks`: the interpolation mode of each block (0: static; 1, 2: moves as the `Moves` of the residual, of
        all light), and the share of the detail that is kept halfway, of 255.
    """

    count = 2
    what = "the blocks of a sprite's detail"

    parts: int = Field(ge=2)
    unit: float = Field(gt=0.0)
    cells: tuple[str, ...]

    def _check_numbers(self, numbers: NDArray[np.uint8]) -> None:
        if len(self.cells) != self.intervals + 1:
            raise ValueError("the detail of a sprite must have one picture more than intervals")
        if (numbers[..., 0] >= WAYS).any():
            raise ValueError(f"ways in the detail of a sprite must be below {WAYS}")

    def check(self, rows: int, columns: int) -> None:
        """Raise ValueError unless every picture has the size for `rows` x `columns` sprite cells."""
        for picture in range(len(self.cells)):
            self._bytes_of(picture, rows, columns)

    def ways(self, interval: int) -> Indices:
        """Return the interpolation mode of each block, shape (rows, columns)."""
        return self.bytes_of_blocks[interval, ..., 0].astype(np.int64)

    def shares(self, interval: int) -> Floats:
        """Return the share of each block's detail that is kept halfway, shape (rows, columns)."""
        return np.asarray(self.bytes_of_blocks[interval, ..., 1] / _FULL_SHARE)

    def picture(self, index: int, rows: int, columns: int) -> Pixels:
        """Return one picture for `rows` x `columns` sprite cells, shape (parts rows, parts columns, 3)."""
        table = _values(np.arange(256, dtype=np.uint8).view(np.int8), self.unit)
        found: Pixels = table[self._bytes_of(index, rows, columns)]
        return found.reshape(self.parts * rows, self.parts * columns, 3)

    def _bytes_of(self, index: int, rows: int, columns: int) -> NDArray[np.uint8]:
        size = 3 * self.parts**2 * rows * columns
        return np.frombuffer(decode_bytes(self.cells[index], size, "the detail of a sprite"), np.uint8)


def _values(numbers: NDArray[np.int8], unit: float) -> Pixels:
    signed = numbers.astype(np.float64)
    return np.asarray(np.sign(signed) * np.expm1(_GROWTH * np.abs(signed)) * (unit / _GROWTH), dtype=np.float32)


def reported_detail(picture: Pixels, unit: float) -> tuple[str, Pixels]:
    """Return the file text of detail, and the radiance that the text encodes.

    Parameters
    ----------
    picture : ndarray, shape (parts rows, parts columns, 3)
        Radiance.
    unit : float
    """
    size = np.log1p(np.abs(picture) * (_GROWTH / unit)) / _GROWTH
    numbers = np.rint(np.copysign(np.minimum(size, 127.0), picture)).astype(np.int8)
    return encode_bytes(numbers.tobytes()), _values(numbers, unit)


def packed_detail(block: int, parts: int, unit: float, cells: tuple[str, ...], ways: Indices, shares: Floats) -> Detail:
    """Return detail in the encoding of files.

    Parameters
    ----------
    block : int
        Cells of the sprite.
    parts : int
    unit : float
    cells : tuple of str
        From `reported_detail`.
    ways, shares : ndarray, shape (intervals, rows, columns)
        As `Detail.ways` and `Detail.shares`.
    """
    intervals, rows, columns = ways.shape
    numbers = np.stack([ways, np.rint(_FULL_SHARE * shares)], axis=-1).astype(np.uint8)
    return Detail(
        block=block, intervals=intervals, rows=rows, columns=columns, numbers=encode_bytes(numbers.tobytes()),
        parts=parts, unit=unit, cells=cells,
    )  # fmt: skip
