"""The normal equations of all ghosts of a view, compared with NumPy's sums over whole pictures."""

import numpy as np

from flarewright.kernels.ghost_model import frame_equations
from flarewright.kernels.ghost_model.frame_equations import add_together, draw_together, windows_together
from flarewright.kernels.ghost_model.ghost_mesh import window_of
from flarewright.kernels.ghost_model.jacobian import draw_with_changes
from flarewright.kernels.jit.decorators import for_python
from flarewright.measure.core.parameter_vector import NUMBERS

ghost_changes = for_python(frame_equations.ghost_changes)

HEIGHT, WIDTH, COLOURS = 9, 12, 3


def test_a_ghosts_changes_are_sums_along_its_rows():
    random = np.random.default_rng(2)
    plane, changes = random.normal(size=(4, 6)), random.normal(size=(4, 6, 3))
    growth = np.array([0.7, -0.2])
    pixels = np.empty((20, 3))
    ghost_changes(plane, changes, 1.5, growth, pixels)
    # the last column of differences lies right of the window
    whole = changes.cumsum(axis=1)[:, :5]
    wanted = np.stack([plane.cumsum(axis=1)[:, :5], 1.5 * whole[..., 0], whole[..., 1:] @ growth], axis=-1)
    assert np.allclose(pixels, wanted.reshape(-1, 3), rtol=1e-12, atol=1e-12)


def test_sums_over_windows_are_those_over_whole_pictures():
    random = np.random.default_rng(5)
    # four ghosts, of which the third is not in the picture; the last does not overlap the first
    boxes = {0: (0, 0, 4, 5), 1: (2, 3, 7, 9), 3: (5, 6, 3, 4)}
    size = 3 * 4
    jacobian = np.zeros((HEIGHT, WIDTH, size + COLOURS))
    windows, pixels, start = [], [], 0
    for ghost, (top, left, height, width) in boxes.items():
        own = random.normal(size=(height, width, 3))
        jacobian[top : top + height, left : left + width, 3 * ghost : 3 * ghost + 3] = own
        windows.append((ghost, start, top, left, height, width))
        pixels.append(own.reshape(-1, 3))
        start += height * width
    even = size + 1
    jacobian[..., even] = 1.0
    weight, residual = random.uniform(size=(HEIGHT, WIDTH)), random.normal(size=(HEIGHT, WIDTH))
    matrix, side = np.zeros((size + COLOURS, size + COLOURS)), np.zeros(size + COLOURS)
    add_together(np.concatenate(pixels), np.array(windows), weight, residual, even, matrix, side)
    flat = jacobian.reshape(-1, size + COLOURS)
    weighted = flat * weight.reshape(-1, 1)
    assert np.allclose(matrix, weighted.T @ flat, rtol=1e-12, atol=1e-12)
    assert np.allclose(side, weighted.T @ residual.ravel(), rtol=1e-12, atol=1e-12)


def test_ghosts_drawn_together_equal_ghosts_drawn_alone():
    sigma, frame, size = 0.7, np.array([20.0, 15.0, 0.8, 0.6, 1.0]), (48, 32)
    parameters = np.zeros((3, NUMBERS))
    parameters[:, 10] = 5.0, 4.0, 6.0
    parameters[:, 20] = 30.0, 10.0, 20.0
    # the second lies outside the picture
    parameters[:, 0] = 8.0, 900.0, -6.0
    discs, free = np.zeros(3, np.int64), np.array([0, 10, 11, 13])
    shifts, growths = np.array([1.4, 1.0, 0.3]), np.random.default_rng(1).normal(size=(3, 3))
    windows = np.zeros((3, 6), np.int64)
    seen, count, largest = windows_together(parameters, discs, sigma, frame, *size, windows)
    assert windows[:seen, 0].tolist() == [0, 2]
    pixels, room = np.full((count, 3), np.nan), np.full(largest * (free.size + 1), np.nan)
    draw_together(parameters, discs, sigma, frame, free, windows[:seen], shifts, growths, room, pixels)
    start = 0
    for row in windows[:seen]:
        left, top, width, height = window_of(parameters[row[0]], 0, sigma, frame, *size)
        assert row[1:].tolist() == [start, top, left, height, width]
        plane, changes = np.zeros((height, width + 1)), np.zeros((height, width + 1, free.size))
        draw_with_changes(parameters[row[0]], 0, sigma, free, frame, left, top, plane, changes)
        own = np.empty((height * width, 3))
        ghost_changes(plane, changes, shifts[row[0]], growths[row[0]], own)
        assert np.allclose(pixels[start : start + own.shape[0]], own, rtol=1e-12, atol=1e-12)
        start += own.shape[0]
    assert start == count
