"""Blobs: the residual of a small bright ghost moves with it, in images of subpixel cells."""

from dataclasses import replace
from typing import cast

import numpy as np
import pytest
from planted_run import LARGEST, shape, views

from flarewright.errors import RecordError
from flarewright.kernels.ghost_model.pupil_mesh import SOFT
from flarewright.measure.core.parameter_vector import field, frame
from flarewright.measure.fitting.alternating_fit import to_model
from flarewright.measure.fitting.detected_ghost import DetectedGhost
from flarewright.measure.replay.blob_drawing import Grid, Outline, add_blob, blob_outline, draw_blobs, reading
from flarewright.measure.replay.ghost_arrays import pack
from flarewright.measure.replay.model_image import replay_model
from flarewright.measure.residual.blob_sprites import blob_sprites, blobs_of, covered_cells
from flarewright.measure.residual.learn import with_residual
from flarewright.model.measurement.ghost_model import GhostModel
from flarewright.model.measurement.sprite import Sprite, encode_pictures

# a strip that holds both ghosts of `TRUE`
SIZE = (240, 64)
CAPTURED = np.arange(1.0, LARGEST + 0.1, 1.0)
BETWEEN = 0.5 * (CAPTURED[:-1] + CAPTURED[1:])
# far brighter than its surroundings, with a soft border like the image of any light of finite size
BLOB = shape(-110.0, 2.0, 80.0)
BLOB.numbers[SOFT] = 0.7**2
# and a large ghost, which is no blob
TRUE = (BLOB, shape(60.0, 18.0, 0.6))


def model_of(shapes, seen):
    ghosts = to_model([DetectedGhost((one, one, one), 0, len(seen) - 1) for one in shapes], seen)
    axis = float(seen[0].frame[0]), float(seen[0].frame[1])
    return GhostModel(
        size_px=SIZE, axis_px=axis, focal_px=1e4, largest_deg=LARGEST,
        constellation_deg=(float(CAPTURED[0]), float(CAPTURED[-1])), ghosts=ghosts,
    )  # fmt: skip


@pytest.fixture(scope="module")
def run():
    """Return a model whose blob is too small, too bright and displaced, and the captures."""
    seen = views(TRUE, angles=CAPTURED, noise=0.001, size=SIZE)
    numbers = TRUE[0].numbers.copy()
    numbers[:4] *= 1.01
    numbers[10:14] *= 0.85
    numbers[20:23] *= 1.1
    return model_of((replace(TRUE[0], numbers=numbers), TRUE[1]), seen), seen


def left_of(model, seen):
    return [view.pixels - replay_model(model, view.constellation_deg)[0].pixels for view in seen]


def missed(model, truth):
    return sum(
        float(((replay_model(model, view.constellation_deg)[0].pixels - view.pixels) ** 2).sum()) for view in truth
    )


def test_small_bright_ghosts_alone_are_blobs(run):
    model, seen = run
    (blob,) = blobs_of(model, seen)
    assert blob.name == model.ghosts[0].name
    assert len(blob.outlines) == len(seen)
    faint = model_of((shape(-110.0, 3.0, 0.02), TRUE[1]), seen)
    assert blobs_of(faint, seen) == ()


def test_a_ghost_as_wide_as_a_blob_of_a_large_picture_is_no_blob_of_a_small_one(run):
    _, seen = run
    ghost = shape(-110.0, 4.0, 80.0)
    ghost.numbers[SOFT] = BLOB.numbers[SOFT]
    wide = model_of((ghost, TRUE[1]), seen)
    at = blob_outline(pack(wide), wide, wide.ghosts[0].name, 5.0)
    # of 720 pixels a blob has up to 12 to each side
    assert at is not None
    assert 8.0 < max(at.half) < 12.0
    assert blobs_of(wide, seen) == ()


def test_the_outline_of_a_disc_is_where_the_disc_is(run):
    _, seen = run
    model = model_of((shape(-110.0, 6.0, 80.0),), seen)
    angle = 7.3
    at = blob_outline(pack(model), model, model.ghosts[0].name, angle)
    green = model.ghosts[0].green
    sigma = field(angle, LARGEST)
    # a disc of radius r has the standard deviation r / 2 along each axis; its border is soft, and drawn as a polygon
    assert at.along == pytest.approx(sigma * (green.f[0] + green.f[3] * sigma**2), abs=0.2)
    assert np.allclose(at.spread, 0.5 * abs(green.g[0] + green.g[3] * sigma**2), rtol=0.1)


@pytest.mark.slow
def test_a_blob_is_predicted_between_captures(run):
    model, seen = run
    seen, halfway = seen[6:18], BETWEEN[6:17]
    blobs = blobs_of(model, seen)
    everywhere = [np.ones(view.pixels.shape[:2], bool) for view in seen]
    sprites = blob_sprites(blobs, seen, left_of(model, seen), everywhere)
    some = range(0, len(halfway), 3)
    truth = views(TRUE, angles=halfway[some], noise=0.0, size=SIZE)
    better = model.replace(sprites=sprites)
    interpolated = sum(
        float(((0.5 * (seen[k].pixels + seen[k + 1].pixels) - view.pixels) ** 2).sum())
        for k, view in zip(some, truth, strict=True)
    )
    assert missed(better, truth) < 0.004 * missed(model, truth)
    assert missed(better, truth) < 0.02 * interpolated


def test_all_that_is_learned_beside_ghosts_holds_the_small_bright_ones(run):
    """The residual is learned in four steps; the residual of coarse cells at blobs is only in the last one."""
    model, seen = run
    few = seen[4:8]
    truth = views(TRUE, angles=BETWEEN[4:7], noise=0.0, size=SIZE)
    learned = with_residual(model, few)
    assert missed(learned, truth) < 0.005 * missed(model, truth)
    others = tuple(sprite for sprite in learned.sprites if sprite.ghost != model.ghosts[0].name)
    assert len(others) < len(learned.sprites)
    assert missed(learned.replace(sprites=others), truth) > 0.2 * missed(model, truth)


def test_nothing_is_learned_where_nothing_may_be_believed(run):
    model, seen = run
    nowhere = [np.zeros(view.pixels.shape[:2], bool) for view in seen]
    assert blob_sprites(blobs_of(model, seen), seen, left_of(model, seen), nowhere) == ()


def test_blobs_are_hidden_from_coarser_pictures(run):
    model, seen = run
    blobs = blobs_of(model, seen)
    for view, mask in zip(seen, covered_cells(blobs, seen, left_of(model, seen)), strict=True):
        alone = cast(GhostModel, model.replace(ghosts=model.ghosts[:1]))
        light = replay_model(alone, view.constellation_deg)[0].pixels[..., 1]
        assert light[~mask].max(initial=0.0) < 0.02 * light.max()
        assert mask.sum() < 400


def test_a_ghost_darker_than_its_surroundings_is_no_blob(run):
    model, seen = run
    bright = [replace(view, pixels=view.pixels + np.float32(300.0)) for view in seen]
    assert blobs_of(model, bright) == ()


def test_a_blob_that_the_model_hides_is_masked_only_if_visible(run):
    model, seen = run
    short = model.replace(ghosts=(model.ghosts[0].replace(visible_deg=(8.5, LARGEST)), model.ghosts[1]))
    (blob,) = blobs_of(short, seen)
    assert {k for k, _ in blob.beyond} == set(range(8))
    there = covered_cells((blob,), seen, left_of(short, seen))
    assert all(mask.any() for mask in there)
    # the ghost is known, and the model shows all light
    gone = views(TRUE[1:], angles=CAPTURED, noise=0.001, size=SIZE)
    empty = covered_cells((blob,), gone, [0.1 * view.pixels for view in gone])
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
    add_blob(out, grid, at, frame((70.0, 70.0), roll, 5.0, scale), picture)
    # cells are half a pixel wide, scaled by 1.5 with the ghost's size
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
    unit, cells = encode_pictures(np.ones((2, 4, 4, 3), np.float32), 0.001)
    about = {
        "follows": "speck", "ghost": "1", "grain_px": 0.5, "corner_px": (-1.0, -1.0), "constellation_deg": (2.0, 9.0),
        "rows": 4, "columns": 4, "unit": unit, "cells": cells,
    }  # fmt: skip
    return Sprite(**{**about, **given})


def test_without_its_ghost_and_beyond_its_pictures_a_blob_is_not_drawn(run):
    model, _ = run
    name = model.ghosts[0].name

    def drawn(one, angle):
        placed = frame(model.axis_px, 0.0, angle, 1.0)
        return draw_blobs([one], pack(model), model, angle, placed, model.size_px)

    assert drawn(sprite(ghost=name), 5.0).any()
    assert not drawn(sprite(ghost=name), 1.5).any()
    assert not drawn(sprite(ghost="missing"), 5.0).any()


@pytest.mark.parametrize("given", [{"ghost": None}, {"follows": "axis"}])
def test_a_sprite_names_its_ghost_if_it_follows_one(given):
    with pytest.raises(RecordError, match="names a ghost if it follows"):
        sprite(**given)
