"""A model without residual is a small file for replay, report and prediction."""

import json

import numpy as np
import pytest
from planted_run import SMALL as SIZE
from planted_run import SMALL_ANGLES, SMALL_GHOSTS, views, write_small
from test_prune import model_of

from flarewright.cli.app import run as command
from flarewright.io.images.exr import read_exr
from flarewright.io.measurement.ghost_model_file import read_ghost_model, write_ghost_model
from flarewright.measure.core.checkpoint import Journal
from flarewright.measure.fitting.ghost_fit import render

PLANTED = SMALL_GHOSTS[:1]
# bytes: some 4 kB per ghost, and the residual of four small pictures of noise
SMALL, LARGE = 12_000, 20_000

pytestmark = pytest.mark.usefixtures("no_crescents")


@pytest.fixture
def folder(tmp_path):
    write_small(tmp_path, PLANTED)
    write_ghost_model(tmp_path / "found.json", model_of(PLANTED, "a", SIZE))
    return tmp_path


@pytest.mark.slow
def test_the_file_is_small_and_every_command_takes_it(folder, capsys, monkeypatch):
    def made(*words):
        assert command([*words, "--json"]) == 0
        facts = json.loads(capsys.readouterr().out)
        return [facts[stage]["kept"] for stage in ("fit", "track", "compress") if stage in facts]

    def size(name):
        return (folder / name).stat().st_size

    fit = ["measure", "fit", str(folder)]
    whole = ["measure", "run", str(folder), "-o", str(folder), "--stages", "fit,track,compress"]
    assert made(*whole, "--no-residual") == [False] * 3
    assert size("model.json") < SMALL
    assert size("compact.json") < SMALL
    small = {name: (folder / name).read_bytes() for name in ("model.json", "compact.json")}
    # it draws the planted ghosts and no residual layer
    angle, out = float(SMALL_ANGLES[2]), folder / "o.exr"
    model = str(folder / "compact.json")
    assert command(["measure", "replay", model, "--constellation", repr(angle), "-o", str(out)]) == 0
    layers = {layer.name: layer.pixels for layer in read_exr(out).layers}
    assert "residual" not in layers
    view = views((), angles=[angle], size=SIZE)[0]
    truth = sum(render(ghost, view) for ghost in PLANTED)
    assert np.sqrt(((layers["beauty"][..., 1] - truth) ** 2).mean()) < 0.02 * np.sqrt((truth**2).mean())
    assert command(["measure", "report", str(folder)]) == 0
    page = (folder / "report.html").read_text()
    assert all(f"<h2>{title}</h2>" in page for title in ("Replay", "Ghosts", "Tracks"))
    capsys.readouterr()
    assert command(["predict", model, "--samples", "5", "--json"]) == 0
    reported = json.loads(capsys.readouterr().out)
    assert max(reported["statistics"]["mean"]["values"]) > 0.0
    # on request the residual is learned for the kept model, and dropped again
    assert made(*fit) == [True]
    with monkeypatch.context() as patch:
        done = 0

        def stopping(self, make, real=Journal.step):
            nonlocal done
            done += 1
            if done == 3:
                raise KeyboardInterrupt
            return real(self, make)

        patch.setattr(Journal, "step", stopping)
        assert command(["measure", "compress", str(folder)]) == 130
    capsys.readouterr()
    assert (folder / "compress-residual.journal").read_text().count("\n") == 3
    assert command(["measure", "compress", str(folder)]) == 0
    assert capsys.readouterr().out.endswith(", ghosts as before\n")
    assert made("measure", "compress", str(folder)) == [True]
    assert not (folder / "compress-residual.journal").exists()
    assert min(size("model.json"), size("compact.json")) > LARGE
    assert read_ghost_model(folder / "compact.json").sprites
    assert made(*whole, "--no-residual") == [True] * 3
    for name, data in small.items():
        assert (folder / name).read_bytes() == data
    assert made("measure", "compress", str(folder), "--no-residual") == [True]
    assert made(*fit, "--no-residual") == [True]


def test_a_run_without_stages_that_learn_it_is_refused(folder, capsys):
    assert command(["measure", "run", str(folder), "-o", str(folder), "--stages", "track", "--no-residual"]) == 2
    assert "--no-residual is for the stages fit and compress" in capsys.readouterr().err
