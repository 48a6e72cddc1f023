"""The loop of a process that works off items; it imports nothing heavy before it knows its number of threads."""

from __future__ import annotations

import os
import pickle
import signal
import sys
import traceback
from collections.abc import Callable
from contextlib import suppress
from importlib import import_module
from queue import SimpleQueue
from threading import Lock, Thread
from typing import Any

from .one_heap import keep_freed_memory, share_one_heap

WRITING = Lock()
"""Held while a result is written, so that a process whose parent has ended leaves no temporary file."""


def serve() -> None:
    """Work off the items that arrive as pickles on stdin; answer on stdout; end with the parent process.

    The first item is (function as "module:name", context, threads). Each further item is the argument of one call
    `function(context, item, threads)`, answered by ("done", result), ("refused", sentence, problems), ("memory",) or
    ("failed", traceback).
    """
    share_one_heap()
    keep_freed_memory()
    answers = os.fdopen(os.dup(1), "wb")
    as_child()
    items: SimpleQueue[Any] = SimpleQueue()
    Thread(target=_receive, args=(items,), daemon=True).start()
    where, context, threads = items.get()
    try:
        function = named(where)
    except BaseException:
        _answer(answers, ("failed", traceback.format_exc()))
        return
    while True:
        _answer(answers, attempt(function, context, items.get(), threads))


def as_child() -> None:
    """Leave signals to the parent, and stdout to its answers."""
    # a terminal sends Ctrl-C to all its processes; the parent decides, and closes stdin
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        with suppress(AttributeError, ValueError, OSError):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    # libraries that print to stdout must not disturb the answers
    os.dup2(2, 1)


def named(where: str) -> Callable[..., Any]:
    """Return the function of a text "module:name"."""
    module, _, name = where.partition(":")
    function: Callable[..., Any] = getattr(import_module(module), name)
    return function


def attempt(function: Callable[..., Any], context: Any, item: Any, threads: int | None) -> tuple[Any, ...]:
    """Call the function for one item; return its answer, as `serve` describes."""
    from ..errors import FlarewrightError

    try:
        return ("done", function(context, item, threads))
    except FlarewrightError as error:
        return ("refused", str(error), tuple(error.problems))
    except MemoryError:
        return ("memory",)
    except Exception:
        return ("failed", traceback.format_exc())


def _receive(items: SimpleQueue[Any]) -> None:
    """Queue what arrives on stdin; end the process when the parent closes it or ends, also within an item."""
    try:
        while True:
            items.put(pickle.load(sys.stdin.buffer))
    finally:
        with WRITING:
            os._exit(0)


def _answer(answers: Any, answer: tuple[Any, ...]) -> None:
    try:
        pickle.dump(answer, answers)
        answers.flush()
    except OSError:
        # the parent, its only reader, has ended
        os._exit(0)
