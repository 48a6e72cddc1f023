"""The irradiance of an extended scene in a render's summary."""

from math import pi

import numpy as np
import pytest

from flarewright.kernels.tracing.sequential import ALIVE, REL, WEIGHT
from flarewright.model import Bare, Camera, Everywhere, Light, Output, Project, Quality
from flarewright.optics.lens.paths import direct_path
from flarewright.optics.rays.bundle import trace_points
from flarewright.render.render import render
from flarewright.render.scene.opening import make_opening
from flarewright.render.scene.resolve import resolve_project
from flarewright.render.scene.shots import make_shots


@pytest.mark.parametrize("name", ["heliar-tronnier", "nikkor-180-ed"])
def test_it_is_what_a_narrow_pencil_along_the_axis_carries(name):
    """A traced bundle through the centre of the pupil against the product of the surfaces' T."""
    project = Project(
        lens=name,
        lights=(Light(field_deg=(3.0, 0.0)),),
        f_number=16.0,
        coating=Everywhere(coating=Bare()),
        camera=Camera(size_px=(8, 8)),
        quality=Quality(mode="draft"),
        output=Output(starburst=False),
    )
    reported = render(project).summary["scene_irradiance_per_radiance"]
    settled = resolve_project(project.replace(lights=(Light(field_deg=(0.0, 0.0)),)))
    (shot,) = make_shots(settled, make_opening(settled, None))
    w = (len(shot.packed.wavelengths_nm) - 1) // 2
    points = np.random.default_rng(1).uniform(-0.01, 0.01, (20, 2))
    rays = trace_points(shot.packed, w, direct_path(settled.lens), shot.incidence.tilt, points)
    assert (rays[:, ALIVE] == 1.0).all()
    assert (rays[:, REL] < 1.0).all()
    # the blades of the iris bound an area equal to the disc's
    expected = pi * rays[:, WEIGHT].mean() / (4.0 * 16.0**2) * shot.opening.mean_transmittance
    assert reported == pytest.approx(expected, rel=2e-3)
