"""The residual of unknown ghosts moves as measured where that predicts captures; at captures nothing changes."""

from base64 import b64encode
from dataclasses import replace
from typing import cast
from zlib import compress

import numpy as np
import pytest
from planted_residual import CAPTURED, FEW, TRUE, missed, model_of, moving, truth_between

from flarewright.measure.replay.ghost_arrays import pack
from flarewright.measure.replay.model_image import replay_model
from flarewright.measure.replay.motion_warp import (
    block_to_cells,
    interpolated,
    middles,
    moved_vectors,
    warped_sprite,
)
from flarewright.measure.replay.sprites import sprite_at
from flarewright.measure.residual.motion_fit import with_moves
from flarewright.model.measurement.ghost_model import GhostModel
from flarewright.model.measurement.residual_motion import Moves, packed_moves
from flarewright.model.measurement.sprite import Sprite, encode_pictures


@pytest.fixture(scope="module", params=[FEW, pytest.param(CAPTURED, marks=pytest.mark.slow)], ids=["few", ""])
def captured(request):
    """Return the constellations of the captures."""
    return request.param


@pytest.fixture(scope="module")
def unknown(captured):
    """Return a model that knows no ghost, before and after it has moves."""
    return moving("unknown", tuple(captured))[:2]


def test_unknown_ghosts_are_predicted_between_captures(unknown, captured):
    before, after = unknown
    truth = truth_between(captured)
    assert missed(after, truth) < 0.3 * missed(before, truth)


def test_the_residual_of_a_mistaken_ghost_is_predicted_between_captures(captured):
    model, with_its_moves, _ = moving("mistaken", tuple(captured))
    truth = truth_between(captured)
    assert missed(with_its_moves, truth) < 0.1 * missed(model, truth)
    assert missed(with_its_moves, truth) < 0.01 * missed(cast(GhostModel, model.replace(sprites=())), truth)
    # the residual alone moves differently from its sum with the ghosts' light
    alone, together = with_its_moves.sprites[0].moves.steps(2)
    assert np.abs(alone - together)[..., :2].max() > 2.0
    strange, _ = model_of((replace(TRUE[0], numbers=-TRUE[0].numbers),), captured)
    assert missed(with_moves(strange), truth) < 0.5 * missed(strange, truth)


def test_at_captures_and_next_to_them_nothing_changes(unknown, captured):
    _, model = unknown
    sprite = model.sprites[0]
    for k in (0, len(captured) // 3, len(captured) - 1):
        own = sprite.pictures[k]
        for beside in (captured[k] - 1e-7, captured[k], captured[k] + 1e-7):
            there = warped_sprite(sprite, pack(model), model, float(beside))
            assert np.abs(there - own).max() < 1e-4 * np.abs(own).max()


def bare(pictures):
    """Return a model without ghosts and with five images of 24 by 80 cells, one degree apart."""
    unit, cells = encode_pictures(pictures, 1e-3)
    sprite = Sprite(
        follows="ghosts", grain_px=3.0, corner_px=(-120.0, -36.0), constellation_deg=(1.0, 2.0, 3.0, 4.0, 5.0), rows=24,
        columns=80, unit=unit, cells=cells,
    )  # fmt: skip
    return GhostModel(
        size_px=(240, 72), axis_px=(120.0, 36.0), focal_px=1e3, largest_deg=5.0, constellation_deg=(1.0, 5.0),
        ghosts=(), sprites=(sprite,),
    )  # fmt: skip


def test_a_blob_of_light_is_carried_over_a_gap_wider_than_itself():
    pictures = np.zeros((5, 24, 80, 3), np.float32)
    for k in range(5):
        pictures[k, 10:14, 8 + 12 * k : 13 + 12 * k] = 1.0
    model = cast(GhostModel, with_moves(bare(pictures)))
    for angle in (2.25, 2.5, 3.75):
        there = warped_sprite(model.sprites[0], pack(model), model, angle)[..., 1]
        light = np.maximum(there, 0.0)
        middle = (light.sum(axis=0) @ np.arange(80)) / light.sum()
        assert middle == pytest.approx(10.0 + 12.0 * (angle - 1.0), abs=0.5)
        # one blob of its width, not two of half the light
        assert light[11].max() == pytest.approx(1.0, abs=0.1)
        assert (light[11] > 0.5).sum() in range(4, 8)
    # light is tracked, distant darkness is not
    reported = model.sprites[0].moves.steps(1)[0]
    assert tuple(reported[2, 6, :2]) == (0.0, 12.0)
    assert reported[2, 6, 2] > 0.0
    assert (reported[:, 11:] == 0.0).all()


def test_what_is_soft_and_wide_is_followed_farther_than_a_block_is_looked_for():
    columns, pictures = np.arange(80), np.zeros((5, 24, 80, 3), np.float32)
    # 25 cells from one image to the next, outside the picture at both ends
    places = 25.0 * np.arange(5) - 10.0
    for k, place in enumerate(places):
        pictures[k] = np.exp(-0.5 * ((columns - place) / 5.0) ** 2)[:, None]
    reported = with_moves(bare(pictures)).sprites[0].moves
    for k in (1, 2):
        halfway_there = int(0.5 * (places[k] + places[k + 1])) // 4
        moves = reported.steps(k)[0, 1:-1, halfway_there - 1 : halfway_there + 2, 1]
        assert np.abs(moves - 25.0).max() < 0.5


def test_one_block_that_looks_like_another_does_not_leave_its_neighbours():
    """A grating matches itself one period on; marks that do not repeat determine the right period."""
    columns, pictures = np.arange(80), np.zeros((5, 24, 80, 3), np.float32)
    for k in range(5):
        x = columns - 5.0 * k
        marks = np.exp(-0.5 * ((x - 12.0) / 2.0) ** 2) + np.exp(-0.5 * ((x - 50.0) / 2.0) ** 2)
        pictures[k] = (marks + 0.3 * np.sin(2.0 * np.pi * x / 6.0) * ((x > 10.0) & (x < 52.0)))[:, None]
    model = cast(GhostModel, with_moves(bare(pictures)))
    reported = model.sprites[0].moves.steps(1)[0]
    # between the marks the grating alone would move one cell back, which is shorter than five cells forward
    assert (np.abs(reported[1:-1, 6:12, 1] - 5.0) < 0.3).all()


def test_nothing_moves_in_darkness_or_where_all_is_alike():
    rng = np.random.default_rng(3)
    for pictures in (np.ones((5, 24, 80, 3), np.float32), rng.normal(0.0, 1e-4, (5, 24, 80, 3)).astype(np.float32)):
        reported = with_moves(bare(pictures)).sprites[0].moves
        assert all((reported.steps(k) == 0.0).all() for k in range(4))


@pytest.mark.parametrize(("rows", "columns"), [(1, 1), (1, 30), (20, 1)])
def test_a_sprite_of_one_row_is_drawn_as_it_stands(unknown, rows, columns):
    unit, cells = encode_pictures(np.ones((2, rows, columns, 3), np.float32), 1e-3)
    thin = Sprite(
        follows="ghosts", grain_px=4.0, corner_px=(-60.0, -40.0), constellation_deg=(11.0, 13.0), rows=rows,
        columns=columns, unit=unit, cells=cells,
    )  # fmt: skip
    drawn = replay_model(cast(GhostModel, unknown[0].replace(sprites=(thin,))), 12.0)
    assert drawn[-1].name == "residual"
    assert drawn[-1].pixels.max() == pytest.approx(1.0, rel=0.05)


def test_two_pictures_give_no_moves(unknown):
    before, _ = unknown
    sprite = before.sprites[0]
    unit, cells = encode_pictures(sprite.pictures[:2], sprite.unit)
    short = before.replace(
        sprites=(
            sprite.replace(
                constellation_deg=sprite.constellation_deg[:2], rolls_deg=sprite.rolls_deg[:2], unit=unit, cells=cells
            ),
        )
    )
    assert with_moves(short).sprites[0].moves is None
    # they are interpolated in place
    angle = 0.5 * sum(sprite.constellation_deg[:2])
    drawn = warped_sprite(short.sprites[0], pack(short), short, angle)
    assert np.array_equal(drawn, sprite_at(short.sprites[0], angle))


def test_moves_come_back_from_a_file_to_their_step(unknown):
    _, model = unknown
    assert GhostModel.model_validate_json(model.model_dump_json()) == model
    rng = np.random.default_rng(1)
    steps = rng.uniform(-150.0, 150.0, (3, 2, 4, 5, 3))
    steps[..., 2] = rng.integers(0, 128, (3, 2, 4, 5))
    shares = rng.dirichlet((1.0, 1.0, 1.0), (3, 4, 5))[..., :2].transpose(0, 3, 1, 2)
    back = packed_moves(4, steps, shares)
    for k in range(3):
        assert np.abs(back.steps(k) - steps[k]).max() <= 0.0625
        assert np.abs(back.shares(k) - shares[k]).max() <= 1.0 / 127.0


def test_broken_moves_are_reported(unknown):
    _, model = unknown
    sprite, moves = model.sprites[0], model.sprites[0].moves
    with pytest.raises(ValueError, match="not base64 of zlib"):
        moves.replace(numbers="?")
    with pytest.raises(ValueError, match=r"hold 8 bytes instead of .*run measure run again"):
        moves.replace(numbers=b64encode(compress(bytes(8))).decode())
    with pytest.raises(ValueError, match="more than"):
        moves.replace(rows=1)
    with pytest.raises(ValueError, match="127 at most together"):
        Moves(
            block=4, intervals=1, rows=1, columns=1, numbers=b64encode(compress(bytes(12) + 2 * b"\x60\x00")).decode()
        )
    with pytest.raises(ValueError, match="do not cover"):
        sprite.replace(moves=packed_moves(4, np.zeros((1, 2, 3, 3, 3)), np.zeros((1, 2, 3, 3))))
    with pytest.raises(ValueError, match='only a sprite that follows "ghosts"'):
        sprite.replace(follows="axis")


def test_what_lands_on_one_place_is_what_weighs_most():
    steps = np.zeros((1, 6, 3))
    steps[0, 1], steps[0, 4] = (0.0, 8.0, 5.0), (0.0, -4.0, 9.0)
    out = moved_vectors(steps, 4, 1.0)
    assert tuple(out[0, 3]) == (0.0, -4.0, 9.0)
    # no vector arrives at their start: unmoved there
    assert tuple(out[0, 1]) == (0.0, 8.0, 5.0)
    assert tuple(moved_vectors(steps, 4, 0.5)[0, 2]) == (0.0, 8.0, 5.0)
    assert np.array_equal(moved_vectors(steps, 4, 0.0), steps)


def test_blocks_are_linear_between_their_middles():
    at = middles(22, 4)
    assert tuple(at) == (2, 6, 10, 14, 18, 21)
    values = block_to_cells(at[:, None].astype(float), 4, (22, 1))[:, 0]
    assert np.abs(values[2:19] - np.arange(2, 19)).max() < 1e-12


def test_what_moves_evenly_is_halfway_in_between():
    row, column = np.mgrid[:30, :40]

    def hill(x):
        return np.exp(-((column - x) ** 2 + (row - 15) ** 2) / 30.0)[..., None] * np.ones(3)

    moves = np.broadcast_to((0.0, 6.0), (30, 40, 2))
    for part in (0.0, 0.3, 0.8):
        between = interpolated(hill(14).astype(np.float32), hill(20).astype(np.float32), moves, part)
        assert np.abs(between - hill(14 + 6 * part)).max() < 0.01
