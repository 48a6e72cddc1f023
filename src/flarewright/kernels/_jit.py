"""One way to compile: cached on disk, without the interpreter lock, NumPy's error model."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba import njit

# contract, reassoc, arcp, nsz and afn keep tests for NaN and infinity legal, unlike fastmath=True
_FASTMATH = {"contract", "reassoc", "arcp", "nsz", "afn"}


def compiled(function: Callable[..., Any]) -> Any:
    """Compile a kernel that Python calls."""
    try:
        return njit(function, cache=True, nogil=True, error_model="numpy", fastmath=_FASTMATH)
    except RuntimeError:
        # no folder to cache in can be written: every run compiles
        return njit(function, nogil=True, error_model="numpy", fastmath=_FASTMATH)


def inlined(function: Callable[..., Any]) -> Any:
    """Compile a formula that kernels call, inlined so that loops over lanes vectorise."""
    return njit(function, inline="always", error_model="numpy", fastmath=_FASTMATH)
