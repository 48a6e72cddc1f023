"""A resumed run repeats the stages whose inputs have changed, and no others."""

import json
import os
from shutil import copytree

import pytest
from planted_run import FOCAL, SMALL, write_small

from flarewright.cli.app import run as command
from flarewright.errors import OutputError
from flarewright.io.measurement.ghost_model_file import read_ghost_model, write_ghost_model
from flarewright.io.measurement.merged import read_run, write_run
from flarewright.measure.pipeline import find_stage
from flarewright.measure.pipeline.provenance import note
from flarewright.measure.residual import learn
from flarewright.model.measurement.capture import CameraNoise
from flarewright.model.measurement.ghost_model import GhostModel
from flarewright.workflow.measure_provenance import STAGES
from flarewright.workflow.measure_run import run_stages

pytestmark = pytest.mark.usefixtures("no_crescents")


def test_only_what_has_changed_is_done_again(tmp_path, capsys, monkeypatch):
    write_small(tmp_path, ())
    done: list[str] = []
    model = GhostModel(
        size_px=SMALL, axis_px=(9.0, 9.0), focal_px=FOCAL, largest_deg=20.0, constellation_deg=(0.0, 20.0)
    )
    for stage in ("find", "fit"):
        path = f"flarewright.measure.pipeline.{stage}_stage.{stage}_ghosts"
        monkeypatch.setattr(path, lambda *_, stage=stage, **__: done.append(stage) or model)
    monkeypatch.setattr(learn, "with_residual", lambda model, *_: model)

    def kept(*arguments: str) -> dict[str, bool]:
        facts = {}
        for stage in ("find", "fit"):
            extra = arguments if stage == "find" else ()
            assert command(["measure", stage, str(tmp_path), *extra, "--json"]) == 0
            facts[stage] = json.loads(capsys.readouterr().out)[stage]["kept"]
        assert done == [stage for stage, was_kept in facts.items() if not was_kept]
        done.clear()
        return facts

    fresh, same = {"find": False, "fit": False}, {"find": True, "fit": True}
    assert kept() == fresh
    assert kept() == same
    # the user edits the rough model: it is kept, and the fit is repeated
    found = read_ghost_model(tmp_path / "found.json")
    write_ghost_model(tmp_path / "found.json", found.replace(remarks=("by hand",)))
    assert kept() == {"find": True, "fit": False}
    # changed frames, and missing files
    frame = tmp_path / "frames" / "003.exr"
    os.utime(frame, ns=(1, 1))
    assert kept() == fresh
    (tmp_path / "model.json").unlink()
    assert kept() == {"find": True, "fit": False}
    (tmp_path / "stages.json").write_text("{")
    assert kept() == fresh
    corrections = tmp_path / "corrections.json"
    corrections.write_text('{"remove": ["7"]}')
    assert kept("--corrections", str(corrections))["find"] is False
    # an interrupted stage is not recorded as finished

    def broken(*_args, **_kwargs):
        raise KeyboardInterrupt

    os.utime(frame, ns=(2, 2))
    with monkeypatch.context() as patch:
        patch.setattr(find_stage, "find_ghosts", broken)
        assert command(["measure", "find", str(tmp_path)]) == 130
    capsys.readouterr()
    assert kept() == fresh


def test_a_light_given_later_is_written_into_the_models(staged, tmp_path):
    folder = copytree(staged.folder, tmp_path / "run")
    dark = {name: read_ghost_model(folder / name) for name in ("found.json", "model.json", "compact.json")}
    run = read_run(folder)
    write_run(folder, run.replace(camera=CameraNoise(luminance_cd_m2=2e6, solid_angle_sr=1e-5)))
    facts = {each.stage: each for each in run_stages(folder)}
    assert [facts[stage].kept for stage in STAGES] == [True] * 4
    for name, before in dark.items():
        now = read_ghost_model(folder / name)
        assert (now.reference.luminance_cd_m2, now.reference.solid_angle_sr) == (2e6, 1e-5)
        assert now.replace(reference=before.reference) == before
    # values that the user writes into a model are kept unless the run has others
    write_run(folder, run)
    list(run_stages(folder))
    assert read_ghost_model(folder / "compact.json").reference.luminance_cd_m2 == 2e6


def test_the_residual_is_learned_once(staged, tmp_path, monkeypatch):
    """A fit as part of `run` leaves the residual out; `measure fit` adds it, and no later stage becomes outdated."""
    folder, first = copytree(staged.folder, tmp_path / "run"), staged.facts
    # which residual it is makes no difference here
    sprites = read_ghost_model(folder / "compact.json").sprites
    monkeypatch.setattr(learn, "with_residual", lambda model, *_: model.replace(sprites=sprites))

    def kept(*some: str) -> list[bool]:
        facts = {each.stage: each for each in run_stages(folder, some)}
        return [facts[stage].kept for stage in some]

    def whole() -> list[bool]:
        return [bool(read_ghost_model(folder / f"{name}.json").sprites) for name in ("model", "compact")]

    assert [first[stage].kept for stage in STAGES] == [False] * 4
    assert whole() == [False, True]
    assert kept("fit") == [True]
    assert whole() == [True, True]
    assert kept(*STAGES) == [True] * 4
    assert whole() == [True, True]


def test_corrections_hold_until_others_are_given(tmp_path, capsys, monkeypatch):
    write_small(tmp_path, ())
    (tmp_path / "captures.csv").write_text("")
    reported = []
    model = GhostModel(
        size_px=SMALL, axis_px=(9.0, 9.0), focal_px=FOCAL, largest_deg=20.0, constellation_deg=(0.0, 20.0)
    )
    monkeypatch.setattr(find_stage, "find_ghosts", lambda *_, **given: reported.append(given) or model)
    run = ["measure", "run", str(tmp_path / "captures.csv"), "-o", str(tmp_path), "--stages", "find", "--json"]

    def kept(*arguments: str) -> bool:
        assert command([*arguments]) == 0
        return json.loads(capsys.readouterr().out)["find"]["kept"]

    corrections = tmp_path / "corrections.json"
    corrections.write_text('{"remove": ["7"]}')
    assert not kept("measure", "find", str(tmp_path), "--corrections", str(corrections), "--json")
    assert kept(*run)
    assert not kept(*run, "--every", "2")
    assert reported[-1]["every"] == 2
    assert [one["corrections"].remove for one in reported] == [("7",), ("7",)]
    assert command([*run[:-1], "--every", "2"]) == 0
    assert "corrections of an earlier search are in effect" in capsys.readouterr().err
    corrections.write_text("{}")
    assert not kept(*run, "--corrections", str(corrections))
    assert reported[-1]["corrections"] is None
    assert kept("measure", "find", str(tmp_path), "--json")
    for words, arguments in (
        ("--corrections are for the stage find", [*run[:-3], "--stages", "fit", "--corrections", str(corrections)]),
        ("no.csv does not exist", ["measure", "run", "no.csv", "-o", str(tmp_path), "--stages", "find"]),
    ):
        assert command(arguments) == 2
        assert words in capsys.readouterr().err
    (tmp_path / "stages.json").write_text('{"corrections": "{"}')
    assert command(run) == 2
    assert "give them again with --corrections" in capsys.readouterr().err


def test_the_note_is_written_whole_or_not_at_all(tmp_path):
    with pytest.raises(OutputError, match="does not exist"):
        note(tmp_path / "nowhere", "find", "x")
