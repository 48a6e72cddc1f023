"""Blobs in models of earlier versions: the residual of a small bright ghost moves with it, in subpixel cells."""

import numpy as np
import pytest
from planted_run import LARGEST, shape, views

from flarewright.errors import RecordError
from flarewright.io.measurement.ghost_model_file import read_ghost_model, write_ghost_model
from flarewright.kernels.ghost_model.pupil_mesh import SOFT
from flarewright.measure.core.parameter_vector import field, frame
from flarewright.measure.fitting.alternating_fit import to_model
from flarewright.measure.fitting.detected_ghost import DetectedGhost
from flarewright.measure.replay.blob_drawing import Grid, Outline, add_blob, blob_outline, draw_blobs, reading
from flarewright.measure.replay.ghost_arrays import pack
from flarewright.measure.replay.model_image import replay_model
from flarewright.model.measurement.ghost_model import GhostModel
from flarewright.model.measurement.sprite import Sprite, encode_pictures

# a strip that holds both ghosts of `TRUE`
SIZE = (240, 64)
CAPTURED = np.arange(1.0, LARGEST + 0.1, 1.0)
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
    """Return a model with a blob, and its captures."""
    seen = views(TRUE, angles=CAPTURED, noise=0.001, size=SIZE)
    return model_of(TRUE, seen), seen


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


@pytest.mark.parametrize("roll", [0.0, 33.0, 217.0])
@pytest.mark.parametrize("scale", [0.7, 1.0, 2.0])
def test_a_picture_keeps_its_light_wherever_it_lies(roll, scale):
    grid = Grid(0.5, (-4.0, -3.0), 12, 16, (2.0, 1.0))
    at = Outline(30.3, (3.6, 1.5))
    picture = np.zeros((12, 16, 3), np.float32)
    picture[3:9, 4:12] = np.random.default_rng(1).random((6, 8, 3))
    size = (round(140 * scale), round(140 * scale))
    out = np.zeros((size[1], size[0], 3), np.float32)
    add_blob(out, grid, at, frame((70.0, 70.0), roll, 5.0, scale), picture)
    # cells are half a pixel wide, scaled with the ghost by 1.8 along its line and by 1.5 across
    area = 0.5 * 1.8 * scale * 0.5 * 1.5 * scale
    assert out.sum(axis=(0, 1)) == pytest.approx(picture.sum(axis=(0, 1)) * area, rel=0.02)
    rows, columns = np.mgrid[: size[1], : size[0]]
    weight = out.sum(axis=2) / out.sum()
    turn = np.radians(roll)
    middle = (columns * weight).sum() + 0.5, (rows * weight).sum() + 0.5
    cells_r, cells_c = np.mgrid[:12, :16]
    share = picture.sum(axis=2) / picture.sum()
    along = at.along + 1.8 * (-4.0 + 0.5 * ((cells_c * share).sum() + 0.5))
    aside = 1.5 * (-3.0 + 0.5 * ((cells_r * share).sum() + 0.5))
    expected = (
        scale * (70.0 + np.cos(turn) * along + np.sin(turn) * aside),
        scale * (70.0 - np.sin(turn) * along + np.cos(turn) * aside),
    )
    assert middle == pytest.approx(expected, abs=0.05)


def test_inside_its_cells_a_picture_counts_whole():
    grid = Grid(0.5, (-5.0, -5.0), 20, 20, (1.0, 1.0))
    read = reading(grid, Outline(10.2, (1.0, 1.0)), frame((30.0, 30.0), 20.0, 5.0, 1.0), (80, 60))
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


def test_a_file_with_a_blob_is_read_and_replayed(run, tmp_path):
    model, _ = run
    write_ghost_model(tmp_path / "earlier.json", model.replace(sprites=(sprite(ghost=model.ghosts[0].name),)))
    earlier = read_ghost_model(tmp_path / "earlier.json")
    angle = 5.0
    light = draw_blobs(earlier.sprites, pack(model), model, angle, frame(model.axis_px, 0.0, angle, 1.0), SIZE)
    more = replay_model(earlier, angle)[0].pixels - replay_model(model, angle)[0].pixels
    assert light.max() > 0.5
    np.testing.assert_allclose(more, light, atol=1e-4)


@pytest.mark.parametrize("given", [{"ghost": None}, {"follows": "axis"}])
def test_a_sprite_names_its_ghost_if_it_follows_one(given):
    with pytest.raises(RecordError, match="names a ghost if it follows"):
        sprite(**given)
