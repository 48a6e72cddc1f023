"""Worker processes of this machine: started, replaced when they are lost, and ended with the command."""

from __future__ import annotations

import pickle
import subprocess
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace

from ...errors import FlarewrightError
from ..processes import end_processes, how_it_ended, start_process
from .worker_side import LocalWorker

# worker processes in a row that may end without a finished item
_MOST_LOST = 8


class LocalWorkers:
    """The worker processes of a local cluster.

    Parameters
    ----------
    start : LocalWorker
        How they start; each has another name.
    announce : callable
        Receives a sentence when a process is lost.
    """

    def __init__(self, start: LocalWorker, announce: Callable[[str], None]) -> None:
        self._start, self._announce = start, announce
        self._threads: int | None = None
        self._processes: list[subprocess.Popen[bytes]] = []
        self._names, self._lost_in_a_row = 0, 0

    def grow(self, number: int, threads: int | None) -> None:
        """Start processes until there are as many as wanted, with a number of threads for the libraries in each."""
        self._threads = threads
        while len(self._processes) < number:
            self._processes.append(self._new())

    def note_result(self) -> None:
        """Note that an item is finished."""
        self._lost_in_a_row = 0

    def watch(self) -> None:
        """Replace processes that have ended.

        Raises
        ------
        FlarewrightError
            Several of them ended without a finished item.
        """
        for k, process in enumerate(self._processes):
            if process.poll() is None:
                continue
            how = how_it_ended(process)
            self._lost_in_a_row += 1
            if self._lost_in_a_row >= _MOST_LOST:
                raise FlarewrightError(
                    f"{_MOST_LOST} worker processes ended one after the other, the last {how}, perhaps for lack of "
                    "memory; finished work is kept: repeat the command with fewer workers, such as --cluster local:1"
                )
            self._announce(f"a worker process ended {how}; another one takes its place and repeats its work")
            with suppress(OSError):
                if process.stdin is not None:
                    process.stdin.close()
            self._processes[k] = self._new()

    def end(self) -> None:
        """End all processes; each finishes the file that it writes."""
        end_processes(self._processes)
        self._processes = []

    def _new(self) -> subprocess.Popen[bytes]:
        process = start_process("from flarewright.jobs.cluster.worker_side import serve; serve()", self._threads)
        self._names += 1
        # a process that has ended already is found by `watch`
        with suppress(OSError):
            assert process.stdin is not None
            pickle.dump(replace(self._start, name=self._names), process.stdin)
            process.stdin.flush()
        return process
