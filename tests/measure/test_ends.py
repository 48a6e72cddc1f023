"""Ghosts end where they no longer explain light, and nowhere else."""

import numpy as np
import pytest
from test_carried import CAPTURED, TRUE, mistaken, model_of

from flarewright.measure.ends import ended
from flarewright.measure.replay import draw


def left_of(model, seen):
    return [view.pixels - draw(model, view.constellation_deg, view.roll_deg, view.size_px) for view in seen]


@pytest.fixture(scope="module")
def run():
    """A model of two ghosts, somewhat mistaken, and what captures show."""
    model, seen = model_of(tuple(mistaken(one) for one in TRUE))
    everywhere = [np.ones(view.pixels.shape[:2], dtype=bool) for view in seen]
    return model.replace(sprites=()), seen, everywhere


def test_ghosts_that_explain_light_stay_as_they_are(run):
    model, seen, masks = run
    left = left_of(model, seen)
    same, rest = ended(model, seen, left, masks)
    # the first leaves the picture, and the last sliver of its mistaken border may be worse than none
    assert same.ghosts[1] == model.ghosts[1]
    assert same.ghosts[0].visible_deg[0] == model.ghosts[0].visible_deg[0]
    assert same.ghosts[0].visible_deg[1] > CAPTURED[-3]
    inside = same.replace(ghosts=same.ghosts[1:])
    again, rest = ended(inside, seen, left, masks)
    assert again == inside
    assert all(np.array_equal(a, b) for a, b in zip(left, rest, strict=True))


def test_a_ghost_ends_with_the_last_photograph_that_shows_it(run):
    model, seen, masks = run
    # the second ghost is not there in the first two and the last three
    gone = [0, 1, len(seen) - 3, len(seen) - 2, len(seen) - 1]
    alone = model_of(TRUE[1:])[0]
    changed = [
        view.showing(view.pixels - draw(alone, view.constellation_deg, 0.0, view.size_px).astype(np.float32))
        if k in gone
        else view
        for k, view in enumerate(seen)
    ]
    short, rest = ended(model, changed, left_of(model, changed), masks)
    assert short.ghosts[1].visible_deg == (0.5 * (CAPTURED[1] + CAPTURED[2]), 0.5 * (CAPTURED[-4] + CAPTURED[-3]))
    assert short.ghosts[1].fade_deg == (1.0, 1.0)
    for told, found in zip(left_of(short, changed), rest, strict=True):
        assert np.abs(told - found).max() < 1e-5


def test_where_nothing_may_be_believed_no_ghost_ends(run):
    model, seen, masks = run
    dark = [view.showing(0.0 * view.pixels) for view in seen]
    same, _ = ended(model, dark, left_of(model, dark), [np.zeros_like(mask) for mask in masks])
    assert same.ghosts == model.ghosts
    # and of one that is never there a few photographs are left
    few, _ = ended(model, dark, left_of(model, dark), masks)
    for ghost in few.ghosts:
        low, high = ghost.visible_deg
        assert ((low <= CAPTURED) & (high >= CAPTURED)).sum() == 3
