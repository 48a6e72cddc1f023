"""Means along a strip, compared with NumPy's correlations of its rows."""

import numpy as np

from flarewright.kernels.ghost_model.strip_means import means_along


def test_means_are_those_of_a_correlation():
    rng = np.random.default_rng(5)
    strip, masks = rng.normal(size=(7, 40)), rng.uniform(size=(3, 7, 9)) > 0.6
    means = np.full((3, 40), np.nan)
    means_along(strip, masks, means)
    for mask, mean in zip(masks, means, strict=True):
        assert np.isnan(mean[:4]).all()
        assert np.isnan(mean[-4:]).all()
        whole = sum(np.correlate(row, part) for row, part in zip(strip, mask.astype(float), strict=True)) / mask.sum()
        assert np.allclose(mean[4:-4], whole, rtol=1e-12, atol=1e-14)


def test_an_unmeasured_pixel_affects_only_the_means_that_read_it():
    strip, mask = np.ones((1, 21)), np.ones((1, 1, 5), bool)
    strip[0, 10] = np.nan
    means = np.empty((1, 21))
    means_along(strip, mask, means)
    assert np.isnan(means[0, 8:13]).all()
    assert np.array_equal(means[0, 2:8], np.ones(6))
