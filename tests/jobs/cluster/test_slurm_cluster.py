"""Workers in jobs of SLURM, with commands that stand in for `sbatch` and `scancel` and run the jobs here."""

from __future__ import annotations

import os
import subprocess
import sys
import time

import pytest

from flarewright.errors import FlarewrightError
from flarewright.jobs.cluster.executor import open_cluster
from flarewright.jobs.processes import work_off

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(sys.platform == "win32", reason="shell scripts"),
]
SBATCH = """#!/bin/bash
if [ -e "$FARM/refuse" ]; then echo "sbatch: error: invalid partition specified: gpu" >&2; exit 1; fi
if [ "$1" = --test-only ]; then exit 0; fi
cp "$1" "$FARM/job.sh"
setsid bash "$FARM/job.sh" > "$FARM/job.log" 2>&1 &
echo $! >> "$FARM/jobs"
echo "Submitted batch job $!"
"""
SCANCEL = '#!/bin/bash\necho "$1" >> "$FARM/cancelled"\nkill -- -"$1"\n'
FARM = 'jobs = 1\ncores = 2\nmemory = "2GB"\nwalltime = "00:05:00"\nprologue = ["touch \\"$FARM/prologue\\""]\n'


@pytest.fixture
def farm(tmp_path, monkeypatch):
    pytest.importorskip("dask_jobqueue", reason="needs the extra slurm")
    folder = tmp_path / "farm"
    folder.mkdir()
    for name, text in (("sbatch", SBATCH), ("scancel", SCANCEL)):
        (folder / name).write_text(text)
        (folder / name).chmod(0o755)
    monkeypatch.setenv("PATH", str(folder), prepend=os.pathsep)
    monkeypatch.setenv("FARM", str(folder))
    # the stand-in for a node imports what this process can
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(path for path in sys.path if path))
    monkeypatch.chdir(tmp_path)
    (tmp_path / "farm.toml").write_text(FARM)
    yield folder
    for job in (folder / "jobs").read_text().split() if (folder / "jobs").exists() else ():
        subprocess.run(["kill", "-9", "--", f"-{job}"], check=False, stderr=subprocess.DEVNULL)


def test_items_are_worked_off_in_jobs_which_are_cancelled(farm, tmp_path):
    with open_cluster("slurm:farm.toml", tmp_path) as cluster:
        assert not cluster.local
        keys = list(tmp_path.glob(".flarewright-*/*"))
        assert len(keys) == 3
        assert {path.stat().st_mode & 0o777 for path in keys} == {0o600}
        done = list(work_off("cluster_work:add", 100, range(20), processes=9, threads=9, executor=cluster))
    assert sorted(one.result[0] for one in done) == list(range(100, 120))
    # one thread each, in the folder of the caller
    assert {one.result[2:] for one in done} == {(1, str(tmp_path))}
    assert (farm / "prologue").exists()
    assert (farm / "cancelled").read_text().split() == (farm / "jobs").read_text().split()
    assert list(tmp_path.glob(".flarewright-*")) == []
    end = time.monotonic() + 20.0
    while any(os.path.exists(f"/proc/{one.result[1]}") for one in done) and time.monotonic() < end:
        time.sleep(0.1)
    assert not any(os.path.exists(f"/proc/{one.result[1]}") for one in done)


def test_jobs_that_slurm_does_not_accept_are_one_sentence(farm, tmp_path):
    (farm / "refuse").write_text("")
    words = r"^farm.toml: SLURM does not accept such a job \(invalid partition specified: gpu\); change the settings$"
    with pytest.raises(FlarewrightError, match=words), open_cluster("slurm:farm.toml", tmp_path):
        pass
    assert not (farm / "jobs").exists()
    assert list(tmp_path.glob(".flarewright-*")) == []


def test_a_machine_without_slurm_is_one_sentence(farm, tmp_path):
    (farm / "sbatch").unlink()
    words = "the command sbatch is not on this machine"
    with pytest.raises(FlarewrightError, match=words), open_cluster("slurm:farm.toml", tmp_path):
        pass
