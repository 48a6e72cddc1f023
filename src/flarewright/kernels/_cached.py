"""Load compiled kernels without what Numba needs only to compile (docs/adr/0007).

Before it looks into its cache Numba imports every function that it could compile, and SciPy's linear algebra for some:
a fifth of a command that finds all its kernels compiled. Machine code needs Numba's memory for arrays and nothing else;
the rest is imported when a kernel has to be compiled after all, by the compiler itself.
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
    raise ImportError("with this Numba kernels are loaded in another way")


def load_lightly(kernel: Any) -> None:
    """Have a kernel loaded from its cache without Numba's library of functions.

    Parameters
    ----------
    kernel : dispatcher
        Changed: its cache loads so from now on.
    """
    cache = kernel._cache
    if not isinstance(cache, _Cache):
        # nothing is cached
        return

    def load_overload(sig: Any, target_context: Any) -> Any:
        _runtime.initialize(target_context)
        with _guard(cache):
            return _load(cache, sig, target_context)

    cache.load_overload = load_overload
