"""Settings of SLURM jobs: known keys, checked values, one sentence for each error."""

from __future__ import annotations

from pathlib import Path

import pytest

from flarewright.errors import ProjectError
from flarewright.jobs.cluster.choice import RunningChoice, parse_cluster
from flarewright.jobs.cluster.slurm_file import SlurmSettings, read_slurm_settings

ROOT = Path(__file__).parents[3]
GOOD = 'jobs = 10\ncores = 16\nmemory = "32GB"\nwalltime = "1-02:00:00"\nprologue = ["module load python"]\n'


def read(folder, text):
    (folder / "farm.toml").write_text(text)
    return read_slurm_settings(folder / "farm.toml")


def test_settings_are_read(tmp_path):
    found = read(tmp_path, GOOD)
    assert (found.jobs, found.cores, found.memory, found.walltime) == (10, 16, "32GB", "1-02:00:00")
    assert (found.prologue, found.directives, found.queue) == (("module load python",), (), None)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (GOOD + 'quue = "gpu"', "quue is not a known key; did you mean 'queue'?"),
        ("jobs = 1\ncores = 1", "memory is missing"),
        (GOOD.replace("10", "0"), "jobs should be greater than or equal to 1"),
        (GOOD.replace("16", "true"), "cores should be a whole number, not true"),
        (GOOD.replace("32GB", "much"), 'memory: is no amount of memory; write for example "32GB"'),
        (GOOD.replace("1-02:00:00", "two hours"), "walltime: is no time of SLURM"),
        # a line break would add a line to the job's script
        (GOOD + 'queue = "a\\nrm -rf x"', "queue: has a line break or control character"),
        (GOOD + 'directives = "--exclusive"', "directives"),
        ("jobs 1", "not valid TOML"),
    ],
)
def test_an_error_is_one_sentence(tmp_path, text, words):
    with pytest.raises(ProjectError) as found:
        read(tmp_path, text)
    assert "farm.toml" in str(found.value)
    assert any(words in line for line in (str(found.value), *found.value.problems))


def test_a_missing_file_is_one_sentence(tmp_path):
    with pytest.raises(ProjectError, match="does not exist"):
        read_slurm_settings(tmp_path / "none.toml")


def test_the_recipe_is_valid_and_the_page_names_every_key():
    assert read_slurm_settings(ROOT / "docs/recipes/slurm.toml").cores == 16
    page = (ROOT / "docs/many-machines.md").read_text()
    assert [name for name in SlurmSettings.model_fields if f"`{name}`" not in page] == []


def test_the_recipe_for_kubernetes_starts_workers_that_are_accepted():
    yaml = pytest.importorskip("yaml", reason="comes with the extra cluster")
    parts = list(yaml.safe_load_all((ROOT / "docs/recipes/kubernetes.yaml").read_text()))
    containers = {
        one["name"]: one
        for part in parts
        if part["kind"] != "Service"
        for one in part["spec"]["template"]["spec"]["containers"]
    }
    worker, shot = containers["worker"]["command"], containers["shot"]["args"]
    assert worker[worker.index("--nthreads") + 1] == "1"
    address = shot[shot.index("--cluster") + 1]
    assert parse_cluster(address) == RunningChoice(worker[2])
    service = next(part for part in parts if part["kind"] == "Service")
    assert address == f"tcp://{service['metadata']['name']}:{service['spec']['ports'][0]['port']}"
    assert containers["worker"]["workingDir"] == containers["shot"]["workingDir"]
