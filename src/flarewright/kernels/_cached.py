"""Load compiled kernels without what Numba needs only to compile, and none that is out of date (docs/adr/0007).

Before it looks into its cache Numba imports every function that it could compile, and SciPy's linear algebra for some:
a fifth of a command that finds all its kernels compiled. Machine code needs Numba's memory for arrays and nothing else;
the rest is imported when a kernel has to be compiled after all, by the compiler itself.

A kernel holds the code of those it calls. Numba asks whether the kernel's own file has changed; here it asks all.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
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


def stamp_of(folder: Path) -> tuple[float, int]:
    """Return when a folder's modules were changed last, and how large they are: other code, another stamp."""
    files = [path.stat() for path in folder.glob("*.py")]
    return max((one.st_mtime for one in files), default=0.0), sum(one.st_size for one in files)


_STAMP = stamp_of(Path(__file__).parent)


def load_lightly(kernel: Any) -> None:
    """Have a kernel loaded from its cache without Numba's library of functions, if no kernel has changed since.

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
    with suppress(AttributeError):
        cache._cache_file._source_stamp = (cache._cache_file._source_stamp, *_STAMP)
