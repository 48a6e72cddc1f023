"""How what is left beside ghosts moves from one picture of a sprite to the next."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .blocks import Blocks
from .bytes_text import told_bytes

# of a move, cells
_STEP = 1.0 / 8.0
_NUMBER = np.dtype("<i2")
# a share of 1
_WHOLE = 127.0


class Moves(Blocks):
    """How what is left moves between the pictures of a sprite that follows ghosts, block by block.

    Attributes
    ----------
    block, intervals, rows, columns
        As of `Blocks`.
    numbers : str
        As of `Blocks`, whole numbers of 16 bits, signed, the lower byte first: where what is in a block halfway between
        two pictures moves from the one to the other, across the light's direction (down when the light is right) and
        towards the light, eighths of a cell, and its weight: of blocks that come to one place, the one of the largest
        weight is seen. These three of what is left, and of it together with the ghosts; then the shares of 127 that
        these two ways have. What lacks to 127 goes with the ghosts' boxes.
    """

    # two each: down, along and weight, of what is left and of the whole light; then the shares of both
    count = 16
    what = "the moves of a sprite"

    def _sound(self, numbers: NDArray[np.uint8]) -> None:
        shares = numbers.view(_NUMBER)[..., 6:].astype(int)
        if (shares < 0).any() or (shares.sum(axis=-1) > _WHOLE).any():
            raise ValueError("shares in the moves of a sprite must be 0 or more and 127 at most together")

    def steps(self, interval: int) -> NDArray[np.float64]:
        """Return moves, cells down and along, and weights of what is left and of it with ghosts, shape (2, R, C, 3)."""
        told = self._signed(interval)[..., :6].reshape(self.rows, self.columns, 2, 3)
        return np.asarray(np.moveaxis(told * np.array([_STEP, _STEP, 1.0]), 2, 0))

    def shares(self, interval: int) -> NDArray[np.float64]:
        """Return the shares of the two ways, shape (2, rows, columns)."""
        return np.asarray(np.moveaxis(self._signed(interval)[..., 6:] / _WHOLE, -1, 0))

    def _signed(self, interval: int) -> NDArray[np.int16]:
        return np.asarray(self.bytes_of_blocks[interval].view(_NUMBER))


def packed_moves(block: int, steps: NDArray[np.float64], shares: NDArray[np.float64]) -> Moves:
    """Return moves as a file holds them.

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
    # cut off, so that both together are never more than all
    whole[..., 6:] = np.moveaxis(np.floor(_WHOLE * shares), 1, -1)
    return Moves(block=block, intervals=intervals, rows=rows, columns=columns, numbers=told_bytes(whole.tobytes()))
