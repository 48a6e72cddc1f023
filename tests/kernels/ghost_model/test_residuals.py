"""Residuals and weights of a drawn picture, compared with NumPy's."""

import numpy as np
import pytest

from flarewright.kernels.ghost_model.residuals import weigh_misfit


@pytest.mark.parametrize("error", [0.0, 0.03])
@pytest.mark.parametrize("outlier", [np.inf, 4.0])
@pytest.mark.parametrize("offset", [False, True])
def test_sums_are_those_of_the_whole_pictures(error, outlier, offset):
    random = np.random.default_rng(4)
    plane, pixels = random.normal(size=(6, 10)), random.normal(size=(6, 9))
    known = random.uniform(1.0, 3.0, size=(6, 9)) * (random.uniform(size=(6, 9)) > 0.3)
    weight, residual = np.full((6, 9), np.nan), np.full((6, 9), np.nan)
    cost, total, count = weigh_misfit(plane, pixels, known, error, outlier, offset, weight, residual)
    drawn = plane.cumsum(axis=1)[:, :9]
    expected = known / (1.0 + known * (error * np.maximum(np.abs(drawn), np.abs(pixels))) ** 2)
    missed = pixels - drawn - (np.average(pixels - drawn, weights=expected) if offset else 0.0)
    expected /= 1.0 + expected * missed**2 / outlier**2
    assert np.allclose(weight, expected, rtol=1e-12)
    assert np.allclose(residual, missed, rtol=1e-12, atol=1e-13)
    assert cost == pytest.approx((expected * missed**2).sum(), rel=1e-12)
    assert total == pytest.approx(expected.sum(), rel=1e-12)
    assert count == np.count_nonzero(known)


def test_without_measured_pixels_there_is_no_background():
    nothing = np.zeros((2, 3))
    weight, residual = np.empty((2, 3)), np.empty((2, 3))
    assert weigh_misfit(np.zeros((2, 4)), np.ones((2, 3)), nothing, 0.0, np.inf, True, weight, residual) == (
        0.0,
        0.0,
        0,
    )
    assert (residual == 1.0).all()
