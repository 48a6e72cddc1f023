"""`measure track` and `compress` from the command line: files, kept files, and one-sentence errors."""

import json

import numpy as np
import pytest
from planted_run import LARGEST, SMALL, SMALL_GHOSTS, rough_model, shape, views, write_small
from test_prune import model_of

from flarewright.cli.app import run as command
from flarewright.cli.measure.report import _of_another_model
from flarewright.io.measurement.ghost_model_file import read_ghost_model, read_ghost_tracks, write_ghost_model
from flarewright.measure.compression.prune import count_parameters
from flarewright.measure.core.parameters import rescaled
from flarewright.measure.fitting.alternating_fit import to_model
from flarewright.measure.fitting.detected_ghost import DetectedGhost
from flarewright.measure.pipeline.compress_stage import compress_ghosts
from flarewright.measure.pipeline.track_stage import track_ghosts
from flarewright.measure.replay.model_image import replay_model
from flarewright.model.measurement.ghost_model import BezierGhost

pytestmark = pytest.mark.usefixtures("no_crescents")


# every second one is used: three
ANGLES = np.linspace(2.0, LARGEST, 5)


def written(folder, count, names, angles=ANGLES):
    write_small(folder, SMALL_GHOSTS[:count], angles=angles)
    write_ghost_model(folder / "model.json", model_of(SMALL_GHOSTS[:count], names, SMALL))
    return folder


@pytest.fixture
def folder(tmp_path):
    return written(tmp_path, 2, "ab")


def test_a_ghost_under_a_removed_one_is_tracked_and_kept(tmp_path):
    """The light of the removed ghost hid the other one from the tracks, so that the compact model lacked it."""
    planted = rescaled(shape(-110.0, 22.0, 0.4, bend=8.0), 0.5), rescaled(shape(-120.0, 30.0, 1.0), 0.5)
    angles = np.linspace(2.0, LARGEST, 6)
    run = write_small(tmp_path, planted, angles=angles)
    both = rough_model(run, planted)
    model = both.replace(ghosts=both.ghosts[:1], removed=both.ghosts[1:])
    tracks = track_ghosts(tmp_path, run, model)
    assert [len(one.lives) for one in tracks.ghosts] == [1]
    small = compress_ghosts(tmp_path, run, model, tracks, residual=False)
    assert small.removed == model.removed
    for view in views(planted[:1], angles=angles[1::2], size=SMALL, noise=0.0):
        drawn = replay_model(small, view.constellation_deg)[0].pixels
        assert np.sqrt(((drawn - view.pixels) ** 2).mean()) < 0.1 * np.sqrt((view.pixels**2).mean())


def test_a_path_on_both_sides_of_the_axis_is_a_ghost_on_each(tmp_path):
    """Both have one shape, so that no frame tells them apart: one of them was dropped, and the other drawn wrong."""
    angles = np.array([-24.0, -19.0, -14.0, -10.0, 9.0, 13.0, 18.0, 23.0])
    run, middle = write_small(tmp_path, angles=angles), len(angles) // 2
    one = (SMALL_GHOSTS[0],) * 3
    seen, beside = views(SMALL_GHOSTS[:1], angles=angles, size=SMALL), rough_model(run)
    sides = DetectedGhost(one, 0, middle - 1), DetectedGhost(one, middle, len(angles) - 1)
    model = beside.replace(ghosts=to_model(sides, seen))
    tracks = track_ghosts(tmp_path, run, model)
    lives = [
        [(life.birth.constellation_deg, life.death.constellation_deg) for life in one.lives] for one in tracks.ghosts
    ]
    assert [[(-24.0, pytest.approx(-0.5))], [(pytest.approx(-0.5), 23.0)]] == lives
    small = compress_ghosts(tmp_path, run, model, tracks, residual=False)
    assert len(small.ghosts) == 2
    for view in views(SMALL_GHOSTS[:1], angles=angles, size=SMALL, noise=0.0):
        drawn = replay_model(small, view.constellation_deg)[0].pixels
        assert np.sqrt(((drawn - view.pixels) ** 2).mean()) < 0.02 * np.sqrt((view.pixels**2).mean())


def test_track_and_compress_write_small_files_and_keep_them(folder, capsys):
    stages = ["track"], ["compress", "--no-residual"]
    for (stage, *more), file in zip(stages, ("tracks.json", "compact.json"), strict=True):
        assert command(["measure", stage, str(folder), "--every", "2", *more, "--json"]) == 0
        reported = json.loads(capsys.readouterr().out)[stage]
        assert reported["ghosts"] == 2
        assert reported["kept"] is False
        assert reported["file"].endswith(file)
    tracks = read_ghost_tracks(folder / "tracks.json")
    assert [len(one.lives) for one in tracks.ghosts] == [1, 1]
    small = read_ghost_model(folder / "compact.json")
    assert small.schema_version == 1
    assert all(any(one.green.uncertainty) for one in small.ghosts)
    assert count_parameters(small) <= count_parameters(read_ghost_model(folder / "model.json")) + 3
    for stage, *more in stages:
        assert command(["measure", stage, str(folder), "--every", "2", *more]) == 0
        assert "as before" in capsys.readouterr().out
    assert command(["measure", "report", str(folder)]) == 0
    page = (folder / "report.html").read_text()
    assert "Brightness relative to the fit" in page
    assert "where the captures end" in page
    capsys.readouterr()
    # other frames, other compression
    assert command(["measure", "track", str(folder), "--every", "1", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["track"]["kept"] is False


def test_one_ghost_is_counted_as_one(tmp_path, capsys):
    written(tmp_path, 1, "a", ANGLES[::2])
    assert command(["measure", "track", str(tmp_path)]) == 0
    assert "tracks.json: 1 ghost, 1 life\n" in capsys.readouterr().out
    assert command(["measure", "report", str(tmp_path)]) == 0
    assert "report.html: 3 frames, 1 ghost\n" in capsys.readouterr().out
    assert "3 frames of 120 x 80 pixels, the light seen in 3; 1 ghost" in (tmp_path / "report.html").read_text()
    assert "degrees, 1 ghost in the picture" in (tmp_path / "report.html").read_text()


def reported(capsys, *words):
    assert command([str(word) for word in words]) == 2
    lines = [line for line in capsys.readouterr().err.splitlines() if "error:" in line]
    assert len(lines) == 1
    return lines[0]


def test_mistakes_are_reported_in_a_sentence(folder, tmp_path_factory, capsys):
    assert "run flarewright measure track" in reported(capsys, "measure", "compress", folder)
    assert command(["measure", "track", str(folder), "--every", "2"]) == 0
    model = read_ghost_model(folder / "model.json")
    tracks = (folder / "tracks.json").read_text()
    (folder / "tracks.json").write_text(tracks.replace('"name": "a"', '"name": "c"'))
    assert "of other ghosts than the model's" in reported(capsys, "measure", "compress", folder, "--every", "2")
    assert "from other frames or with another --every" in reported(capsys, "measure", "compress", folder)
    (folder / "tracks.json").write_text(tracks.replace('"state": "seen"', '"state": "guessed"'))
    assert "state" in reported(capsys, "measure", "compress", folder, "--every", "2")
    (folder / "tracks.json").write_text("{")
    assert "is not valid JSON" in reported(capsys, "measure", "compress", folder)
    write_ghost_model(folder / "model.json", model.replace(size_px=(99, 98)))
    assert "fitted to pictures of 99x98 pixels and the frames have 120x80" in reported(
        capsys, "measure", "track", folder
    )
    bezier = BezierGhost(name="z", numbers=((1.0,),) * 19, visible_deg=(0.0, 9.0))
    write_ghost_model(folder / "model.json", model.replace(ghosts=(bezier,)))
    assert "a Bezier ghost is a function of the constellation already" in reported(capsys, "measure", "track", folder)
    (folder / "model.json").unlink()
    assert "run flarewright measure fit" in reported(capsys, "measure", "track", folder)
    empty = tmp_path_factory.mktemp("empty")
    assert "merged.json does not exist" in reported(capsys, "measure", "track", empty)
    assert "merged.json does not exist" in reported(capsys, "measure", "compress", empty)


def test_a_file_of_another_version_is_reported(folder, capsys):
    data = json.loads((folder / "model.json").read_text())
    (folder / "model.json").write_text(json.dumps({**data, "schema_version": 7}))
    assert "schema_version" in reported(capsys, "measure", "track", folder)


@pytest.mark.slow
def test_what_is_of_an_earlier_model_is_neither_compressed_nor_reported(folder, capsys):
    for stage in ("track", "compress"):
        more = ["--no-residual"] if stage == "compress" else []
        assert command(["measure", stage, str(folder), "--every", "2", *more]) == 0
    # another model with ghosts of the same names
    model = read_ghost_model(folder / "model.json")
    swapped = [ghost.replace(name={"a": "b", "b": "a"}[ghost.name]) for ghost in model.ghosts]
    write_ghost_model(folder / "model.json", model.replace(ghosts=tuple(swapped)))
    assert "tracks.json was made from another model.json" in reported(
        capsys, "measure", "compress", folder, "--every", "2"
    )
    write_ghost_model(folder / "found.json", model)
    assert command(["measure", "fit", str(folder), "--every", "2", "--no-residual"]) == 0
    capsys.readouterr()

    def remarks(*more):
        assert command(["measure", "report", str(folder), "--json", *more]) == 0
        return json.loads(capsys.readouterr().out)["remarks"]

    all_of_them = remarks()
    for name in ("compact.json", "tracks.json"):
        assert any(f"{name} was made from another model.json and is omitted" in remark for remark in all_of_them)
    assert "<h2>Tracks</h2>" not in (folder / "report.html").read_text()
    # no remark about a model that the user chooses
    assert remarks("--model", str(folder / "compact.json")) == []
    write_ghost_model(folder / "found.json", read_ghost_model(folder / "found.json").replace(remarks=("by hand",)))
    reported_of = f"{folder / 'model.json'} was made from another found.json; flarewright measure fit recreates it"
    assert reported_of in _of_another_model(folder)[1]


@pytest.mark.slow
def test_recreated_stages_are_of_the_same_model(folder, capsys):
    write_ghost_model(folder / "found.json", read_ghost_model(folder / "model.json"))

    def remarks():
        assert command(["measure", "report", str(folder), "--json"]) == 0
        return json.loads(capsys.readouterr().out)["remarks"]

    stages = ["--stages", "fit,track,compress", "--every", "2", "--no-residual"]
    assert command(["measure", "run", str(folder), "-o", str(folder), *stages]) == 0
    capsys.readouterr()
    assert remarks() == []
    assert "<h2>Tracks</h2>" in (folder / "report.html").read_text()
    # tracks of other frames, or the residual, do not make another model
    assert command(["measure", "track", str(folder), "--every", "1"]) == 0
    assert command(["measure", "fit", str(folder), "--every", "2"]) == 0
    assert read_ghost_model(folder / "model.json").sprites
    assert _of_another_model(folder) == ([], [])
    write_ghost_model(folder / "found.json", read_ghost_model(folder / "found.json").replace(remarks=("by hand",)))
    reported_of = [f"{folder / 'model.json'} was made from another found.json; flarewright measure fit recreates it"]
    assert _of_another_model(folder) == ([], reported_of)
