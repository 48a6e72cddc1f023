"""The inverse of a measured flare's light position: a render draws the light at the pixel."""

from __future__ import annotations

import pytest
from test_model_image import planted

from flarewright.errors import ProjectError
from flarewright.io.measurement.ghost_model_file import write_ghost_model
from flarewright.measure.replay.light_place import measured_angles_at
from flarewright.measure.replay.measured_project import render_measured
from flarewright.model import Camera, Light, Project


@pytest.mark.parametrize("distortion", [0.0, 0.08, -0.05])
def test_a_render_places_the_light_at_its_pixel(tmp_path, distortion):
    path = tmp_path / "model.json"
    write_ghost_model(path, planted().replace(distortion=distortion))
    size = (80, 60)
    project = Project(lens=str(path), lights=[Light(field_deg=(0, 0))], camera=Camera(size_px=size))
    place = (52.25, 21.5)
    lit = project.replace(lights=(Light(field_deg=measured_angles_at(project, place)),))
    summary = render_measured(lit).summary
    x, y = summary["lights"][0]["direct_position_mm"]
    across, down = summary["sensor_mm"]
    assert (40.0 + x * size[0] / across, 30.0 - y * size[1] / down) == pytest.approx(place, abs=1e-6)


def test_a_place_that_the_distortion_does_not_reach_is_one_sentence(tmp_path):
    path = tmp_path / "model.json"
    write_ghost_model(path, planted().replace(distortion=-0.5))
    project = Project(lens=str(path), lights=[Light(field_deg=(0, 0))], camera=Camera(size_px=(80, 60)))
    with pytest.raises(ProjectError, match="the measured distortion images no light at 5000,30 px"):
        measured_angles_at(project, (5000.0, 30.0))
