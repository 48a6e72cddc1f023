"""Starbursts of anamorphic lenses whose cylinders stand behind the stop: the sensor sees the iris squeezed."""

from __future__ import annotations

import numpy as np
import pytest

from flarewright.model import Camera, Lens, Light, Lines, Medium, Output, Project, Quality, Starburst, Stop, Surface
from flarewright.optics.lens.paths import direct_path
from flarewright.optics.rays.pack import facing
from flarewright.optics.scattering.veiling_glare import from_surround
from flarewright.render.render import render
from flarewright.render.scene.opening import make_opening
from flarewright.render.scene.resolve import complete_lens, resolve_project
from flarewright.render.scene.shots import make_shots

PIXELS = 81


def rear_anamorphic():
    """Return a lens whose two cylinders keep the focus and lengthen the focal length across by 1.6."""
    glass = Medium(n_d=1.6, v_d=50.0)
    behind = (
        Surface(thickness=3.0, medium=glass, curvature_x=curvature, semi_diameter=12.0)
        for curvature in (0.025, -0.08968640262607)
    )
    rows = [Surface(curvature=0.02, thickness=4.0, medium=glass, semi_diameter=12.0)]
    rows += [Surface(curvature=-0.005, thickness=4.0, semi_diameter=12.0), Stop(thickness=10.0)]
    for cylinder, gap in zip(behind, (15.0, 0.0), strict=True):
        rows += [cylinder, Surface(thickness=gap, semi_diameter=12.0)]
    return complete_lens(Lens(name="rear anamorphic", f_number=11.0, rows=tuple(rows)))


def project(lens, lights=1, **parts):
    line = Lines(lines=((587.56, 1.0),))
    return Project(
        lens=lens,
        f_number=22.0,
        lights=tuple(Light(field_deg=(0.0, 0.0), intensity=1.0 / lights, spectrum=line) for _ in range(lights)),
        camera=Camera(size_px=(PIXELS, PIXELS), sensor_mm=(0.1, 0.1)),
        quality=Quality(mode="draft", wavelengths=1),
        output=Output(layers="passes"),
        **parts,
    )


def star(made):
    layers = {layer.name: layer for layer in render(made, threads=1).layers}
    return layers["starburst"].pixels.sum(axis=2, dtype=np.float64)


@pytest.fixture(scope="module")
def lens():
    return rear_anamorphic()


def test_the_pattern_of_the_iris_is_that_of_the_traced_pupil(lens):
    """On the axis a cat's eye is the iris, so both pictures are the same, 1.6 times as wide as high."""
    plain, traced = star(project(lens)), star(project(lens, starburst=Starburst(cats_eye=True)))
    # the traced pupil is a picture with soft edges
    np.testing.assert_allclose(plain, traced, atol=0.02 * plain.max())
    middle = PIXELS // 2
    wide, high = (
        np.interp(-0.5, -line / line[0], np.arange(len(line)))
        for line in (plain[middle, middle:], plain[middle:, middle])
    )
    assert wide / high == pytest.approx(1.608, rel=0.01)
    assert plain.sum() == pytest.approx(traced.sum(), rel=0.02)


def test_many_lights_have_it_too(lens):
    plain = star(project(lens))
    np.testing.assert_allclose(star(project(lens, lights=9)), plain, atol=0.02 * plain.max())


def test_an_extended_scene_is_seen_through_an_ellipse(lens):
    """Against rays from the centre of the sensor through the whole opening."""
    made = project(lens)
    settled = resolve_project(made)
    (shot,) = make_shots(settled, make_opening(settled, None))
    packed = facing(shot.packed, shot.incidence.axes)
    light = from_surround(settled.lens, packed, [direct_path(settled.lens)], 0.0, threads=1)[0, 0]
    assert render(made, threads=1).summary["scene_irradiance_per_radiance"] == pytest.approx(light, rel=0.02)
