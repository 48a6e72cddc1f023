"""Directions of a plate's pixels invert the traced direct image, and their solid angles fill the picture."""

from __future__ import annotations

import numpy as np
import pytest

from flarewright import Camera, Light, Project
from flarewright.plates.field_map import field_map
from flarewright.render.scene.pixel_place import direct_images, image_px
from flarewright.render.scene.resolve import resolve_project

SIZE = (640, 360)


def mapped(lens, **changes):
    light = Light(field_deg=(0.0, 0.0))
    settled = resolve_project(Project(lens=lens, lights=[light], camera=Camera(size_px=SIZE, **changes)))
    return settled, field_map(settled)


def missed_px(settled, found, places):
    images = direct_images(settled, Light(field_deg=(0.0, 0.0)))
    slopes = found.slopes(places)
    there = np.array([image_px(images, tuple(np.degrees(np.arctan(slope)))) for slope in slopes])
    return np.abs(there - places).max()


def test_a_light_in_the_direction_of_a_pixel_is_imaged_there():
    settled, found = mapped("heliar-tronnier")
    places = np.random.default_rng(2).uniform(0, 1, (5, 2)) * SIZE
    assert missed_px(settled, found, places) < 0.05


@pytest.mark.slow
@pytest.mark.parametrize("lens", ["anamorphic-heliar-2x", "canon-28-80", "angenieux-50-f1.1", "fisheye-nikkor-10.5"])
def test_the_map_of_other_lenses_is_as_exact(lens):
    settled, found = mapped(lens)
    places = (0.2 + 0.6 * np.random.default_rng(2).uniform(0, 1, (20, 2))) * SIZE
    assert missed_px(settled, found, places) < 0.1


def test_the_solid_angles_of_all_pixels_are_that_of_the_picture():
    _, found = mapped("heliar-tronnier")
    columns, rows = np.meshgrid(np.arange(SIZE[0]) + 0.5, np.arange(SIZE[1]) + 0.5)
    total = found.solid_angles(np.column_stack([columns.ravel(), rows.ravel()])).sum()
    # the four-sided cone through the corners: Oosterom and Strackee's formula, here for a rectangle
    (a, b), *_ = np.abs(found.slopes(np.array([[0.0, 0.0]])))
    assert total == pytest.approx(4.0 * np.arcsin(a * b / np.sqrt((1 + a * a) * (1 + b * b))), rel=2e-3)


def test_places_that_a_fisheye_does_not_image_have_no_direction():
    _, found = mapped("fisheye-nikkor-10.5")
    slopes = found.slopes(np.array([[320.0, 180.0], [2.0, 2.0]]))
    assert slopes[0] == pytest.approx([0.0, 0.0], abs=1e-9)
    assert np.isnan(slopes[1]).all()
