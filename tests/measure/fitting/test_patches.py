"""Residuals of patches in contiguous memory equal those of each patch in NumPy, for any number of threads."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from planted_run import GHOSTS, views

from flarewright.kernels.ghost_model.jacobian import draw_with_changes
from flarewright.measure.core.parameters import Shape, free_numbers
from flarewright.measure.fitting.patches import equations, laid_out, patches_of, residual_in
from flarewright.measure.fitting.settings import FitSettings

GHOST = GHOSTS[2]
FREE = free_numbers(1, 1, 1, soft=True)


def drawn(patch):
    """Return the picture of the ghost in a patch, and its derivatives."""
    height, width = patch.pixels.shape
    plane, changes = np.zeros((height, width + 1)), np.zeros((height, width + 1, FREE.size))
    numbers = GHOST.numbers.copy()
    draw_with_changes(numbers, GHOST.discs, patch.sigma, FREE, patch.frame, patch.left, patch.top, plane, changes)
    return plane.cumsum(axis=1)[:, :width], changes.cumsum(axis=1)[:, :width]


@pytest.fixture(scope="module")
def patches():
    found = patches_of(GHOST, views(noise=0.05)[3:10], 1)
    # one pixel was not measured
    found[1].weight[4, 5] = 0.0
    return found


@pytest.mark.parametrize("offset", [True, False])
@pytest.mark.parametrize(("error", "tails"), [(0.0, True), (0.03, True), (0.03, False)])
def test_residuals_equal_those_of_numpy(patches, offset, error, tails):
    whole = laid_out(patches)
    miss = residual_in(GHOST, whole, offset=offset, error=error, tails=tails)
    matrices, sides = equations(GHOST, FREE, whole, miss, offset=offset)
    for k, patch in enumerate(patches):
        picture, changes = drawn(patch)
        level = error * np.maximum(np.abs(picture), np.abs(patch.pixels))
        weight = patch.weight / (1.0 + patch.weight * level**2)
        residual = patch.pixels - picture
        if offset:
            residual -= (weight * residual).sum() / weight.sum()
        if error > 0.0 and tails:
            weight = weight / (1.0 + weight * residual**2 / FitSettings().outlier ** 2)
        jacobian, flat = changes.reshape(-1, FREE.size), weight.reshape(-1, 1)
        matrix = jacobian.T @ (flat * jacobian)
        if offset:
            mean = (flat * jacobian).sum(axis=0)
            matrix -= np.outer(mean, mean) / weight.sum()
        wanted = (weight * residual**2).sum(), weight.sum(), np.count_nonzero(weight)
        np.testing.assert_allclose(miss.sums[k], wanted, rtol=1e-10)
        np.testing.assert_allclose(sides[k], jacobian.T @ (weight * residual).ravel(), rtol=1e-8, atol=1e-6)
        np.testing.assert_allclose(matrices[k], matrix, rtol=1e-8, atol=1e-8 * np.abs(matrix).max())
    assert miss.cost == pytest.approx(miss.costs.sum())
    assert miss.count == whole.pixels.size - 1


def test_threads_change_nothing(patches):
    whole = laid_out(patches)
    alone = residual_in(GHOST, whole, error=0.03)
    with ThreadPoolExecutor(3) as pool:
        shared = residual_in(GHOST, whole, error=0.03, pool=pool)
        both = equations(GHOST, FREE, whole, shared, pool=pool)
    np.testing.assert_array_equal(shared.sums, alone.sums)
    np.testing.assert_array_equal(shared.residual, alone.residual)
    for one, other in zip(both, equations(GHOST, FREE, whole, alone), strict=True):
        np.testing.assert_array_equal(one, other)


def test_no_patches_have_no_residual():
    miss = residual_in(GHOST, laid_out([]), error=0.03)
    assert (miss.cost, miss.count) == (0.0, 0)
    assert [each.shape for each in equations(GHOST, FREE, laid_out([]), miss)] == [(0, 16, 16), (0, 16)]


def test_a_smaller_area_halves_pictures_more_often():
    shown = views()[8:12]
    fine, rough = patches_of(GHOST, shown, 1), patches_of(GHOST, shown, 1, area=600)
    assert all(a.pixels.size > 3 * b.pixels.size for a, b in zip(fine, rough, strict=True))
    assert all(b.pixels.size < 2 * 600 for b in rough)


def test_a_shut_ghost_draws_nothing(patches):
    shut = GHOST.numbers.copy()
    shut[30:33] = 12.0, 0.0, 0.05
    dark = residual_in(Shape(shut, 1), laid_out(patches), offset=False, error=0.0)
    light = sum(float((patch.weight * patch.pixels**2).sum()) for patch in patches)
    assert dark.cost == pytest.approx(light, rel=1e-10)
