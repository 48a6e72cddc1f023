"""The decorators of all kernels: compiled with an on-disk cache, without the interpreter lock, NumPy's error model."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any

from numba import njit

from .cache_stamp import stamp_cache

# contract, reassoc, arcp, nsz and afn keep tests for NaN and infinity legal, unlike fastmath=True
_FASTMATH = {"contract", "reassoc", "arcp", "nsz", "afn"}


# the stubs lack some of Numba's options
_njit: Any = njit
# no code takes a kernel's address, and calls from other kernels do not need the C wrapper
_OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy", "fastmath": _FASTMATH, "no_cfunc_wrapper": True}
_ROOT: dict[str, Any] = {}
_INNER: dict[str, Any] = {"no_cpython_wrapper": True}
# with an unsupported Numba version, Numba's compiler makes the same code, more slowly
with suppress(ImportError, AttributeError):
    from .linking import InnerCompiler
    from .pipeline import KernelCompiler

    _ROOT, _INNER = {"pipeline_class": KernelCompiler}, {"pipeline_class": InnerCompiler}


def _load_as_numba(*_: Any) -> None:
    """Do nothing: Numba loads and writes the kernel itself."""


_load: Callable[[Any], None] = _load_as_numba
with suppress(ImportError, AttributeError, KeyError):
    from .cache_loading import load_lightly

    _load = load_lightly

_check: Callable[[Any], None] = _load_as_numba
_no_folder: Callable[[], None] = _load_as_numba
with suppress(ImportError, AttributeError):
    from .cache_files import check_files, report_no_folder

    _check, _no_folder = check_files, report_no_folder


def compiled(function: Callable[..., Any]) -> Any:
    """Compile a kernel that only Python calls.

    Other kernels must not call it. The code of a kernel that kernels also call exists in several copies, each optimised
    in its context, and what is already loaded decides which copy runs: the run that compiles would compute other last
    bits than the next run.
    """
    try:
        kernel = _njit(function, cache=True, **_ROOT, **_OPTIONS)
    except RuntimeError:
        # no cache folder is writable: every run compiles
        _no_folder()
        return _njit(function, **_ROOT, **_OPTIONS)
    # with NUMBA_DISABLE_JIT the kernel is a plain Python function
    if hasattr(kernel, "_cache"):
        stamp_cache(kernel)
        _load(kernel)
        _check(kernel)
    return kernel


def inner(function: Callable[..., Any], **options: Any) -> Any:
    """Compile a kernel that only kernels call; from Python it raises TypeError.

    It has no Python wrapper, no machine code and no cache: its code is linked into its callers. This saves a third of
    the compile time and several cache files.
    """

    def refuse(*_: Any, **__: Any) -> None:
        raise TypeError(f"{function.__name__} is for kernels; Python may call its py_func")

    kernel = _njit(function, **_INNER, **_OPTIONS, **options)
    if hasattr(kernel, "_insert"):
        # without this Numba would jump to machine code that does not exist
        kernel._insert = lambda *_: None
        kernel._compile_for_args = refuse
        _forget_literals(kernel)
    return kernel


def _forget_literals(kernel: Any) -> None:
    """Compile a kernel once for all integers: Numba would compile it again for each that a caller writes as a literal.

    The caller still passes the number, and LLVM still sees it where the kernel is inlined.
    """
    from numba.core import types

    template = kernel.get_call_template

    def plain(one: Any) -> Any:
        return types.unliteral(one) if isinstance(one, types.IntegerLiteral) else one

    def get_call_template(args: Any, kws: Any) -> Any:
        return template(tuple(plain(one) for one in args), {name: plain(one) for name, one in kws.items()})

    kernel.get_call_template = get_call_template


def borrowing(function: Callable[..., Any]) -> Any:
    """Compile an `inner` kernel that creates and returns no arrays and only borrows those of its callers.

    This removes Numba's reference counting, which locks at every call and took a twelfth of the time of a frame with
    many small triangles and cells. A kernel that creates an array does not compile with this decorator.
    """
    return inner(function, _nrt=False)


def embedded(function: Callable[..., Any]) -> Any:
    """Compile a `borrowing` kernel into its callers, however large it is.

    For the body of a hot loop that takes many arrays: LLVM leaves it outside for its size, and every call then copies
    what describes the arrays. Rings of small triangles took a quarter more time.
    """
    return inner(function, _nrt=False, forceinline=True)


def for_python(kernel: Any) -> Any:
    """Return a wrapper by which Python can call an inner kernel, for tests."""

    def call(*arguments: Any) -> Any:
        return kernel(*arguments)

    return _njit(call, **_OPTIONS)


def inlined(function: Callable[..., Any]) -> Any:
    """Compile a formula that kernels call, inlined so that loops over lanes vectorise."""
    return njit(function, inline="always", error_model="numpy", fastmath=_FASTMATH)
