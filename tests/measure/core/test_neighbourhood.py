"""Sliding extremes and block means, compared with SciPy and with plain means."""

import numpy as np
import pytest
from scipy import ndimage

from flarewright.measure.core.binning import binned
from flarewright.measure.core.neighbourhood import brightest, darkest


@pytest.mark.parametrize("far", [0, 1, 2, 3, 7])
def test_largest_and_smallest_of_squares(far):
    pixels = np.random.default_rng(5).random((11, 14, 3))
    side = 2 * far + 1
    expected = ndimage.maximum_filter(pixels, (side, side, 1), mode="nearest")
    np.testing.assert_array_equal(brightest(pixels, far), expected)
    expected = ndimage.minimum_filter(pixels, (side, side, 1), mode="nearest")
    np.testing.assert_array_equal(darkest(pixels, far), expected)
    expected = ndimage.maximum_filter1d(pixels, side, axis=2, mode="nearest")
    np.testing.assert_array_equal(brightest(pixels, far, axes=[2]), expected)


@pytest.mark.parametrize("block", [1, 2, 3])
def test_blocks_are_averaged_and_incomplete_ones_dropped(block):
    pixels = np.random.default_rng(6).random((7, 10, 3)).astype(np.float32)
    means = binned(pixels, block)
    assert means.shape == (7 // block, 10 // block, 3)
    assert means.dtype == np.float64
    for row, column in ((0, 0), (means.shape[0] - 1, means.shape[1] - 1)):
        part = pixels[row * block : (row + 1) * block, column * block : (column + 1) * block]
        np.testing.assert_allclose(means[row, column], part.mean(axis=(0, 1), dtype=np.float64), rtol=1e-12)
    np.testing.assert_allclose(binned(pixels > 0.5, block)[0, 0], (pixels > 0.5)[:block, :block].mean(axis=(0, 1)))
