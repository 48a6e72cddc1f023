"""How a process allocates memory: one heap for all its threads, which keeps what was freed."""

from __future__ import annotations

import os
import sys
from contextlib import suppress

# options of mallopt (malloc.h of the GNU C library)
_ARENA_MAX, _TRIM_THRESHOLD, _MMAP_THRESHOLD = -8, -1, -3
# the largest that all versions of it accept as the least size of memory apart from the heap
_APART_BYTES = 32 << 20


def share_one_heap() -> None:
    """Let all threads allocate from one heap; for the start of a process, before its first thread.

    The GNU C library gives each thread a heap, and each keeps what was freed in it: pictures of HD take 100 to 150 MB
    more. Threads rarely wait for each other: kernels allocate little. MALLOC_ARENA_MAX is left to decide where it is
    set; other C libraries have one heap, or no such option.
    """
    if "MALLOC_ARENA_MAX" not in os.environ:
        _mallopt(_ARENA_MAX, 1)


def keep_freed_memory() -> None:
    """Keep memory that was freed, for the start of a process whose items are all of one size.

    The GNU C library returns freed memory at the end of the heap to the system, which clears it for the next item.
    """
    if any(name.startswith("MALLOC_") for name in os.environ):
        return
    # the second option alone would take all pictures apart from the heap
    if _mallopt(_MMAP_THRESHOLD, _APART_BYTES):
        _mallopt(_TRIM_THRESHOLD, 2**31 - 1)


def _mallopt(option: int, value: int) -> bool:
    """Set an option of the GNU C library; False where there is another library, or it refuses."""
    if sys.platform != "linux":
        return False
    import ctypes

    with suppress(OSError, AttributeError):
        return bool(ctypes.CDLL(None).mallopt(option, value))
    return False
