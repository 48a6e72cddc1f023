"""How far light can move between the pictures of a ghost-following sprite; interpolation clamps to these ranges."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...typing import Indices
from ..bytes_text import encode_bytes
from .block_values import Blocks

ANYWHERE = 255
"""Range without a limit: the light can come from any distance."""


class Reaches(Blocks):
    """Search ranges, in the pictures before and after, for equally dark and equally bright light.

    Attributes
    ----------
    block, intervals, rows, columns
        As in `Blocks`.
    numbers : str
        As in `Blocks`: per block the range in cells of local minima and of local maxima from one picture to the next;
        255: no limit.
    """

    count = 2
    what = "the reaches of a sprite"

    def within(self, interval: int) -> NDArray[np.uint8]:
        """Return the search ranges of an interval, shape (rows, columns, 2): cells, or `ANYWHERE`."""
        return np.asarray(self.bytes_of_blocks[interval])


def packed_reaches(block: int, cells: Indices) -> Reaches:
    """Return search ranges in the encoding of files.

    Parameters
    ----------
    block : int
        Cells.
    cells : ndarray, shape (intervals, rows, columns, 2)
        As `Reaches.within`.
    """
    intervals, rows, columns, _ = cells.shape
    text = encode_bytes(cells.astype(np.uint8).tobytes())
    return Reaches(block=block, intervals=intervals, rows=rows, columns=columns, numbers=text)
