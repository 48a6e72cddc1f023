"""Libraries that print what is wrong with a file by themselves: a person is told in one sentence, which is ours."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, redirect_stdout, suppress
from io import StringIO
from threading import Lock

_STDERR = 2
_LOCK = Lock()
# what the first reader has turned away, and the last one lets back; and how many there are
_TURNED = ExitStack()
_READERS: list[object] = []


@contextmanager
def quiet() -> Iterator[None]:
    """Keep what libraries print by themselves from the terminal, be it from C or from Python.

    Notes
    -----
    These are the process' own streams, so words of other threads are lost meanwhile. Readers may be in it together.
    """
    reader = object()
    with _LOCK:
        if not _READERS:
            _TURNED.enter_context(redirect_stdout(StringIO()))
            _TURNED.enter_context(_nowhere())
        _READERS.append(reader)
    try:
        yield
    finally:
        with _LOCK:
            _READERS.remove(reader)
            if not _READERS:
                _TURNED.close()


@contextmanager
def _nowhere() -> Iterator[None]:
    """Lead the error stream's file descriptor nowhere; a process may have none."""
    with suppress(OSError, ValueError, AttributeError):
        sys.stderr.flush()
    try:
        terminal = os.dup(_STDERR)
    except OSError:
        yield
        return
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, _STDERR)
    os.close(nowhere)
    try:
        yield
    finally:
        os.dup2(terminal, _STDERR)
        os.close(terminal)
