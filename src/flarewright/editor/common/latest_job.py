"""A background thread that runs the newest job and drops outdated ones."""

from __future__ import annotations

import os
import sys
import threading
import traceback
from collections.abc import Callable
from contextlib import suppress

# niceness of background work, 0 to 19, so that the page stays responsive
NICENESS = 5


class Overtaken(Exception):  # noqa: N818 (not an error: a newer job waits)
    """Raised inside a job when a newer one waits."""


Check = Callable[[], None]
Job = Callable[[Check], None]


class Lane:
    """Run one job at a time; a new job replaces the waiting one and asks the running one to end.

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
        """Run a job next; it receives a function that raises `Overtaken` when the job should end."""
        with self._wake:
            self._newest += 1
            self._next = (self._newest, job)
            self._wake.notify_all()

    def cancel(self) -> None:
        """Ask the running job to end, and drop the waiting one."""
        with self._wake:
            self._newest += 1
            self._next = None

    def wait(self, timeout_s: float) -> bool:
        """Wait until no job runs or waits; return False after the timeout."""
        with self._wake:
            return self._wake.wait_for(lambda: self._next is None and not self._busy, timeout_s)

    def close(self) -> None:
        """End the thread after the running job."""
        with self._wake:
            self._closed = True
            self._newest += 1
            self._next = None
            self._wake.notify_all()

    def _run(self) -> None:
        _lower_priority()
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
            except Exception as error:
                if refused_at_exit(error):
                    return
                # a job reports expected errors itself; this one is a bug, and the thread must survive it
                traceback.print_exc()
            finally:
                with self._wake:
                    self._busy = False
                    self._wake.notify_all()


def refused_at_exit(error: BaseException) -> bool:
    """Return whether a job failed because the process ends, which is no error of the job.

    Notes
    -----
    The end of the main thread first closes all pools, then waits for their workers, and only then stops daemon threads.
    In between, a job that submits work to a pool gets a RuntimeError. Nothing public reports that state, so the words
    of the message decide ("cannot schedule new futures after interpreter shutdown", "can't create new thread at
    interpreter shutdown"). A worker that ends closes its pool, whose message then ends like that of any closed pool.
    """
    if not isinstance(error, RuntimeError):
        return False
    ends = bool(getattr(threading, "_SHUTTING_DOWN", False))
    return str(error).endswith("interpreter shutdown") or (ends and str(error).endswith("after shutdown"))


def _lower_priority() -> None:
    """Lower the priority of this thread and its children below the page and the server, where the system can."""
    if sys.platform == "linux":
        with suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), NICENESS)
