"""Steps of lateral colour: as many between two traced wavelengths as the light between them shows."""

import numpy as np
import pytest

from flarewright.model import BlackBody, Camera, Light, Project, Quality
from flarewright.optics.lens.paths import ghost_paths
from flarewright.render.ghosts.traced_ghosts import MOST_BRIDGES, STEP_CONTRAST, _steps_shown, draw_final, find_final
from flarewright.render.image.canvas import blank
from flarewright.render.scene.opening import make_opening
from flarewright.render.scene.resolve import resolve_project
from flarewright.render.scene.shots import make_shots

SIZE = (640, 360)


def shot_of(**light):
    project = Project(
        lens="canon-28-80", lights=(Light(field_deg=(-9.0, 5.0), **light),), camera=Camera(size_px=SIZE),
        quality=Quality(wavelengths=7, ringing="off"),
    )  # fmt: skip
    settled = resolve_project(project)
    (shot,) = make_shots(settled, make_opening(settled, None))
    return settled, project.quality, shot


def test_steps_follow_the_light_between_two_wavelengths():
    _, _, shot = shot_of()
    steps = _steps_shown(shot, None, 50.0 * STEP_CONTRAST)
    # each of the first five gaps holds a tenth to two thirds of one channel
    assert len(steps) == 6
    assert all(5 <= n <= 32 for n in steps[:5])
    # beyond 640 nm red fades: half as many as where it is brightest
    assert steps[5] < 0.7 * steps[4]
    _, _, warm = shot_of(spectrum=BlackBody(temperature_k=2000.0))
    redder = _steps_shown(warm, None, 50.0 * STEP_CONTRAST)
    assert redder[5] > steps[5]


def test_the_brightest_ghosts_have_all_steps_and_dark_ones_none():
    _, _, shot = shot_of()
    assert _steps_shown(shot, None, float("inf")) == [MOST_BRIDGES] * 6
    assert _steps_shown(shot, None, STEP_CONTRAST) == [1] * 6


def test_omitted_steps_are_fainter_than_what_shows(monkeypatch):
    """Against all steps no pixel changes by the contrast that shows, and much less than without steps."""
    settled, quality, shot = shot_of()
    (path,) = (path for path in ghost_paths(settled.lens) if path.name == "19-9")
    item = find_final(shot, path)
    visibility = 8.0 * STEP_CONTRAST
    # the mean of all ghosts, of which this one has that part
    level = item.region.brightness * item.gain / visibility

    def picture(steps=None):
        if steps:
            monkeypatch.setattr("flarewright.render.ghosts.traced_ghosts._steps_shown", lambda *_: [steps] * 6)
        canvas = blank(SIZE)
        draw_final(item, quality, canvas, visibility, detail=0)
        return canvas.plane().astype(float)

    few, none, every = picture(), picture(1), picture(MOST_BRIDGES)
    off = np.abs(few - every)
    assert 0.0 < off.max() < 0.2 * STEP_CONTRAST * level
    assert off.sum() < 0.5 * np.abs(none - every).sum()
    assert few.sum(axis=(0, 1, 3)) == pytest.approx(every.sum(axis=(0, 1, 3)), rel=1e-3)
