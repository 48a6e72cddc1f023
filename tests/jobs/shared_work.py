"""Functions of (context, item, threads) that the tests of the processes call in other interpreters."""

import os
import signal
import sys
import time
from pathlib import Path

from flarewright.errors import OutputError


def add(context, item, threads):
    # what a library prints must not disturb the answers
    print("noise")
    return context + item, os.getpid(), threads, os.environ.get("NUMBA_NUM_THREADS")


def fail(context, item, threads):
    if item == context:
        raise OutputError("cannot write a.exr: no space left", ("one", "two"))
    if item == context + 1:
        raise ValueError("a bug")
    return item


def die(context, item, threads):
    if item == context:
        os.kill(os.getpid(), signal.SIGKILL if sys.platform != "win32" else signal.SIGTERM)
    return item


def mark(context, item, threads):
    (Path(context) / f"{item}.{os.getpid()}").write_text("")
    time.sleep(60.0)
    return item
