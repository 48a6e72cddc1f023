"""A run that is taken up again repeats the stages whose makings have changed, and no others."""

import json
import os
from shutil import copytree

import pytest
from planted_run import FOCAL, SMALL, write_small

from flarewright.cli.app import run as command
from flarewright.cli.measure_stages import STAGES, run_stages
from flarewright.errors import OutputError
from flarewright.io.ghost_model_file import read_ghost_model, write_ghost_model
from flarewright.io.merged import read_run, write_run
from flarewright.measure import rest_fit, stages
from flarewright.measure.notes import note
from flarewright.model.capture import CameraNoise
from flarewright.model.ghost_model import GhostModel

pytestmark = pytest.mark.usefixtures("no_lunes")


def test_only_what_has_changed_is_done_again(tmp_path, capsys, monkeypatch):
    write_small(tmp_path, ())
    done: list[str] = []
    model = GhostModel(
        size_px=SMALL, axis_px=(9.0, 9.0), focal_px=FOCAL, largest_deg=20.0, constellation_deg=(0.0, 20.0)
    )
    for stage in ("find", "fit"):
        monkeypatch.setattr(stages, f"{stage}_ghosts", lambda *_, stage=stage, **__: done.append(stage) or model)
    monkeypatch.setattr(rest_fit, "with_rest", lambda model, *_: model)

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
    # a person edits what was found: it is kept, and fitted anew
    found = read_ghost_model(tmp_path / "found.json")
    write_ghost_model(tmp_path / "found.json", found.replace(remarks=("by hand",)))
    assert kept() == {"find": True, "fit": False}
    # other frames, and files that went away
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
    # a stage that is interrupted is not noted as done

    def broken(*_args, **_kwargs):
        raise KeyboardInterrupt

    os.utime(frame, ns=(2, 2))
    with monkeypatch.context() as patch:
        patch.setattr(stages, "find_ghosts", broken)
        assert command(["measure", "find", str(tmp_path)]) == 130
    capsys.readouterr()
    assert kept() == fresh


def test_a_light_that_is_told_later_is_written_into_what_was_made(staged, tmp_path):
    folder = copytree(staged.folder, tmp_path / "run")
    dark = {name: read_ghost_model(folder / name) for name in ("found.json", "model.json", "compact.json")}
    run = read_run(folder)
    write_run(folder, run.replace(camera=CameraNoise(luminance_cd_m2=2e6, solid_angle_sr=1e-5)))
    facts = run_stages(folder, STAGES, 1, None, None, False)
    assert [facts[stage]["kept"] for stage in STAGES] == [True] * 4
    for name, before in dark.items():
        now = read_ghost_model(folder / name)
        assert (now.reference.luminance_cd_m2, now.reference.solid_angle_sr) == (2e6, 1e-5)
        assert now.replace(reference=before.reference) == before
    # what a person has written into a model stays where the run does not tell it
    write_run(folder, run)
    run_stages(folder, STAGES, 1, None, None, False)
    assert read_ghost_model(folder / "compact.json").reference.luminance_cd_m2 == 2e6


def test_what_is_left_beside_ghosts_is_learned_once(staged, tmp_path):
    """A fit on the way to the small model leaves it out; asked for by itself it has it, and no later stage is stale."""
    folder, first = copytree(staged.folder, tmp_path / "run"), staged.facts

    def kept(*some: str) -> list[bool]:
        facts = run_stages(folder, some, 1, None, None, False)
        return [facts[stage]["kept"] for stage in some]

    def whole() -> list[bool]:
        return [bool(read_ghost_model(folder / f"{name}.json").sprites) for name in ("model", "compact")]

    assert [first[stage]["kept"] for stage in STAGES] == [False] * 4
    assert whole() == [False, True]
    assert kept("fit") == [True]
    assert whole() == [True, True]
    assert kept(*STAGES) == [True] * 4
    assert whole() == [True, True]


def test_corrections_hold_until_others_are_given(tmp_path, capsys, monkeypatch):
    write_small(tmp_path, ())
    (tmp_path / "captures.csv").write_text("")
    told = []
    model = GhostModel(
        size_px=SMALL, axis_px=(9.0, 9.0), focal_px=FOCAL, largest_deg=20.0, constellation_deg=(0.0, 20.0)
    )
    monkeypatch.setattr(stages, "find_ghosts", lambda *_, **given: told.append(given) or model)
    run = ["measure", "run", str(tmp_path / "captures.csv"), "-o", str(tmp_path), "--stages", "find", "--json"]

    def kept(*arguments: str) -> bool:
        assert command([*arguments]) == 0
        return json.loads(capsys.readouterr().out)["find"]["kept"]

    corrections = tmp_path / "corrections.json"
    corrections.write_text('{"remove": ["7"]}')
    assert not kept("measure", "find", str(tmp_path), "--corrections", str(corrections), "--json")
    assert kept(*run)
    assert not kept(*run, "--every", "2")
    assert told[-1]["every"] == 2
    assert [one["corrections"].remove for one in told] == [("7",), ("7",)]
    assert command([*run[:-1], "--every", "2"]) == 0
    assert "corrections that were given before still hold" in capsys.readouterr().err
    corrections.write_text("{}")
    assert not kept(*run, "--corrections", str(corrections))
    assert told[-1]["corrections"] is None
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
