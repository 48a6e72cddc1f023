"""Blocks are found where they were put, on the shortest way, and what only looks the same does not count."""

import numpy as np
import pytest

from flarewright.kernels.measure_motion import match_blocks, refine_blocks

REACH = np.array([4, 9])
ROWS, COLUMNS = np.arange(10, 40, 4), np.arange(20, 60, 4)
NOISE = 1e-4


def light(down=0.0, along=0.0, fine=1, pace=1.0):
    """Return a smooth picture of a pattern that does not repeat, moved by so many cells."""
    row, column = np.mgrid[: 50 * fine, : 80 * fine] / fine
    y, x = pace * (row - down), pace * (column - along)
    planes = [
        np.sin(0.5 * x + 0.02 * x * x / 3.0) * np.cos(0.4 * y + 0.01 * y * y),
        np.cos(0.31 * x - 0.27 * y),
        y / 50,
    ]
    return np.stack(planes, axis=-1).astype(np.float32)


def matched(here, there, stiff=0.01):
    out = np.full((ROWS.size, COLUMNS.size, 3), np.nan)
    match_blocks(here, there, ROWS, COLUMNS, 3, REACH, stiff, NOISE, out)
    return out


@pytest.mark.parametrize(("down", "along"), [(0, 0), (2, -7), (-3, 9)])
def test_every_block_is_found_where_it_was_put(down, along):
    found = matched(light(), light(down, along))
    assert (found[..., 0] == down).all()
    assert (found[..., 1] == along).all()
    assert ((found[..., 2] > 1.0) == bool(down or along)).all()


def test_no_move_is_passed_over_that_does_better():
    """Every move is tried here, whatever the blocks' means say."""
    rng = np.random.default_rng(8)
    here, there = (light(0.3, along) + rng.normal(0.0, 0.2, (50, 80, 3)).astype(np.float32) for along in (0.0, 3.4))
    found = matched(here, there)
    wide = np.pad(there.astype(float), [(20, 20), (20, 20), (0, 0)], mode="edge")
    for i, row in enumerate(ROWS):
        for j, column in enumerate(COLUMNS):
            own = here[row - 3 : row + 4, column - 3 : column + 4].astype(float)
            costs = {}
            for down in range(-REACH[0], REACH[0] + 1):
                for along in range(-REACH[1], REACH[1] + 1):
                    other = wide[row + down + 17 : row + down + 24, column + along + 17 : column + along + 24]
                    costs[down, along] = (((own - other) ** 2).sum() + NOISE) * (1.0 + 0.01 * np.hypot(down, along))
            assert tuple(found[i, j, :2]) == min(costs, key=costs.get)


def test_nothing_moves_in_darkness_or_where_all_is_alike():
    rng = np.random.default_rng(3)
    dark = [rng.normal(0.0, 0.05 * np.sqrt(NOISE / 147.0), (50, 80, 3)).astype(np.float32) for _ in range(2)]
    assert (matched(*dark)[..., :2] == 0.0).all()
    assert (matched(np.ones_like(dark[0]), np.ones_like(dark[0]))[..., :2] == 0.0).all()


def test_a_block_of_light_in_darkness_is_followed_and_darkness_is_not():
    here, there = np.zeros((50, 80, 3), np.float32), np.zeros((50, 80, 3), np.float32)
    here[20:27, 30:37] = light()[20:27, 30:37]
    there[21:28, 38:45] = here[20:27, 30:37]
    found = matched(here, there)
    at = found[np.argmin(np.abs(ROWS - 23)), np.argmin(np.abs(COLUMNS - 33))]
    assert tuple(at[:2]) == (1.0, 8.0)
    assert (found[:, 9, :2] == 0.0).all()


def test_moves_are_refined_to_parts_of_a_cell():
    before, after = light(-0.65, -1.2, 2, 0.4), light(0.65, 1.2, 2, 0.4)
    steps = np.zeros((ROWS.size, COLUMNS.size, 3))
    steps[..., :2] = (2.0, 1.0)
    refine_blocks(before, after, ROWS, COLUMNS, 3, 2, steps)
    assert np.abs(steps[..., 0] - 1.3).max() < 0.1
    assert np.abs(steps[..., 1] - 2.4).max() < 0.1
    assert (steps[..., 2] == 0.0).all()
