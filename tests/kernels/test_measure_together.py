"""The equations of all ghosts of a view against the same sums over whole pictures by NumPy."""

import numpy as np

from flarewright.kernels.measure_together import add_together, ghost_changes

HEIGHT, WIDTH, COLOURS = 9, 12, 3


def test_a_ghosts_changes_are_sums_along_its_rows():
    random = np.random.default_rng(2)
    plane, changes = random.normal(size=(4, 6)), random.normal(size=(4, 6, 3))
    growth = np.array([0.7, -0.2])
    pixels = np.empty((20, 3))
    ghost_changes(plane, changes, 1.5, growth, pixels)
    # what stands in the last column lies right of the window
    whole = changes.cumsum(axis=1)[:, :5]
    wanted = np.stack([plane.cumsum(axis=1)[:, :5], 1.5 * whole[..., 0], whole[..., 1:] @ growth], axis=-1)
    assert np.allclose(pixels, wanted.reshape(-1, 3), rtol=1e-12, atol=1e-12)


def test_sums_over_windows_are_those_over_whole_pictures():
    random = np.random.default_rng(5)
    # of four ghosts the third is not in the picture; the last lies apart from the first
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
    weight, left_over = random.uniform(size=(HEIGHT, WIDTH)), random.normal(size=(HEIGHT, WIDTH))
    matrix, side = np.zeros((size + COLOURS, size + COLOURS)), np.zeros(size + COLOURS)
    add_together(np.concatenate(pixels), np.array(windows), weight, left_over, even, matrix, side)
    flat = jacobian.reshape(-1, size + COLOURS)
    weighted = flat * weight.reshape(-1, 1)
    assert np.allclose(matrix, weighted.T @ flat, rtol=1e-12, atol=1e-12)
    assert np.allclose(side, weighted.T @ left_over.ravel(), rtol=1e-12, atol=1e-12)
