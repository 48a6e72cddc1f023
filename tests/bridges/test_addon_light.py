"""Irradiance of lamps and glowing surfaces in the add-on, without Blender: sums against closed forms."""

from __future__ import annotations

from math import cos, pi, radians, sin, sqrt, tan

import numpy as np
import pytest

HERE = (0.0, 0.0, 0.0)


def at(place, turn=0.0):
    """Return a matrix at a place, turned about x; a lamp shines along its -z."""
    c, s = cos(turn), sin(turn)
    return [[1, 0, 0, place[0]], [0, c, -s, place[1]], [0, s, c, place[2]], [0, 0, 0, 1]]


def total(samples):
    return sum(sample.irradiance for sample in samples)


def test_a_point_spreads_its_power_over_a_sphere(addon):
    lamp = addon.light.Lamp("POINT", at((3.0, 0.0, 4.0)), 100.0)
    (sample,) = addon.light.lamp_samples(lamp, HERE, 32)
    assert sample.irradiance == pytest.approx(100.0 / (4 * pi * 25.0))
    assert sample.direction == pytest.approx((0.6, 0.0, 0.8))
    assert sample.distance == pytest.approx(5.0)


def test_a_large_area_before_the_camera_tends_to_pi_times_its_radiance(addon):
    # a disc of radius R at distance d: E = pi L R^2 / (R^2 + d^2)
    for radius, count in ((0.1, 64), (1.0, 2048), (5.0, 8192)):
        lamp = addon.light.Lamp("AREA", at((0, 0, 2.0)), 10.0, shape="DISK", size=(2 * radius, 0.0), normalized=False)
        exact = 10.0 * radius**2 / (radius**2 + 4.0)
        assert total(addon.light.lamp_samples(lamp, HERE, count)) == pytest.approx(exact, rel=0.01)


def test_an_area_shines_to_its_front_only_and_falls_with_the_cosine(addon):
    flat = [
        total(addon.light.lamp_samples(addon.light.Lamp("AREA", at((0, 0, 9.0), turn), 1.0, size=(0.1, 0.1)), HERE, 16))
        for turn in (0.0, radians(60), pi)
    ]
    assert flat[1] == pytest.approx(0.5 * flat[0], rel=0.02)
    assert flat[2] == 0.0


def test_a_spread_keeps_the_power_of_an_area(addon):
    # radiant intensity over the hemisphere, whatever the angle of the grid
    def power(spread):
        angles = (np.arange(4000) + 0.5) * 0.5 * pi / 4000
        intensity = np.array([cos(a) / pi * addon.light._spread_part(0.5 * spread, cos(a)) for a in angles])
        return float(np.sum(intensity * 2 * pi * np.sin(angles)) * 0.5 * pi / 4000)

    assert power(pi) == pytest.approx(1.0, rel=1e-3)
    for spread in (0.2, 1.0, 2.5):
        assert power(spread) == pytest.approx(1.0, rel=2e-3)


def test_a_spot_is_a_point_within_its_cone_and_dark_outside(addon):
    def level(turn, blend):
        lamp = addon.light.Lamp("SPOT", at((0, 0, 5.0), turn), 1.0, spot_angle=1.0, spot_blend=blend)
        return total(addon.light.lamp_samples(lamp, HERE, 8)) * 4 * pi * 25.0

    assert level(0.0, 1.0) == pytest.approx(1.0)
    assert level(0.49, 0.0) == pytest.approx(1.0)
    assert level(0.51, 0.0) == 0.0
    # half-way in the cosine between the edge and the middle
    middle = np.arccos(0.5 * (1.0 + cos(0.5)))
    assert level(middle, 1.0) == pytest.approx(0.5)


def test_a_sun_has_its_strength_and_its_disc(addon):
    lamp = addon.light.Lamp("SUN", at((7, 8, 9), 0.3), 5.0, angle=0.1)
    samples = addon.light.lamp_samples(lamp, HERE, 200)
    assert total(samples) == pytest.approx(5.0)
    axis = np.array([0.0, -sin(0.3), cos(0.3)])
    angles = np.arccos(np.clip(np.array([sample.direction for sample in samples]) @ axis, -1, 1))
    assert angles.max() == pytest.approx(0.05, rel=0.01)
    # the mean square of a uniform disc is half of its square
    assert (angles**2).mean() == pytest.approx(0.5 * 0.05**2, rel=0.02)
    bare = lamp._replace(normalized=False)
    assert total(addon.light.lamp_samples(bare, HERE, 8)) == pytest.approx(5.0 * pi * sin(0.05) ** 2)


def test_a_parallel_area_lights_only_its_beam(addon):
    lamp = addon.light.Lamp("AREA", at((0.3, 0.0, 5.0)), 2.0, shape="SQUARE", size=(1.0, 1.0), spread=0.0)
    assert total(addon.light.lamp_samples(lamp, HERE, 8)) == pytest.approx(2.0)
    assert addon.light.lamp_samples(lamp, (0.9, 0.0, 0.0), 8) == []


def test_lamps_of_no_power_or_size_and_cameras_inside_a_lamp_give_nothing(addon):
    lamps = [
        addon.light.Lamp("POINT", at((0, 0, 5.0)), -1.0),
        addon.light.Lamp("AREA", at((0, 0, 5.0)), 1.0, size=(0.0, 1.0)),
        addon.light.Lamp("POINT", at((0, 0, 0.1)), 1.0, radius=0.5),
    ]
    assert [addon.light.lamp_samples(lamp, HERE, 8) for lamp in lamps] == [[], [], []]


def test_a_glowing_square_has_the_solid_angle_of_its_triangles(addon):
    half, far = 0.5, 10.0
    a, b, c, d = ((x, y, far) for x, y in ((-half, -half), (half, -half), (half, half), (-half, half)))
    samples = addon.light.mesh_samples([(a, b, c), (a, c, d)], HERE, 64)
    # of a square seen from its axis
    omega = 4 * np.arcsin(half**2 / (half**2 + far**2))
    assert total(samples) == pytest.approx(omega, rel=0.005)
    assert addon.light.mesh_samples([(a, a, a)], HERE, 64) == []


def test_the_radius_of_an_area_is_that_of_a_disc_of_its_size(addon):
    wide = [[2, 0, 0, 0], [0, 3, 0, 0], [0, 0, 1, 5], [0, 0, 0, 1]]
    lamp = addon.light.Lamp("AREA", wide, 1.0, shape="RECTANGLE", size=(0.5, 0.25))
    assert addon.light.lamp_radius(lamp) == pytest.approx(sqrt(1.0 * 0.75 / pi))
    assert addon.light._spread_part(1.0, cos(1.0)) == pytest.approx(0.0, abs=1e-12)
    assert addon.light._spread_part(1.0, 1.0) == pytest.approx(tan(1.0) / (tan(1.0) - 1.0))
