"""`quiet` suppresses the output of libraries while a file is read, and restores the streams afterwards."""

import os
import sys
from concurrent.futures import ThreadPoolExecutor
from threading import Barrier

import pytest

from flarewright.io.files.silence_libraries import silenced


def noise(words):
    os.write(2, words.encode())
    print(words)


def test_libraries_are_silent_within_and_heard_after(capfd):
    with silenced():
        noise("within")
    noise("after")
    assert capfd.readouterr() == ("after\n", "after")


def test_readers_may_come_and_go_in_any_order(capfd):
    """The first reader ends first: only the last one restores the streams."""
    together, gone = Barrier(2), Barrier(2)

    def first():
        with silenced():
            together.wait()
            noise("first")
        gone.wait()

    def second():
        with silenced():
            together.wait()
            gone.wait()
            noise("second")

    before = sys.stdout
    with ThreadPoolExecutor(2) as pool:
        for each in [pool.submit(first), pool.submit(second)]:
            each.result()
    assert sys.stdout is before
    noise("after")
    assert capfd.readouterr() == ("after\n", "after")


def test_what_goes_wrong_within_lets_the_streams_back(capfd):
    with pytest.raises(OSError, match="broken"), silenced():
        raise OSError("broken")
    noise("after")
    assert capfd.readouterr() == ("after\n", "after")


def test_a_process_without_an_error_stream_reads_too(monkeypatch):
    def none(_):
        raise OSError(9, "bad file descriptor")

    monkeypatch.setattr(os, "dup", none)
    with silenced():
        pass
