"""A process that runs hostile inputs, with limits on time and memory."""

from __future__ import annotations

import multiprocessing
import os
import resource
import signal
import time
from contextlib import suppress
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection

from .answers import PATIENCE_S, peak_mb
from .compile_time import compile_time
from .kinds import KINDS, SLOW
from .verdict import Verdict

# wall time after which a worker is killed, seconds: machines are slow and busy
LOST_S = 300.0
# whole measurements and galleries, several times
LOST_LONG_S = 3600.0
# no input may need more memory than this beside the program itself, MB
MOST_MB = 1024.0
# of address space for a worker, so that a wrong size ends in a MemoryError instead of a full machine
SPACE = 12 * 2**30


@dataclass(frozen=True)
class Tried:
    """An input as the worker saw it."""

    verdict: Verdict
    cpu_s: float
    """Without the compilation of kernels."""
    peak_mb: float


def _work(pipe: Connection) -> None:
    # a killed worker closes nothing: editors and browsers that it started end with its group
    os.setpgrp()
    # a browser, which needs more, lifts the limit
    resource.setrlimit(resource.RLIMIT_AS, (SPACE, resource.getrlimit(resource.RLIMIT_AS)[1]))
    while True:
        kind, seed = pipe.recv()
        before = time.process_time() - compile_time().seconds()
        verdict = KINDS[kind](seed)
        pipe.send(Tried(verdict, time.process_time() - compile_time().seconds() - before, peak_mb()))


class Worker:
    """A process that runs inputs; replaced when it dies, hangs or has grown."""

    def __init__(self) -> None:
        self._process: multiprocessing.process.BaseProcess | None = None
        self._base_mb = 0.0

    def run(self, kind: str, seed: int) -> Tried:
        """Run one input and judge time and memory too."""
        if self._process is None:
            self._start()
        process = self._process
        assert process is not None
        self._pipe.send((kind, seed))
        patience_s = LOST_LONG_S if kind in SLOW else LOST_S
        if not self._pipe.poll(patience_s):
            self.stop()
            return Tried(Verdict(kind, f"seed {seed}", False, f"no answer in {patience_s:g} s"), patience_s, 0.0)
        try:
            tried: Tried = self._pipe.recv()
        except (EOFError, ConnectionResetError):
            process.join(10.0)
            code = process.exitcode
            self.stop()
            return Tried(Verdict(kind, f"seed {seed}", False, f"the interpreter ended with {code}"), 0.0, 0.0)
        self._base_mb = self._base_mb or tried.peak_mb
        grown = tried.peak_mb - self._base_mb
        verdict = tried.verdict
        if verdict.held and tried.cpu_s > 2.0 * PATIENCE_S:
            verdict = replace(verdict, held=False, remark=f"{tried.cpu_s:.0f} CPU s")
        if verdict.held and grown > MOST_MB:
            verdict = replace(verdict, held=False, remark=f"{grown:.0f} MB")
        if grown > 0.5 * MOST_MB:
            # the peak never falls: a new process sees the next one
            self.stop()
        return replace(tried, verdict=verdict)

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=_work, args=(theirs,), daemon=True)
        self._process.start()
        theirs.close()
        self._base_mb = 0.0

    def stop(self) -> None:
        """End the process."""
        if self._process is not None:
            assert self._process.pid is not None, "it is started"
            with suppress(ProcessLookupError):
                os.killpg(self._process.pid, signal.SIGKILL)
            self._process.kill()
            self._process.join()
            self._pipe.close()
            self._process = None
