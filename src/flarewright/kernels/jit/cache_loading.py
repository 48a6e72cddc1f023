"""Faster loading: read compiled kernels from the cache without Numba's function library (docs/adr/0007).

Before Numba reads its cache it imports every function that it can compile, and SciPy's linear algebra for some of them.
That takes a fifth of the time of a command that finds all kernels in the cache. Machine code needs only Numba's memory
runtime; the compiler imports the rest if a kernel has to be compiled.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba.core import runtime
from numba.core.caching import FunctionCache

# Numba's stubs do not know these
_Cache: Any = FunctionCache
_runtime: Any = vars(runtime)["rtsys"]
_load: Callable[..., Any] = _Cache._load_overload
_guard: Callable[..., Any] = _Cache._guard_against_spurious_io_errors

_LOADER = _Cache.load_overload.__code__
if _LOADER.co_varnames[: _LOADER.co_argcount] != ("self", "sig", "target_context"):
    raise ImportError("unsupported Numba version: load_overload has other parameters")


def load_lightly(kernel: Any) -> None:
    """Make a kernel load from its cache without importing Numba's function library.

    Parameters
    ----------
    kernel : dispatcher
        Changed in place.
    """
    cache = kernel._cache
    if not isinstance(cache, _Cache):
        # the kernel has no cache
        return

    def load_overload(sig: Any, target_context: Any) -> Any:
        _runtime.initialize(target_context)
        with _guard(cache):
            return _load(cache, sig, target_context)

    cache.load_overload = load_overload
