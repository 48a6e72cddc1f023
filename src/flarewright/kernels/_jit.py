"""One way to compile: cached on disk, without the interpreter lock, NumPy's error model."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any

from numba import njit

from ._fresh import ask_all

# contract, reassoc, arcp, nsz and afn keep tests for NaN and infinity legal, unlike fastmath=True
_FASTMATH = {"contract", "reassoc", "arcp", "nsz", "afn"}


# its stubs know fewer options than Numba has
_njit: Any = njit
# nothing takes a kernel's address, and calls from other kernels do not need it
_OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy", "fastmath": _FASTMATH, "no_cfunc_wrapper": True}
_ROOT: dict[str, Any] = {}
_INNER: dict[str, Any] = {"no_cpython_wrapper": True}
# with another Numba its own compiler makes the same code, later
with suppress(ImportError, AttributeError):
    from ._compiler import KernelCompiler
    from ._inner import InnerCompiler

    _ROOT, _INNER = {"pipeline_class": KernelCompiler}, {"pipeline_class": InnerCompiler}


def _as_numba_does(_: Any) -> None:
    """Leave to Numba how it loads a kernel."""


_load: Callable[[Any], None] = _as_numba_does
with suppress(ImportError, AttributeError, KeyError):
    from ._cached import load_lightly

    _load = load_lightly


def compiled(function: Callable[..., Any]) -> Any:
    """Compile a kernel that Python calls, and no kernel.

    Of one that kernels call as well there would be several copies, each optimised in its own place, and which of them
    runs depends on what was loaded first: the run that compiles told other last bits than the next one.
    """
    try:
        kernel = _njit(function, cache=True, **_ROOT, **_OPTIONS)
    except RuntimeError:
        # no folder to cache in can be written: every run compiles
        return _njit(function, **_ROOT, **_OPTIONS)
    # plain Python where Numba does not compile
    if hasattr(kernel, "_cache"):
        ask_all(kernel)
        _load(kernel)
    return kernel


def inner(function: Callable[..., Any], **options: Any) -> Any:
    """Compile a kernel that only kernels call; from Python it raises TypeError.

    It has neither what Python needs to call it, nor machine code, nor a cache of its own, for its callers hold its
    code: a third of the work and several files less.
    """

    def refuse(*_: Any, **__: Any) -> None:
        raise TypeError(f"{function.__name__} is for kernels; Python may call its py_func")

    kernel = _njit(function, **_INNER, **_OPTIONS, **options)
    if hasattr(kernel, "_insert"):
        # Numba itself would jump to the code that is not there
        kernel._insert = lambda *_: None
        kernel._compile_for_args = refuse
    return kernel


def borrowing(function: Callable[..., Any]) -> Any:
    """Compile an `inner` kernel that makes and returns no arrays: those that it is given are its callers' to keep.

    Numba else counts, with a lock, how often each array is held, at every call: of a frame's small triangles and cells
    that was a twelfth of the time. To make an array here does not compile.
    """
    return inner(function, _nrt=False)


def for_python(kernel: Any) -> Any:
    """Make an inner kernel one that Python can call, for tests."""

    def call(*arguments: Any) -> Any:
        return kernel(*arguments)

    return _njit(call, **_OPTIONS)


def inlined(function: Callable[..., Any]) -> Any:
    """Compile a formula that kernels call, inlined so that loops over lanes vectorise."""
    return njit(function, inline="always", error_model="numpy", fastmath=_FASTMATH)
