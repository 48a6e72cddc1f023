"""How far a first run has compiled, reported while it compiles: the compiler itself reports nothing."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import accumulate
from threading import Event, Lock, Thread

Progress = Callable[[float, str], None]

WORDS = "compiling kernels"
_TICK_S = 0.25
# until a kernel is finished: the first one pays for the compiler's own start too
_FIRST_SLOWNESS = 1.5
# it is not over before everything has been waited for
_NEARLY = 0.99


@dataclass(frozen=True)
class Schedule:
    """When a first run expects to have compiled what.

    Attributes
    ----------
    ends_s : tuple of float
        Of each kernel that this process compiles, in order, from the start.
    whole_s : float
        The end of the process that takes longest.
    """

    ends_s: tuple[float, ...]
    whole_s: float


def schedule(own_s: Sequence[float], others_s: Sequence[float]) -> Schedule:
    """Return the schedule of a first run.

    Parameters
    ----------
    own_s : sequence of float
        How long each kernel of this process takes.
    others_s : sequence of float
        How long each other process takes.
    """
    ends = tuple(accumulate(own_s))
    return Schedule(ends, max([0.0, *ends[-1:], *others_s]))


def part_done(plan: Schedule, finished: int, finished_at_s: float, now_s: float) -> float:
    """Return the part of a first run that is done, by the kernels that are finished and the time between them.

    Parameters
    ----------
    plan : Schedule
    finished : int
        Kernels that this process has compiled.
    finished_at_s, now_s : float
        When it finished the last one, and now, from the start.

    Returns
    -------
    float
        0 to 0.99. It never falls while `finished` and `now_s` rise, and waits at the end of a kernel that takes longer
        than expected; finished kernels correct for the speed of the machine.
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
    """Report how far the block has come, at every kernel and four times a second between them.

    Parameters
    ----------
    plan : Schedule
    progress : callable or None
        Called with the part done and a few words; None: no reports.
    clock : callable
        Returns seconds.

    Yields
    ------
    callable
        To be called when a kernel of this process is compiled.
    """
    if progress is None:
        yield lambda: None
        return
    begun, over, turn = clock(), Event(), Lock()
    finished: list[float] = [0.0]

    def report() -> None:
        # one at a time, so that no report is overtaken by a later one
        with turn:
            progress(part_done(plan, len(finished) - 1, finished[-1], clock() - begun), WORDS)

    def tick() -> None:
        while not over.wait(_TICK_S):
            report()

    def note() -> None:
        finished.append(clock() - begun)
        report()

    report()
    ticking = Thread(target=tick, daemon=True)
    ticking.start()
    try:
        yield note
    finally:
        over.set()
        ticking.join()
