"""The command starts in any environment: closed streams, and settings of libraries that they cannot read."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from flarewright.cli.app import _check_threads


@pytest.mark.skipif(os.name == "nt", reason="needs a POSIX shell")
def test_what_is_said_to_a_closed_error_stream_goes_nowhere_else(tmp_path):
    """It used to be printed among the results. A command that does not exist answers before anything is loaded."""
    command = f"exec {sys.executable} -m flarewright nosuch 2>&-"
    done = subprocess.run(["sh", "-c", command], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (2, "")


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs a device that is always full")
def test_a_full_error_stream_ends_no_command(tmp_path):
    """The remark on the number of threads ended any command with a traceback and code 1: a log on a full disk."""
    command = f"NUMBA_NUM_THREADS=abc exec {sys.executable} -m flarewright --version 2>/dev/full"
    done = subprocess.run(["sh", "-c", command], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0
    assert done.stdout.startswith("flarewright ")


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs a device that is always full")
def test_a_full_output_stream_is_named(tmp_path):
    command = f"exec {sys.executable} -m flarewright --version >/dev/full"
    done = subprocess.run(["sh", "-c", command], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr == (
        "flarewright: error: cannot write the output: no space left on device; free some space, or write it elsewhere\n"
    )


def test_a_number_of_threads_that_is_none_is_ignored(monkeypatch, capsys):
    for text, kept in (("abc", False), ("0", False), ("2", True)):
        monkeypatch.setenv("NUMBA_NUM_THREADS", text)
        _check_threads()
        assert ("NUMBA_NUM_THREADS" in os.environ) == kept
        sentence = f"flarewright: NUMBA_NUM_THREADS is {text!r}, no whole number above 0: ignored\n"
        assert capsys.readouterr().err == ("" if kept else sentence)
