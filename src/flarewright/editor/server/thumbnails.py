"""Thumbnails of the user's lenses in the background: a child process renders them while a page shows the library."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from contextlib import suppress

from ..common.latest_job import NICENESS

# pictures of one child process: it ends after them, also when the editor has crashed
_MOST = 12


class ThumbnailMaker:
    """Starts a child process that renders missing thumbnails, at most one at a time."""

    def __init__(self) -> None:
        self._child: subprocess.Popen[bytes] | None = None
        self._lock = threading.Lock()
        # in the order of the requests: those that a page shows now are the last ones
        self._wanted: dict[str, None] = {}
        self._closed = False

    def ask(self, name: str) -> None:
        """Render the thumbnail of one of the user's lenses soon; the page asks again until it is there."""
        with self._lock:
            self._wanted.pop(name, None)
            self._wanted[name] = None
            if self._closed or (self._child is not None and self._child.poll() is None):
                return
            # one thread: the page draws on the other cores
            environment = os.environ | {"NUMBA_NUM_THREADS": "1", "PYTHONUNBUFFERED": "1"}
            names = list(self._wanted)[: -_MOST - 1 : -1]
            self._wanted.clear()
            with suppress(OSError):
                self._child = subprocess.Popen(
                    [sys.executable, "-m", "flarewright", "library", "thumbnails", "--", *names],
                    env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                )  # fmt: skip
                if hasattr(os, "setpriority"):
                    os.setpriority(os.PRIO_PROCESS, self._child.pid, 2 * NICENESS)

    def close(self) -> None:
        """End the child process; the pictures that it has finished stay."""
        with self._lock:
            self._closed = True
            if self._child is not None and self._child.poll() is None:
                self._child.terminate()
                with suppress(subprocess.TimeoutExpired):
                    self._child.wait(1.0)
                if self._child.poll() is None:
                    self._child.kill()
                    self._child.wait()
            self._child = None
