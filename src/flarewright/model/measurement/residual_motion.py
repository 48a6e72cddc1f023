"""Motion of the residual light of a ghost-following sprite from one picture to the next."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...typing import Floats
from ..bytes_text import encode_bytes
from .block_values import Blocks

# quantization step of a displacement, cells
_STEP = 1.0 / 8.0
_NUMBER = np.dtype("<i2")
# number that encodes a share of 1
_FULL_SHARE = 127.0


class Moves(Blocks):
    """Block-wise motion of the residual between the pictures of a ghost-following sprite.

    Attributes
    ----------
    block, intervals, rows, columns
        As in `Blocks`.
    numbers : str
        As in `Blocks`, signed 16-bit integers, low byte first. For the block halfway between two pictures: its
        displacement from the one to the other, across the light's direction (down when the light is on the right) and
        towards the light, eighths of a cell; and its weight. Where several blocks land at one place, the block of the
        largest weight wins. One such triple for the residual, one for the residual with the ghosts; then the shares of
        both, of 127. The remaining share stays in place.
    """

    # two bytes each: down, along and weight of the residual and of the whole light; then the shares of both
    count = 16
    what = "the moves of a sprite"

    def _check_numbers(self, numbers: NDArray[np.uint8]) -> None:
        shares = numbers.view(_NUMBER)[..., 6:].astype(int)
        if (shares < 0).any() or (shares.sum(axis=-1) > _FULL_SHARE).any():
            raise ValueError("shares in the moves of a sprite must be 0 or more and 127 at most together")

    def steps(self, interval: int) -> Floats:
        """Return displacements (cells down, along) and weights: residual, residual with ghosts; shape (2, R, C, 3)."""
        triples = self._signed(interval)[..., :6].reshape(self.rows, self.columns, 2, 3)
        return np.asarray(np.moveaxis(triples * np.array([_STEP, _STEP, 1.0]), 2, 0))

    def shares(self, interval: int) -> Floats:
        """Return the shares of residual and whole light, shape (2, rows, columns)."""
        return np.asarray(np.moveaxis(self._signed(interval)[..., 6:] / _FULL_SHARE, -1, 0))

    def _signed(self, interval: int) -> NDArray[np.int16]:
        return np.asarray(self.bytes_of_blocks[interval].view(_NUMBER))


def packed_moves(block: int, steps: Floats, shares: Floats) -> Moves:
    """Return moves in the encoding of files.

    Parameters
    ----------
    block : int
        Cells.
    steps : ndarray, shape (intervals, 2, rows, columns, 3)
        As `Moves.steps`; weights from 0 to 127.
    shares : ndarray, shape (intervals, 2, rows, columns)
    """
    intervals, _, rows, columns, _ = steps.shape
    whole = np.empty((intervals, rows, columns, Moves.count // _NUMBER.itemsize), _NUMBER)
    numbers = np.rint(steps / np.array([_STEP, _STEP, 1.0]))
    whole[..., :6] = np.moveaxis(numbers, 1, 3).reshape(intervals, rows, columns, 6)
    # round down, so that the sum never exceeds 127
    whole[..., 6:] = np.moveaxis(np.floor(_FULL_SHARE * shares), 1, -1)
    return Moves(block=block, intervals=intervals, rows=rows, columns=columns, numbers=encode_bytes(whole.tobytes()))
