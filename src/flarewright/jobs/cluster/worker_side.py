"""What runs on a worker: its versions, an item, and the loop of a worker process of this machine."""

from __future__ import annotations

import os
import pickle
import platform
import shutil
import sys
from contextlib import suppress
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from threading import Lock, Thread
from typing import Any

from ..._version import __version__
from ..worker import WRITING, as_child, attempt, named
from .quiet import quiet

# packages whose version can change the bytes of a file
_COMPARED = ("numpy", "numba", "llvmlite", "scipy", "OpenEXR", "pillow", "av", "rawpy", "tifffile")
# the working folder belongs to the process: one item at a time, whatever the number of threads
_ONE = Lock()
# marks that this process has found
_seen: set[str] = set()


@dataclass(frozen=True)
class Facts:
    """What must agree between the caller and a worker.

    Attributes
    ----------
    flarewright : str
        Version.
    versions : dict of str to str
        Others that can change the bytes of a file.
    host : str
    pid : int
    """

    flarewright: str
    versions: dict[str, str]
    host: str
    pid: int


@dataclass(frozen=True)
class Order:
    """What all items of a list share, except the context.

    Attributes
    ----------
    function : str
        "module:name", as of `processes.work_off`.
    threads : int or None
        Of each item; None: those of the worker.
    version : str
        Of Flarewright.
    folder : str
        Working folder, from which relative names start; empty: that of the worker.
    mark : str
        A file that the caller has written into the folder of the results; empty: none.
    """

    function: str
    threads: int | None
    version: str
    folder: str
    mark: str = ""


@dataclass(frozen=True)
class LocalWorker:
    """How a worker process of this machine starts.

    Attributes
    ----------
    address : str
        Of the scheduler.
    security : object
        `distributed.Security`.
    name : int
    scratch : str
        Folder for temporary files.
    """

    address: str
    security: Any
    name: int
    scratch: str


def facts() -> Facts:
    """Return the versions of this process."""
    return Facts(
        __version__, {"python": platform.python_version(), **_packages(), **_machine()}, platform.node(), os.getpid()
    )


def _packages() -> dict[str, str]:
    found = {}
    for name in _COMPARED:
        with suppress(PackageNotFoundError):
            found[name] = version(name)
    return found


def _machine() -> dict[str, str]:
    # compiled code differs between processors, in the last bit of a sine for example
    from llvmlite.binding import get_host_cpu_name

    return {"system": f"{platform.system()} {platform.machine()}", "processor": get_host_cpu_name()}


def missing_place(folder: str, mark: str) -> str:
    """Return what this worker lacks of the caller's folders, as the end of a sentence; empty: nothing."""
    if folder and not os.path.isdir(folder):
        return f"does not see the working folder {folder}"
    if mark and mark not in _seen:
        if not os.path.isfile(mark):
            return f"does not see the folder {os.path.dirname(mark)}"
        _seen.add(mark)
    return ""


def work(context: Any, order: Order, item: Any) -> tuple[Any, ...]:
    """Work off one item; return its answer, as `worker.attempt` does.

    A worker can join after the caller has compared versions and folders, so each item compares them again.
    """
    if order.version != __version__:
        host = platform.node()
        return ("refused", f"a worker on {host} has flarewright {__version__}, not {order.version}: update it", ())
    with _ONE:
        if lacks := missing_place(order.folder, order.mark):
            return ("refused", f"a worker on {platform.node()} {lacks}: give folders that all machines share", ())
        if order.folder and order.folder != os.getcwd():
            os.chdir(order.folder)
        try:
            function = named(order.function)
        except Exception as error:
            return ("failed", f"{type(error).__name__}: {error}")
        return attempt(function, context, item, order.threads)


def serve() -> None:
    """Be a worker of the scheduler that stdin names; end with the process that started this one."""
    as_child()
    start: LocalWorker = pickle.load(sys.stdin.buffer)
    Thread(target=_end_with_caller, args=(start.scratch,), daemon=True).start()
    import asyncio

    with quiet():
        asyncio.run(_run(start))
    # threads of a running item would keep the process
    with WRITING:
        os._exit(0)


async def _run(start: LocalWorker) -> None:
    from importlib import import_module

    distributed = import_module("distributed")
    worker = distributed.Worker(
        start.address,
        nthreads=1,
        name=start.name,
        security=start.security,
        host="127.0.0.1",
        memory_limit=0,
        local_directory=start.scratch,
        dashboard=False,
        dashboard_address="127.0.0.1:0",
    )
    async with worker:
        await worker.finished()


def _end_with_caller(scratch: str) -> None:
    """End the process when the caller closes its stdin or ends, also within an item."""
    try:
        sys.stdin.buffer.read()
    finally:
        with WRITING:
            # a caller that was killed cannot remove it
            shutil.rmtree(scratch, ignore_errors=True)
            os._exit(0)
