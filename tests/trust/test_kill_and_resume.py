"""Every long job is killed and resumes to the result of an uninterrupted run."""

from pathlib import Path

import pytest

from flarewright.workflow.long_jobs import JOBS, SAME, job_of

from .commands import commands
from .kill_and_resume import TRIALS, kill_and_resume

# commands that end within a minute on any machine and any sensible input
SHORT = {
    "nuke-script", "cameras", "lenses", "edit", "lens show", "lens check", "lens convert", "lens schema",
    "looks save", "library list", "library search", "library show", "library remove",
    "coating list", "coating plot", "project init", "project check", "project schema", "scene init", "scene check",
    "scene schema", "design target", "design resize", "design move-stop", "design identify", "measure report",
    "measure replay",
}  # fmt: skip


def test_every_command_is_in_the_list_or_short():
    long = {" ".join(job.words) for job in JOBS}
    assert not long & SHORT
    assert {name for name, _ in commands()} == long | SHORT


def test_every_long_job_is_killed_by_the_rig_and_documented():
    assert {" ".join(job.words) for job in JOBS} == {name.partition(" --")[0] for name in TRIALS}
    page = (Path(__file__).parents[2] / "docs" / "cli.md").read_text("utf-8")
    for job in JOBS:
        for file in job.keeps.split(", "):
            assert file.replace(f"{job.words[-1]}.journal", "STAGE.journal") in page


@pytest.mark.parametrize(
    "line",
    [
        "measure run captures.csv -o run", "predict heliar-tronnier --output=a.html", "ghosts heliar-tronnier",
        "design benchmark heliar",
    ],
)  # fmt: skip
def test_the_list_knows_a_job_by_its_words(line):
    job = job_of(line.split())
    assert job in JOBS
    assert job.resume == SAME
    assert job_of(["lenses", "heliar-tronnier"]) is None


@pytest.mark.slow
@pytest.mark.parametrize("kind", [0, 1], ids=["SIGKILL", "SIGTERM"])
@pytest.mark.parametrize("job", TRIALS)
def test_a_killed_job_resumes_to_the_same_files(job, kind):
    for seed in (kind, kind + 2):
        verdict = kill_and_resume(job, seed)
        assert verdict.held, verdict
