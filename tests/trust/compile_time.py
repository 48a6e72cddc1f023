"""Processor time that this process spends compiling kernels: it is spent once per installation, whatever the input."""

from __future__ import annotations

import time
from functools import cache

from numba.core import event


class CompileTime(event.Listener):  # type: ignore[misc]
    """Sums the processor time of compilations; inner kernels compile within the compilation of their callers."""

    def __init__(self) -> None:
        self._finished_s, self._depth, self._since = 0.0, 0, 0.0

    def on_start(self, event: event.Event) -> None:
        """Begin to count at the outermost compilation."""
        self._depth += 1
        if self._depth == 1:
            self._since = time.process_time()

    def on_end(self, event: event.Event) -> None:
        """Add the outermost compilation."""
        self._depth -= 1
        if self._depth == 0:
            self._finished_s += time.process_time() - self._since

    def seconds(self) -> float:
        """Return the time so far, with the compilation that runs."""
        return self._finished_s + (time.process_time() - self._since if self._depth else 0.0)


@cache
def compile_time() -> CompileTime:
    """Return the counter of this process, which listens from the first call on."""
    counted = CompileTime()
    event.register("numba:compile", counted)
    return counted
