"""Store the state of a long job every few seconds while it runs, and delete it when the job is done."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Event, Thread

from ...errors import OutputError
from ...io.files.atomic_write import delete_written

CHECKPOINT_S = 10.0
"""Time between two checkpoints, unless writing takes more than a tenth of it."""


@contextmanager
def checkpoints(store: Callable[[], None], report: Callable[[str], None]) -> Iterator[None]:
    """Store the state of a job every `CHECKPOINT_S` during the block, on a thread; a full disk does not end the job.

    Parameters
    ----------
    store : callable
        Writes the state; raises OutputError if that fails.
    report : callable
        Called with a sentence on the first failure.
    """
    over = Event()

    def work() -> None:
        pause, reported = CHECKPOINT_S, False
        while not over.wait(pause):
            started = time.perf_counter()
            try:
                store()
            except OutputError as error:
                if not reported:
                    report(f"no checkpoint: {error}")
                reported = True
            pause = max(CHECKPOINT_S, 10.0 * (time.perf_counter() - started))

    thread = Thread(target=work, name="checkpoints", daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


@contextmanager
def kept_until_done(
    path: Path, store: Callable[[], None], report: Callable[[str], None], what: str, *, lasting: bool = False
) -> Iterator[None]:
    """Store the state of a job during the block, and once more if the block fails; its success deletes the file.

    Parameters
    ----------
    path : Path
        The file that `store` writes.
    store, report
        As of `checkpoints`; `store` writes nothing when nothing is new.
    what : str
        What is kept, for the sentence on a failure at the end.
    lasting : bool
        Whether the file stays, with the state at the end.
    """
    ended = False
    try:
        with checkpoints(store, report):
            yield
        ended = True
    finally:
        if ended and not lasting:
            delete_written(path)
        else:
            try:
                store()
            except OutputError as error:
                report(f"{what} are not kept for a later run: {error}")
