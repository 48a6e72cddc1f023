"""A job that still submits work while the process ends says nothing."""

from __future__ import annotations

import subprocess
import sys
import threading

import pytest

from flarewright.editor.common.latest_job import refused_at_exit

BUSY = """
import time
from concurrent.futures import ThreadPoolExecutor
from flarewright.editor.common.latest_job import Lane

def job(check):
    with ThreadPoolExecutor(2) as pool:
        while True:
            done = [pool.submit(time.sleep, 0.001) for _ in range(2)]
            done[0].result()

lanes = [Lane("a lane") for _ in range(4)]
for lane in lanes:
    lane.submit(job)
time.sleep(0.2)
"""


def test_the_end_of_a_process_whose_jobs_submit_work_is_quiet():
    done = subprocess.run([sys.executable, "-c", BUSY], capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize(
    ("words", "ends", "refused"),
    [
        ("cannot schedule new futures after interpreter shutdown", False, True),
        ("cannot schedule new futures after shutdown", True, True),
        # a pool that someone closed too early is a bug
        ("cannot schedule new futures after shutdown", False, False),
        ("a pool is empty", True, False),
    ],
)
def test_only_the_end_of_the_process_refuses_work(monkeypatch, words, ends, refused):
    monkeypatch.setattr(threading, "_SHUTTING_DOWN", ends, raising=False)
    assert refused_at_exit(RuntimeError(words)) is refused
    assert not refused_at_exit(ValueError(words))
