"""Blocks are compared at all requested moves, and moves are refined to fractions of a cell."""

import numpy as np
import pytest

from flarewright.kernels.ghost_model.block_matching import block_misfits, block_structure, refine_blocks

ROWS, COLUMNS = np.array([1, 10, 25, 49]), np.arange(0, 80, 9)
HALF = 3


def light(down=0.0, along=0.0, fine=1, pace=1.0):
    """Return a smooth picture of a pattern that does not repeat, moved by `down` and `along` cells."""
    row, column = np.mgrid[: 50 * fine, : 80 * fine] / fine
    y, x = pace * (row - down), pace * (column - along)
    planes = [
        np.sin(0.5 * x + 0.02 * x * x / 3.0) * np.cos(0.4 * y + 0.01 * y * y),
        np.cos(0.31 * x - 0.27 * y),
        y / 50,
    ]
    return np.stack(planes, axis=-1).astype(np.float32)


def compared(here, there, around, reach=(2, 3)):
    out = np.full((ROWS.size, COLUMNS.size, 2 * reach[0] + 1, 2 * reach[1] + 1), np.nan, np.float32)
    block_misfits(here, there, ROWS, COLUMNS, HALF, around, out)
    return out


def widened(picture):
    """Return a picture extended beyond its border by the border cells."""
    return np.pad(picture.astype(float), [(40, 40), (40, 40), (0, 0)], mode="edge")


def block(wide, row, column):
    """Return a block of a widened picture; it may extend beyond the border."""
    row, column = row + 40 - HALF, column + 40 - HALF
    return wide[row : row + 2 * HALF + 1, column : column + 2 * HALF + 1]


@pytest.mark.parametrize("far", [0, 12])
def test_blocks_are_compared_at_all_requested_moves(far):
    rng = np.random.default_rng(8)
    here, there = (light(0.3, along) + rng.normal(0.0, 0.2, (50, 80, 3)).astype(np.float32) for along in (0.0, 3.4))
    around = rng.integers(-far, far + 1, (ROWS.size, COLUMNS.size, 2))
    # blocks with the central move (0, 0) are computed from shared sums
    around[::2, ::3] = 0
    found = compared(here, there, around)
    here, there = widened(here), widened(there)
    for i, row in enumerate(ROWS):
        for j, column in enumerate(COLUMNS):
            for v in range(5):
                for h in range(7):
                    down, along = around[i, j] + (v - 2, h - 3)
                    apart = ((block(here, row, column) - block(there, row + down, column + along)) ** 2).sum()
                    assert found[i, j, v, h] == pytest.approx(apart, rel=1e-4)


@pytest.mark.parametrize(("down", "along"), [(0, 0), (2, -3), (-1, 3)])
def test_a_block_has_no_misfit_at_its_true_move(down, along):
    inside = compared(light(), light(down, along), np.zeros((ROWS.size, COLUMNS.size, 2), np.int64))[1:3, 2:7]
    assert np.abs(inside[:, :, 2 + down, 3 + along]).max() < 1e-6
    assert np.median(inside) > 1.0


def test_the_structure_of_a_block_is_its_squared_difference_from_the_mean():
    out = np.empty((ROWS.size, COLUMNS.size))
    block_structure(light(), ROWS, COLUMNS, HALF, out)
    wide = widened(light())
    for i, row in enumerate(ROWS):
        for j, column in enumerate(COLUMNS):
            own = block(wide, row, column)
            assert out[i, j] == pytest.approx(((own - own.mean(axis=(0, 1))) ** 2).sum(), rel=1e-6)


def test_moves_are_refined_to_parts_of_a_cell():
    before, after = light(-0.65, -1.2, 2, 0.4), light(0.65, 1.2, 2, 0.4)
    rows, columns = np.arange(10, 40, 4), np.arange(20, 60, 4)
    steps = np.zeros((rows.size, columns.size, 3))
    steps[..., :2] = (2.0, 1.0)
    refine_blocks(before, after, rows, columns, HALF, 2, steps)
    assert np.abs(steps[..., 0] - 1.3).max() < 0.1
    assert np.abs(steps[..., 1] - 2.4).max() < 0.1
    assert (steps[..., 2] == 0.0).all()
