"""Work off items by the workers of a Dask cluster."""

from __future__ import annotations

import os
import pickle
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from itertools import islice
from pathlib import Path
from queue import Empty, SimpleQueue
from threading import Thread
from typing import Any, NoReturn
from uuid import uuid4

from ..._version import __version__
from ...errors import FlarewrightError, ProjectError
from ...io.files.atomic_write import write_bytes_atomically
from ..answers import Done, result_of
from ..processes import next_answer
from .checks import check_threads, differences, refuse_other_versions
from .choice import LocalChoice, SlurmChoice, parse_cluster
from .connections import Connection, connect
from .quiet import quiet
from .slurm_file import read_slurm_settings
from .worker_side import Order, facts, missing_place, work

# items that are submitted ahead, of all and for each worker: a queue that never runs dry, in flat memory
_AHEAD, _AHEAD_OF_WORKER = 256, 3
# seconds between two looks at the workers
_WATCH_S = 1.0


class Cluster:
    """An open cluster; made by `open_cluster`.

    Parameters
    ----------
    connection : Connection
    local : bool
        Whether the workers are processes of this machine.
    chosen : int, optional
        Number of local workers that the text states.
    folder, mark : str
        As of `worker_side.Order`.
    """

    def __init__(
        self, connection: Connection, local: bool, chosen: int | None = None, folder: str = "", mark: str = ""
    ) -> None:
        self._connection, self.local, self.chosen = connection, local, chosen
        self._folder, self._mark, self._started = folder, mark, 0

    @property
    def workers(self) -> int:
        """Number of local workers, also of those that start again; of others those that are there now."""
        if self.local:
            return self._started
        # none if the scheduler does not answer
        with suppress(Exception):
            return len(self._connection.client.nthreads())
        return 0

    def work_off(
        self,
        function: str,
        context: Any,
        items: Sequence[Any],
        *,
        processes: int,
        threads: int | None,
        what: str,
        watch: Callable[[], None] | None = None,
    ) -> Iterator[Done]:
        """Call a function for each item on the workers; parameters and errors as of `processes.work_off`.

        An item whose worker is lost is repeated by another one, so a function can be called twice for an item.
        """
        if not items:
            return
        connection, client = self._connection, self._connection.client
        connection.grow(processes, threads)
        self._started = max(self._started, processes)
        run = uuid4().hex[:12]
        # a task, so that the scheduler makes it again if all workers that hold it are lost
        shared = client.submit(pickle.loads, pickle.dumps(context), key=f"context-{run}", pure=False)
        order = Order(function, threads if self.local else 1, __version__, self._folder, self._mark)
        answers: SimpleQueue[Any] = SimpleQueue()
        todo, pending = iter(enumerate(items)), dict[str, tuple[Any, Any]]()

        def submit(number: int) -> None:
            for place, item in islice(todo, number):
                key = f"{what}-{run}-{place}"
                with _lost_as_sentence(client):
                    # Dask treats submissions within a tenth of a second as equal; earlier items come first
                    future = client.submit(work, shared, order, item, key=key, pure=False, priority=-place)
                pending[future.key] = (item, future)
                future.add_done_callback(answers.put)

        def look() -> None:
            # first what may end this: no lost worker is then replaced for nothing
            if watch is not None:
                watch()
            connection.watch()

        ahead = max(_AHEAD, _AHEAD_OF_WORKER * max(processes, self.workers))
        submit(ahead)
        looked = time.monotonic()
        try:
            while pending:
                found = [next_answer(answers, look)]
                with suppress(Empty):
                    while True:
                        found.append(answers.get_nowait())
                done = [(pending.pop(future.key)[0], future) for future in found]
                submit(ahead - len(pending))
                for (item, _), answer in zip(done, _gathered(connection, done, what), strict=True):
                    connection.note_result()
                    yield Done(item, result_of(item, answer, what))
                if time.monotonic() - looked > _WATCH_S:
                    look()
                    looked = time.monotonic()
        finally:
            # forgotten futures are cancelled
            pending.clear()

    def check(self, announce: Callable[[str], None]) -> None:
        """Compare the workers with this process, before the first item.

        Raises
        ------
        FlarewrightError
            A worker has another version, several threads, or other folders.
        """
        client = self._connection.client
        with _lost_as_sentence(client):
            check_threads(client.nthreads(), client.scheduler.address)
            here, found = facts(), client.run(facts, on_error="return")
            refuse_other_versions(here, found)
            lacking = client.run(missing_place, self._folder, self._mark, on_error="return")
        for address, lacks in lacking.items():
            # one that left meanwhile answers with an exception
            if lacks and isinstance(lacks, str):
                raise FlarewrightError(
                    f"the worker {address} on {found[address].host} {lacks}; give folders that all machines share"
                )
        for line in differences(here, list(found.values())):
            announce(line)


def _lost(error: BaseException) -> FlarewrightError:
    return FlarewrightError(
        f"the connection with the cluster is lost ({type(error).__name__}); finished work is kept: repeat the command"
    )


@contextmanager
def _lost_as_sentence(client: Any) -> Iterator[None]:
    """Turn an exception of the block into a sentence if the client has lost its scheduler."""
    try:
        yield
    except FlarewrightError:
        raise
    except Exception as error:
        # a broken connection is noticed by its user before its state changes
        if client.status == "running" and not isinstance(error, OSError):
            raise
        raise _lost(error) from None


def _gathered(connection: Connection, done: Sequence[tuple[Any, Any]], what: str) -> list[tuple[Any, ...]]:
    """Return the answers in finished futures.

    A result lies on its worker until it is fetched. If that worker is lost, the item is repeated, which needs other
    workers: so the fetch waits on a thread, and the workers are watched meanwhile.
    """
    found: SimpleQueue[Any] = SimpleQueue()

    def fetch() -> None:
        try:
            found.put(connection.client.gather([future for _, future in done]))
        except BaseException as error:
            found.put(error)

    failed = [(item, future) for item, future in done if future.status == "error"]
    if not failed:
        Thread(target=fetch, daemon=True).start()
        answers = next_answer(found, connection.watch)
        if isinstance(answers, list):
            return answers
        # a repeated item can fail
        failed = [(item, future) for item, future in done if future.status == "error"]
        if not failed:
            raise _lost(answers)
    _raise_failed(*failed[0], what)


def _raise_failed(item: Any, future: Any, what: str) -> NoReturn:
    """Raise the error of an item that no worker could work off; errors of its function are answers."""
    error = future.exception()
    if type(error).__name__ == "KilledWorker":
        raise FlarewrightError(
            f"{getattr(error, 'allowed_failures', 0) + 1} workers ended one after the other at {what} {item} or the "
            "one that waited behind it, perhaps for lack of memory; finished work is kept: repeat the command with "
            "fewer workers on a machine"
        )
    if isinstance(error, ImportError):
        raise FlarewrightError(
            f"a worker cannot work off {what} {item} ({error}); install flarewright {__version__} there"
        )
    raise RuntimeError(f"{what} {item}: {type(error).__name__}: {error}") from error


def workers_of(cluster: str | None, processes: int | None, threads: int | None) -> int | None:
    """Return the number of processes that a command's options state; None: by cores and memory.

    Parameters
    ----------
    cluster : str, optional
        As of `parse_cluster`.
    processes, threads : int, optional

    Raises
    ------
    ProjectError
        They contradict each other, or are below 1.

    Examples
    --------
    >>> workers_of("local:4", None, None), workers_of(None, 2, None)
    (4, 2)
    """
    for what, number in (("processes", processes), ("threads", threads)):
        if number is not None and number < 1:
            raise ProjectError(f"{number} {what} are not possible; give 1 or more, or None for one per core")
    if cluster is None:
        return processes
    choice = parse_cluster(cluster)
    if isinstance(choice, LocalChoice):
        if choice.workers is not None and processes is not None:
            raise ProjectError(f"--processes {processes} and --cluster {cluster} both set the processes; keep one")
        return processes if choice.workers is None else choice.workers
    for flag, value in (("processes", processes), ("threads", threads)):
        if value is not None:
            raise ProjectError(
                f"--{flag} has no effect on --cluster {cluster}, whose workers have one thread each; omit it"
            )
    return None


def _remove(mark: Path) -> None:
    with suppress(OSError):
        mark.unlink(missing_ok=True)


@contextmanager
def open_cluster(
    text: str | None, folder: str | os.PathLike[str], announce: Callable[[str], None] | None = None
) -> Iterator[Cluster | None]:
    """Connect with a cluster for the block.

    Parameters
    ----------
    text : str or None
        As of `parse_cluster`. None: there is no cluster, and Dask is not imported.
    folder : path
        Folder of the results; all workers must see it.
    announce : callable, optional
        Receives sentences about the cluster as they arise.

    Yields
    ------
    Cluster or None

    Raises
    ------
    FlarewrightError
        The text is no cluster, a package is missing, no such cluster runs, or its workers have another version or do
        not see the folder.
    """
    if text is None:
        yield None
        return
    choice = parse_cluster(text)
    say = announce or (lambda _: None)
    settings = read_slurm_settings(choice.file) if isinstance(choice, SlurmChoice) else None
    with quiet(), ExitStack() as stack:
        connection = connect(choice, settings, say)
        stack.callback(connection.close)
        if isinstance(choice, LocalChoice):
            yield Cluster(connection, True, choice.workers)
            return
        mark = Path(folder).resolve() / f".flarewright-{uuid4().hex}"
        write_bytes_atomically(mark, b"A command that draws on several machines is running.\n")
        stack.callback(_remove, mark)
        cluster = Cluster(connection, False, None, os.getcwd(), str(mark))
        cluster.check(say)
        yield cluster
