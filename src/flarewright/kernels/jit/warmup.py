"""The first run: compile the kernels that a command needs in several processes at once (docs/adr/0007).

Numba holds one lock while it compiles, so threads do not help. Each process compiles a share of the roots, the kernels
that Python calls, into Numba's on-disk cache, and the command loads what its helper processes have compiled. The
command does not depend on the helpers: a root that is missing from the cache is compiled at its first call.
"""

from __future__ import annotations

import gc
import os
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from importlib import import_module
from typing import Any

from numba.core import types as numba_types

from ...typing import Progress
from .compile_progress import reporting, schedule
from .roots import START_S, divide_roots, durations, roots
from .warmup_processes import ahead, helper_processes, is_helper

Shown = Callable[[], AbstractContextManager[Progress | None]]

_KERNELS = __package__.removesuffix(".jit")


def compile_together(names: Sequence[str], processes: int, shown: Shown | None = None) -> None:
    """Compile the roots that are not in the cache, some of them in other processes.

    Return at once if the cache holds all of them, if Numba does not compile or has no cache folder, or if there is only
    one process and no progress to show: then each root is compiled at its first call.

    Parameters
    ----------
    names : sequence of str
        Keys of `roots.roots` that the command will call.
    processes : int
        Largest number of processes, this one included.
    shown : callable, optional
        Called only if a root has to be compiled. Returns a context manager whose value is called with the part done
        (0 to 1) and a label, or is None to show nothing.
    """
    if is_helper():
        return
    missing = absent(names)
    started = [helper for helper in ahead() if set(helper.names) & set(missing)]
    others = {name for helper in started for name in helper.names}
    shares = divide_roots([name for name in missing if name not in others], max(processes - len(started), 1))
    alone = len(shares) + len(started) < 2
    if not missing or (alone and shown is None):
        return
    # start the helpers before setting up the progress display
    with helper_processes(shares[1:]) as helpers, nullcontext() if shown is None else shown() as progress:
        if alone and progress is None:
            return
        own, *theirs = shares or [[]]
        busy = [START_S + sum(durations(share)) for share in theirs] + [
            sum(durations(helper.names)) for helper in started
        ]
        with reporting(schedule(durations(own), busy), progress) as compiled:
            compile_roots(own, compiled)
            for helper in (*helpers, *started):
                helper.wait()


def absent(names: Iterable[str]) -> list[str]:
    """Return the roots without a cache entry for the current sources; none where Numba does not cache."""
    return [name for name in names if not _is_cached(name)]


def kernel(name: str) -> Any:
    """Return the kernel of a root."""
    module, function = roots()[name].kernel.rsplit(".", 1)
    return getattr(import_module(f"{_KERNELS}.{module}"), function)


def types(name: str) -> tuple[Any, ...]:
    """Return the argument types of a root, as Numba stores them in the cache."""

    def named_tuple(fields: Sequence[Any], path: str) -> Any:
        module, made = path.rsplit(".", 1)
        return numba_types.BaseTuple.from_types(fields, getattr(import_module(f"{_KERNELS}.{module}"), made))

    # an expression of the package's table, in Numba's names of types
    return tuple(eval(f"({roots()[name].types},)", {**vars(numba_types), "NamedTuple": named_tuple}))


def _is_cached(name: str) -> bool:
    try:
        # Numba has no public function to inspect its cache without a call
        index = kernel(name)._cache._cache_file._load_index()
    except Exception:
        # not compiled, not cached, or an unsupported Numba version: compiling ahead saves nothing
        return True
    signature = types(name)
    return any(key[0] == signature for key in index)


def compile_roots(names: Sequence[str], compiled: Callable[[], None] = lambda: None) -> None:
    """Compile roots for the argument types of the table, into the on-disk cache.

    Parameters
    ----------
    names : sequence of str
        Keys of `roots.roots`.
    compiled : callable, optional
        Called after each root.
    """
    with without_garbage_collection():
        for name in names:
            # a root that fails to compile raises the error at its first call
            with suppress(Exception):
                kernel(name).compile(types(name))
            compiled()


def run_helper(names: Sequence[str]) -> None:
    """Compile roots in a helper process, and end the process.

    Parameters
    ----------
    names : sequence of str
        Keys of `roots.roots`.
    """

    def end_with_parent() -> None:
        # the system closes the pipe when the command ends, even when it is killed
        os.read(0, 1)
        os._exit(1)

    threading.Thread(target=end_with_parent, daemon=True).start()
    compile_roots(absent(names))
    os._exit(0)


@contextmanager
def without_garbage_collection() -> Iterator[None]:
    """Disable the garbage collector while the compiler runs: it takes a tenth of the time and frees little.

    Afterwards freeze the existing objects. Without that, the first collection would visit the compiler's half a million
    objects: 0.4 s in every process, and no memory freed.
    """
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.freeze()
            gc.enable()
