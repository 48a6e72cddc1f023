"""A shot and a data set on real clusters: the bytes of one process, also if a worker is killed in the middle."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from moving_shot import LAST, contents, project

from flarewright import dataset, shot
from flarewright.io.project.project_text import project_text
from flarewright.model.project.dataset import DatasetSpec

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX"),
]


@pytest.fixture(autouse=True)
def _with_dask():
    pytest.importorskip("distributed", reason="needs the extra cluster")


def workers():
    """Return the worker processes of this machine that belong to this one."""
    found = []
    for folder in Path("/proc").iterdir():
        try:
            if not folder.name.isdigit():
                continue
            parent = (folder / "stat").read_text().rpartition(")")[2].split()
            if (
                parent[0] != "Z"
                and int(parent[1]) == os.getpid()
                and b"worker_side" in (folder / "cmdline").read_bytes()
            ):
                found.append(int(folder.name))
        except OSError:
            continue
    return found


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole")
    shot(project(), folder / "f.####.exr", frames=f"1-{LAST}", processes=1)
    return contents(folder)


@pytest.mark.skipif(not Path("/proc").exists(), reason="finds the workers in /proc")
def test_a_worker_killed_in_the_middle_loses_no_frame(whole, tmp_path):
    killed, said = [], []

    def kill_one(result, done, of):
        # early: where all is drawn before the lost worker is noticed, there is nothing to say
        if done == 1:
            killed.append(workers()[0])
            os.kill(killed[0], signal.SIGKILL)

    result = shot(
        project(), tmp_path / "f.####.exr", frames=f"1-{LAST}", cluster="local:2", report=kill_one,
        announce=said.append,
    )  # fmt: skip
    assert [frame.frame for frame in result.frames] == list(range(1, LAST + 1))
    assert result.processes == 2
    assert contents(tmp_path) == whole
    assert any("ended by signal 9; another one takes its place" in line for line in said)
    assert workers() == []
    # finished frames are kept on a cluster as well
    again = shot(project(), tmp_path / "f.####.exr", frames=f"1-{LAST}", cluster="local:1")
    assert not any(frame.drawn for frame in again.frames)


def test_a_data_set_has_the_bytes_of_one_process(tmp_path):
    spec = DatasetSpec.model_validate(
        {
            "size_px": (64, 48),
            "items_per_shard": 4,
            "lens": {"names": {"choice": ("heliar-tronnier",)}, "stops_down": 4},
        }
    )
    dataset(spec, tmp_path / "one", items=6, processes=1)
    result = dataset(spec, tmp_path / "many", items=6, cluster="local:2")
    assert (result.drawn, result.complete) == (6, True)
    assert contents(tmp_path / "many") == contents(tmp_path / "one")


def start(words, folder, **more):
    command = [sys.executable, "-c", f"import sys; sys.path[:] = {sys.path!r}\n{words}"]
    return subprocess.Popen(command, cwd=folder, stderr=subprocess.PIPE, text=True, **more)


def flarewright(*words):
    return (
        f"from flarewright.cli.app import end_as_interrupted, run; end_as_interrupted(); sys.exit(run({list(words)!r}))"
    )


@pytest.mark.parametrize("how", ["SIGINT", "SIGTERM"])
def test_an_interrupted_command_leaves_no_process_and_no_temporary_file(tmp_path, how):
    (tmp_path / "p.toml").write_text(project_text(project()))
    command = start(
        flarewright("shot", "--project", "p.toml", "--frames", "1-900", "--cluster", "local:2", "-o", "f.####.exr"),
        tmp_path,
    )
    line = next(line for line in command.stderr if line.startswith("{"))
    assert json.loads(line)["state"] == "drawn"
    started = time.monotonic()
    command.send_signal(getattr(signal, how))
    said = command.communicate(timeout=60)[1]
    assert command.returncode == 130
    assert time.monotonic() - started < 15.0
    assert "nothing was left half-written, and the same command resumes" in said
    assert "Traceback" not in said
    assert {path.suffix for path in tmp_path.iterdir()} == {".exr", ".toml"}
    assert not any(path.name.startswith(".") for path in tmp_path.iterdir())


def dask(*words):
    program = "import sys; from dask.__main__ import main; main()"
    return subprocess.Popen(
        [sys.executable, "-c", f"import sys; sys.path[:] = {sys.path!r}; sys.argv[1:] = {list(words)!r}; {program}"],
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip


@pytest.fixture
def scheduler(tmp_path):
    """A scheduler that runs already; its address."""
    file = tmp_path / "scheduler.json"
    process = dask(
        "scheduler", "--host", "127.0.0.1", "--port", "0", "--dashboard-address", "127.0.0.1:0", "--scheduler-file",
        str(file),
    )  # fmt: skip
    end = time.monotonic() + 60.0
    while not (file.exists() and file.read_text().strip()):
        assert time.monotonic() < end
        time.sleep(0.1)
    yield json.loads(file.read_text())["address"]
    process.terminate()
    process.wait(30)


def test_workers_started_by_hand_write_the_bytes_of_one_process(whole, tmp_path, scheduler, monkeypatch):
    out = tmp_path / "out"
    out.mkdir()
    # relative names mean the caller's folder, wherever the worker was started
    monkeypatch.chdir(out)
    worker = dask("worker", scheduler, "--nthreads", "1", "--no-nanny", "--local-directory", str(tmp_path / "scratch"))
    try:
        result = shot(project(), "f.####.exr", frames=f"1-{LAST}", cluster=scheduler)
    finally:
        worker.terminate()
        worker.wait(30)
    assert (len(result.frames), result.processes) == (LAST, 1)
    assert contents(out) == whole
