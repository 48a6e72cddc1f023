"""Between two captures a replay stays in the range that both show nearby; at captures it is unchanged."""

from base64 import b64encode
from dataclasses import replace
from zlib import compress

import numpy as np
import pytest
from planted_residual import CAPTURED, FEW, SIZE, between, missed, model_beside, moving, soft, truth_between
from planted_run import views

from flarewright.measure.core.parameter_vector import frame
from flarewright.measure.replay.clamping import clamped
from flarewright.measure.replay.model_image import replay_model
from flarewright.measure.residual.clamp_range import with_reaches
from flarewright.measure.residual.motion_fit import with_moves
from flarewright.model.measurement.clamp_ranges import ANYWHERE, Reaches, packed_reaches
from flarewright.model.measurement.ghost_model import GhostModel
from flarewright.model.measurement.sprite import Sprite, encode_pictures

# column from which on an edge behind the lens blocks all light
EDGE = 190


def cut(seen, edge=EDGE):
    """Return views of ghosts that a fixed edge cuts."""
    column = np.arange(SIZE[0])[None, :, None]
    return [view.showing(np.where(column < edge, view.pixels, 0.0).astype(np.float32)) for view in seen]


@pytest.fixture(scope="module", params=[FEW, pytest.param(CAPTURED, marks=pytest.mark.slow)], ids=["few", ""])
def captured(request):
    """Return the constellations of the captures."""
    return request.param


@pytest.fixture(scope="module")
def at_an_edge(captured):
    """Return a model of ghosts without the edge that cuts them, and the truth between captures."""
    ghosts = (soft(150.0, 12.0, 1.0), soft(60.0, 18.0, 0.6))
    seen = cut(views(ghosts, angles=captured, noise=0.001, size=SIZE))
    model = with_moves(model_beside(ghosts, seen))
    return model, with_reaches(model, seen), cut(views(ghosts, angles=between(captured), noise=0.0, size=SIZE))


def test_light_that_an_edge_cuts_off_is_not_drawn_beyond_it(at_an_edge, captured):
    loose, tight, truth = at_an_edge
    assert missed(tight, truth) < missed(loose, truth)
    # cells of three pixels leave some light there at captures too
    in_between, loosely, at_them = (
        np.mean([np.abs(replay_model(model, float(angle))[0].pixels[:, EDGE + 4 :]).sum() for angle in angles])
        for model, angles in ((tight, between(captured)), (loose, between(captured)), (tight, captured))
    )
    assert in_between < 1.1 * at_them
    assert in_between < 0.8 * loosely
    # the clamping changes the residual layer
    there = {layer.name: layer.pixels for layer in replay_model(tight, 13.5)}
    assert np.abs(there["beauty"] - there["ghosts"] - there["residual"]).max() < 1e-5
    np.testing.assert_array_equal(there["ghosts"], replay_model(loose, 13.5)[1].pixels)


def test_at_captures_nothing_changes(at_an_edge, captured):
    loose, tight, _ = at_an_edge
    inner = captured[len(captured) // 3]
    for angle in (captured[0], inner, captured[-1], captured[-1] + 0.04):
        for one, other in zip(replay_model(loose, float(angle)), replay_model(tight, float(angle)), strict=True):
            np.testing.assert_array_equal(one.pixels, other.pixels)
    # no discontinuity next to captures
    near, there = (replay_model(tight, float(angle))[0].pixels for angle in (inner + 1e-6, inner))
    assert np.abs(near - there).max() < 1e-3 * np.abs(there).max()


@pytest.mark.parametrize(
    "known", ["unknown", *(pytest.param(known, marks=pytest.mark.slow) for known in ("known", "mistaken"))]
)
def test_ghosts_that_move_are_left_to_move(known, captured):
    _, model, seen = moving(known, tuple(captured))
    truth = truth_between(captured)
    assert missed(with_reaches(model, seen), truth) < 1.01 * missed(model, truth)


def test_a_roll_turns_what_is_reported_about_the_edge(at_an_edge):
    _, tight, _ = at_an_edge
    # a sprite without rolls turns everywhere, and does not fade out
    tight = tight.replace(sprites=tuple(one.replace(rolls_deg=()) for one in tight.sprites))
    upright, turned = (replay_model(tight, 13.5, roll_deg=roll)[0].pixels for roll in (0.0, 180.0))
    # about the axis, which is slightly off the centre
    x, y = (2.0 * (at - 0.5 * side) for at, side in zip(tight.axis_px, SIZE, strict=True))
    moved = np.roll(turned[::-1, ::-1], (round(y), round(x)), axis=(0, 1))
    inner = np.s_[30:-30, 30:-30]
    assert np.abs(moved - upright)[inner].mean() < 0.1 * upright[inner].mean()


def bare(pictures, angles):
    """Return a model without ghosts, whose sprite has these images (cells of 3 pixels), and views of them."""
    _, rows, columns, _ = pictures.shape
    unit, cells = encode_pictures(pictures.astype(np.float32), 1e-3)
    size = 3 * columns, 3 * rows
    sprite = Sprite(
        follows="ghosts", grain_px=3.0, corner_px=(-0.5 * size[0], -0.5 * size[1]),
        constellation_deg=tuple(map(float, angles)), rows=rows, columns=columns, unit=unit, cells=cells,
    )  # fmt: skip
    axis = 0.5 * size[0], 0.5 * size[1]
    model = GhostModel(
        size_px=size, axis_px=axis, focal_px=1e3, largest_deg=max(map(abs, angles)),
        constellation_deg=(min(angles), max(angles)), ghosts=(), sprites=(sprite,),
    )  # fmt: skip
    blank = views((), angles=angles, noise=1e-3, size=size)
    fine = pictures.repeat(3, axis=1).repeat(3, axis=2).astype(np.float32)
    seen = [replace(view, pixels=fine[k], frame=frame(axis, 0.0, angles[k], 1.0)) for k, view in enumerate(blank)]
    return model, seen


def test_reach_is_how_far_light_goes_and_none_where_nothing_moves():
    pictures = np.full((7, 24, 80, 3), 0.1)
    for k in range(7):
        pictures[k, 10:14, 8 + 6 * k : 12 + 6 * k] = 1.0
    model, seen = bare(pictures, [float(k) for k in range(1, 8)])
    reaches = with_reaches(model, seen).sprites[0].reaches
    dark, bright = np.moveaxis(reaches.within(3), -1, 0)
    # between photographs 3 and 4, columns 26 to 29 and 32 to 35 in blocks of two cells; of its 4 cells the middle ones
    # have to search 4 cells far
    assert (bright[5:7, 13:18] == 4).all()
    assert not dark.any()
    assert not bright[:, 28:].any()
    assert not bright[:2].any()


def test_light_that_vanishes_may_be_where_it_was_but_not_beyond_an_edge():
    pictures = np.full((7, 24, 80, 3), 0.1)
    for k in range(4):
        pictures[k, 10:14, 8 + 6 * k : 12 + 6 * k] = 1.0
    model, seen = bare(pictures, [float(k) for k in range(1, 8)])
    bright = with_reaches(model, seen).sprites[0].reaches.within(3)[..., 1]
    # its far end, column 29, is 6 cells from the position before, and the next photograph has no light
    assert (bright[5:7, 13:15] == 6).all()
    # no photograph shows light there, nor farther out
    assert not bright[:, 15:].any()
    # a single flash can come from anywhere
    pictures[:] = 0.1
    pictures[3, 10:14, 26:30] = 1.0
    model, seen = bare(pictures, [float(k) for k in range(1, 8)])
    assert (with_reaches(model, seen).sprites[0].reaches.within(3)[5:7, 13:15, 1] == ANYWHERE).all()


def test_nothing_is_held_where_the_light_changes_sides():
    pictures = np.full((6, 24, 40, 3), 0.1)
    pictures[::2] = 0.2
    angles = [-2.5, -1.5, -0.5, 0.5, 1.5, 2.5]
    model, seen = bare(pictures, angles)
    tight = with_reaches(model, seen)
    (sprite,) = tight.sprites
    bright = np.full((5, *sprite.reaches.within(0).shape), 0)
    tight = tight.replace(sprites=(sprite.replace(reaches=packed_reaches(sprite.reaches.block, bright)),))
    np.testing.assert_array_equal(replay_model(tight, 0.2)[0].pixels, replay_model(model, 0.2)[0].pixels)


def test_what_is_held_lies_between_what_both_photographs_show():
    pictures = np.full((3, 4, 4, 3), 0.5)
    model, _ = bare(pictures, [1.0, 2.0, 3.0])
    block = np.zeros((2, 2, 2, 2), int)
    block[:, 0, 0] = ANYWHERE
    block[:, 1, 1, 1] = 2
    sprite = model.sprites[0].replace(reaches=packed_reaches(2, block))
    before, after = np.full((2, 12, 12, 3), 1.0)
    before[0:3] = 0.2
    before[:, 5] = 3.0
    wild = np.full((12, 12, 3), 9.0)
    wild[::2] = -9.0
    out = clamped(wild, before, after, sprite, 0, 0.5, frame((6.0, 6.0), 0.0, 1.0, 1.0))
    # the first block is not limited
    np.testing.assert_array_equal(out[:6, :6], wild[:6, :6])
    assert out[0, 8] == pytest.approx(0.2)
    assert out[1, 8] == pytest.approx(1.0)
    assert out[4, 8] == pytest.approx(1.0)
    # two cells of three pixels, half of it: three pixels on each side
    assert out[7, 8] == pytest.approx(3.0)
    assert out[7, 9] == pytest.approx(1.0)
    assert out[8, 8] == pytest.approx(1.0)


def test_reaches_come_back_from_a_file_and_broken_ones_are_reported(at_an_edge):
    loose, tight, _ = at_an_edge
    assert GhostModel.model_validate_json(tight.model_dump_json()) == tight
    sprite = tight.sprites[0]
    with pytest.raises(ValueError, match="not base64 of zlib"):
        sprite.reaches.replace(numbers="?")
    with pytest.raises(ValueError, match="reaches of a sprite hold 8 bytes instead of"):
        sprite.reaches.replace(numbers=b64encode(compress(bytes(8))).decode())
    with pytest.raises(ValueError, match="reaches of a sprite do not cover"):
        sprite.replace(reaches=packed_reaches(4, np.zeros((1, 3, 3, 2), int)))
    with pytest.raises(ValueError, match='only a sprite that follows "ghosts" has reaches'):
        loose.sprites[0].replace(follows="axis", moves=None, reaches=sprite.reaches)
    assert isinstance(sprite.reaches, Reaches)


def test_two_pictures_tell_no_reaches():
    model, seen = bare(np.full((2, 8, 8, 3), 0.1), [1.0, 2.0])
    assert with_reaches(model, seen).sprites[0].reaches is None


def test_what_is_dark_for_less_than_three_pixels_is_no_darkness():
    model, _ = bare(np.full((3, 4, 4, 3), 0.5), [1.0, 2.0, 3.0])
    block = np.zeros((2, 2, 2, 2), int)
    block[..., 1] = ANYWHERE
    sprite = model.sprites[0].replace(reaches=packed_reaches(2, block))
    before, after = np.full((2, 12, 12, 3), 1.0)
    for one in (before, after):
        one[3, 3] = one[8, 2:8] = 0.0
        one[1:4, 7:10] = 0.1
    black = np.zeros((12, 12, 3))

    def out(part, scale=1.0):
        return clamped(black, before, after, sprite, 0, part, frame((6.0, 6.0), 0.0, 1.0, scale))[..., 1]

    middle = out(0.5)
    # a pixel, and a line of pixels
    assert middle[3, 3] == middle[8, 4] == pytest.approx(0.8)
    # a square of three pixels is kept
    np.testing.assert_allclose(middle[1:4, 7:10], 0.1)
    assert (middle[5:7] == 1.0).all()
    # the filling decreases to 0 at the photographs
    assert 0.0 < out(0.9)[3, 3] < 0.5 * middle[3, 3]
    np.testing.assert_array_equal(out(1.0), before[..., 1])
    # the same in a picture of higher resolution
    assert out(0.5, 1.5)[2, 8] == pytest.approx(0.8)
