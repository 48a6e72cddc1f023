"""Ghosts of one picture, and of a model at one constellation."""

import numpy as np
import pytest

from flarewright.errors import FlarewrightError
from flarewright.measure.detection.single_image import spots_of_model, spots_of_picture
from flarewright.model.measurement.ghost_model import AberrationGhost, BezierGhost, Channel, Curve, Curves, GhostModel

SIZE = (480, 320)
AXIS = (236.0, 165.0)
# position on the line and radius, pixels; radiance
DISCS = ((60.0, 22.0, (1.0, 0.8, 0.5)), (-80.0, 40.0, (0.3, 0.4, 0.6)), (130.0, 9.0, (2.0, 2.0, 2.0)),
         (10.0, 70.0, (0.2, 0.2, 0.2)))  # fmt: skip


def picture(discs=DISCS, toward_deg=30.0, noise=0.01, seed=0):
    """Return uniform discs along a line, anti-aliased, with noise."""
    x, y = np.arange(SIZE[0]) + 0.5 - AXIS[0], np.arange(SIZE[1]) + 0.5 - AXIS[1]
    cosine, sine = np.cos(np.radians(toward_deg)), np.sin(np.radians(toward_deg))
    out = np.random.default_rng(seed).normal(0.0, noise, (SIZE[1], SIZE[0], 3))
    for place, radius, rgb in discs:
        away = np.hypot(x[None, :] - place * cosine, y[:, None] + place * sine)
        out += np.clip(radius + 0.5 - away, 0.0, 1.0)[..., None] * np.array(rgb)
    return out.astype(np.float32)


@pytest.mark.parametrize("toward_deg", [30.0, -135.0])
def test_discs_along_the_line_are_found(toward_deg):
    found = spots_of_picture(picture(toward_deg=toward_deg), AXIS, toward_deg)
    assert len(found) == len(DISCS)
    for place, radius, rgb in DISCS:
        one = min(found, key=lambda spot: abs(spot.place_px - place) + abs(spot.radius_px - radius))
        assert one.place_px == pytest.approx(place, abs=0.7)
        assert one.radius_px == pytest.approx(radius, abs=0.7)
        assert one.rgb == pytest.approx(rgb, rel=0.1, abs=0.02)


def test_neither_noise_nor_discs_off_the_line_are_ghosts():
    assert spots_of_picture(picture(()), AXIS, 30.0) == ()
    assert spots_of_picture(picture(((90.0, 20.0, (1.0, 1.0, 1.0)),)), AXIS, 120.0) == ()


def test_hidden_pixels_are_ignored():
    hidden = np.zeros((SIZE[1], SIZE[0]), bool)
    hidden[:, 300:] = True
    places = [one.place_px for one in spots_of_picture(picture(), AXIS, 30.0, hidden=hidden)]
    assert all(place < 70.0 for place in places)
    assert len(places) >= 2


def test_a_hidden_light_on_the_line_is_no_dark_disc():
    """The steep edge of the mask of a bright light must not raise the level of chance."""
    light, radius = 110.0, 26.0
    ghosts = ((-80.0, 40.0, (0.3, 0.4, 0.6)), (30.0, 20.0, (0.4, 0.4, 0.4)))
    glare = ((light, radius + 2.0, (50.0, 50.0, 50.0)),)
    x, y = np.arange(SIZE[0]) + 0.5 - AXIS[0], np.arange(SIZE[1]) + 0.5 - AXIS[1]
    hidden = np.hypot(x[None, :] - light, y[:, None]) < radius + 8.0
    # haze that the mask cuts
    shown = picture(ghosts + glare, toward_deg=0.0) + np.float32(0.3)
    found = spots_of_picture(shown, AXIS, 0.0, hidden=hidden)
    for place, size, _ in ghosts:
        assert any(abs(one.place_px - place) < 1.0 and abs(one.radius_px - size) < 1.0 for one in found)
    assert all(abs(one.place_px - light) > 5.0 for one in found)


def model(*ghosts):
    return GhostModel(
        size_px=(600, 400), axis_px=(300.0, 200.0), focal_px=800.0, largest_deg=20.0, constellation_deg=(0.0, 20.0),
        ghosts=ghosts,
    )  # fmt: skip


def aberrated(f, g, visible=(0.0, 20.0)):
    zero = (0.0,) * 9
    channel = Channel(f=(f, *zero), g=(g, *zero), intensity=(50.0, *zero))
    return AberrationGhost(name="a", red=channel, green=channel, blue=channel, visible_deg=visible)


def test_the_ghosts_of_a_model_are_discs():
    (one,) = spots_of_model(model(aberrated(150.0, -30.0)), 10.0)
    s = np.tan(np.radians(10.0)) / np.tan(np.radians(20.0))
    assert one.place_px == pytest.approx(150.0 * s)
    assert one.radius_px == pytest.approx(30.0)
    # a disc of pi r^2 pixels holds the pupil's 50 pi
    assert one.rgb == pytest.approx((50.0 / 900.0,) * 3)
    assert spots_of_model(model(aberrated(150.0, -30.0, (12.0, 20.0))), 10.0) == ()
    with pytest.raises(FlarewrightError, match="0 to 20 degrees"):
        spots_of_model(model(aberrated(150.0, -30.0)), 25.0)


def test_aberrations_move_and_widen_the_disc():
    # x = s f + p g with g = g0 + g1 u: the mean of u^2 over that of u is 2/3 on the unit disc
    zero = (0.0,) * 8
    channel = Channel(f=(100.0, *zero, 0.0), g=(20.0, 6.0, *zero), intensity=(1.0, *zero, 0.0))
    ghost = AberrationGhost(name="a", red=channel, green=channel, blue=channel, visible_deg=(0.0, 20.0))
    (one,) = spots_of_model(model(ghost), 20.0)
    assert one.radius_px == pytest.approx(20.0 + 6.0 * 2.0 / 3.0, rel=0.01)
    assert one.place_px == pytest.approx(100.0)


def test_a_denominator_enlarges_the_disc():
    zero = (0.0,) * 9
    channel = Channel(f=(100.0, *zero), g=(20.0, *zero), intensity=(1.0, *zero), below=(0.0, -0.5))
    ghost = AberrationGhost(name="a", red=channel, green=channel, blue=channel, visible_deg=(0.0, 20.0))
    (one,) = spots_of_model(model(ghost), 20.0)
    assert (one.place_px, one.radius_px) == pytest.approx((200.0, 40.0))
    assert one.rgb == pytest.approx((1.0 / 1600.0,) * 3)
    # b enlarges the half of the pupil towards the light: the mean of 1 / (1 + b v) is above 1
    bent = channel.replace(below=(0.4, -0.5))
    ghost = AberrationGhost(name="a", red=bent, green=bent, blue=bent, visible_deg=(0.0, 20.0))
    (one,) = spots_of_model(model(ghost), 20.0)
    p = np.linspace(-1.0, 1.0, 801)
    x, y = (each[np.hypot(*np.meshgrid(p, p)) <= 1.0] for each in np.meshgrid(p, p))
    lands = (100.0 + 20.0 * x) / (0.5 + 0.4 * x)
    assert one.place_px == pytest.approx(lands.mean(), rel=0.01)
    upwards = y * 20.0 * y / (0.5 + 0.4 * x)
    assert one.radius_px == pytest.approx(abs((x * lands + upwards).sum()) / (x**2 + y**2).sum(), rel=0.02)


def test_places_count_towards_the_light_on_both_sides_of_the_axis():
    """At negative constellations the places of aberrated ghosts had the wrong sign, those of Bezier ghosts had not."""
    numbers = [0.0] * 19
    numbers[0], numbers[2], numbers[16] = 40.0, 12.0, 0.5
    curves = Curves(along_px=Curve(values=(3.0,), error=(0.1,)))
    both = (
        aberrated(150.0, -30.0, (-20.0, 20.0)).replace(curves=curves),
        BezierGhost(name="b", numbers=tuple((value,) for value in numbers), visible_deg=(-20.0, 20.0)),
    )
    sides = model(*both).replace(constellation_deg=(-20.0, 20.0))
    here, there = ([one.place_px for one in spots_of_model(sides, angle)] for angle in (10.0, -10.0))
    assert there == pytest.approx(here)
    assert here[0] > 0.0


def test_a_bezier_ghost_is_a_disc():
    numbers = [0.0] * 19
    numbers[0], numbers[2], numbers[3], numbers[4], numbers[16] = 40.0, 12.0, 10.0, 14.0, 0.5
    ghost = BezierGhost(name="b", numbers=tuple((value,) for value in numbers), visible_deg=(0.0, 20.0))
    (one,) = spots_of_model(model(ghost), 5.0)
    assert (one.place_px, one.radius_px, one.rgb[0]) == pytest.approx((42.0, 12.0, 0.5))
