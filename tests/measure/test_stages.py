"""Find and fit as stages of a run's folder, from the command line too."""

import json
import re

import numpy as np
import pytest
from planted_run import GHOSTS, LARGEST, SIZE, shape, views

from flarewright.cli.app import run as command
from flarewright.io.ghost_model_file import read_ghost_model
from flarewright.io.merged import read_run, write_frame, write_run
from flarewright.measure import stages
from flarewright.measure.fit import render
from flarewright.measure.found import Found
from flarewright.measure.reading import read_views
from flarewright.measure.replay import draw, replay
from flarewright.measure.settle import to_model
from flarewright.measure.stages import find_ghosts, fit_ghosts
from flarewright.model.capture import FrameInfo, MergedFrame, MergedRun
from flarewright.model.corrections import Corrections, Pointed
from flarewright.model.ghost_model import GhostModel

ANGLES = np.linspace(2.0, LARGEST, 12)
FOCAL = 900.0


def write(folder, ghosts, focal=FOCAL, last_from=0) -> None:
    """Write a merged run of planted ghosts, the last of which is born at one of the constellations."""
    infos = []
    (folder / "frames").mkdir()
    before, after = views(ghosts[:-1], angles=ANGLES), views(ghosts, angles=ANGLES)
    for k, view in enumerate([*before[:last_from], *after[last_from:]]):
        x, y = float(view.frame[0]), float(view.frame[1])
        info = FrameInfo(
            file=f"frames/{k:03d}.exr", constellation_deg=float(ANGLES[k]), nominal_deg=float(ANGLES[k]),
            light_px=(x + focal * float(np.tan(np.radians(ANGLES[k]))), y), axis_px=(x, y),
        )  # fmt: skip
        write_frame(folder, MergedFrame(info, view.pixels, view.variance))
        infos.append(info)
    write_run(folder, MergedRun(size_px=SIZE, frames=tuple(infos), axis_px=(x, y), px_per_rad=focal))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("run")
    write(place, GHOSTS[1:2])
    return place


def test_found_and_fitted_from_even_angles_replays_the_odd_ones(folder, capsys):
    assert command(["measure", "find", str(folder), "--every", "2", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["find"]["ghosts"] == 1
    assert command(["measure", "fit", str(folder), "--every", "2"]) == 0
    model = read_ghost_model(folder / "model.json")
    assert len(model.ghosts) == 1
    for angle, view in zip(ANGLES[1:-1:2], views((), angles=ANGLES[1:-1:2]), strict=True):
        truth = render(GHOSTS[1], view)
        error = replay(model, float(angle))[0].pixels[..., 1] - truth
        assert np.sqrt((error**2).mean()) < 0.03 * np.sqrt((truth**2).mean())


def test_a_ghost_that_goes_along_with_the_light_is_found(tmp_path):
    """It covers what is next to the light in most constellations: taken for glow, it would be found in pieces."""
    planted = shape(80.0, 24.0, 0.5)
    write(tmp_path, (planted,), focal=100.0)
    model = find_ghosts(tmp_path, read_run(tmp_path))
    assert len(model.ghosts) == 1
    # by its outline: a rim of its own says the same as a pupil of that size
    for angle, view in zip(ANGLES[3::3], views((), angles=ANGLES[3::3]), strict=True):
        found, true = draw(model, float(angle), 0.0, SIZE)[..., 1], render(planted, view)
        drawn, there = (light > 0.5 * np.median(light[light > 1e-3]) for light in (found, true))
        assert np.count_nonzero(drawn & there) > 0.93 * np.count_nonzero(drawn | there)


def test_a_search_in_halved_pictures_tells_of_the_captures_pixels(tmp_path, monkeypatch):
    write(tmp_path, GHOSTS[1:2])
    monkeypatch.setattr(stages, "SEARCH_WIDTH", SIZE[0] // 2)
    told: list[str] = []
    found = find_ghosts(tmp_path, read_run(tmp_path), most=1, tell=told.append)
    speed, size = (float(re.search(f"^ghost 1: .*{word} (-?[0-9.]+) px", told[0])[1]) for word in ("speed", "size"))
    # as planted, and as the file has it
    assert speed == pytest.approx(55.0, abs=2.0)
    assert size == pytest.approx(14.0, abs=1.5)
    assert found.ghosts[0].green.f[0] == pytest.approx(speed, abs=2.0)


def test_a_fit_joins_what_was_found_in_pieces(tmp_path):
    """Light that lands in the middle from half of the pupil, found as a body and a core."""
    whole = shape(-50.0, 30.0, 0.4)
    whole.numbers[10], whole.numbers[11] = 9.0, 21.0
    write(tmp_path, (whole,))
    pieces = [Found((one, one, one), 0, len(ANGLES) - 1) for one in (shape(-50.0, 29.0, 0.4), shape(-49.0, 8.0, 0.4))]
    run = read_run(tmp_path)
    rough = GhostModel(
        size_px=SIZE, axis_px=run.axis_px, focal_px=FOCAL, largest_deg=LARGEST, constellation_deg=(2.0, LARGEST),
        ghosts=to_model(pieces, views((), angles=ANGLES)),
    )  # fmt: skip
    told = []
    model = fit_ghosts(tmp_path, run, rough, tell=told.append)
    assert len(model.ghosts) == 1
    assert any("is a part of one of size" in line for line in told)


def test_a_person_can_take_a_ghost_away_and_point_at_one(folder, tmp_path, capsys):
    path = tmp_path / "corrections.json"
    x = 0.5 * SIZE[0] + 2.3 + 55.0 * np.tan(np.radians(ANGLES[8])) / np.tan(np.radians(LARGEST))
    pointed = {"constellation_deg": ANGLES[8], "centre_px": [x, 0.5 * SIZE[1] - 1.6], "radius_px": 14.0}
    path.write_text(json.dumps({"add": [pointed], "remove": ["1"]}))
    assert command(["measure", "find", str(folder), "--corrections", str(path), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["find"]["ghosts"] == 0


def test_a_fit_does_not_find_again_what_a_person_took_away(tmp_path):
    write(tmp_path, GHOSTS[:2])
    run = read_run(tmp_path)
    found = find_ghosts(tmp_path, run)
    unwanted = min(found.ghosts, key=lambda ghost: abs(ghost.green.f[0] - 55.0))
    rough = find_ghosts(tmp_path, run, corrections=Corrections(remove=(unwanted.name,)))
    assert len(rough.ghosts) == len(found.ghosts) - 1
    assert [ghost.name for ghost in rough.removed] == [unwanted.name]
    model = fit_ghosts(tmp_path, run, rough)
    assert [round(ghost.green.f[0], -1) for ghost in model.ghosts] == [-110.0]
    # the frames still show its light, so a replay does
    angle = float(ANGLES[6])
    shown = replay(model, angle)[0].pixels[..., 1] - render(GHOSTS[0], views((), angles=[angle])[0])
    truth = render(GHOSTS[1], views((), angles=[angle])[0])
    assert shown.sum() == pytest.approx(truth.sum(), rel=0.2)


def test_of_many_constellations_some_are_searched_and_all_fitted(tmp_path, monkeypatch):
    born, searched = 5, [0, 2, 4, 7, 9, 11]
    monkeypatch.setattr(stages, "SEARCHED", len(searched))
    write(tmp_path, GHOSTS[:2], last_from=born)
    run = read_run(tmp_path)
    # pointed at where no constellation is searched
    x = run.axis_px[0] + 55.0 * np.tan(np.radians(ANGLES[5])) / np.tan(np.radians(LARGEST))
    pointed = Pointed(constellation_deg=float(ANGLES[5]), centre_px=(x, run.axis_px[1]), radius_px=14.0)
    rough = find_ghosts(tmp_path, run, most=1, corrections=Corrections(add=(pointed,)))
    assert [ghost.green.f[0] for ghost in rough.ghosts] == pytest.approx([55.0], abs=1.0)
    # it begins between the last one searched that does not show it and the first that does
    assert ANGLES[4] < rough.ghosts[0].visible_deg[0] < ANGLES[7]
    model = fit_ghosts(tmp_path, run, rough)
    late, other = sorted(model.ghosts, key=lambda ghost: -ghost.green.f[0])
    assert ANGLES[born - 1] < late.visible_deg[0] < ANGLES[born]
    assert other.green.f[0] == pytest.approx(-110.0, abs=1.0)
    assert other.visible_deg == (ANGLES[0], ANGLES[-1])


@pytest.mark.parametrize(("every", "kept"), [(1, 8), (2, 4), (3, 4)])
def test_only_every_nth_constellation_of_each_roll_is_read(tmp_path, every, kept):
    (tmp_path / "frames").mkdir()
    infos = []
    for k, (angle, roll) in enumerate((angle, roll) for angle in (2.0, 4.0, 6.0, 8.0) for roll in (0.0, 90.0)):
        view = views((), angles=[angle], roll_deg=roll)[0]
        info = FrameInfo(
            file=f"frames/{k:03d}.exr", constellation_deg=angle + 0.001 * (roll > 0.0), nominal_deg=angle,
            roll_deg=roll, nominal_roll_deg=roll, light_px=(9.0, 9.0), axis_px=(120.0, 80.0),
        )  # fmt: skip
        write_frame(tmp_path, MergedFrame(info, view.pixels, view.variance))
        infos.append(info)
    run = MergedRun(size_px=SIZE, frames=tuple(infos), axis_px=(120.0, 80.0), px_per_rad=FOCAL)
    read = read_views(tmp_path, run, every)
    assert len(read) == kept
    for roll in (0.0, 90.0):
        turned = [view.constellation_deg for view in read if round(view.roll_deg) == roll]
        assert turned == pytest.approx([2.0, 4.0, 6.0, 8.0][::every], abs=0.01)


def test_what_came_of_corrections_is_told(folder, tmp_path, capsys):
    path = tmp_path / "corrections.json"
    along, y = np.tan(np.radians(ANGLES[8])) / np.tan(np.radians(LARGEST)), 0.5 * SIZE[1] - 1.6
    there, nowhere = (
        {"constellation_deg": ANGLES[8], "centre_px": [0.5 * SIZE[0] + 2.3 + speed * along, y], "radius_px": 14.0}
        for speed in (55.0, -90.0)
    )
    path.write_text(json.dumps({"add": [there, nowhere], "remove": ["77"]}))
    assert command(["measure", "find", str(folder), "--corrections", str(path)]) == 0
    told = capsys.readouterr().err
    assert "is ghost 1" in told
    assert "left out" in told
    assert "no ghost '77' to remove; found were 1" in told


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"centre_px": [9999.0, 80.0]}, "not in the picture"), ({"constellation_deg": 70.0}, "no frame shows 70"),
        ({"radius_px": 500.0}, "larger than the picture"),
    ],
)  # fmt: skip
def test_a_correction_that_points_at_nothing_is_refused(folder, tmp_path, capsys, change, words):
    path = tmp_path / "corrections.json"
    path.write_text(json.dumps({"add": [{"constellation_deg": 12.0, "centre_px": [9, 9], "radius_px": 5} | change]}))
    assert command(["measure", "find", str(folder), "--corrections", str(path)]) == 2
    assert words in capsys.readouterr().err


def test_fitting_needs_finding_first(tmp_path, capsys):
    write(tmp_path, ())
    assert command(["measure", "fit", str(tmp_path)]) == 2
    assert "measure find" in capsys.readouterr().err
    assert command(["measure", "find", str(tmp_path), "--every", "9"]) == 2
    assert "too few" in capsys.readouterr().err


def test_more_than_every_constellation_left_out_is_told(folder, capsys):
    assert command(["measure", "find", str(folder), "--every", "50"]) == 2
    told = capsys.readouterr().err
    assert "--every 50 leaves 1 of 12 constellations" in told
    assert "at most --every 5" in told
    assert len(read_views(folder, read_run(folder), 5)) == 3


def test_a_frame_of_another_size_is_named(tmp_path, capsys):
    write(tmp_path, ())
    info = read_run(tmp_path).frames[3]
    small = np.zeros((20, 30, 3), np.float32)
    write_frame(tmp_path, MergedFrame(info, small, small + 1.0))
    assert command(["measure", "find", str(tmp_path)]) == 2
    told = capsys.readouterr().err
    assert info.file in told
    assert "30x20" in told
