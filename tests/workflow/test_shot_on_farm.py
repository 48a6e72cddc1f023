"""A shot on clusters that this process does not own: a Dask scheduler started by hand, and SLURM where there is one."""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest
from moving_shot import LAST, contents, project

from flarewright import shot

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX"),
]
FARM = 'jobs = 2\ncores = 1\nmemory = "2GB"\nwalltime = "00:10:00"\n'


def draw(folder, **more):
    """Draw the shot into a new folder; return the result and the bytes of its files."""
    folder.mkdir()
    result = shot(project(), folder / "f.####.exr", frames=f"1-{LAST}", **more)
    return result, contents(folder)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return draw(tmp_path_factory.mktemp("whole") / "frames", processes=1)[1]


@pytest.fixture
def importable(monkeypatch):
    """Let programs that are started elsewhere import what this process can."""
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(path for path in sys.path if path))


@pytest.fixture
def scheduler(importable):
    """Return the address of a scheduler, and its two workers."""
    pytest.importorskip("distributed", reason="needs the extra cluster")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{free.getsockname()[1]}"
    _, host, port = address.replace("//", "").split(":")
    programs = [start("scheduler", "--host", host, "--port", port, "--no-dashboard")]
    programs += [start("worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard") for _ in range(2)]
    yield address, programs[1:]
    for program in programs:
        program.kill()
        program.wait()


def start(kind, *words):
    command = [sys.executable, "-m", f"distributed.cli.dask_{kind}", *words]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def connected(address, workers, within_s=60.0):
    from distributed import Client

    with Client(address, timeout=within_s) as client:
        client.wait_for_workers(workers, timeout=within_s)


def test_a_scheduler_started_by_hand_that_loses_a_worker_draws_all_frames(whole, scheduler, tmp_path):
    address, workers = scheduler
    connected(address, len(workers))

    def kill_one(result, done, of):
        if done == 1:
            workers[0].kill()

    result, files = draw(tmp_path / "frames", cluster=address, report=kill_one)
    assert [frame.frame for frame in result.frames] == list(range(1, LAST + 1))
    assert files == whole
    # the scheduler and its other worker are not ours to end
    assert workers[1].poll() is None


def slurm_answers():
    if not all(shutil.which(name) for name in ("sbatch", "scancel", "squeue", "sinfo")):
        return False
    try:
        states = subprocess.run(["sinfo", "-h", "-o", "%T"], capture_output=True, text=True, timeout=20.0, check=False)
    except subprocess.TimeoutExpired:
        return False
    return states.returncode == 0 and "idle" in states.stdout


def jobs():
    """Return the identifiers of this account's jobs that wait or run."""
    shown = subprocess.run(
        ["squeue", "-h", "--me", "-t", "PD,R", "-o", "%i"], capture_output=True, text=True, check=True
    )
    return shown.stdout.split()


@pytest.mark.skipif(not slurm_answers(), reason="SLURM does not answer here")
def test_slurm_that_cancels_a_job_draws_all_frames(whole, importable, tmp_path, monkeypatch):
    pytest.importorskip("dask_jobqueue", reason="needs the extra slurm")
    monkeypatch.chdir(tmp_path)
    Path("farm.toml").write_text(FARM)
    before, cancelled = set(jobs()), []

    def cancel_one(result, done, of):
        if done == 1:
            cancelled.append(min(set(jobs()) - before))
            subprocess.run(["scancel", cancelled[0]], check=True)

    result, files = draw(tmp_path / "frames", cluster="slurm:farm.toml", report=cancel_one)
    assert len(result.frames) == LAST
    assert files == whole
    assert cancelled
    end = time.monotonic() + 30.0
    while set(jobs()) - before and time.monotonic() < end:
        time.sleep(0.5)
    assert set(jobs()) - before == set()
