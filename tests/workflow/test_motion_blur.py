"""Motion blur: its times, its energy, and its number of sub-frames against traced ghosts."""

from __future__ import annotations

from math import hypot

import numpy as np
import pytest

from flarewright import Camera, Layer, Light, Project, ghosts
from flarewright.render.scene.resolve import resolve_project
from flarewright.workflow.motion_blur import MOST_SUBFRAMES, mean_layers, motion_px, subframe_count, subframe_times

SIZE = (48, 32)


def dot(column, value=1.0):
    pixels = np.zeros((1, 1, 3), np.float32) + np.float32(value) * np.float32([1, 2, 3])
    return Layer("starburst", pixels, (column, 5, 1, 1))


def test_the_mean_keeps_the_energy_of_each_channel_and_the_variance_of_a_uniform_motion():
    columns = range(10, 26)
    (layer,) = mean_layers(([dot(c)] for c in columns), SIZE, 16)
    assert layer.pixels.shape == (32, 48, 3)
    assert layer.pixels.sum(axis=(0, 1), dtype=float) == pytest.approx([1.0, 2.0, 3.0], rel=1e-6)
    x = np.arange(48)
    for profile in layer.pixels[5].T:
        centre = (profile @ x) / profile.sum()
        assert centre == pytest.approx(17.5, abs=1e-5)
        # of 16 equal steps of one pixel
        assert (profile @ (x - centre) ** 2) / profile.sum() == pytest.approx((16**2 - 1) / 12, rel=1e-5)


def test_a_missing_layer_and_pixels_outside_count_as_dark():
    (layer,) = mean_layers([[dot(3)], [dot(-4)], []], SIZE, 3)
    assert layer.pixels.sum(dtype=float) == pytest.approx(6 / 3)


def test_the_variance_of_a_mean_falls_with_its_number():
    one = Layer("ghosts.variance", np.ones((32, 48, 3), np.float32), (0, 0, 48, 32))
    (layer,) = mean_layers([[one]] * 4, SIZE, 4)
    assert layer.pixels == pytest.approx(np.full((32, 48, 3), 0.25))


def test_the_shutter_is_open_around_the_frame():
    times = subframe_times(2.0, 0.02, 4)
    assert np.mean(times) == pytest.approx(2.0)
    assert np.diff(times) == pytest.approx(np.full(3, 0.005))
    assert times[0] == pytest.approx(1.99 + 0.0025)


def at(x):
    return Project(
        lens="heliar-tronnier", f_number=16, lights=[Light(field_deg=(x, 0))], camera=Camera(size_px=(720, 480))
    )


def test_the_motion_is_that_of_the_fastest_traced_ghost_in_the_picture():
    way = []
    here, there = (
        {(row.first_reflection, row.second_reflection): row for row in table.ghosts}
        for table in (ghosts("heliar-tronnier", (x, 0.0), f_number=16) for x in (1.0, 1.5))
    )
    for name, one in here.items():
        other = there[name]
        # the rims of larger ghosts lie outside the picture, where surfaces cut them, so that their centroid jumps
        if one.rms_radius_mm * 2**0.5 < 0.5 * hypot(36.0, 24.0):
            way.append(abs(other.centroid_mm[0] - one.centroid_mm[0]) * 720 / 36)
    assert motion_px([at(1.0), at(1.25), at(1.5)]) == pytest.approx(max(way), rel=0.1)


def test_the_count_follows_the_motion():
    assert subframe_count([at(3.0)] * 3) == 1
    few, many = (subframe_count([at(3.0), at(3.0 + step)]) for step in (0.1, 0.2))
    assert many == pytest.approx(2 * few, abs=2)
    assert subframe_count([at(-15.0), at(0.0), at(15.0)]) == MOST_SUBFRAMES


@pytest.mark.parametrize(("lens", "f_number", "first"), [("nikkor-180-ed", 8, 3.0), ("heliar-tronnier", 22, 13.0)])
def test_a_ghost_that_leaves_the_picture_counts_and_more_time_is_more_motion(lens, f_number, first):
    """Ghosts that are in the picture at some moments only were left out, and with them half of the sub-frames."""
    camera = Camera(size_px=(360, 240))
    moments = [
        Project(lens=lens, f_number=f_number, lights=[Light(field_deg=(first + step, 0))], camera=camera)
        for step in (0.0, 0.075, 0.15, 0.225, 0.3)
    ]
    half, whole = motion_px(moments[:3]), motion_px(moments)
    assert whole == pytest.approx(2.0 * half, rel=0.02)


def test_a_desqueezed_picture_moves_as_many_pixels_down_as_a_squeezed_one():
    way = []
    for desqueeze in (False, True):
        camera = Camera(size_px=(240, 160), desqueeze=desqueeze)
        made = [
            Project(lens="anamorphic-heliar-2x", f_number=8, lights=[Light(field_deg=(0.01, y))], camera=camera)
            for y in (1.0, 1.2)
        ]  # fmt: skip
        way.append(motion_px(made) * resolve_project(made[0]).project.camera.sensor[1] / 160)
    assert way[1] == pytest.approx(way[0], rel=0.02)
