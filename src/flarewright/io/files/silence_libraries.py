"""Suppress what libraries print about broken files; our error message is the only one that the user sees."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, redirect_stdout, suppress
from io import StringIO
from threading import Lock

_STDERR = 2
_LOCK = Lock()
# the first reader redirects the streams, the last one restores them; a list of the active readers
_REDIRECTS = ExitStack()
_READERS: list[object] = []


@contextmanager
def silenced() -> Iterator[None]:
    """Discard output that libraries print to the terminal, from C or from Python.

    Notes
    -----
    The redirect affects the whole process, so other threads lose their output meanwhile. Nested and concurrent use
    is safe.
    """
    reader = object()
    with _LOCK:
        if not _READERS:
            _REDIRECTS.enter_context(redirect_stdout(StringIO()))
            _REDIRECTS.enter_context(_stderr_to_null())
        _READERS.append(reader)
    try:
        yield
    finally:
        with _LOCK:
            _READERS.remove(reader)
            if not _READERS:
                _REDIRECTS.close()


@contextmanager
def _stderr_to_null() -> Iterator[None]:
    """Redirect the error stream's file descriptor to the null device; the process may have none."""
    with suppress(OSError, ValueError, AttributeError):
        sys.stderr.flush()
    try:
        terminal = os.dup(_STDERR)
    except OSError:
        yield
        return
    null_device = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null_device, _STDERR)
    os.close(null_device)
    try:
        yield
    finally:
        os.dup2(terminal, _STDERR)
        os.close(terminal)
