"""Memory of large planes.

Rows of a plane lie kilobytes apart, so with pages of 4 kB a triangle touches another page in each of its rows. And what
the system maps for one plane returns to it when the plane is gone, while the C library may keep it: a tenth of the peak
of a large frame.
"""

from __future__ import annotations

import mmap
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

# smaller planes fit into few pages
_LEAST_BYTES = 4 * 2**20
# size of a huge page; where it is larger, planes just lie in small pages
_HUGE_BYTES = 2 * 2**20


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
    # typed as Any: only some systems have these names
    system: Any = mmap
    if 4 * count < _LEAST_BYTES or not hasattr(system, "MADV_HUGEPAGE"):
        return np.zeros(count, dtype=np.float32)
    # whole huge pages, and space to begin at one: each end would else lie in hundreds of small pages, which cost more
    # than all the huge ones together. What is never written takes no memory
    size = -(-4 * count // _HUGE_BYTES) * _HUGE_BYTES
    try:
        block = system.mmap(-1, size + _HUGE_BYTES, flags=system.MAP_PRIVATE | system.MAP_ANONYMOUS)
    except OSError:
        # the C library may hold enough that was freed; else this raises MemoryError, which the editor and jobs expect
        return np.zeros(count, dtype=np.float32)
    # a system without huge pages refuses; small pages do as well
    with suppress(OSError):
        block.madvise(system.MADV_HUGEPAGE)
    floats: NDArray[np.float32] = np.frombuffer(block, dtype=np.float32)
    start = -floats.ctypes.data % _HUGE_BYTES // floats.itemsize
    return floats[start : start + count]


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
