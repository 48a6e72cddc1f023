"""One heap for all threads of a process, where the C library would give each thread its own."""

from __future__ import annotations

import os
import sys
from contextlib import suppress

# `M_ARENA_MAX` of mallopt (malloc.h of the GNU C library)
_ARENA_MAX = -8


def share_one_heap() -> None:
    """Let all threads allocate from one heap; for the start of a process, before its first thread.

    The GNU C library gives each thread a heap, and each keeps what was freed in it: pictures of HD take 100 to 150 MB
    more. Threads rarely wait for each other: kernels allocate little. MALLOC_ARENA_MAX is left to decide where it is
    set; other C libraries have one heap, or no such option.
    """
    if sys.platform != "linux" or "MALLOC_ARENA_MAX" in os.environ:
        return
    import ctypes

    with suppress(OSError, AttributeError):
        ctypes.CDLL(None).mallopt(_ARENA_MAX, 1)
