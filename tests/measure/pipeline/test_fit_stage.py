"""The find and fit stages in a run's folder, as functions and from the command line."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from planted_run import FOCAL, LARGEST, SIZE, SMALL, SMALL_ANGLES, SMALL_GHOSTS, shape, views, write, write_small

from flarewright.cli.app import run as command
from flarewright.io.measurement.ghost_model_file import read_ghost_model
from flarewright.io.measurement.merged import read_frame, read_run, write_frame
from flarewright.measure.core.frame_reading import read_views
from flarewright.measure.core.parameters import rescaled
from flarewright.measure.detection.settings import DetectionSettings
from flarewright.measure.fitting.alternating_fit import to_model
from flarewright.measure.fitting.detected_ghost import DetectedGhost
from flarewright.measure.fitting.ghost_fit import render
from flarewright.measure.fitting.settings import FitSettings, Growth
from flarewright.measure.pipeline import find_stage, fit_stage
from flarewright.measure.pipeline.find_stage import find_ghosts
from flarewright.measure.pipeline.fit_stage import fit_ghosts
from flarewright.measure.pipeline.settings import MeasureSettings
from flarewright.measure.replay.model_image import draw, replay_model
from flarewright.model.measurement.capture import FrameInfo, MergedFrame, MergedRun
from flarewright.model.measurement.corrections import Corrections, MarkedGhost
from flarewright.model.measurement.ghost_model import GhostModel

pytestmark = pytest.mark.usefixtures("no_crescents")

ANGLES = np.linspace(2.0, LARGEST, 9)
ONE = SMALL_GHOSTS[1]
# motion of the ghost up to the largest constellation, and its radius, pixels
SPEED, RADIUS = 27.5, 7.0
# settings without the slow parts of a fit
PLAIN = MeasureSettings(fit=FitSettings(rounds=1, most=Growth(order=1, discs=0)))
AXIS = 0.5 * SMALL[0] + 2.3, 0.5 * SMALL[1] - 1.6


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return a run with one ghost at nine constellations."""
    place = tmp_path_factory.mktemp("run")
    write_small(place, (ONE,), angles=ANGLES)
    return place


def searches(monkeypatch):
    """Return a list to which every search adds its views."""
    pursued = []
    real = fit_stage.pursue
    for stage in (find_stage, fit_stage):
        monkeypatch.setattr(
            stage, "pursue", lambda seen, *reported, **how: pursued.append(seen) or real(seen, *reported, **how)
        )
    return pursued


@pytest.mark.slow
def test_found_and_fitted_from_even_angles_replays_the_odd_ones(folder, capsys):
    assert command(["measure", "find", str(folder), "--every", "2", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["find"]["ghosts"] == 1
    assert command(["measure", "fit", str(folder), "--every", "2"]) == 0
    model = read_ghost_model(folder / "model.json")
    assert len(model.ghosts) == 1
    for angle, view in zip(ANGLES[1:-1:2], views((), angles=ANGLES[1:-1:2], size=SMALL), strict=True):
        truth = render(ONE, view)
        error = replay_model(model, float(angle))[0].pixels[..., 1] - truth
        assert np.sqrt((error**2).mean()) < 0.03 * np.sqrt((truth**2).mean())


@pytest.mark.slow
def test_a_ghost_that_goes_along_with_the_light_is_found(tmp_path):
    """It covers the light's surroundings at most constellations; treated as glow it would be found in pieces."""
    planted, size = rescaled(shape(80.0, 24.0, 0.5), 0.75), (180, 120)
    angles = np.linspace(2.0, LARGEST, 8)
    model = find_ghosts(tmp_path, write(tmp_path, (planted,), angles=angles, size=size, focal=75.0), max_ghosts=2)
    assert len(model.ghosts) == 1
    # by its outline: a separate rim is equivalent to a pupil of that size
    for angle, view in zip(angles[2:], views((), angles=angles[2:], size=size), strict=True):
        found, true = draw(model, float(angle), 0.0, size)[..., 1], render(planted, view)
        drawn, there = (light > 0.5 * np.median(light[light > 1e-3]) for light in (found, true))
        assert np.count_nonzero(drawn & there) > 0.93 * np.count_nonzero(drawn | there)


def test_a_search_in_halved_pictures_reports_of_the_captures_pixels(tmp_path, monkeypatch):
    run = write(tmp_path, (rescaled(ONE, 2.0),), angles=SMALL_ANGLES)
    settings = MeasureSettings(detection=DetectionSettings(width_px=SIZE[0] // 2))
    pursued = searches(monkeypatch)
    reported: list[str] = []
    found = find_ghosts(tmp_path, run, max_ghosts=1, report=reported.append, settings=settings)
    assert [view.size_px for view in pursued[0]] == [(SIZE[0] // 2, SIZE[1] // 2)] * len(SMALL_ANGLES)
    speed, size = (float(re.search(f"^ghost 1: .*{word} (-?[0-9.]+) px", reported[0])[1]) for word in ("speed", "size"))
    # as planted, and as stored in the file
    assert speed == pytest.approx(55.0, abs=2.0)
    assert size == pytest.approx(14.0, abs=1.5)
    assert found.ghosts[0].green.f[0] == pytest.approx(speed, abs=2.0)


def test_a_fit_joins_what_was_found_in_pieces(tmp_path):
    """Light that lands in the middle from half of the pupil, detected as a body and a core."""
    whole = shape(-50.0, 30.0, 0.4)
    whole.numbers[10], whole.numbers[11] = 9.0, 21.0
    size = 84, 56
    run = write_small(tmp_path, (rescaled(whole, 0.35),), size=size)
    pieces = [
        DetectedGhost((one, one, one), 0, len(SMALL_ANGLES) - 1)
        for one in (rescaled(shape(-50.0, 29.0, 0.4), 0.35), rescaled(shape(-49.0, 8.0, 0.4), 0.35))
    ]
    rough = GhostModel(
        size_px=size, axis_px=run.axis_px, focal_px=FOCAL, largest_deg=LARGEST, constellation_deg=(2.0, LARGEST),
        ghosts=to_model(pieces, views((), angles=SMALL_ANGLES, size=size)),
    )  # fmt: skip
    reported = []
    model = fit_ghosts(tmp_path, run, rough, settings=PLAIN, max_ghosts=2, residual=False, report=reported.append)
    assert len(model.ghosts) == 1
    assert any("joined the ghost of speed" in line for line in reported)


@pytest.mark.slow
def test_the_user_can_remove_a_ghost_and_add_one(folder, tmp_path, capsys):
    path = tmp_path / "corrections.json"
    x = AXIS[0] + SPEED * np.tan(np.radians(ANGLES[6])) / np.tan(np.radians(LARGEST))
    pointed = {"constellation_deg": ANGLES[6], "centre_px": [x, AXIS[1]], "radius_px": RADIUS}
    path.write_text(json.dumps({"add": [pointed], "remove": ["1"]}))
    assert command(["measure", "find", str(folder), "--corrections", str(path), "--every", "2", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["find"]["ghosts"] == 0


def test_a_fit_does_not_detect_a_removed_ghost_again(tmp_path):
    run = write_small(tmp_path, SMALL_GHOSTS[:2])
    rough = find_ghosts(tmp_path, run, max_ghosts=2, corrections=Corrections(remove=("2",)))
    assert [ghost.name for ghost in rough.ghosts] == ["1"]
    assert [ghost.name for ghost in rough.removed] == ["2"]
    model = fit_ghosts(tmp_path, run, rough, settings=PLAIN)
    both = sorted(ghost.green.f[0] for ghost in (*rough.ghosts, *rough.removed))
    assert both == pytest.approx([-55.0, SPEED], abs=1.0)
    planted = SMALL_GHOSTS[:2] if rough.ghosts[0].green.f[0] < 0.0 else SMALL_GHOSTS[1::-1]
    assert [ghost.green.f[0] for ghost in model.ghosts] == pytest.approx([planted[0].numbers[0]], abs=1.0)
    assert [ghost.green.f[0] for ghost in model.removed] == pytest.approx([planted[1].numbers[0]], abs=1.0)
    # the frames still contain its light, so a replay does too
    angle = float(SMALL_ANGLES[2])
    (bare,) = views((), angles=[angle], size=SMALL)
    shown = replay_model(model, angle)[0].pixels[..., 1] - render(planted[0], bare)
    assert shown.sum() == pytest.approx(render(planted[1], bare).sum(), rel=0.2)


@pytest.mark.slow
def test_of_many_constellations_some_are_searched_and_all_fitted(tmp_path, monkeypatch):
    angles, born, searched = np.linspace(2.0, LARGEST, 12), 5, [0, 2, 4, 7, 9, 11]
    settings = replace(PLAIN, detection=DetectionSettings(views=len(searched)))
    pursued = searches(monkeypatch)
    run = write_small(tmp_path, SMALL_GHOSTS[:2], angles=angles, last_from=born)
    # the hint is at a constellation that is not searched
    x = run.axis_px[0] + SPEED * np.tan(np.radians(angles[born])) / np.tan(np.radians(LARGEST))
    pointed = MarkedGhost(constellation_deg=float(angles[born]), centre_px=(x, run.axis_px[1]), radius_px=RADIUS)
    rough = find_ghosts(tmp_path, run, max_ghosts=1, corrections=Corrections(add=(pointed,)), settings=settings)
    assert [ghost.green.f[0] for ghost in rough.ghosts] == pytest.approx([SPEED], abs=1.0)
    # its range begins between the last searched constellation without it and the first with it
    assert angles[4] < rough.ghosts[0].visible_deg[0] < angles[7]
    model = fit_ghosts(tmp_path, run, rough, settings=settings, max_ghosts=2, residual=False)
    late, other = sorted(model.ghosts, key=lambda ghost: -ghost.green.f[0])
    assert angles[born - 1] < late.visible_deg[0] < angles[born]
    assert other.green.f[0] == pytest.approx(-55.0, abs=1.0)
    assert other.visible_deg == (angles[0], angles[-1])
    # both searches
    for seen in pursued:
        assert [view.constellation_deg for view in seen] == pytest.approx(angles[searched])
    assert len(pursued) == 2


@pytest.mark.parametrize(("every", "kept"), [(1, 8), (2, 4), (3, 4)])
def test_only_every_nth_constellation_of_each_roll_is_read(tmp_path, every, kept):
    (tmp_path / "frames").mkdir()
    infos = []
    for k, (angle, roll) in enumerate((angle, roll) for angle in (2.0, 4.0, 6.0, 8.0) for roll in (0.0, 90.0)):
        view = views((), angles=[angle], roll_deg=roll, size=SMALL)[0]
        info = FrameInfo(
            file=f"frames/{k:03d}.exr", constellation_deg=angle + 0.001 * (roll > 0.0), nominal_deg=angle,
            roll_deg=roll, nominal_roll_deg=roll, light_px=(9.0, 9.0), axis_px=AXIS,
        )  # fmt: skip
        write_frame(tmp_path, MergedFrame(info, view.pixels, view.variance))
        infos.append(info)
    run = MergedRun(size_px=SMALL, frames=tuple(infos), axis_px=AXIS, px_per_rad=FOCAL)
    read = read_views(tmp_path, run, every)
    assert len(read) == kept
    for roll in (0.0, 90.0):
        turned = [view.constellation_deg for view in read if round(view.roll_deg) == roll]
        assert turned == pytest.approx([2.0, 4.0, 6.0, 8.0][::every], abs=0.01)


def test_the_effect_of_corrections_is_reported(folder, tmp_path, capsys):
    path = tmp_path / "corrections.json"
    along = np.tan(np.radians(ANGLES[4])) / np.tan(np.radians(LARGEST))
    there, nowhere = (
        {"constellation_deg": ANGLES[4], "centre_px": [AXIS[0] + speed * along, AXIS[1]], "radius_px": RADIUS}
        for speed in (SPEED, -45.0)
    )
    path.write_text(json.dumps({"add": [there, nowhere], "remove": ["77"]}))
    assert command(["measure", "find", str(folder), "--every", "4", "--corrections", str(path)]) == 0
    reported = capsys.readouterr().err
    assert "is ghost 1" in reported
    assert "mark ignored" in reported
    assert "no ghost '77' to remove; found: 1" in reported


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
    assert command(["measure", "find", str(folder), "--every", "4", "--corrections", str(path)]) == 2
    assert words in capsys.readouterr().err


def test_fitting_needs_finding_first(tmp_path, capsys):
    write_small(tmp_path, (), angles=ANGLES)
    assert command(["measure", "fit", str(tmp_path)]) == 2
    assert "measure find" in capsys.readouterr().err
    assert command(["measure", "find", str(tmp_path), "--every", "9"]) == 2
    assert "too few" in capsys.readouterr().err


def test_more_than_every_constellation_left_out_is_reported(folder, capsys):
    assert command(["measure", "find", str(folder), "--every", "50"]) == 2
    reported = capsys.readouterr().err
    assert "--every 50 leaves 1 of 9 constellations" in reported
    assert "at most --every 4" in reported
    assert len(read_views(folder, read_run(folder), 4)) == 3


@pytest.mark.parametrize(
    ("variance", "which", "words"),
    [
        (0.0, slice(1), "has a variance of 0 or less in 1 pixel, and"),
        (-1.0, slice(None), "has a variance of 0 or less in 9600 pixels"),
        (np.inf, slice(None), "every pixel of every frame counts as clipped"),
    ],
)
def test_frames_without_noise_or_measured_pixels_are_refused(tmp_path, capsys, variance, which, words):
    """Weights became infinite, and `find` ended in an error of linear algebra; or it found no ghost in nothing."""
    run = write_small(tmp_path, ())
    for info in run.frames:
        frame = read_frame(tmp_path, info)
        given = frame.variance.copy()
        given[which, which] = variance
        write_frame(tmp_path, replace(frame, variance=given))
    assert command(["measure", "find", str(tmp_path)]) == 2
    reported = capsys.readouterr().err
    assert words in reported
    assert len(reported.strip().splitlines()) == 1


def test_a_frame_of_another_size_is_named(tmp_path, capsys):
    write_small(tmp_path, ())
    info = read_run(tmp_path).frames[3]
    small = np.zeros((20, 30, 3), np.float32)
    write_frame(tmp_path, MergedFrame(info, small, small + 1.0))
    assert command(["measure", "find", str(tmp_path)]) == 2
    reported = capsys.readouterr().err
    assert info.file in reported
    assert "30x20" in reported
