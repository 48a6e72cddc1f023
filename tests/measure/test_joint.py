"""Light solved for all ghosts at once, and fragments that become one ghost."""

import numpy as np
import pytest
from planted_run import GHOSTS, LARGEST, NOISE, shape, views

from flarewright.measure.fit import render
from flarewright.measure.found import Found
from flarewright.measure.fragments import joined
from flarewright.measure.joint import lit
from flarewright.measure.shape import Shape

FEW = np.linspace(2.0, LARGEST, 9)


def found(one: Shape, count: int = 9) -> Found:
    return Found((one, one, one), 0, count - 1)


def dimmer(one: Shape, factor: float) -> Shape:
    numbers = one.numbers.copy()
    numbers[20:30] *= factor
    return Shape(numbers, one.discs)


def misfit(ghosts, shown) -> float:
    """Return the root mean square of what ghosts leave of views, over the noise."""
    left = [
        view.pixels[..., 1] - sum(render(ghost.shapes[1], view) for ghost in ghosts if ghost.first <= k <= ghost.last)
        for k, view in enumerate(shown)
    ]
    return float(np.sqrt(np.mean(np.square(left))) / NOISE)


def test_overlapping_ghosts_get_the_light_that_is_theirs():
    # they overlap in all views: one lies within the other
    planted = (shape(-40.0, 34.0, 0.5), shape(-46.0, 20.0, 0.4))
    shown = views(planted, angles=FEW)
    wrong = [found(dimmer(planted[0], 1.7)), found(dimmer(planted[1], 0.2))]
    right = lit(wrong, shown)
    assert misfit(wrong, shown) > 3.0
    assert misfit(right, shown) < 1.2
    for ghost, truth in zip(right, planted, strict=True):
        for one in ghost.shapes:
            assert one.numbers[20] + 0.5 * one.numbers[21] == pytest.approx(
                truth.numbers[20] + 0.5 * truth.numbers[21], rel=0.03
            )


def test_a_ghost_that_others_stand_in_for_is_left_out():
    shown = views((GHOSTS[0],), angles=FEW)
    twice = [found(dimmer(GHOSTS[0], 0.5)), found(dimmer(GHOSTS[0], 0.5)), found(GHOSTS[1])]
    kept = lit(twice, shown)
    assert len(kept) == 1
    assert kept[0].shapes[1].numbers[0] == GHOSTS[0].numbers[0]
    assert lit([], shown) == []


def test_a_ghost_is_judged_by_the_light_that_its_rims_let_through():
    # a disc leaves the middle of the pupil, where it is bright; beyond, its law falls below 0 and nothing is drawn
    core = shape(-40.0, 30.0, 0.5)
    core.numbers[21] = -3.0 * core.numbers[20]
    core.numbers[30:33] = 0.0, 0.0, 0.4
    planted = (GHOSTS[0], Shape(core.numbers, 1))
    shown = views(planted, angles=FEW)
    kept = lit([found(one) for one in planted], shown)
    assert len(kept) == 2
    assert misfit(kept, shown) < 1.2


@pytest.mark.parametrize("colour", [0, 1, 2])
def test_a_ghost_that_one_colour_alone_shows_is_needed(colour):
    body, within = shape(-40.0, 34.0, 0.5), shape(-46.0, 20.0, 0.4)
    shown = []
    for view in views((body,), angles=FEW):
        light = view.pixels.copy()
        light[..., colour] += render(within, view).astype(np.float32)
        shown.append(view.showing(light))
    kept = lit([found(body), found(within)], shown)
    assert [ghost.shapes[1].numbers[0] for ghost in kept] == [body.numbers[0], within.numbers[0]]
    told = [one.numbers[20] / within.numbers[20] for one in kept[1].shapes]
    assert told == pytest.approx([float(m == colour) for m in range(3)], abs=0.05)
    assert len(lit([found(body), found(within)], views((body,), angles=FEW))) == 1


@pytest.mark.parametrize(("part", "told"), [(0.015, 1), (0.06, 2)])
def test_what_a_model_may_miss_of_a_ghost_is_no_other_ghost(part, told):
    # no noise to speak of: whatever is drawn explains its own light well
    body, within = shape(-40.0, 34.0, 50.0), shape(-46.0, 20.0, 50.0 * part)
    shown = views((body, within), angles=FEW)
    kept = lit([found(body), found(within)], shown)
    assert len(kept) == told
    assert kept[0].shapes[1].numbers[0] == body.numbers[0]


def test_ghosts_are_lit_only_where_they_are():
    shown = views((GHOSTS[0],), angles=FEW[:5]) + views((), angles=FEW[5:])
    assert misfit(lit([found(dimmer(GHOSTS[0], 0.5), 5)], shown), shown) < 1.2


def test_a_core_and_its_body_become_one_ghost():
    # light that lands in the middle from half of the pupil: g is small there
    whole = shape(-50.0, 30.0, 0.4)
    whole.numbers[10], whole.numbers[11] = 9.0, 21.0
    shown = views((whole,), angles=FEW)
    body, core = shape(-50.0, 29.0, 0.4), shape(-49.0, 8.0, 0.4)
    pieces = lit([found(body), found(core)], shown, needed=0.0)
    assert len(pieces) == 2
    told: list[str] = []
    one = joined(pieces, shown, factor=2.0, tell=told.append)
    assert len(one) == 1
    # told as in pictures twice as wide
    assert told == ["a ghost at speed -98 px is a part of one of size 58 px"]
    assert misfit(lit(one, shown), shown) < 0.5 * misfit(pieces, shown)


def test_two_ghosts_stay_two():
    planted = (shape(-40.0, 34.0, 0.25), shape(-55.0, 14.0, 0.6))
    shown = views(planted, angles=FEW)
    assert len(joined([found(one) for one in planted], shown)) == 2


def test_what_a_larger_ghost_gains_by_itself_joins_no_other_to_it():
    # found as an even disc, which it is not: how much better its own numbers fit tells of no fragment
    large, small = shape(-40.0, 34.0, 0.5), shape(-52.0, 9.0, 0.1)
    large.numbers[10], large.numbers[11] = 10.0, 24.0
    shown = views((large, small), angles=FEW)
    assert len(joined([found(shape(-40.0, 32.0, 0.5)), found(small)], shown)) == 2


def test_light_that_lies_beside_a_ghost_is_no_part_of_it():
    # small in the middle of the pupil, wide at its rim: most of it lies where the other has nothing
    small, wide = shape(-40.0, 12.0, 0.6), shape(-42.0, 6.0, 0.1)
    wide.numbers[11] = 44.0
    wide.numbers[20:23] *= 20.0
    shown = views((small, wide), angles=FEW)
    assert len(joined([found(small), found(wide)], shown)) == 2


def test_ghosts_that_have_shrunk_to_nothing_take_no_other_with_them():
    """Where a fit finds no light for a ghost, its size may go to 0, and rounding gives its triangles their signs."""
    rng = np.random.default_rng(3)
    shown = views(GHOSTS[:2], angles=FEW)
    vanished = []
    for _ in range(60):
        numbers = np.zeros(GHOSTS[0].numbers.size)
        for first in (0, 10):
            numbers[first : first + 4] = 10.0 ** rng.uniform(-15.0, -11.0) * rng.normal(size=4)
        numbers[20], numbers[30:33] = 1e-13, (1e-14, 1e-15, 0.05)
        vanished.append(Shape(numbers, 1))
        for view in shown:
            assert np.isfinite(render(vanished[-1], view)).all()
    kept = lit([*map(found, vanished[:5]), *map(found, GHOSTS[:2])], shown)
    assert [ghost.shapes[1].numbers[0] for ghost in kept] == [ghost.numbers[0] for ghost in GHOSTS[:2]]


def test_a_speck_stays_a_ghost_of_its_own(monkeypatch):
    """A caustic core of a pixel: drawn as a part of its ghost it is soft, and nothing finer than a pixel is learned."""
    whole = shape(-50.0, 12.0, 0.4)
    whole.numbers[10], whole.numbers[11] = 1.0, 11.0
    shown = views((whole,), angles=FEW)
    pieces = lit([found(shape(-50.0, 12.0, 0.4)), found(shape(-50.0, 1.1, 4.0))], shown, needed=0.0)
    assert len(pieces) == 2
    assert len(joined(pieces, shown)) == 2
    # it is one ghost, and a larger one would be taken for that
    monkeypatch.setattr("flarewright.measure.fragments._SPECK", 0.0)
    assert len(joined(pieces, shown)) == 1
