"""Sprites: drawn at the right place, predict left-out constellations, and contain no ghosts."""

import json
from base64 import b64encode
from dataclasses import replace
from zlib import compress

import numpy as np
import pytest
from planted_run import LARGEST, SIZE, views
from test_model_image import planted

from flarewright.errors import FlarewrightError
from flarewright.io.measurement.ghost_model_file import read_ghost_model, write_ghost_model
from flarewright.measure.core.parameter_vector import frame
from flarewright.measure.core.views import View
from flarewright.measure.glow.laws import offsets
from flarewright.measure.glow.subtraction import AROUND_LIGHT
from flarewright.measure.replay.light_law import light_law
from flarewright.measure.replay.model_image import light_px, replay_model
from flarewright.measure.replay.sprites import draw_sprites, sprite_at
from flarewright.measure.residual.learn import around_light, with_residual
from flarewright.measure.residual.sprite_fit import axis_sprite, drawn, light_sprites, seen_near
from flarewright.model.measurement.ghost_model import GhostModel
from flarewright.model.measurement.sprite import Sprite, encode_pictures

ANGLES = np.linspace(1.0, LARGEST, 10)


def sprite(pictures, **changes):
    unit, cells = encode_pictures(np.asarray(pictures, np.float32), 1e-4)
    count, rows, columns, _ = np.shape(pictures)
    said = {"follows": "axis", "grain_px": 4.0, "corner_px": (-60.0, -40.0), "constellation_deg": tuple(range(count))}
    return Sprite(**{**said, "rows": rows, "columns": columns, "unit": unit, "cells": cells, **changes})


def slope(rows=20, columns=30):
    """Return an image whose light is a linear function of the cell position."""
    y, x = np.mgrid[:rows, :columns] + 0.5
    return straight(x, y)


def straight(x, y):
    return np.stack([0.2 * (x - 15.0), 0.1 * (x - 15.0) + 0.3 * (y - 10.0), 0.2 * (10.0 - y)], axis=-1)


def test_records_that_were_read_are_equal_as_those_that_were_not():
    one, same, other = sprite([slope()]), sprite([slope()]), sprite([slope() + 1.0])
    # decoded images are cached, and the comparison of two arrays is not a bool
    assert one.pictures.shape == same.pictures.shape == other.pictures.shape
    assert one == same == sprite([slope()])
    assert hash(one) == hash(same)
    assert one != other
    assert one != "a sprite"


def test_cells_come_back_to_their_step():
    values = np.random.default_rng(0).normal(size=(3, 5, 4, 3)) * np.geomspace(0.01, 100.0, 3)[:, None, None, None]
    back = sprite(values, constellation_deg=(0.0, 1.0, 2.0)).pictures
    off = np.abs(back - values)
    assert (off <= np.maximum(np.maximum(0.5e-4, 0.5 * np.abs(values).max() / 32768.0), np.abs(values) / 31.0)).all()


@pytest.mark.parametrize(("turn", "scale"), [(0.0, 1.0), (37.0, 1.0), (180.0, 2.5)])
def test_a_sprite_lies_where_its_corner_and_the_lights_direction_say(turn, scale):
    axis, size = (51.3 * scale, 47.8 * scale), (round(104 * scale), round(98 * scale))
    toward = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    one = sprite([slope()])
    got = draw_sprites([one], [sprite_at(one, 3.0)], (0.0, 0.0), axis, toward, size, scale)
    x, y = offsets(axis, size, scale)
    # along the light's direction, and down when it is at the right; y counts upwards
    along, down = toward[0] * x + toward[1] * y, toward[1] * x - toward[0] * y
    u, v = (along + 60.0) / 4.0, (down + 40.0) / 4.0
    expected = straight(u, v)
    # splines deviate near the border
    inner = (u > 5.0) & (u < 25.0) & (v > 5.0) & (v < 15.0)
    assert inner.sum() > 1000
    # cells are quantized to 1 part in 32, with mean error 0
    assert np.abs(got - expected)[inner].max() < 0.15
    assert np.abs((got - expected)[inner].mean(axis=0)).max() < 0.005
    if turn % 180.0 == 0.0:
        assert np.abs(got[(u < -0.5) | (u > 30.5) | (v < -0.5) | (v > 20.5)]).max(initial=0.0) == 0.0


def test_one_that_goes_with_the_light_stays_upright_and_changes_over_the_constellation():
    one = sprite([slope(), 3.0 * slope()], follows="light", constellation_deg=(4.0, 8.0))
    here, there = (
        draw_sprites([one], [sprite_at(one, 5.0)], place, (0.0, 0.0), (0.0, 1.0), (120, 80))
        for place in ((60, 40), (63, 38))
    )
    assert np.allclose(here[2:, :-3], there[:-2, 3:], atol=1e-5)
    assert np.allclose(sprite_at(one, 5.0), 1.5 * slope(), rtol=0.05)
    assert np.array_equal(sprite_at(one, 99.0), one.pictures[1])


@pytest.mark.parametrize(("turn", "scale"), [(0.0, 1.0), (63.0, 1.0), (-150.0, 2.0)])
def test_a_strip_from_the_light_lies_in_its_direction_and_nowhere_else(turn, scale):
    one = sprite([slope()], follows="light", turn_deg=turn, stretch=3.0, grain_px=1.5, corner_px=(12.0, -15.0))
    place, size = (90.3 * scale, 101.8 * scale), (round(200 * scale), round(210 * scale))
    got = draw_sprites([one], [sprite_at(one, 3.0)], place, (0.0, 0.0), (0.0, 1.0), size, scale)
    x, y = offsets(place, size, scale)
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    u, v = (c * x + s * y - 12.0) / 4.5, (s * x - c * y + 15.0) / 1.5
    inner = (u > 3.0) & (u < 27.0) & (v > 3.0) & (v < 17.0)
    assert inner.sum() > 500
    assert np.abs(got - straight(u, v))[inner].max() < 0.15
    assert not got[(u < -0.01) | (u > 30.01) | (v < -0.01) | (v > 20.01)].any()


def lights(fade, angles=ANGLES):
    """Return views of a star whose shape changes with the pupil's vignetting, and the light positions."""
    out = []
    for view in views((), noise=0.002, angles=angles, seed=int(angles[0] * 100)):
        place = (30.0 + 7.3 * view.constellation_deg, 79.2)
        x, y = offsets(place, SIZE, 1.0)
        wide = 1.0 + fade * view.constellation_deg
        light = 3.0 / (1.0 + (x**2 + (wide * y) ** 2) / 40.0)
        pixels = view.pixels + light[..., None]
        out.append(
            View(view.constellation_deg, view.sigma, view.frame, place, pixels.astype(np.float32), view.variance)
        )
    return out


def test_sprites_that_follow_the_light_are_predicted_between_constellations():
    seen, between = lights(0.05), lights(0.05, 0.5 * (ANGLES[:-1] + ANGLES[1:]))
    found = light_sprites(seen, [view.pixels for view in seen], starry=True)
    mine = interpolated = 0.0
    for k, view in enumerate(between):
        far = np.hypot(*offsets(view.light_px, SIZE, 1.0)) > 8.0
        mine += float(((drawn(found, view) - view.pixels)[far] ** 2).sum())
        halfway = 0.5 * (seen[k].pixels + seen[k + 1].pixels)
        interpolated += float(((halfway - view.pixels)[far] ** 2).sum())
    assert mine < 0.12 * interpolated


def test_the_residual_stays_about_the_axis_at_both_sides_and_where_nothing_was_measured():
    angles = np.concatenate([-ANGLES[:4][::-1], ANGLES[:4]])
    seen = []
    for view in views((), angles=angles, roll_deg=20.0, noise=0.001):
        placed = frame((122.3, 78.4), 20.0, view.constellation_deg, 1.0)
        x, y = offsets((122.3, 78.4), SIZE, 1.0)
        along = placed[2] * x + placed[3] * y
        soft = np.exp(-0.5 * ((along - 30.0) ** 2 + (x**2 + y**2 - along**2)) / 18.0**2)
        pixels = view.pixels + 0.4 * soft[..., None].astype(np.float32)
        pixels[60:70, 100:120] = np.nan if view.constellation_deg == angles[3] else 0.0
        seen.append(View(view.constellation_deg, view.sigma, placed, view.light_px, pixels, view.variance))
    one = axis_sprite(seen, [view.pixels for view in seen])
    assert one.constellation_deg == pytest.approx(angles)
    for view in seen:
        known = np.isfinite(view.pixels)
        known[52:78, 92:128] = False
        assert np.abs(drawn((one,), view) - view.pixels)[known].max() < 0.02
        assert np.isfinite(drawn((one,), view)).all()


def test_the_lights_place_follows_the_lens_distortion():
    model = GhostModel(
        size_px=SIZE, axis_px=(120.0, 80.0), focal_px=600.0, distortion=-0.08, largest_deg=LARGEST,
        constellation_deg=(1.0, LARGEST),
    )  # fmt: skip
    seen = []
    for view in views((), angles=ANGLES, roll_deg=10.0):
        placed = frame(model.axis_px, 10.0, view.constellation_deg, 1.0)
        at = light_px(model, view.constellation_deg, 10.0)
        seen.append(View(view.constellation_deg, view.sigma, placed, at, view.pixels, view.variance))
    # a predicted position where the light is out of the picture, and one where another light was detected
    stray = [
        replace(view, light_px=(1.02 * view.light_px[0], view.light_px[1])) if view.light_px[0] > SIZE[0] else view
        for view in seen
    ]
    assert sum(a is not b for a, b in zip(stray, seen, strict=True)) > 4
    stray[4] = replace(stray[4], light_px=(120.5, 80.2))
    focal, bent = light_law(stray, 590.0)
    assert focal == pytest.approx(600.0, rel=1e-3)
    assert bent == pytest.approx(-0.08, abs=0.02)
    assert light_law(seen[:3], 290.0) == (290.0, 0.0)


def test_a_replay_with_its_rest_is_the_capture():
    model = planted().replace(star=None)
    seen = []
    for k, angle in enumerate((2.0, 11.0, 20.0)):
        placed = frame(model.axis_px, 0.0, angle, 1.0)
        rest = 0.2 * np.outer(np.hanning(90), np.hanning(160))[..., None] * (1.0 + k)
        pixels = (replay_model(model, angle)[0].pixels + rest).astype(np.float32)
        seen.append(View(angle, 0.5, placed, light_px(model, angle), pixels, np.full(pixels.shape, 1e-6, np.float32)))
    whole = with_residual(model, seen)
    for view in seen:
        layers = {layer.name: layer.pixels for layer in replay_model(whole, view.constellation_deg)}
        assert np.abs(layers["beauty"] - view.pixels).max() < 0.05
        assert np.allclose(layers["beauty"], layers["ghosts"] + layers["halo"] + layers["residual"], atol=1e-6)
        # half the size shows the same light
        small = replay_model(whole, view.constellation_deg, size_px=(80, 45))[-1].pixels
        assert np.abs(small - layers["residual"].reshape(45, 2, 80, 2, 3).mean(axis=(1, 3))).max() < 0.02
    # sprites are replaced, not added
    assert len(with_residual(whole, seen[:2]).sprites) == len(whole.sprites)


def test_a_broken_sprite_is_reported_in_a_sentence(tmp_path):
    path = tmp_path / "model.json"
    write_ghost_model(path, planted().replace(sprites=(sprite([slope()]),)))
    assert np.array_equal(read_ghost_model(path).sprites[0].pictures, sprite([slope()]).pictures)
    said = json.loads(path.read_text())
    for cells, words in (
        ("AAAA", "not base64 of zlib"),
        (sprite([slope(3, 3)]).cells, "hold 54 bytes instead of 3600"),
        (b64encode(compress(bytes(10_000_000))).decode(), "hold more than 3600 bytes"),
    ):
        said["sprites"][0]["cells"] = cells
        path.write_text(json.dumps(said))
        with pytest.raises(FlarewrightError, match=words):
            read_ghost_model(path)


def test_what_no_view_shows_about_a_constellation_is_not_reported_from_afar():
    reported, knots = np.arange(10.0), np.array([0.0, 3.0, 6.0, 9.0])
    weights = np.ones((10, 3), np.float32)
    weights[5:, 1] = 0.0
    weights[:, 2] = 0.0
    near = seen_near(weights, reported, knots)
    assert near[:, 0].all()
    assert near[:, 1].tolist() == [True, True, False, False]
    assert not near[:, 2].any()


def test_what_hides_the_light_is_filled_by_what_is_as_far_from_it():
    one = views((), angles=np.array([5.0]), noise=0.0)[0]
    size = one.size_px
    x, y = offsets(one.light_px, size, 1.0)
    far = np.hypot(x, y)
    glow = np.repeat((50.0 / (1.0 + far) ** 2)[..., None], 3, axis=2).astype(np.float32)
    clipped, hidden_by_blob = far < 2.0, (far > 4.0) & (far < 8.0) & (y > 0.0)
    beyond = far > AROUND_LIGHT * size[0]
    seen = np.where((clipped | hidden_by_blob | (beyond & (x > 60.0)))[..., None], np.float32(np.nan), glow)
    variance = np.where(clipped[..., None], np.inf, one.variance).astype(np.float32)
    filled = around_light(replace(one, variance=variance), seen)
    assert np.isnan(filled[clipped]).all()
    assert np.allclose(filled[hidden_by_blob], glow[hidden_by_blob], rtol=0.35)
    assert np.isnan(filled[beyond & (x > 60.0)]).all()
    known = np.isfinite(seen)
    assert np.array_equal(filled[known], seen[known])


def test_near_the_axis_the_residual_keeps_its_photographed_orientation():
    pictures = np.random.default_rng(5).uniform(0.0, 1.0, (3, 20, 20, 3)).astype(np.float32)
    unit, cells = encode_pictures(pictures, 1e-4)
    sprite = Sprite(
        follows="ghosts", grain_px=3.0, corner_px=(-30.0, -30.0), rolls_deg=(350.0, 10.0, 10.0),
        constellation_deg=(0.1, 0.5, 5.0), rows=20, columns=20, unit=unit, cells=cells,
    )  # fmt: skip
    model = GhostModel(
        size_px=(60, 60), axis_px=(30.0, 30.0), focal_px=60.0, largest_deg=5.0, constellation_deg=(0.0, 5.0), ghosts=(),
        sprites=(sprite,),
    )  # fmt: skip
    turning = model.replace(sprites=(sprite.replace(rolls_deg=()),))
    inner = np.s_[15:-15, 15:-15]

    def both(angle, roll):
        return (replay_model(one, angle, roll_deg=roll)[0].pixels[inner] for one in (model, turning))

    # at the axis as photographed, whatever the roll; between two rolls 20 degrees apart, not 340
    there, photographed = next(both(0.1, 77.0)), replay_model(turning, 0.1, roll_deg=350.0)[0].pixels[inner]
    assert np.abs(there - photographed).mean() < 0.01 * photographed.mean()
    between = replay_model(turning, 0.3, roll_deg=0.0)[0].pixels[inner]
    assert np.abs(next(both(0.3, 77.0)) - between).mean() < 0.05 * between.mean()
    # at and near the photographed rolls nothing changes, farther off the axis
    for angle, roll in ((0.5, 10.0), (5.0, 14.0), (5.0, 346.0)):
        mine, plain = both(angle, roll)
        np.testing.assert_allclose(mine, plain, atol=1e-6)
    # far from the photographed rolls half of it remains
    parts = [next(both(5.0, roll)).mean() / next(both(5.0, 10.0)).mean() for roll in (15.0, 27.5, 40.0, 77.0, 200.0)]
    assert parts == pytest.approx([1.0, 0.75, 0.5, 0.5, 0.5], abs=0.06)
    # where both sides were photographed, half a turn away is the other side
    sides = model.replace(
        constellation_deg=(-5.0, 5.0), largest_deg=5.0,
        sprites=(sprite.replace(constellation_deg=(-5.0, 0.0, 5.0), rolls_deg=(0.0, 0.0, 0.0)),),
    )  # fmt: skip
    left, right = (replay_model(sides, angle, roll_deg=roll)[0].pixels for angle, roll in ((-5.0, 0.0), (5.0, 180.0)))
    assert left.max() > 0.1
    np.testing.assert_allclose(left, right, atol=1e-6)
    # no discontinuity, neither where the light crosses the axis nor where turning begins
    for one, other, roll in ((1e-7, 1e-7, 180.0), (2.2905, 2.2915, 0.0)):
        near, beyond = (replay_model(model, angle, roll_deg=to)[0].pixels for angle, to in ((one, 0.0), (other, roll)))
        assert np.abs(near - beyond).max() < 1e-3
    with pytest.raises(ValueError, match="one for each picture"):
        sprite.replace(rolls_deg=(1.0, 2.0))
