"""Tracks of ghosts that fade, cross, grow and leave the frame."""

from dataclasses import replace

import numpy as np
import pytest
from planted_run import LARGEST, NOISE, SIZE, shape, views

from flarewright.measure.core.parameters import Shape
from flarewright.measure.core.pose_curves import Pose, posed
from flarewright.measure.fitting.ghost_fit import render
from flarewright.measure.tracking.follow import follow, lives
from flarewright.measure.tracking.frame_fit import measure_together
from flarewright.measure.tracking.settings import FrameFitSettings
from flarewright.model.measurement.ghost_tracks import Step

ANGLES = np.linspace(1.0, LARGEST, 24)
# a part of the picture that holds all ghosts of these tests
STRIP = (SIZE[0], 90)


def drawn(ghosts, poses, *, noise=NOISE, seed=1, angles=ANGLES, size=STRIP):
    """Return views of ghosts in the poses `poses(number, constellation)`."""
    rng = np.random.default_rng(seed)
    out = []
    for view in views((), angles=angles, size=size):
        total = np.zeros(view.pixels.shape[:2])
        for g, ghost in enumerate(ghosts):
            pose = poses(g, view.constellation_deg)
            total += render(replace(ghost, numbers=posed(ghost.numbers, view.sigma, pose)), view)
        out.append(view.showing((total[..., None] + rng.normal(0.0, noise, view.pixels.shape)).astype(np.float32)))
    return out


def grey(ghosts: tuple[Shape, ...]):
    return [(one, one, one) for one in ghosts]


@pytest.mark.parametrize("seeds", [3, pytest.param(5, marks=pytest.mark.slow)])
def test_poses_of_overlapping_ghosts_come_back_within_their_errors(seeds):
    ghosts = (shape(-40.0, 30.0, 0.3), shape(-32.0, 22.0, 0.25), shape(70.0, 12.0, 1.0))
    planted = (Pose(1.2, 1.5, 0.95), Pose(0.8, -1.0, 1.04), Pose(1.0, 0.7, 1.02))
    # the ghosts have no model error, and the noise no outliers
    exact = FrameFitSettings(model_error=0.0, outlier=np.inf)
    off = []
    for seed in range(seeds):
        for view in drawn(ghosts, lambda g, _: planted[g], seed=seed, angles=ANGLES[12:16]):
            found = measure_together(grey(ghosts), [Pose()] * 3, view, exact)
            values = np.array([(pose.brightness, pose.along_px, pose.size) for pose in found.poses])
            truth = np.array([(pose.brightness, pose.along_px, pose.size) for pose in planted])
            off.append((values - truth) / found.error)
    # the first two overlap, the third is alone
    assert found.crossing[0] > 1.05 > found.crossing[2]
    assert np.mean(np.square(off)) == pytest.approx(1.0, abs=0.25)


def test_births_and_deaths_and_their_reasons():
    ghosts = (shape(-60.0, 20.0, 1.0), shape(55.0, 14.0, 0.6), shape(190.0, 12.0, 0.8))
    few = np.linspace(1.0, LARGEST, 13)

    def poses(g, angle):
        fading = np.clip((angle - 6.0) / 2.0, 0.0, 1.0) * np.clip((17.0 - angle) / 2.0, 0.0, 1.0)
        return Pose(float(fading)) if g == 1 else Pose(1.0 + 0.4 * angle / LARGEST, 0.1 * angle, 1.0)

    tracks = follow(("still", "fading", "leaving"), grey(ghosts), drawn(ghosts, poses, angles=few)).ghosts
    still, fading, leaving = (track.lives for track in tracks)
    assert [(one.birth.how, one.death.how) for one in still] == [("range", "range")]
    assert (still[0].birth.constellation_deg, still[0].death.constellation_deg) == (1.0, LARGEST)
    (life,) = fading
    assert (life.birth.how, life.death.how) == ("fade", "fade")
    # the brightness is half at 7 and at 16 degrees
    assert life.birth.constellation_deg == pytest.approx(7.0, abs=life.birth.error_deg)
    assert life.death.constellation_deg == pytest.approx(16.0, abs=life.death.error_deg)
    (life,) = leaving
    assert life.death.how == "frame"
    # 190 px at the largest field, less half the picture, the ghost's own radius, and the planted shift
    gone = np.degrees(np.arctan((0.5 * SIZE[0] - 2.3 + 12.0) / 190.0 * np.tan(np.radians(LARGEST))))
    assert life.death.constellation_deg == pytest.approx(gone, abs=1.5)
    steps = tracks[0].steps
    assert [step.along_px for step in steps] == pytest.approx(
        [0.1 * step.constellation_deg for step in steps], abs=0.05
    )
    assert [step.brightness for step in steps] == pytest.approx(
        [1.0 + 0.4 * step.constellation_deg / LARGEST for step in steps], abs=0.01
    )


def test_a_drifting_ghost_is_tracked():
    """Its position drifts by a third of its size over the range, too far for a fit without prediction."""
    ghosts, few = (shape(-60.0, 9.0, 1.0),), ANGLES[::3]
    seen = drawn(ghosts, lambda _, angle: Pose(1.0, 0.2 * angle, 1.0), angles=few)
    (track,) = follow(("1",), grey(ghosts), seen).ghosts
    assert {step.state for step in track.steps} == {"seen"}
    assert [step.along_px for step in track.steps] == pytest.approx([0.2 * angle for angle in few], abs=0.1)


def test_noise_has_no_lives():
    seen = drawn((), lambda *_: Pose(), angles=ANGLES[::4])
    (track,) = follow(("1",), grey((shape(-60.0, 9.0, 1.0),)), seen).ghosts
    assert track.lives == ()
    assert {step.state for step in track.steps} == {"faint"}
    assert follow((), [], seen).ghosts == ()


def steps_of(states: str) -> list[Step]:
    names = {"#": "seen", ".": "faint", "?": "hidden", "o": "outside"}
    return [
        Step(constellation_deg=float(k), state=names[letter], inside=0.0 if letter == "o" else 1.0)
        for k, letter in enumerate(states)
    ]


@pytest.mark.parametrize(
    ("states", "expected"),
    [
        ("....", []),
        ("####", [("range", "range")]),
        (".##?##.", [("fade", "fade")]),
        ("..##..###", [("fade", "fade"), ("fade", "range")]),
        ("##.##", [("range", "range")]),
        ("..#..", []),
        ("oo###?", [("frame", "hidden")]),
        ("?###oo", [("hidden", "frame")]),
    ],
)
def test_lives_from_states(states, expected):
    assert [(life.birth.how, life.death.how) for life in lives(steps_of(states))] == expected
