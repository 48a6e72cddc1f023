"""An interrupted stage resumes and writes the same bytes as an uninterrupted one."""

import json
from contextlib import suppress
from pathlib import Path
from shutil import copytree

import numpy as np
import pytest

from flarewright.cli.app import run as command
from flarewright.errors import FlarewrightError, OutputError
from flarewright.measure.core import checkpoint as journals
from flarewright.measure.core.checkpoint import Journal, journal
from flarewright.measure.core.parameter_vector import NUMBERS
from flarewright.measure.core.parameters import Shape
from flarewright.measure.detection.rim_voting import RimCandidate
from flarewright.measure.fitting.detected_ghost import DetectedGhost
from flarewright.measure.fitting.ghost_fit import Fit
from flarewright.model.measurement.ghost_model import Blades

pytestmark = pytest.mark.usefixtures("no_crescents")


def interrupted(path, digest, results) -> int:
    """Run steps, interrupt them, and return the number of steps that an earlier run recorded."""
    known = -1
    with suppress(KeyboardInterrupt), journal(path, digest) as steps:
        known = steps.remembered
        for one in results:
            steps.step(lambda one=one: one)
        raise KeyboardInterrupt
    return known


def test_a_journal_restores_every_bit(tmp_path):
    rng = np.random.default_rng(1)
    shape = Shape(rng.normal(size=NUMBERS), 2)
    fit = Fit(shape, np.array([0, 3, 10]), rng.normal(size=(3, 3)), 1.0 / 3.0, 7)
    results = [
        [RimCandidate(np.float64(0.1), 2.0, 0, 3, np.float64(1e-17), Blades(count=7, first_deg=0.1 + 0.2))],
        None,
        DetectedGhost((shape, shape, shape), 0, 5, (fit,) * 3),
        [],
        3.5,
    ]
    assert interrupted(tmp_path / "j", "d", results) == 0
    with journal(tmp_path / "j", "d") as steps:
        assert steps.remembered == len(results)
        again = [steps.step(pytest.fail) for _ in results]
        assert steps.step(lambda: "new") == "new"
    assert again[0] == results[0]
    assert again[1] is None
    assert again[3:] == results[3:]
    found = again[2]
    for mine, its in zip(found.fits, results[2].fits, strict=True):
        for name in ("free", "covariance"):
            np.testing.assert_array_equal(getattr(mine, name), getattr(its, name))
        np.testing.assert_array_equal(mine.shape.numbers, its.shape.numbers)
        assert (mine.cost, mine.count, mine.shape.discs) == (its.cost, its.count, its.shape.discs)
    # a finished stage removes its journal
    assert not (tmp_path / "j").exists()


@pytest.mark.parametrize(
    ("harm", "sentence"),
    [
        (lambda lines: [], "is damaged; its steps are repeated"),
        (lambda lines: ["x", *lines[1:]], "is damaged; its steps are repeated"),
        (lambda lines: [*lines[:2], "x"], "is damaged after 1 step; later ones are repeated"),
        (lambda lines: lines, None),
    ],
)
def test_a_damaged_journal_is_named_in_one_sentence(harm, sentence, tmp_path):
    interrupted(tmp_path / "j", "a", [1.0, 2.0])
    lines = (tmp_path / "j").read_text().splitlines(keepends=True)
    (tmp_path / "j").write_text("".join(harm(lines)))
    said = []
    with journal(tmp_path / "j", "a", said.append):
        pass
    assert said == ([] if sentence is None else [f"{tmp_path / 'j'} {sentence}"])


def test_a_journal_with_another_digest_or_a_damaged_line_is_discarded(tmp_path):
    assert interrupted(tmp_path / "j", "a", [1.0, 2.0]) == 0
    assert interrupted(tmp_path / "j", "a", [1.0, 2.0, 3.0]) == 2
    text = (tmp_path / "j").read_text()
    (tmp_path / "j").write_text(text[:-3])
    assert interrupted(tmp_path / "j", "a", []) == 2
    assert interrupted(tmp_path / "j", "b", []) == 0
    # reading ends at a line of valid JSON that is not a step
    assert interrupted(tmp_path / "j", "b", [1.0, 2.0, 3.0]) == 0
    lines = (tmp_path / "j").read_text().splitlines(keepends=True)
    not_steps = ({"is": "Nothing"}, {"array": 3}, {"is": "Blades", "reported": {"count": 0}})
    # and at a changed number
    for damaged in (*map(journals._line, not_steps), lines[2].replace("2.0", "2.5")):
        (tmp_path / "j").write_text("".join([*lines[:2], damaged, *lines[3:]]))
        assert interrupted(tmp_path / "j", "b", []) == 1
    (tmp_path / "j").write_text("".join(lines))
    assert interrupted(tmp_path / "j", "b", []) == 3
    (tmp_path / "j").write_bytes(b"\xff\xfe")
    assert interrupted(tmp_path / "j", "b", []) == 0
    with pytest.raises(TypeError, match="cannot hold"), journal(tmp_path / "k", "b") as steps:
        steps.step(object)


def test_a_step_that_was_cut_is_not_recorded_and_an_unfinished_journal_stays(tmp_path):
    with journal(tmp_path / "j", "d") as steps:
        assert steps.step(lambda: 1.0) == 1.0
        assert steps.step(lambda: 2.0, cut=lambda: True) == 2.0
        steps.unfinished = True
    with journal(tmp_path / "j", "d") as steps:
        assert steps.remembered == 1
        assert steps.step(pytest.fail) == 1.0
    assert not (tmp_path / "j").exists()


def test_a_full_disk_is_reported(tmp_path):
    class Full:
        name = "x.journal"

        def write(self, _):
            raise OSError(28, "No space left on device")

    with pytest.raises(OutputError, match=r"cannot write x\.journal: no space left on device"):
        Journal(file=Full()).step(lambda: 1.0)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full")
def test_a_full_disk_is_reported_though_the_journal_cannot_be_closed(tmp_path, monkeypatch):
    real = Path.open

    def opened(path, mode="r", **options):
        return real(Path("/dev/full") if mode == "a" else path, mode, **options)

    monkeypatch.setattr(Path, "open", opened)
    with (
        pytest.raises(OutputError, match=r"cannot write /dev/full: no space left on device; check the free space"),
        journal(tmp_path / "j", "d") as steps,
    ):
        steps.step(lambda: 1.0)


def test_a_stage_that_fails_at_its_first_step_leaves_no_journal(tmp_path):
    def refused():
        raise FlarewrightError("no")

    with pytest.raises(FlarewrightError), journal(tmp_path / "j", "d") as steps:
        steps.step(refused)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("stage", "file"),
    [
        ("find", "found.json"),
        pytest.param("fit", "model.json", marks=pytest.mark.slow),
        ("track", "tracks.json"),
        pytest.param("compress", "compact.json", marks=pytest.mark.slow),
    ],
)
def test_an_interrupted_stage_resumes_to_the_same_bytes(stage, file, staged, tmp_path, capsys, monkeypatch):
    folder = copytree(staged.folder, tmp_path / "run")
    # only the last stage fits the residual
    words = ["measure", stage, str(folder), *(["--no-residual"] if stage == "fit" else [])]
    made, done = (folder / file).read_bytes(), staged.steps[stage]
    assert done >= 2
    (folder / file).unlink()
    left = done // 2

    def stopping(self, make, real=journals.Journal.step):
        nonlocal left
        if left == 0:
            raise KeyboardInterrupt
        left -= 1
        return real(self, make)

    with monkeypatch.context() as patch:
        patch.setattr(journals.Journal, "step", stopping)
        assert command(words) == 130
    said = "flarewright: interrupted; nothing was left half-written, and the same command resumes\n"
    assert capsys.readouterr().err.endswith(said)
    lines = (folder / f"{stage}.journal").read_text().splitlines()
    assert len(lines) == 1 + done // 2
    assert json.loads(lines[0].partition(" ")[2])["journal"] == 13
    assert command(words) == 0
    assert f"resumes after {done // 2} steps" in capsys.readouterr().err
    assert (folder / file).read_bytes() == made
    assert not (folder / f"{stage}.journal").exists()
