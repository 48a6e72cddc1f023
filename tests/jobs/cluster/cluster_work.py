"""Functions of (context, item, threads) that workers of the tests call, and a stand-in for a Dask client."""

import os
import signal
import time
from pathlib import Path

from flarewright.errors import OutputError


def add(context, item, threads):
    return context + item, os.getpid(), threads, os.getcwd()


def refuse(context, item, threads):
    if item == context:
        raise OutputError("cannot write a.exr: no space left", ("one", "two"))
    if item == context + 1:
        raise ValueError("a bug")
    return item


def die_once(context, item, threads):
    """Kill this process at one item, unless a mark states that it was killed before."""
    mark = Path(context) / "killed"
    if item == 3 and not mark.exists():
        mark.write_text("")
        os.kill(os.getpid(), signal.SIGKILL)
    time.sleep(0.05)
    return item, os.getpid()


def die(context, item, threads):
    if item == context:
        os.kill(os.getpid(), signal.SIGKILL)
    return item


class KilledWorker(Exception):  # noqa: N818 - the name of Dask's
    allowed_failures = 3


class Future:
    """A task: finished when it is submitted."""

    def __init__(self, client, key, call):
        self.client, self.key = client, key
        try:
            self.value, self.status = call(), "finished"
        except Exception as error:
            self.value, self.status = error, "error"

    def add_done_callback(self, call):
        self.client.waiting += 1
        self.client.most = max(self.client.most, self.client.waiting)
        call(self)

    def exception(self):
        return self.value


class Client:
    """What the executor uses of a client; runs tasks in this process."""

    def __init__(self, fails=None):
        self.fails, self.waiting, self.most, self.submitted, self.status = fails, 0, 0, [], "running"
        self.priorities = []

    def nthreads(self):
        return {"tcp://a:1": 1, "tcp://b:1": 1}

    def submit(self, function, *arguments, key, pure, priority=None):
        if priority is not None:
            self.priorities.append(priority)

        def call():
            if self.fails and key.startswith("frame"):
                raise self.fails
            return function(*(each.value if isinstance(each, Future) else each for each in arguments))

        self.submitted.append(key)
        return Future(self, key, call)

    def gather(self, futures):
        self.waiting -= len(futures)
        return [each.value for each in futures]


class Connection:
    """A connection whose workers are this process."""

    def __init__(self, fails=None):
        self.client, self.results = Client(fails), 0

    def grow(self, workers, threads):
        self.grown = workers, threads

    def watch(self):
        pass

    def note_result(self):
        self.results += 1
