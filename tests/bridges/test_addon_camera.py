"""The picture of a camera in the add-on, without Blender: pixels, axis, and the window that is drawn."""

from __future__ import annotations

import json

import numpy as np
import pytest

from flarewright.io.tracks.scene_json import read_scene

EYE = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]


def view(addon, **values):
    fields = {
        "focal_mm": 50.0, "sensor_mm": (36.0, 24.0), "fit": "AUTO", "shift": (0.0, 0.0), "size_px": (1920, 1080),
        "pixel_aspect": (1.0, 1.0), "region": (0, 0, 1920, 1080),
    }  # fmt: skip
    return addon.camera.CameraView(**{**fields, **values})


@pytest.mark.parametrize(
    ("values", "pixel"),
    [
        ({}, (36 / 1920, 36 / 1920)),
        ({"size_px": (1080, 1920)}, (36 / 1920, 36 / 1920)),
        ({"size_px": (1080, 1920), "fit": "HORIZONTAL"}, (36 / 1080, 36 / 1080)),
        ({"fit": "VERTICAL"}, (24 / 1080, 24 / 1080)),
        ({"pixel_aspect": (2.0, 1.0)}, (36 / 1920, 18 / 1920)),
        # high pixels make the picture higher than wide
        ({"pixel_aspect": (1.0, 2.0)}, (36 / 2160, 72 / 2160)),
    ],
)
def test_the_sensor_fits_the_longer_side_or_the_chosen_one(addon, values, pixel):
    assert addon.camera.pixel_mm(view(addon, **values)) == pytest.approx(pixel)


def test_a_shift_moves_the_axis_the_other_way(addon):
    axis = addon.camera.axis_px(view(addon, shift=(0.1, -0.2)))
    assert axis == pytest.approx((960 - 192, 540 + 384))


@pytest.mark.parametrize("shift", [(0.0, 0.0), (0.1, -0.2), (-0.0301, 0.0777), (0.4, 0.4)])
@pytest.mark.parametrize("region", [(0, 0, 1920, 1080), (100, 7, 1203, 900)])
def test_the_window_is_the_smallest_around_the_axis_that_holds_the_region(addon, shift, region):
    seen = view(addon, shift=shift, region=region)
    window, axis = addon.camera.drawn_window(seen), addon.camera.axis_px(seen)
    low, size = np.array([window.left, window.bottom]), np.array(window.size_px)
    assert (low <= region[:2]).all()
    assert (low + size >= region[2:]).all()
    assert np.abs(low + 0.5 * size - axis).max() <= 0.5 + 1e-9
    # no smaller one: it ends where the region does on one side at least
    assert all(a == b or c == d for a, b, c, d in zip(low, region[:2], low + size, region[2:], strict=True))
    assert np.allclose(window.offset_px, low + 0.5 * size - 0.5 * (np.array(region[:2]) + region[2:]))
    assert all(float(part).is_integer() for part in window.offset_px)


def test_the_program_reads_the_place_that_a_pinhole_gives(addon):
    seen = view(addon, shift=(0.1, 0.05), pixel_aspect=(2.0, 1.0), focal_mm=35.0)
    window = addon.camera.drawn_window(seen)
    path = addon.document.LightPath("Lamp", "point")
    path.add(1, [[1, 0, 0, 0.8], [0, 1, 0, 0.3], [0, 0, 1, -4.0], [0, 0, 0, 1]], (1.0, 1.0, 1.0), 1.0, 0.0)
    state = addon.camera.camera_state(1, EYE, seen, window)
    data = addon.document.scene_data(24.0, "Camera", [state], [path])
    place = read_scene(json.dumps(data), "s.json").tracks[0].from_top_left(window.size_px)[0]
    wide, high = addon.camera.pixel_mm(seen)
    axis = addon.camera.axis_px(seen)
    expected = (axis[0] + 0.2 * 35.0 / wide - window.left, axis[1] + 0.075 * 35.0 / high - window.bottom)
    assert (place[0], window.size_px[1] - place[1]) == pytest.approx(expected, abs=1e-6)
