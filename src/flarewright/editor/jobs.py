"""Work beside the page: one thread that always does the newest job and drops what is overtaken."""

from __future__ import annotations

import os
import sys
import threading
import traceback
from collections.abc import Callable
from contextlib import suppress

# by which work waits for a page, of 19
BEHIND = 5


class Overtaken(Exception):  # noqa: N818 (nothing is wrong: something newer came)
    """Raised inside a job when a newer one waits."""


Check = Callable[[], None]
Job = Callable[[Check], None]


class Lane:
    """Runs one job at a time; a new one takes the place of the waiting one and asks the running one to end.

    Parameters
    ----------
    name : str
        Of the thread.
    """

    def __init__(self, name: str) -> None:
        self._wake = threading.Condition()
        self._next: tuple[int, Job] | None = None
        self._newest = 0
        self._busy = False
        self._closed = False
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def submit(self, job: Job) -> None:
        """Do this next; `job` is given a function that raises `Overtaken` when it should end."""
        with self._wake:
            self._newest += 1
            self._next = (self._newest, job)
            self._wake.notify_all()

    def cancel(self) -> None:
        """Ask the running job to end, and forget the waiting one."""
        with self._wake:
            self._newest += 1
            self._next = None

    def wait(self, timeout_s: float) -> bool:
        """Wait until nothing is left to do; False when that takes too long."""
        with self._wake:
            return self._wake.wait_for(lambda: self._next is None and not self._busy, timeout_s)

    def close(self) -> None:
        """End after the running job."""
        with self._wake:
            self._closed = True
            self._newest += 1
            self._next = None
            self._wake.notify_all()

    def _run(self) -> None:
        _step_back()
        while True:
            with self._wake:
                self._wake.wait_for(lambda: self._next is not None or self._closed)
                if self._next is None:
                    return
                number, job = self._next
                self._next, self._busy = None, True

            def check(number: int = number) -> None:
                if number != self._newest:
                    raise Overtaken

            try:
                with suppress(Overtaken):
                    job(check)
            except Exception:
                # a job tells its own mistakes; what is left is one of ours, and the lane must go on
                traceback.print_exc()
            finally:
                with self._wake:
                    self._busy = False
                    self._wake.notify_all()


def _step_back() -> None:
    """Let the page, and what answers it, go before this thread and those that it begins, where threads have ranks."""
    if sys.platform == "linux":
        with suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), BEHIND)


class Gate:
    """Lets one through at a time, whoever asked last first: what a person looks at now is what they asked for last."""

    def __init__(self) -> None:
        self._wake = threading.Condition()
        self._waiting: list[object] = []
        self._busy = False

    def __enter__(self) -> None:
        """Wait for one's turn."""
        ticket = object()
        with self._wake:
            self._waiting.append(ticket)
            self._wake.wait_for(lambda: not self._busy and self._waiting[-1] is ticket)
            self._waiting.pop()
            self._busy = True

    def __exit__(self, *_: object) -> None:
        """Let the next one through."""
        with self._wake:
            self._busy = False
            self._wake.notify_all()
