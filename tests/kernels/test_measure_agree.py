"""Moves cost what their misfits tell, and along a line of blocks what trying all of them together tells."""

from itertools import pairwise, product

import numpy as np
import pytest

from flarewright.kernels.measure_agree import agree, move_costs

STEP, LEAP = 0.3, 0.8


def summed(costs, around=None, step=STEP, leap=LEAP):
    costs = costs.astype(np.float32)
    out = np.full_like(costs, np.nan)
    agree(costs, np.zeros((*costs.shape[:2], 2), np.int64) if around is None else around, step, leap, out)
    return out


def apart(one, other):
    """Return what it costs when neighbours have these moves."""
    down, along = abs(one[0] - other[0]), abs(one[1] - other[1])
    return min(STEP * (down + along), LEAP) if max(down, along) <= 1 else LEAP


def test_a_move_costs_what_it_misses_by_and_more_the_longer_it_is():
    rng = np.random.default_rng(4)
    misfits, around = rng.uniform(0.0, 9.0, (2, 3, 3, 5)).astype(np.float32), rng.integers(-9, 10, (2, 3, 2))
    out = np.full_like(misfits, np.nan)
    move_costs(misfits, around, 2.0, 0.1, out)
    down = around[..., 0, None, None] + np.arange(-1, 2)[:, None]
    along = around[..., 1, None, None] + np.arange(-2, 3)
    assert out == pytest.approx(np.log1p(misfits / 2.0) + np.log1p(0.1 * np.hypot(down, along)), rel=1e-5)


@pytest.mark.parametrize("upright", [False, True])
def test_along_a_line_the_sums_are_those_of_the_best_of_all_together(upright):
    costs = np.random.default_rng(5).uniform(0.0, 2.0, (4, 3, 3))
    labels = list(product(range(3), range(3)))
    least = np.full(costs.shape, np.inf)
    for chosen in product(labels, repeat=4):
        total = sum(costs[n][label] for n, label in enumerate(chosen))
        total += sum(apart(*pair) for pair in pairwise(chosen))
        for n, label in enumerate(chosen):
            least[n][label] = min(least[n][label], total)
    out = summed(costs[:, None] if upright else costs[None]).reshape(costs.shape)
    # two lines run along the blocks, and six across each alone; a sum is told up to what all moves of a block have
    told = out - 7.0 * costs
    for one, other in zip(told, least, strict=True):
        assert np.abs((one - one.min()) - (other - other.min())).max() < 1e-5


def test_where_any_move_beside_another_is_free_each_block_stands_alone():
    costs = np.random.default_rng(6).uniform(0.0, 1.0, (5, 6, 3, 5))
    assert np.abs(summed(costs, leap=0.0) - 8.0 * costs).max() < 1e-5


def test_moves_are_compared_as_they_are_whatever_they_are_looked_for_around():
    rng = np.random.default_rng(7)
    # seven by seven moves, dear but for the middle ones, which every block looks through
    whole = np.full((5, 6, 7, 7), 1e3)
    whole[:, :, 2:5, 2:5] = rng.uniform(0.0, 2.0, (5, 6, 3, 3))
    around = rng.integers(-1, 2, (5, 6, 2))
    part = np.empty((5, 6, 5, 5))
    for i, j in np.ndindex(5, 6):
        a, b = around[i, j] + 1
        part[i, j] = whole[i, j, a : a + 5, b : b + 5]
    plain, shifted = summed(whole), summed(part, around)
    for i, j in np.ndindex(5, 6):
        a, b = 1 - around[i, j]
        assert shifted[i, j, a : a + 3, b : b + 3] == pytest.approx(plain[i, j, 2:5, 2:5], abs=1e-3)


def test_a_block_that_tells_nothing_goes_with_those_around_it():
    costs = np.full((5, 5, 3, 7), 4.0)
    costs[:, :, 2, 5] = 0.0
    costs[2, 2] = 0.0
    # it tells next to nothing, and against them
    costs[2, 2, 0, 0] = -0.01
    best = summed(costs).reshape(5, 5, -1).argmin(axis=2)
    assert (best == 2 * 7 + 5).all()
