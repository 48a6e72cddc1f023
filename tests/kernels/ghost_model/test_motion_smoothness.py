"""Costs of single moves follow their misfits; along a line of blocks the sums equal an exhaustive search."""

from itertools import pairwise, product

import numpy as np
import pytest

from flarewright.kernels.ghost_model.motion_smoothness import agree, move_costs

STEP, LEAP = 0.3, 0.8


def summed(costs, around=None, step=STEP, leap=LEAP):
    costs = costs.astype(np.float32)
    out = np.full_like(costs, np.nan)
    agree(costs, np.zeros((*costs.shape[:2], 2), np.int64) if around is None else around, step, leap, out)
    return out


def apart(one, other):
    """Return the cost of two neighbours' moves."""
    down, along = abs(one[0] - other[0]), abs(one[1] - other[1])
    return min(STEP * (down + along), LEAP) if max(down, along) <= 1 else LEAP


def test_the_cost_of_a_move_grows_with_its_misfit_and_its_length():
    rng = np.random.default_rng(4)
    misfits, around = rng.uniform(0.0, 9.0, (2, 3, 3, 5)).astype(np.float32), rng.integers(-9, 10, (2, 3, 2))
    out = np.full_like(misfits, np.nan)
    move_costs(misfits, around, 2.0, 0.1, out)
    down = around[..., 0, None, None] + np.arange(-1, 2)[:, None]
    along = around[..., 1, None, None] + np.arange(-2, 3)
    assert out == pytest.approx(np.log1p(misfits / 2.0) + np.log1p(0.1 * np.hypot(down, along)), rel=1e-5)


@pytest.mark.parametrize("upright", [False, True])
def test_along_a_line_the_sums_equal_an_exhaustive_search(upright):
    costs = np.random.default_rng(5).uniform(0.0, 2.0, (4, 3, 3))
    labels = list(product(range(3), range(3)))
    least = np.full(costs.shape, np.inf)
    for chosen in product(labels, repeat=4):
        total = sum(costs[n][label] for n, label in enumerate(chosen))
        total += sum(apart(*pair) for pair in pairwise(chosen))
        for n, label in enumerate(chosen):
            least[n][label] = min(least[n][label], total)
    out = summed(costs[:, None] if upright else costs[None]).reshape(costs.shape)
    # two lines run along the blocks; the six others add each block's cost once. Sums are compared up to a constant for
    # each block
    sums = out - 7.0 * costs
    for one, other in zip(sums, least, strict=True):
        assert np.abs((one - one.min()) - (other - other.min())).max() < 1e-5


def test_without_a_cost_of_differences_blocks_are_independent():
    costs = np.random.default_rng(6).uniform(0.0, 1.0, (5, 6, 3, 5))
    assert np.abs(summed(costs, leap=0.0) - 8.0 * costs).max() < 1e-5


def test_the_central_move_of_the_search_does_not_matter():
    rng = np.random.default_rng(7)
    # seven by seven moves, expensive except for the middle ones, which are in the search range of every block
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


def test_a_block_without_structure_follows_its_neighbours():
    costs = np.full((5, 5, 3, 7), 4.0)
    costs[:, :, 2, 5] = 0.0
    costs[2, 2] = 0.0
    # a negligible preference for another move
    costs[2, 2, 0, 0] = -0.01
    best = summed(costs).reshape(5, 5, -1).argmin(axis=2)
    assert (best == 2 * 7 + 5).all()
