"""Targets from a measured flare: the ghosts of the side where the light lies."""

import pytest

from flarewright.io.measurement.ghost_model_file import write_ghost_model
from flarewright.model.measurement.ghost_model import AberrationGhost, Channel, GhostModel
from flarewright.workflow.searches.flare_targets import busiest_constellation, project_of_model


def ghost(name: str, speed: float, visible_deg: tuple[float, float]) -> AberrationGhost:
    zero = (0.0,) * 9
    one = Channel(f=(speed, *zero), g=(20.0, *zero), intensity=(50.0, *zero))
    return AberrationGhost(name=name, red=one, green=one, blue=one, visible_deg=visible_deg)


@pytest.mark.parametrize(("angle", "speeds"), [(-20.0, [-100.0, 60.0]), (20.0, [30.0])])
def test_a_light_on_the_left_has_the_ghosts_that_were_found_there(tmp_path, angle, speeds):
    """Both sides were measured; the targets of either light were the ghosts of the right side."""
    sides = GhostModel(
        size_px=(600, 400), axis_px=(300.0, 200.0), focal_px=800.0, largest_deg=20.0, constellation_deg=(-20.0, 20.0),
        ghosts=(ghost("a", -100.0, (-20.0, -3.0)), ghost("b", 60.0, (-20.0, -3.0)), ghost("c", 30.0, (3.0, 20.0))),
    )  # fmt: skip
    assert busiest_constellation(sides) < 0.0
    write_ghost_model(tmp_path / "model.json", sides)
    project = project_of_model(tmp_path / "model.json", [(angle, 0.0)], 36.0, 9)
    assert project.design is not None
    # 600 pixels on 36 mm; places count towards the light
    assert sorted(one.place_mm for one in project.design.ghost_targets) == pytest.approx(
        [0.06 * speed for speed in speeds]
    )
