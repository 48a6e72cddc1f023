"""A run fitted in Walch's way, for comparison: his primitive finds the planted ghosts, if less exactly than ours."""

import json

import numpy as np
import pytest
from planted_run import GHOSTS, views
from test_stages import ANGLES, write

from flarewright.cli.app import run as command
from flarewright.io.ghost_model_file import read_ghost_model
from flarewright.measure.fit import render
from flarewright.measure.journal import Journal
from flarewright.measure.numbers import bezier_numbers, with_bounded_controls
from flarewright.measure.replay import draw
from flarewright.measure.walch import circle
from flarewright.measure.walch_fit import _compressed


def missed(model, ghosts, angle):
    """Return the error of a model's ghosts, part of the true light."""
    view = views((), angles=[angle])[0]
    truth = sum(render(ghost, view) for ghost in ghosts)
    error = draw(model, angle, 0.0, view.size_px)[..., 1] - truth
    return float(np.sqrt((error**2).sum() / (truth**2).sum()))


def test_both_sides_of_the_axis_share_their_polynomials():
    angles = np.array([-12.0, -9.0, -6.0, -3.0, -1.0, 1.0, 3.0, 6.0, 9.0, 12.0])
    numbers = np.tile(circle(0.0, 20.0, np.ones(3), np.ones(3)), (angles.size, 1))
    # pictures are turned so that the light is on the right
    numbers[:, 0] = 4.0 * np.abs(angles) + 3.0
    ghost = _compressed("1", angles, numbers)
    for angle in (*angles, 0.0, 7.5, -7.5):
        assert bezier_numbers(ghost, float(angle))[0] == pytest.approx(4.0 * abs(angle) + 3.0, abs=1e-6)
    one_sided = _compressed("1", angles[:4], numbers[:4])
    assert bezier_numbers(one_sided, -10.0)[0] == pytest.approx(43.0, abs=1e-6)
    assert len(ghost.numbers[0]) == len(one_sided.numbers[0]) == 2


def test_control_points_bend_no_border_sharper_than_is_drawn():
    wild = circle(0.0, 20.0, np.ones(3), np.ones(3))
    wild[5:9] = 90.0, -4.0, 25.0, 31.0
    assert with_bounded_controls(wild)[5:9].tolist() == [30.0, 0.0, 25.0, 30.0]
    tame = with_bounded_controls(circle(0.0, 20.0, np.ones(3), np.ones(3)))
    assert tame.tolist() == circle(0.0, 20.0, np.ones(3), np.ones(3)).tolist()


def test_a_stopped_fit_goes_on_with_other_threads(tmp_path, capsys, monkeypatch):
    write(tmp_path, GHOSTS[:2])
    assert command(["measure", "find", str(tmp_path), "--every", "4"]) == 0
    words = ["measure", "fit", str(tmp_path), "--by", "walch", "--every", "4", "--no-residual"]
    real = Journal.step

    def stopping(self, make):
        real(self, make)
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(Journal, "step", stopping)
        assert command([*words, "--threads", "2"]) == 130
    capsys.readouterr()
    assert command([*words, "--threads", "1"]) == 0
    assert "fit goes on after 1 step that an earlier run had done" in capsys.readouterr().err
    stopped = read_ghost_model(tmp_path / "model.json")
    (tmp_path / "model.json").unlink()
    assert command([*words, "--threads", "1"]) == 0
    assert read_ghost_model(tmp_path / "model.json") == stopped
    assert len(stopped.ghosts) == 2


def test_his_way_follows_a_ghost_from_picture_to_picture(tmp_path, capsys):
    planted = GHOSTS[1:2]
    write(tmp_path, planted)

    def fitted(*told):
        assert command(["measure", "fit", str(tmp_path), "--every", "3", "--json", *told]) == 0
        return json.loads(capsys.readouterr().out)["fit"], read_ghost_model(tmp_path / "model.json")

    assert command(["measure", "find", str(tmp_path), "--every", "3"]) == 0
    capsys.readouterr()
    assert command(["measure", "fit", str(tmp_path), "--by", "guess"]) == 2
    capsys.readouterr()
    said, his = fitted("--by", "walch")
    assert said["ghosts"] == 1
    assert not said["kept"]
    assert his.ghosts[0].kind == "bezier"
    assert any("Walch" in remark for remark in his.remarks)
    errors = [missed(his, planted, float(angle)) for angle in ANGLES[1:9]]
    assert max(errors) < 0.3
    # `run` takes the same way, and refuses to go on with what cannot be tracked before it does anything
    words = ["measure", "run", str(tmp_path), "-o", str(tmp_path), "--every", "3", "--by", "walch"]
    for stages, remedy in ((), "--stages merge,find,fit"), (("--stages", "find"), "drop --by"):
        assert command([*words, *stages]) == 2
        told = capsys.readouterr()
        assert told.out == ""
        assert told.err.count("\n") == 1
        assert remedy in told.err
    assert command([*words, "--stages", "find,fit", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["fit"]["kept"]
    # asked again nothing is done; it has its numbers over the constellation already; the other way is another model
    assert fitted("--by", "walch")[0]["kept"]
    assert command(["measure", "track", str(tmp_path)]) == 2
    assert "Bezier" in capsys.readouterr().err
    said, ours = fitted()
    assert not said["kept"]
    assert ours.ghosts[0].kind == "aberration"
    assert np.median([missed(ours, planted, float(angle)) for angle in ANGLES[1:9]]) < 0.5 * np.median(errors)
