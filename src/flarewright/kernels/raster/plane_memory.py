"""Memory of large planes.

Rows of a plane lie kilobytes apart, so with pages of 4 kB a triangle touches another page in each of its rows. And what
the system maps for one plane returns to it when the plane is gone, while the C library may keep it: a tenth of the peak
of a large frame. What drafts are drawn in is kept for the next one, as the system clears new pages for a third of their
time.
"""

from __future__ import annotations

import mmap
import weakref
from collections import deque
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

# smaller planes fit into few pages
_LEAST_BYTES = 4 * 2**20
# size of a huge page; where it is larger, planes just lie in small pages
_HUGE_BYTES = 2 * 2**20
# up to this size, and this number of them, memory is kept: for drafts of 1280 x 720 pixels in double precision
_KEPT_BYTES, _KEPT = 24 * 2**20, 5

# appending to it and popping from it are atomic, and the oldest is dropped
_kept: deque[Any] = deque(maxlen=_KEPT)


def black_memory(count: int) -> NDArray[np.float32]:
    """Return zeros, for a large plane in separate huge pages where the system has them (Linux).

    Parameters
    ----------
    count : int
        Number of floats.

    Returns
    -------
    ndarray of float32, shape (count,)

    Raises
    ------
    MemoryError
        There is not so much memory.
    """
    return _blackened(*_memory(count))


def black_picture(width: int, height: int) -> NDArray[np.float32]:
    """Return a black picture in memory from `black_memory`.

    Parameters
    ----------
    width, height : int
        Number of columns and of rows.

    Returns
    -------
    ndarray of float32, shape (height, width, 3)
    """
    return black_memory(3 * width * height).reshape(height, width, 3)


def unset_picture(width: int, height: int) -> NDArray[np.float32]:
    """Return a picture whose values are not set, as from `numpy.empty`; its memory is kept when it is gone.

    Parameters
    ----------
    width, height
        As in `black_picture`.

    Returns
    -------
    ndarray of float32, shape (height, width, 3)
    """
    return _memory(3 * width * height, keep=True)[0].reshape(height, width, 3)


def black_differences(width: int, height: int) -> NDArray[np.float64]:
    """Return zeros for a picture of row differences (`polygons.sum_rows`); their memory is kept when they are gone.

    Parameters
    ----------
    width, height
        As in `black_picture`.

    Returns
    -------
    ndarray of float64, shape (height, width, 3)
    """
    return _blackened(*_memory(6 * width * height, keep=True)).view(np.float64).reshape(height, width, 3)


def _blackened(floats: NDArray[np.float32], is_black: bool) -> NDArray[np.float32]:
    """Set floats to 0 unless they are."""
    if not is_black:
        floats.fill(0.0)
    return floats


def _memory(count: int, *, keep: bool = False) -> tuple[NDArray[np.float32], bool]:
    """Return floats, whose memory is kept if it is not too large, and whether they are all 0."""
    # typed as Any: only some systems have these names
    system: Any = mmap
    if 4 * count < _LEAST_BYTES or not hasattr(system, "MADV_HUGEPAGE"):
        return np.zeros(count, dtype=np.float32), True
    # whole huge pages, and space to begin at one: each end would else lie in hundreds of small pages, which cost more
    # than all the huge ones together. What is never written takes no memory
    size = (-(-4 * count // _HUGE_BYTES) + 1) * _HUGE_BYTES
    block = _taken(size)
    is_black = block is None
    if block is None:
        try:
            block = system.mmap(-1, size, flags=system.MAP_PRIVATE | system.MAP_ANONYMOUS)
        except OSError:
            # the C library may hold enough that was freed; else this raises MemoryError, which the editor and jobs
            # expect
            return np.zeros(count, dtype=np.float32), True
        # a system without huge pages refuses; small pages do as well
        with suppress(OSError):
            block.madvise(system.MADV_HUGEPAGE)
    floats: NDArray[np.float32] = np.frombuffer(block, dtype=np.float32)
    if keep and size <= _KEPT_BYTES:
        # all views of the plane hold this array
        weakref.finalize(floats, _kept.append, block).atexit = False
    start = -floats.ctypes.data % _HUGE_BYTES // floats.itemsize
    return floats[start : start + count], is_black


def _taken(size: int) -> Any | None:
    """Take a block of a size from those that are kept."""
    for _ in range(_KEPT):
        try:
            block = _kept.pop()
        except IndexError:
            return None
        if len(block) == size:
            return block
        _kept.appendleft(block)
    return None
