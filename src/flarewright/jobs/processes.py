"""Share independent items among processes."""

from __future__ import annotations

import pickle
import subprocess
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from queue import Empty, SimpleQueue
from threading import Lock, Thread
from typing import Any, NoReturn, Protocol

from ..errors import FlarewrightError
from ..kernels.jit.warmup_processes import cores, start_python
from .answers import Done, result_of
from .worker import named

# time that a process gets to write its present result when it has to end
_PATIENCE_S = 10.0
# libraries that read their number of threads from the environment when they are imported
_THREADS = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


class Executor(Protocol):
    """What works off items instead of processes of this machine: `cluster.executor.Cluster`."""

    def work_off(
        self,
        function: str,
        context: Any,
        items: Sequence[Any],
        *,
        processes: int,
        threads: int | None,
        what: str,
        watch: Callable[[], None] | None,
    ) -> Iterator[Done]:
        """Parameters and errors as of `processes.work_off`."""
        ...


def shares(items: int, processes: int | None = None, threads: int | None = None) -> tuple[int, int]:
    """Return how many processes work off items, and the threads of each, so that the machine is not oversubscribed.

    Parameters
    ----------
    items : int
    processes : int, optional
        None: one a core. Never more than items.
    threads : int, optional
        Threads of all processes together; None: the cores.

    Returns
    -------
    tuple of int

    Examples
    --------
    >>> shares(100, processes=4, threads=8), shares(1, processes=4, threads=8)
    ((4, 2), (1, 8))
    """
    all_threads = threads or cores()
    number = max(1, min(processes or all_threads, items))
    return number, max(1, all_threads // number)


def fitting(process_bytes: float, threads: int | None) -> int:
    """Return how many processes the cores, or the wanted threads of all together, and the free memory allow.

    Parameters
    ----------
    process_bytes : float
        Memory of one.
    threads : int, optional
        None: the cores.
    """
    from ..render.scene.memory_check import spare_bytes

    return max(1, int(min(threads or cores(), spare_bytes() / process_bytes)))


def work_off(
    function: str,
    context: Any,
    items: Sequence[Any],
    *,
    processes: int = 1,
    threads: int | None = None,
    what: str = "item",
    executor: Executor | None = None,
    watch: Callable[[], None] | None = None,
) -> Iterator[Done]:
    """Call a function for each item, and yield the results as they come.

    Parameters
    ----------
    function : str
        "module:name" of a function of (context, item, threads). Its result must not depend on the process, the order or
        the threads.
    context : object
        First argument of all calls; sent to each process once, as a pickle.
    items : sequence
    processes : int
        1: in this process. More: new interpreters (on every system, never a copy of this process) that keep what they
        have loaded for all their items, and end with the iterator or with this process.
    threads : int, optional
        Threads of each process; None: all cores.
    what : str
        What an item is, for messages.
    executor : Executor, optional
        Works off the items instead; None: processes of this machine.
    watch : callable, optional
        Called about twice a second while other processes work; an exception of it ends them.

    Yields
    ------
    Done
        In the order in which items are finished.

    Raises
    ------
    FlarewrightError
        The function raised one for an item, or a process was lost; results before it are valid.
    MemoryError
        A process has no memory for an item.
    RuntimeError
        Any other exception of the function, with its traceback.
    """
    if executor is not None:
        yield from executor.work_off(
            function, context, items, processes=processes, threads=threads, what=what, watch=watch
        )
        return
    if processes == 1:
        call = named(function)
        for item in items:
            yield Done(item, call(context, item, threads))
        return
    answers: SimpleQueue[tuple[Any, tuple[Any, ...]]] = SimpleQueue()
    todo, lock = iter(items), Lock()
    first = (function, context, threads)
    started: list[subprocess.Popen[bytes]] = []
    try:
        for _ in range(min(processes, len(items))):
            process = start_process(f"from {__package__}.worker import serve; serve()", threads)
            started.append(process)
            Thread(target=_attend, args=(process, first, todo, lock, answers), daemon=True).start()
        for _ in items:
            item, answer = next_answer(answers, watch)
            if answer[0] == "lost":
                _raise_lost(answer[1], item, what)
            yield Done(item, result_of(item, answer, what))
    finally:
        end_processes(started)


def start_process(code: str, threads: int | None) -> subprocess.Popen[bytes]:
    """Start an interpreter with a pipe to its stdin and from its stdout.

    Parameters
    ----------
    code : str
        Statements.
    threads : int, optional
        Threads of its libraries; None: as they choose.

    Raises
    ------
    FlarewrightError
        No process can be started.
    """
    number = {} if threads is None else dict.fromkeys(_THREADS, str(threads))
    try:
        return start_python(code, stdout=subprocess.PIPE, environment=number)
    except (OSError, ValueError) as error:
        raise FlarewrightError(f"no further process can be started ({error}); give fewer --processes") from None


def _attend(
    process: subprocess.Popen[bytes],
    first: Any,
    todo: Iterator[Any],
    lock: Lock,
    answers: SimpleQueue[tuple[Any, tuple[Any, ...]]],
) -> None:
    """Feed one process; queue its answers, or that it was lost."""
    assert process.stdin is not None
    assert process.stdout is not None
    item = None
    try:
        pickle.dump(first, process.stdin)
        while True:
            with lock:
                item = next(todo)
            pickle.dump(item, process.stdin)
            process.stdin.flush()
            answers.put((item, pickle.load(process.stdout)))
    except StopIteration:
        pass
    # a process that was killed while it answered leaves half a pickle
    except (OSError, EOFError, ValueError, pickle.UnpicklingError):
        answers.put((item, ("lost", process)))


def next_answer(answers: SimpleQueue[Any], watch: Callable[[], None] | None = None) -> Any:
    """Wait for an answer; with pauses, because some systems deliver Ctrl-C only between calls.

    Parameters
    ----------
    answers : SimpleQueue
    watch : callable, optional
        Called in each pause.
    """
    while True:
        with suppress(Empty):
            return answers.get(timeout=0.5)
        if watch is not None:
            watch()


def _raise_lost(process: subprocess.Popen[bytes], item: Any, what: str) -> NoReturn:
    where = "before its first work" if item is None else f"at {what} {item}"
    raise FlarewrightError(
        f"a process ended {how_it_ended(process)} {where}, perhaps for lack of memory; finished work is kept: repeat "
        "the command, with fewer --processes"
    )


def how_it_ended(process: subprocess.Popen[bytes]) -> str:
    """Return the end of a lost process in words: "by signal 9", "with exit code 1"."""
    with suppress(subprocess.TimeoutExpired):
        process.wait(1.0)
    code = process.returncode
    return f"by signal {-code}" if code is not None and code < 0 else f"with exit code {code}"


def end_processes(started: Sequence[subprocess.Popen[bytes]]) -> None:
    """End processes: closing their stdin lets each finish what it writes."""
    for process in started:
        with suppress(OSError):
            if process.stdin is not None:
                process.stdin.close()
    for process in started:
        try:
            process.wait(_PATIENCE_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
