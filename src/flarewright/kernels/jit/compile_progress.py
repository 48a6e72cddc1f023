"""Progress of a first run, estimated from the compiled kernels and the clock: the compiler reports nothing."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import accumulate
from threading import Event, Lock, Thread

from ...typing import Progress

WORDS = "compiling kernels"
_TICK_S = 0.25
# assumed slowness until the first kernel is compiled, which includes the start of the compiler
_FIRST_SLOWNESS = 1.5
# largest part reported: the run is not complete before all helpers have ended
_NEARLY = 0.99


@dataclass(frozen=True)
class Schedule:
    """The expected times of a first run.

    Attributes
    ----------
    ends_s : tuple of float
        Expected end of each kernel that this process compiles, in order, from the start.
    whole_s : float
        Expected end of the slowest process.
    """

    ends_s: tuple[float, ...]
    whole_s: float


def schedule(own_s: Sequence[float], others_s: Sequence[float]) -> Schedule:
    """Return the schedule of a first run.

    Parameters
    ----------
    own_s : sequence of float
        Duration of each kernel of this process.
    others_s : sequence of float
        Duration of each other process.
    """
    ends = tuple(accumulate(own_s))
    return Schedule(ends, max([0.0, *ends[-1:], *others_s]))


def part_done(plan: Schedule, finished: int, finished_at_s: float, now_s: float) -> float:
    """Return the part of a first run that is done, from the finished kernels and the time since the last of them.

    Parameters
    ----------
    plan : Schedule
    finished : int
        Number of kernels that this process has compiled.
    finished_at_s, now_s : float
        Time of the last finished kernel, and current time, from the start.

    Returns
    -------
    float
        0 to 0.99. It never falls while `finished` and `now_s` rise. It stops at the expected end of a kernel that takes
        longer than expected; the finished kernels calibrate the speed of the machine.
    """
    if not plan.whole_s > 0.0:
        return 0.0
    expected, following = [0.0, *plan.ends_s, plan.whole_s][finished : finished + 2]
    slowness = finished_at_s / expected if expected > 0.0 and finished_at_s > 0.0 else _FIRST_SLOWNESS
    reached = min(expected + (now_s - finished_at_s) / slowness, max(expected, following))
    return min(reached / plan.whole_s, _NEARLY)


@contextmanager
def reporting(
    plan: Schedule, progress: Progress | None, clock: Callable[[], float] = time.perf_counter
) -> Iterator[Callable[[], None]]:
    """Report the progress of the block after every kernel and four times a second in between.

    Parameters
    ----------
    plan : Schedule
    progress : callable or None
        Called with the part done and a label; None for no reports.
    clock : callable
        Returns the time in seconds.

    Yields
    ------
    callable
        Call it after each kernel that this process has compiled.
    """
    if progress is None:
        yield lambda: None
        return
    started, over, turn = clock(), Event(), Lock()
    finished: list[float] = [0.0]

    def report() -> None:
        # the lock keeps reports in order
        with turn:
            progress(part_done(plan, len(finished) - 1, finished[-1], clock() - started), WORDS)

    def tick() -> None:
        while not over.wait(_TICK_S):
            report()

    def note() -> None:
        finished.append(clock() - started)
        report()

    report()
    ticking = Thread(target=tick, daemon=True)
    ticking.start()
    try:
        yield note
    finally:
        over.set()
        ticking.join()
