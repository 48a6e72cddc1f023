"""Constellation, roll and brightness (Walch 2017, equations 8.1 to 8.3) against simple cases."""

import numpy as np
import pytest

from flarewright.optics.lens.field_angles import brightness_scale, constellation_and_roll, field_angles, view_axes

NORTH, UP = (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


@pytest.mark.parametrize(
    ("to_light", "constellation", "roll"),
    [
        ((0.0, 5.0, 0.0), 0.0, 0.0),
        ((1.0, 1.0, 0.0), 45.0, 0.0),  # east of a camera that looks north is on its right
        ((0.0, 2.0, 2.0), 45.0, 90.0),
        ((-3.0, 3.0, 0.0), 45.0, 180.0),
        ((1.0, 0.0, -1.0), 90.0, -45.0),
        ((0.0, -1.0, 0.0), 180.0, 0.0),
    ],
)
def test_light_around_a_camera_that_looks_north(to_light, constellation, roll):
    found = constellation_and_roll(view_axes(NORTH, UP), to_light)
    np.testing.assert_allclose(found, (constellation, roll), atol=1e-12)


def test_constellation_is_the_arc_cosine_of_equation_8_1():
    rng = np.random.default_rng(1)
    forward, up, light = rng.normal(size=(3, 200, 3))
    found, _ = constellation_and_roll(view_axes(forward, up), light)
    cosine = (forward * light).sum(axis=1) / np.linalg.norm(forward, axis=1) / np.linalg.norm(light, axis=1)
    np.testing.assert_allclose(found, np.degrees(np.arccos(cosine)), atol=1e-5)


def test_axes_are_right_handed_and_up_is_up():
    axes = view_axes((1.0, 2.0, -0.5), UP)
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    # right x up points back to the eye
    np.testing.assert_allclose(np.cross(axes[0], axes[1]), -axes[2], atol=1e-12)
    assert axes[1] @ np.array(UP) > 0.0


def test_up_along_the_view_is_not_a_number():
    assert np.isnan(view_axes(UP, UP)).any()


def test_field_angles_are_the_light_again():
    for angle, roll in [(0.0, 0.0), (30.0, 20.0), (80.0, -130.0)]:
        x, y = np.tan(np.radians(field_angles(angle, roll)))
        found = constellation_and_roll(np.eye(3), (x, y, 1.0))
        np.testing.assert_allclose(found, (angle, roll), atol=1e-9)


@pytest.mark.parametrize(
    ("ratios", "factor"),
    [
        ({}, 1.0),
        ({"f_number": 2.0}, 0.25),  # two stops down
        ({"iso": 4.0}, 4.0),
        ({"exposure_s": 1.0 / 50.0}, 0.02),
        ({"luminance_cd_m2": 2.0}, 2.0),
        ({"solid_angle_sr": 3.0}, 3.0),
        # f/2.8 after f/4, ISO 800 after 100, 1/125 s after 1 s, and the sun, 1.6e9 cd/m2 over 6.8e-5 sr, after a lamp
        # of 1e6 over 1e-5: 2.0408 * 8 * 0.008 * 1600 * 6.8
        ({"f_number": 0.7, "iso": 8.0, "exposure_s": 0.008, "luminance_cd_m2": 1600.0, "solid_angle_sr": 6.8},
         1421.0612),
    ],
)  # fmt: skip
def test_brightness_of_equation_8_3(ratios, factor):
    assert brightness_scale(ratios) == pytest.approx(factor, rel=1e-6)
    assert brightness_scale({name: 1.0 / ratio for name, ratio in ratios.items()}) == pytest.approx(1.0 / factor)
