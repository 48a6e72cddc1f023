"""Heights of chief rays: paraxial near the axis, and equal to the direct image of a render."""

import numpy as np
import pytest

from flarewright.model import Camera, Light, Output, Project, Quality
from flarewright.optics.rays.image_height import image_heights
from flarewright.render.render import render
from flarewright.render.scene.resolve import resolve_project


@pytest.mark.parametrize(("name", "angle_deg"), [("fisheye-nikkor-10.5", 40.0), ("canon-28-80", 20.0)])
def test_heights_are_paraxial_near_the_axis_and_the_renders_far_from_it(name, angle_deg):
    project = Project(
        lens=name, f_number=11.0, lights=(Light(field_deg=(angle_deg, 0.0)),),
        camera=Camera(size_px=(64, 36)), output=Output(layers="passes", starburst=False),
        # the direct image is the same in all qualities; a draft has the cheapest ghosts
        quality=Quality(mode="draft", wavelengths=3, paths="same-side"),
    )  # fmt: skip
    settled = resolve_project(project)
    # at 0.1 degrees, within the rounding of the angle
    near, far = image_heights(settled.lens, settled.order, np.array([0.1, angle_deg]))
    assert near == pytest.approx(settled.order.efl * np.tan(np.radians(0.1)), rel=1e-4)
    assert render(project).summary["lights"][0]["direct_position_mm"][0] == pytest.approx(far, abs=0.05)
    # and it differs from the paraxial height
    assert abs(far - settled.order.efl * np.tan(np.radians(angle_deg))) > 0.1


def test_lenses_that_are_not_round_have_none():
    settled = resolve_project(Project(lens="anamorphic-heliar-2x", lights=(Light(field_deg=(1.0, 0.0)),)))
    assert np.isnan(image_heights(settled.lens, settled.order, np.array([1.0, 5.0]))).all()
