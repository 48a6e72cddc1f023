"""Give memory that the C library holds free back to the system.

Threads of pools allocate in up to eight arenas a core. Each arena holds what pictures have freed, up to the most that
it ever had, and no other arena can use it. So the memory of an editor grows for hours although its data do not.
"""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable
from functools import cache

MOST_FREE_BYTES = 128 * 2**20
"""Free memory that is kept for the next pictures."""


class _Mallinfo(ctypes.Structure):
    """The record `mallinfo2` of the GNU C library; sizes in bytes, of all arenas."""

    _fields_ = [
        (name, ctypes.c_size_t)
        for name in (
            "arena", "ordblks", "smblks", "hblks", "hblkhd", "usmblks", "fsmblks", "uordblks", "fordblks", "keepcost",
        )
    ]  # fmt: skip


@cache
def _library() -> tuple[Callable[[], _Mallinfo], Callable[[int], int]] | None:
    """Return `mallinfo2` and `malloc_trim`; None where the C library has none."""
    if sys.platform != "linux":
        return None
    try:
        library = ctypes.CDLL(None)
        info, trim = library.mallinfo2, library.malloc_trim
    except (AttributeError, OSError):
        return None
    info.restype, info.argtypes = _Mallinfo, []
    trim.restype, trim.argtypes = ctypes.c_int, [ctypes.c_size_t]
    return info, trim


def free_bytes() -> int:
    """Return how much memory the C library has free, in all arenas, also what `release` gave back; 0 if not known."""
    library = _library()
    return 0 if library is None else int(library[0]().fordblks)


def release(most: int = MOST_FREE_BYTES) -> bool:
    """Give free memory back to the system if there is more than `most`, bytes; return whether any was given back."""
    library = _library()
    return library is not None and free_bytes() > most and bool(library[1](0))
