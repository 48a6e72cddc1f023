"""What is left beside ghosts goes with them between captures; ghosts come and go between captures too."""

from dataclasses import replace
from functools import cache
from typing import cast

import numpy as np
import pytest
from planted_run import LARGEST, SIZE, shape, views

from flarewright.kernels.measure_pupil import SOFT
from flarewright.measure.carried import carried
from flarewright.measure.found import Found
from flarewright.measure.moves_fit import with_moves
from flarewright.measure.packed import pack
from flarewright.measure.replay import replay
from flarewright.measure.settle import to_model
from flarewright.measure.shape import Shape
from flarewright.measure.sprite_fit import axis_sprite
from flarewright.measure.sprites import sprite_at
from flarewright.model.ghost_model import GhostModel
from flarewright.model.sprite import Sprite, packed

CAPTURED = np.arange(1.0, LARGEST + 0.1, 1.0)
BETWEEN = 0.5 * (CAPTURED[:-1] + CAPTURED[1:])
# where one ghost of `TRUE` begins to leave the picture
FEW = CAPTURED[9:15]


def soft(speed: float, size: float, level: float) -> Shape:
    """Return a ghost with borders wider than a sprite's cells."""
    one = shape(speed, size, level)
    one.numbers[SOFT] = 2.5**2
    return one


# one crosses the picture and leaves it, one stays inside
TRUE = (soft(-150.0, 30.0, 1.0), soft(60.0, 18.0, 0.6))


def mistaken(one: Shape) -> Shape:
    """Return a ghost drawn a little too small and too bright, in a wrong place."""
    numbers = one.numbers.copy()
    numbers[:4] *= 1.02
    numbers[10:14] *= 0.93
    numbers[20:23] *= 1.05
    return replace(one, numbers=numbers)


def between(captured: np.ndarray) -> np.ndarray:
    """Return the constellations halfway between captures."""
    return 0.5 * (captured[:-1] + captured[1:])


def model_of(shapes: tuple[Shape, ...], captured: np.ndarray = CAPTURED) -> tuple[GhostModel, list]:
    """Return a model of some ghosts, and what the captures show beside it."""
    seen = views(TRUE, angles=captured, noise=0.001)
    return model_beside(shapes, seen), seen


def model_beside(shapes: tuple[Shape, ...], seen: list) -> GhostModel:
    """Return a model of some ghosts and of what captures show beside them."""
    ghosts = to_model([Found((one, one, one), 0, len(seen) - 1) for one in shapes], seen)
    axis = float(seen[0].frame[0]), float(seen[0].frame[1])
    model = GhostModel(
        size_px=SIZE, axis_px=axis, focal_px=1e4, largest_deg=LARGEST,
        constellation_deg=(seen[0].constellation_deg, seen[-1].constellation_deg), ghosts=ghosts,
    )  # fmt: skip
    left = [view.pixels - replay(model, view.constellation_deg)[0].pixels for view in seen]
    return model.replace(sprites=(axis_sprite(seen, left),))


# how well a model knows the ghosts of `TRUE`
KNOWN = {"unknown": (), "known": TRUE, "mistaken": tuple(mistaken(one) for one in TRUE)}


@cache
def moving(known: str, captured: tuple[float, ...]) -> tuple[GhostModel, GhostModel, list]:
    """Return a model before and after it has moves, and what captures show: made once for all tests."""
    model, seen = model_of(KNOWN[known], np.array(captured))
    return model, with_moves(model), seen


def missed(model: GhostModel, truth: list) -> float:
    return sum(float(((replay(model, view.constellation_deg)[0].pixels - view.pixels) ** 2).sum()) for view in truth)


@pytest.fixture(scope="module")
def both():
    """Return a model of both ghosts, drawn as they are not, and what the captures show."""
    return model_of(tuple(mistaken(one) for one in TRUE), FEW)


@pytest.fixture(scope="module")
def one():
    """Return a model of one of them."""
    return model_of((mistaken(TRUE[1]),), FEW)[0]


def test_what_is_left_of_ghosts_is_foretold_between_captures(both):
    foretells(*both, between(FEW))


@pytest.mark.slow
def test_what_is_left_of_ghosts_is_foretold_between_many_captures():
    foretells(*model_of(tuple(mistaken(one) for one in TRUE)), BETWEEN)


def foretells(model, seen, angles):
    truth = views(TRUE, angles=angles, noise=0.0)
    standing = model.replace(sprites=(model.sprites[0].replace(follows="axis"),))
    interpolated = sum(
        float(((0.5 * (seen[k].pixels + seen[k + 1].pixels) - view.pixels) ** 2).sum()) for k, view in enumerate(truth)
    )
    bare = missed(cast(GhostModel, model.replace(sprites=())), truth)
    mine = missed(model, truth)
    assert mine < 0.2 * missed(standing, truth)
    assert mine < 0.3 * interpolated
    assert mine < 0.02 * bare


def test_at_captures_and_beyond_them_a_sprite_is_its_own_picture(both):
    model, _ = both
    sprite = model.sprites[0]
    for k in (0, 3, -1):
        angle, own = FEW[k], sprite.pictures[k]
        assert np.array_equal(carried(sprite, pack(model), model, float(angle)), own)
        # and nothing leaps next to them
        for beside in (angle - 1e-7, angle + 1e-7):
            there = carried(sprite, pack(model), model, float(beside))
            assert np.abs(there - own).max() < 1e-4 * np.abs(own).max()
    assert np.array_equal(carried(sprite, pack(model), model, LARGEST + 1.0), sprite.pictures[-1])


def test_no_light_is_made_or_lost_where_a_ghost_only_moves(one):
    sprite = one.sprites[0]
    # of the other ghost, which the model does not know, and of this one, far from the border
    for angle in (10.5, 11.5):
        there = carried(sprite, pack(one), one, angle).sum(axis=(0, 1))
        assert there == pytest.approx(sprite_at(sprite, angle).sum(axis=(0, 1)), rel=0.03)


def test_what_no_ghost_borders_stays_in_its_place():
    model, _ = model_of((), FEW[:3])
    sprite = model.sprites[0]
    assert np.array_equal(carried(sprite, pack(model), model, 11.3), sprite_at(sprite, 11.3))
    # a ghost far from it changes nothing there
    far = model_of((mistaken(soft(60.0, 4.0, 0.6)),), CAPTURED[18:22])[0]
    own, moved = sprite_at(far.sprites[0], 20.5), carried(far.sprites[0], pack(far), far, 20.5)
    columns = own.shape[1] // 3
    assert np.abs(own[:, :columns]).max() > 0.1
    assert np.abs(own - moved)[:, :columns].max() < 0.01 * np.abs(own).max()


@pytest.mark.parametrize(("rows", "columns"), [(1, 1), (1, 30), (20, 1)])
def test_a_sprite_of_one_row_is_drawn_as_it_stands(one, rows, columns):
    unit, cells = packed(np.ones((2, rows, columns, 3), np.float32), 1e-3)
    thin = Sprite(
        follows="ghosts", grain_px=4.0, corner_px=(-60.0, -40.0), constellation_deg=(11.0, 13.0), rows=rows,
        columns=columns, unit=unit, cells=cells,
    )  # fmt: skip
    drawn = replay(cast(GhostModel, one.replace(sprites=(thin,))), 12.0)
    assert drawn[-1].name == "residual"
    assert drawn[-1].pixels.max() == pytest.approx(1.0, rel=0.05)


def test_a_ghost_comes_and_goes_between_the_captures_that_show_it_and_those_that_do_not():
    seen = views(TRUE, angles=CAPTURED)
    one = TRUE[1]
    whole, some = (to_model([Found((one, one, one), *ends)], seen)[0] for ends in ((0, 23), (5, 11)))
    assert (whole.visible_deg, whole.fade_deg) == ((1.0, 24.0), (0.0, 0.0))
    assert (some.visible_deg, some.fade_deg) == ((5.5, 12.5), (1.0, 1.0))
    model = GhostModel(
        size_px=SIZE, axis_px=(120.0, 80.0), focal_px=1e4, largest_deg=LARGEST, constellation_deg=(1.0, 24.0),
        ghosts=(some,),
    )  # fmt: skip
    always = model.replace(ghosts=(some.replace(visible_deg=(1.0, 24.0), fade_deg=(0.0, 0.0)),))
    for angle, part in ((5.0, 0.0), (5.25, 0.25), (5.5, 0.5), (6.0, 1.0), (12.0, 1.0), (12.75, 0.25), (13.0, 0.0)):
        there, all_of_it = (float(replay(each, angle)[0].pixels.sum()) for each in (model, always))
        assert there == pytest.approx(part * all_of_it, rel=1e-4, abs=1e-6)
