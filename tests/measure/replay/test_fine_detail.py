"""Detail finer than cells is exact at captures, and between them as strong as captures predict each other."""

from base64 import b64encode
from dataclasses import replace
from typing import cast
from zlib import compress

import numpy as np
import pytest
from planted_run import views

from flarewright.measure.core.parameter_vector import frame
from flarewright.measure.replay.fine_detail import detail_at
from flarewright.measure.replay.model_image import replay_model
from flarewright.measure.residual.fine_detail_fit import with_detail
from flarewright.measure.residual.motion_fit import with_moves
from flarewright.measure.residual.sprite_fit import axis_sprite
from flarewright.model.measurement.fine_detail import Detail, packed_detail, reported_detail
from flarewright.model.measurement.ghost_model import GhostModel

SIZE = (270, 120)
AXIS = (135.0, 60.0)
ANGLES = tuple(float(k) for k in range(1, 7))
NOISE = 1e-3
# rows of the picture: fixed grains, grains that move three pixels right per half step, and grains that always change
STILL, GOES, NEW = np.s_[4:36], np.s_[44:76], np.s_[84:116]


def scene(angle, seed=0):
    """Return a picture of grains one pixel in size."""
    rng = np.random.default_rng(seed)
    grains = rng.uniform(0.0, 1.0, (3, 32, 330, 3)).astype(np.float32)
    out = np.full((SIZE[1], SIZE[0], 3), 0.5, np.float32)
    out[STILL] += grains[0, :, : SIZE[0]]
    begin = 50 - round(6.0 * (angle - 1.0))
    out[GOES] += grains[1, :, begin : begin + SIZE[0]]
    out[NEW] += np.random.default_rng(round(2 * angle) + 100).uniform(0.0, 1.0, (32, SIZE[0], 3)).astype(np.float32)
    return out


def seen(angles, noise=NOISE):
    blank = views((), angles=angles, noise=noise, size=SIZE)
    return [
        replace(view, pixels=view.pixels + scene(angle), frame=frame(AXIS, 0.0, angle, 1.0))
        for view, angle in zip(blank, angles, strict=True)
    ]


def left(model, captured):
    return [view.pixels - replay_model(model, view.constellation_deg)[0].pixels for view in captured]


@pytest.fixture(scope="module")
def grains():
    """Return a model of grains without detail and with it, and the views."""
    captured = seen(ANGLES)
    sprite = axis_sprite(captured, [view.pixels for view in captured])
    empty = GhostModel(
        size_px=SIZE, axis_px=AXIS, focal_px=1e3, largest_deg=ANGLES[-1],
        constellation_deg=(ANGLES[0], ANGLES[-1]), ghosts=(), sprites=(sprite,),
    )  # fmt: skip
    coarse = cast(GhostModel, with_moves(empty))
    return coarse, with_detail(coarse, captured, left(coarse, captured)), captured


def missed(model, angle, *places):
    """Return the mean squared error of a replay in each of some rows."""
    error = (replay_model(model, angle)[0].pixels - scene(angle))[:, 60:-60]
    return np.array([(error[rows] ** 2).mean() for rows in places])


def test_captures_are_replayed_grain_by_grain(grains):
    coarse, fine, captured = grains
    for view in captured[::2]:
        ours, theirs = (missed(model, view.constellation_deg, STILL, GOES, NEW) for model in (fine, coarse))
        assert (ours < 0.01 * theirs).all()


def test_between_captures_detail_stays_or_goes_as_what_is_around_it(grains):
    coarse, fine, _ = grains
    # blocks beside moving ones average both
    still = np.s_[4:24]
    for angle in (2.5, 4.5, 5.5):
        ours, theirs = (missed(model, angle, still, GOES) for model in (fine, coarse))
        # moves are stored to parts of a pixel
        assert (ours < np.array([0.01, 0.2]) * theirs).all()


def test_unpredictable_detail_is_not_drawn_between_captures(grains):
    coarse, fine, _ = grains
    for angle in (2.5, 4.5):
        assert missed(fine, angle, NEW) < 1.05 * missed(coarse, angle, NEW)
        detail = detail_at(fine.sprites[0], fine.sprites[0].detail, angle)
        # the cells start at the picture's corner
        assert detail.shape == (SIZE[1], SIZE[0], 3)
        assert (detail[NEW] ** 2).mean() < 0.1 * (detail[STILL] ** 2).mean()


def test_nothing_leaps_next_to_captures(grains):
    _, fine, _ = grains
    near, there = (replay_model(fine, angle)[0].pixels for angle in (4.0 + 1e-6, 4.0))
    assert np.abs(near - there).max() < 1e-3


def test_noise_is_no_detail():
    captured = [view.showing(view.pixels - scene(view.constellation_deg)) for view in seen(ANGLES[:4], noise=0.01)]
    sprite = axis_sprite(captured, [view.pixels for view in captured])
    empty = GhostModel(
        size_px=SIZE, axis_px=AXIS, focal_px=1e3, largest_deg=ANGLES[-1],
        constellation_deg=(ANGLES[0], ANGLES[-1]), ghosts=(), sprites=(sprite,),
    )  # fmt: skip
    fine = with_detail(with_moves(empty), captured, [view.pixels for view in captured])
    (sprite,) = fine.sprites
    assert (sprite.detail.picture(2, sprite.rows, sprite.columns) != 0.0).mean() < 0.02
    assert np.abs(detail_at(sprite, sprite.detail, 2.5)).max() < 0.01


def test_what_is_not_known_has_no_detail(grains):
    coarse, _, captured = grains
    pixels = left(coarse, captured)
    for each in pixels:
        each[:, :80] = np.nan
    (sprite,) = with_detail(coarse, captured, pixels).sprites
    for k in range(len(ANGLES)):
        picture = sprite.detail.picture(k, sprite.rows, sprite.columns)
        assert not picture[:, :80].any()
        assert picture[:, 90:].any()


def test_a_roll_turns_detail_and_a_larger_picture_enlarges_it(grains):
    _, fine, _ = grains
    # a sprite without rolls turns everywhere, and does not fade out
    turning = fine.replace(sprites=tuple(one.replace(rolls_deg=()) for one in fine.sprites))
    upright, turned = (replay_model(turning, 3.0, roll_deg=roll)[0].pixels for roll in (0.0, 180.0))
    np.testing.assert_allclose(turned[::-1, ::-1], upright, atol=1e-4)
    large = replay_model(fine, 3.0, size_px=(3 * SIZE[0], 3 * SIZE[1]))[0].pixels
    # every third pixel is at the centre of a cell
    np.testing.assert_allclose(large[1::3, 1::3], upright, atol=1e-4)


def test_a_picture_with_pixels_too_large_for_detail_has_none(grains):
    coarse, fine, _ = grains
    for size, seen in (((135, 60), False), ((216, 96), True)):
        differ = replay_model(fine, 3.0, size_px=size)[0].pixels - replay_model(coarse, 3.0, size_px=size)[0].pixels
        assert differ.any() == seen


def test_detail_comes_back_from_a_file_to_its_step(grains):
    _, fine, _ = grains
    assert GhostModel.model_validate_json(fine.model_dump_json()) == fine
    rng = np.random.default_rng(3)
    picture = (rng.normal(0.0, 1.0, (6, 9, 3)) * 10.0 ** rng.uniform(-3.0, 3.0, (6, 9, 3))).astype(np.float32)
    text, reported = reported_detail(picture, 0.01)
    ways, shares = rng.integers(0, 3, (1, 1, 1)), rng.uniform(0.0, 1.0, (1, 1, 1))
    back = packed_detail(4, 3, 0.01, (text, text), ways, shares)
    np.testing.assert_array_equal(back.picture(1, 2, 3), reported)
    assert (np.abs(reported - picture) <= 0.55 * 0.01 + 0.08 * np.abs(picture)).all()
    assert back.ways(0) == ways[0]
    assert np.abs(back.shares(0) - shares[0]).max() <= 0.5 / 255.0


def test_two_pictures_have_no_detail(grains):
    coarse, _, captured = grains
    (sprite,) = coarse.sprites
    still = cast(GhostModel, coarse.replace(sprites=(sprite.replace(moves=None),)))
    assert with_detail(still, captured, left(still, captured)) == still


def test_broken_detail_is_reported(grains):
    _, fine, _ = grains
    (sprite,) = fine.sprites
    with pytest.raises(ValueError, match="one picture more than intervals"):
        sprite.detail.replace(cells=sprite.detail.cells[1:])
    with pytest.raises(ValueError, match="must be below 3"):
        Detail(
            block=4, intervals=1, rows=1, columns=1, numbers=b64encode(compress(b"\x03\x00")).decode(), parts=3,
            unit=1.0, cells=("", ""),
        )  # fmt: skip
    with pytest.raises(ValueError, match="the detail of a sprite are not base64 of zlib"):
        sprite.replace(detail=sprite.detail.replace(cells=("?", *sprite.detail.cells[1:])))
    with pytest.raises(ValueError, match="the detail of a sprite hold more than"):
        sprite.replace(detail=sprite.detail.replace(parts=2))
    with pytest.raises(ValueError, match="must come with moves of the same blocks"):
        sprite.replace(moves=None)
