"""Reference quality and the ledger from the command line."""

import json

import numpy as np
import OpenEXR
import pytest
from singlet_file import singlet_file

from flarewright.cli.app import run
from flarewright.io.images.exr import read_exr
from flarewright.io.render_state.reference_state import read_reference_state
from flarewright.render.reference import energy_ledger, estimator

SMALL = ["render", "singlet.toml", "--light", "8,4", "--size", "24x16", "--no-starburst", "--no-png", "--ledger"]
REFERENCE = [*SMALL, "--quality", "reference"]


@pytest.fixture(autouse=True)
def _folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    singlet_file(tmp_path)
    monkeypatch.setattr(estimator, "SIDE", 16)
    monkeypatch.setattr(energy_ledger, "SIDE", 16)


def test_render_and_go_on(capsys, tmp_path):
    assert run([*REFERENCE, "--samples", "2048", "--json", "-o", "a.exr"]) == 0
    out, err = capsys.readouterr()
    summary = json.loads(out)
    assert summary["quality"] == "reference"
    assert summary["reference"]["points"] == 2048
    assert summary["layers"][-1] == "ghosts.order4+.variance"
    assert "Where the light went" in err
    assert "six or more, beside it" in err
    assert summary["ledger"]["sum"] == pytest.approx(1.0, abs=1e-3)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.exr", "a.state.npz", "singlet.toml"]
    layers = {layer.name: layer.pixels for layer in read_exr("a.exr").layers}
    # variances are too small for half floats, which the other layers are
    held = OpenEXR.File("a.exr", separate_channels=True).parts
    variances = [part.channels[f"{part.name()}.R"].type() for part in held if part.name().endswith(".variance")]
    assert set(variances) == {OpenEXR.FLOAT}
    assert OpenEXR.HALF in {next(iter(part.channels.values())).type() for part in held}
    assert np.median(layers["ghosts.variance"]) < 1e-6
    assert np.count_nonzero(layers["ghosts.variance"]) > 100

    assert run(["render", "--resume", "a.state.npz", "--samples", "4096", "--no-png", "-o", "b.exr"]) == 0
    capsys.readouterr()
    assert run([*REFERENCE, "--samples", "4096", "-o", "c.exr"]) == 0
    for b, c in zip(read_exr("b.exr").layers, read_exr("c.exr").layers, strict=True):
        np.testing.assert_array_equal(b.pixels, c.pixels)


def test_interrupted_says_how_to_go_on(capsys, monkeypatch):
    add, calls = estimator.Sums.add, []

    def interrupt(sums, result):
        add(sums, result)
        calls.append(1)
        if len(calls) == 3:
            raise KeyboardInterrupt

    monkeypatch.setattr(estimator.Sums, "add", interrupt)
    assert run([*REFERENCE, "-o", "a.exr"]) == 130
    assert "to resume: flarewright render --resume a.state.npz -o a.exr" in capsys.readouterr().err
    assert read_reference_state("a.state.npz").batches == 3


def test_a_state_of_another_light_is_refused(capsys):
    assert run([*REFERENCE, "--samples", "512", "-o", "a.exr"]) == 0
    capsys.readouterr()
    assert run(["render", "--resume", "a.state.npz", "--light", "1,1", "-o", "b.exr"]) == 2
    assert "the state to resume belongs to another light;" in capsys.readouterr().err
    assert run(["render", "--resume", "a.state.npz", "--fstop", "11", "-o", "b.exr"]) == 2
    assert "the state to resume belongs to another f-number;" in capsys.readouterr().err
    assert run(["render", "--resume", "a.state.npz", "--quality", "final", "-o", "b.exr"]) == 2
    assert "--resume works with --quality reference only" in capsys.readouterr().err


def test_ledger_of_final_quality(capsys):
    assert run([*SMALL, "--json", "-o", "a.exr"]) == 0
    out, err = capsys.readouterr()
    assert json.loads(out)["ledger"]["shares"]["direct.in_picture"] > 0.1
    assert "back out of the front" in err
