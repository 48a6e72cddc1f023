"""The normal equations of all ghosts of a view, compared with NumPy's sums over whole pictures."""

import numpy as np

from flarewright.kernels.ghost_model.joint_equations import add_jointly

HEIGHT, WIDTH = 9, 12
# top, left, height, width and number of parameters of each ghost; the last does not overlap the first
BOXES = ((0, 0, 4, 5, 3), (2, 3, 7, 9, 13), (5, 6, 3, 4, 1))


def test_sums_over_windows_are_those_over_whole_pictures():
    random = np.random.default_rng(4)
    size = sum(box[4] for box in BOXES)
    jacobian = np.zeros((HEIGHT, WIDTH, size))
    packed, windows, start, first = [], [], 0, 0
    for top, left, height, width, count in BOXES:
        changes = random.normal(size=(height, width + 1, count))
        # a ghost does not reach all pixels of its window
        changes[height // 2] = 0.0
        # the last column of differences lies right of the window
        jacobian[top : top + height, left : left + width, first : first + count] = changes.cumsum(axis=1)[:, :width]
        packed.append(changes.ravel())
        windows.append((start, first, count, top, left, height, width))
        start, first = start + changes.size, first + count
    weight = random.uniform(size=(HEIGHT, WIDTH)) * (random.uniform(size=(HEIGHT, WIDTH)) > 0.3)
    residual = random.normal(size=(HEIGHT, WIDTH))
    matrix, side, mean = np.zeros((size, size)), np.zeros(size), np.zeros(size)
    add_jointly(np.concatenate(packed), np.array(windows), weight, residual, matrix, side, mean)
    flat = jacobian.reshape(-1, size)
    weighted = flat * weight.reshape(-1, 1)
    assert np.allclose(matrix, weighted.T @ flat, rtol=1e-12, atol=1e-12)
    assert np.allclose(side, weighted.T @ residual.ravel(), rtol=1e-12, atol=1e-12)
    assert np.allclose(mean, weighted.sum(axis=0), rtol=1e-12, atol=1e-12)
