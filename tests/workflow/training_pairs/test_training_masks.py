"""Masks: the disc of a light, where its starburst clips, and which ghost a pixel shows."""

from __future__ import annotations

import numpy as np
import pytest

from flarewright import BlackBody, Layer, Light
from flarewright.workflow.training_pairs.masks import LightImage, ghost_mask, light_image, light_mask

SIZE = (40, 30)


def disc(number, place, radius):
    return LightImage(number, place, radius, np.ones(3))


def test_the_area_and_the_radiance_of_a_disc_hold_its_irradiance():
    light = Light(field_deg=(0.0, 0.0), intensity=3.0, diameter_deg=2.0, spectrum=BlackBody(temperature_k=4000.0))
    found = light_image(light, 1, (0.1, -0.2), (100.0, 100.0), (800, 600), (24.0, 18.0))
    assert found.place_px == pytest.approx((400.0 + 0.1 * 800 / 24, 300.0 + 0.2 * 600 / 18))
    _, cover = found.coverage((800, 600))
    radians = np.radians(2.0)
    # area of a disc of this angle, in pixels of 0.03 mm at 100 mm
    assert cover.sum() == pytest.approx(np.pi / 4 * radians**2 * (100.0 / 0.03) ** 2, rel=2e-3)
    luminance = found.radiance @ [0.2126, 0.7152, 0.0722]
    assert luminance * np.pi / 4 * radians**2 == pytest.approx(3.0, rel=2e-3)
    assert found.radiance[0] > found.radiance[2]


def test_a_squeezed_picture_shows_an_oval():
    light = Light(field_deg=(0.0, 0.0), intensity=3.0, diameter_deg=2.0)
    found = light_image(light, 1, (0.0, 0.0), (25.0, 50.0), (400, 300), (24.0, 18.0))
    _, cover = found.coverage((400, 300))
    down = 50.0 * np.tan(np.radians(1.0)) * 300 / 18.0
    assert cover.sum() == pytest.approx(0.5 * np.pi * down**2, rel=0.01)
    assert (cover.sum(axis=1) > 0.5).sum() == pytest.approx(2.0 * down, abs=1.5)
    assert (cover.sum(axis=0) > 0.5).sum() == pytest.approx(down, abs=1.5)
    mask = light_mask([found], np.zeros((300, 400, 3), np.float32))
    assert np.count_nonzero(mask) == pytest.approx(0.5 * np.pi * down**2, rel=0.03)
    round_one = light_image(light, 1, (0.0, 0.0), (50.0, 50.0), (400, 300), (24.0, 18.0))
    np.testing.assert_allclose(found.radiance, round_one.radiance, rtol=1e-12)


def test_a_point_covers_one_pixel_and_a_light_outside_none():
    point = light_image(Light(field_deg=(0.0, 0.0)), 1, (0.0, 0.0), (50.0, 50.0), SIZE, (24.0, 18.0))
    assert np.pi * point.radius_px**2 == pytest.approx(1.0, rel=1e-3)
    black = np.zeros((30, 40, 3), np.float32)
    assert np.count_nonzero(light_mask([disc(1, (10.5, 7.5), point.radius_px)], black)) == 1
    assert np.argwhere(light_mask([disc(2, (10.2, 7.9), 0.1)], black)).tolist() == [[7, 10]]
    assert not light_mask([disc(1, (-5.0, 7.5), 3.0)], black).any()


def test_the_clipped_disc_belongs_to_the_light_but_its_spikes_do_not():
    star = np.zeros((30, 40, 3), np.float32)
    y, x = np.mgrid[:30, :40] + 0.5
    star[np.hypot(x - 20.0, y - 15.0) < 6.0] = 2.0
    star[14:16] = 2.0
    mask = light_mask([disc(1, (20.0, 15.0), 0.6)], star)
    assert mask[15, 24] == 1
    assert mask[15, 35] == 0
    assert np.count_nonzero(mask) == pytest.approx(np.pi * 36.0, rel=0.2)
    two = light_mask([disc(1, (20.0, 15.0), 0.6), disc(2, (22.0, 15.0), 3.0)], star)
    assert (two[15, 18], two[15, 23]) == (1, 2)


def test_a_pixel_shows_its_brightest_ghost_and_a_box_holds_the_whole_ghost():
    def ghost(name, window, value):
        return Layer(f"ghost.{name}", np.full((window[3], window[2], 3), value, np.float32), window)

    layers = [ghost("7-3", (2, 3, 10, 6), 1.0), ghost("4-1", (8, 4, 4, 3), 5.0), ghost("2-1", (0, 0, 3, 3), 0.001)]
    outside = ghost("9-1", (38, 28, 10, 10), 2.0)
    mask, listed = ghost_mask([*layers, outside], SIZE, 0.5, 0.01)
    # by falling flux
    assert [one["name"] for one in listed] == ["9-1", "7-3", "4-1"]
    by = {one["name"]: one for one in listed}
    assert by["7-3"]["box"] == [2, 3, 10, 6]
    assert by["7-3"]["pixels"] == 60
    assert by["9-1"]["box"] == [38, 28, 2, 2]
    assert by["4-1"]["peak"] == pytest.approx(2.5)
    assert (mask[5, 9], mask[3, 3], mask[29, 39]) == (by["4-1"]["id"], by["7-3"]["id"], by["9-1"]["id"])
    assert mask[1, 1] == 0
