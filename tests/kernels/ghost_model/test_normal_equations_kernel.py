"""The normal equations of a fit, compared with NumPy's sums."""

import numpy as np
import pytest

from flarewright.kernels.ghost_model import normal_equations
from flarewright.kernels.jit.decorators import for_python

normal_equations = for_python(normal_equations.normal_equations)


@pytest.mark.parametrize(("height", "width", "count"), [(1, 1, 1), (5, 7, 3), (4, 16, 33)])
# with 0.7 most pixels have the same derivatives as the pixel before
@pytest.mark.parametrize("even", [0.0, 0.7])
def test_sums_are_those_of_the_whole_matrices(height, width, count, even):
    random = np.random.default_rng(3)
    changes = random.normal(size=(height, width + 1, count))
    changes[random.uniform(size=(height, width + 1)) < even] = 0.0
    # the last column of differences lies right of the window
    weight = random.uniform(size=(height, width)) * (random.uniform(size=(height, width)) > 0.3)
    residual = random.normal(size=(height, width))
    matrix, side, mean = np.full((count, count), np.nan), np.full(count, np.nan), np.full(count, np.nan)
    normal_equations(changes, weight, residual, matrix, side, mean)
    jacobian = changes.cumsum(axis=1)[:, :width].reshape(-1, count)
    weighted = jacobian * weight.reshape(-1, 1)
    assert np.allclose(matrix, weighted.T @ jacobian, rtol=1e-12, atol=1e-12)
    assert np.allclose(side, weighted.T @ residual.ravel(), rtol=1e-12, atol=1e-12)
    assert np.allclose(mean, weighted.sum(axis=0), rtol=1e-12, atol=1e-12)
    assert np.array_equal(matrix, matrix.T)


def test_pixels_without_weight_are_ignored():
    changes, weight, residual = np.ones((2, 4, 2)), np.ones((2, 3)), np.ones((2, 3))
    weight[1, 2], residual[1, 2] = 0.0, np.nan
    matrix, side, mean = np.empty((2, 2)), np.empty(2), np.empty(2)
    normal_equations(changes, weight, residual, matrix, side, mean)
    # derivatives are 1, 2, 3 along each row; the last pixel of the second row is ignored
    assert matrix[0, 0] == 19.0
    assert side[0] == 9.0
    assert mean[1] == 9.0
