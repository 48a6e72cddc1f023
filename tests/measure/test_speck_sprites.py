"""Specks: what is left of a small bright ghost goes with it in pictures finer than a pixel."""

from dataclasses import replace
from typing import cast

import numpy as np
import pytest
from planted_run import LARGEST, SIZE, shape, views
from pydantic import ValidationError

from flarewright.kernels.measure_pupil import SOFT
from flarewright.measure.found import Found
from flarewright.measure.numbers import field, frame
from flarewright.measure.packed import pack
from flarewright.measure.replay import replay
from flarewright.measure.rest_fit import with_rest
from flarewright.measure.settle import to_model
from flarewright.measure.speck_sprites import covered, speck_sprites, specks_of
from flarewright.measure.specks_drawn import Grid, Outline, add_speck, draw_specks, outline, reading
from flarewright.model.ghost_model import GhostModel
from flarewright.model.sprite import Sprite, packed

CAPTURED = np.arange(1.0, LARGEST + 0.1, 1.0)
BETWEEN = 0.5 * (CAPTURED[:-1] + CAPTURED[1:])
# far brighter than what is beside it, its border soft as that of every image of a light that has a size
SPECK = shape(-110.0, 3.0, 80.0)
SPECK.numbers[SOFT] = 0.7**2
# and a large one that is none
TRUE = (SPECK, shape(60.0, 18.0, 0.6))


def model_of(shapes, seen):
    ghosts = to_model([Found((one, one, one), 0, len(seen) - 1) for one in shapes], seen)
    axis = float(seen[0].frame[0]), float(seen[0].frame[1])
    return GhostModel(
        size_px=SIZE, axis_px=axis, focal_px=1e4, largest_deg=LARGEST,
        constellation_deg=(float(CAPTURED[0]), float(CAPTURED[-1])), ghosts=ghosts,
    )  # fmt: skip


@pytest.fixture(scope="module")
def run():
    """A model whose speck is too small, too bright and beside its place, and what the captures show."""
    seen = views(TRUE, angles=CAPTURED, noise=0.001)
    numbers = TRUE[0].numbers.copy()
    numbers[:4] *= 1.01
    numbers[10:14] *= 0.85
    numbers[20:23] *= 1.1
    return model_of((replace(TRUE[0], numbers=numbers), TRUE[1]), seen), seen


def left_of(model, seen):
    return [view.pixels - replay(model, view.constellation_deg)[0].pixels for view in seen]


def missed(model, truth):
    return sum(float(((replay(model, view.constellation_deg)[0].pixels - view.pixels) ** 2).sum()) for view in truth)


def test_small_bright_ghosts_alone_are_specks(run):
    model, seen = run
    (speck,) = specks_of(model, seen)
    assert speck.name == model.ghosts[0].name
    assert len(speck.outlines) == len(seen)
    faint = model_of((shape(-110.0, 3.0, 0.02), TRUE[1]), seen)
    assert specks_of(faint, seen) == ()


def test_the_outline_of_a_disc_is_where_the_disc_is(run):
    _, seen = run
    model = model_of((shape(-110.0, 6.0, 80.0),), seen)
    angle = 7.3
    at = outline(pack(model), model, model.ghosts[0].name, angle)
    green = model.ghosts[0].green
    sigma = field(angle, LARGEST)
    # of a disc of radius r the standard deviation towards any side is r / 2; its border is soft, and drawn as a polygon
    assert at.along == pytest.approx(sigma * (green.f[0] + green.f[3] * sigma**2), abs=0.2)
    assert np.allclose(at.spread, 0.5 * abs(green.g[0] + green.g[3] * sigma**2), rtol=0.1)


def test_a_speck_is_foretold_between_captures(run):
    model, seen = run
    specks = specks_of(model, seen)
    everywhere = [np.ones(view.pixels.shape[:2], bool) for view in seen]
    sprites = speck_sprites(specks, seen, left_of(model, seen), everywhere)
    some = range(0, len(BETWEEN), 3)
    truth = views(TRUE, angles=BETWEEN[some], noise=0.0)
    better = model.replace(sprites=sprites)
    interpolated = sum(
        float(((0.5 * (seen[k].pixels + seen[k + 1].pixels) - view.pixels) ** 2).sum())
        for k, view in zip(some, truth, strict=True)
    )
    # 0.009 if cells were not held to their neighbours
    assert missed(better, truth) < 0.008 * missed(model, truth)
    assert missed(better, truth) < 0.02 * interpolated


def test_all_that_is_learned_beside_ghosts_holds_the_small_bright_ones(run):
    """The residual is learned in four steps; what coarse cells leave of a small bright ghost is only in the last."""
    model, seen = run
    few = seen[4:8]
    truth = [view for view in views(TRUE, angles=BETWEEN, noise=0.0) if 5.0 < view.constellation_deg < 8.0]
    learned = with_rest(model, few)
    assert missed(learned, truth) < 0.005 * missed(model, truth)
    others = tuple(sprite for sprite in learned.sprites if sprite.ghost != model.ghosts[0].name)
    assert len(others) < len(learned.sprites)
    assert missed(learned.replace(sprites=others), truth) > 0.2 * missed(model, truth)


def test_nothing_is_learned_where_nothing_may_be_believed(run):
    model, seen = run
    nowhere = [np.zeros(view.pixels.shape[:2], bool) for view in seen]
    assert speck_sprites(specks_of(model, seen), seen, left_of(model, seen), nowhere) == ()


def test_specks_are_hidden_from_coarser_pictures(run):
    model, seen = run
    specks = specks_of(model, seen)
    for view, mask in zip(seen, covered(specks, seen, left_of(model, seen)), strict=True):
        alone = cast(GhostModel, model.replace(ghosts=model.ghosts[:1]))
        light = replay(alone, view.constellation_deg)[0].pixels[..., 1]
        assert light[~mask].max(initial=0.0) < 0.02 * light.max()
        assert mask.sum() < 400


def test_a_ghost_that_does_not_outshine_what_is_around_it_is_no_speck(run):
    model, seen = run
    bright = [replace(view, pixels=view.pixels + np.float32(300.0)) for view in seen]
    assert specks_of(model, bright) == ()


def test_where_a_model_does_not_show_a_speck_it_is_hidden_only_if_it_is_there(run):
    model, seen = run
    short = model.replace(ghosts=(model.ghosts[0].replace(visible_deg=(8.5, LARGEST)), model.ghosts[1]))
    (speck,) = specks_of(short, seen)
    assert {k for k, _ in speck.beyond} == set(range(8))
    there = covered((speck,), seen, left_of(short, seen))
    assert all(mask.any() for mask in there)
    # the ghost is known, and what the model shows is all
    gone = views(TRUE[1:], angles=CAPTURED, noise=0.001)
    empty = covered((speck,), gone, [0.1 * view.pixels for view in gone])
    assert not any(mask.any() for mask in empty[:8])


@pytest.mark.parametrize("roll", [0.0, 33.0, 217.0])
@pytest.mark.parametrize("scale", [0.7, 1.0, 2.0])
def test_a_picture_keeps_its_light_wherever_it_lies(roll, scale):
    grid = Grid(0.5, (-4.0, -3.0), 12, 16, (2.0, 1.0))
    at = Outline(30.3, (3.0, 1.5), (6.0, 3.0), 1.0)
    picture = np.zeros((12, 16, 3), np.float32)
    picture[3:9, 4:12] = np.random.default_rng(1).random((6, 8, 3))
    size = (round(140 * scale), round(140 * scale))
    out = np.zeros((size[1], size[0], 3), np.float32)
    add_speck(out, grid, at, frame((70.0, 70.0), roll, 5.0, scale), picture)
    # cells are half a pixel, half as large again where the ghost is
    area = (0.5 * 1.5 * scale) ** 2
    assert out.sum(axis=(0, 1)) == pytest.approx(picture.sum(axis=(0, 1)) * area, rel=0.02)
    rows, columns = np.mgrid[: size[1], : size[0]]
    weight = out.sum(axis=2) / out.sum()
    turn = np.radians(roll)
    middle = (columns * weight).sum() + 0.5, (rows * weight).sum() + 0.5
    cells_r, cells_c = np.mgrid[:12, :16]
    share = picture.sum(axis=2) / picture.sum()
    along = at.along + 1.5 * (-4.0 + 0.5 * ((cells_c * share).sum() + 0.5))
    aside = 1.5 * (-3.0 + 0.5 * ((cells_r * share).sum() + 0.5))
    expected = (
        scale * (70.0 + np.cos(turn) * along + np.sin(turn) * aside),
        scale * (70.0 - np.sin(turn) * along + np.cos(turn) * aside),
    )
    assert middle == pytest.approx(expected, abs=0.05)


def test_inside_its_cells_a_picture_counts_whole():
    grid = Grid(0.5, (-5.0, -5.0), 20, 20, (1.0, 1.0))
    read = reading(grid, Outline(10.2, (1.0, 1.0), (3.0, 3.0), 1.0), frame((30.0, 30.0), 20.0, 5.0, 1.0), (80, 60))
    sums = read.weights.sum(axis=1)
    assert sums.max() == pytest.approx(1.0)
    assert (sums > 0.999).sum() > 40


def sprite(**given):
    unit, cells = packed(np.ones((2, 4, 4, 3), np.float32), 0.001)
    about = {
        "follows": "speck", "ghost": "1", "grain_px": 0.5, "corner_px": (-1.0, -1.0), "constellation_deg": (2.0, 9.0),
        "rows": 4, "columns": 4, "unit": unit, "cells": cells,
    }  # fmt: skip
    return Sprite(**{**about, **given})


def test_without_its_ghost_and_beyond_its_pictures_a_speck_is_not_drawn(run):
    model, _ = run
    name = model.ghosts[0].name

    def drawn(one, angle):
        placed = frame(model.axis_px, 0.0, angle, 1.0)
        return draw_specks([one], pack(model), model, angle, placed, model.size_px)

    assert drawn(sprite(ghost=name), 5.0).any()
    assert not drawn(sprite(ghost=name), 1.5).any()
    assert not drawn(sprite(ghost="nobody"), 5.0).any()


@pytest.mark.parametrize("given", [{"ghost": None}, {"follows": "axis"}])
def test_a_sprite_names_its_ghost_if_it_follows_one(given):
    with pytest.raises(ValidationError, match="names a ghost if it follows"):
        sprite(**given)
