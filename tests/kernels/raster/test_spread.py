"""Convolution tap by tap, against SciPy's."""

import numpy as np
import pytest
from scipy.signal import convolve

from flarewright.kernels.raster.spread import spread_taps


def spread(picture, kernel, first=(0, 0), size=None):
    height, width = (picture.shape[k] + kernel.shape[k] - 1 for k in (0, 1))
    light = np.zeros((*(size or (height, width)), 3), dtype=np.float32)
    spread_taps(picture, kernel, *first, light)
    return light


@pytest.fixture(scope="module")
def pair():
    rng = np.random.default_rng(3)
    picture, kernel = rng.random((13, 21, 3)).astype(np.float32), rng.random((5, 9)).astype(np.float32)
    kernel[rng.random(kernel.shape) < 0.3] = 0.0
    return picture, kernel


def test_it_is_the_convolution_of_each_channel(pair):
    picture, kernel = pair
    whole = np.stack([convolve(picture[..., c].astype(float), kernel.astype(float)) for c in range(3)], axis=2)
    np.testing.assert_allclose(spread(picture, kernel), whole, rtol=1e-5)


@pytest.mark.parametrize(("first", "size"), [((2, 3), (7, 11)), ((0, 25), (17, 4)), ((14, 0), (3, 29))])
def test_a_window_is_that_part_of_the_whole(pair, first, size):
    whole = spread(*pair)
    part = whole[first[0] : first[0] + size[0], first[1] : first[1] + size[1]]
    np.testing.assert_array_equal(spread(*pair, first, size), part)


def test_where_no_tap_reaches_there_is_exactly_nothing():
    picture = np.zeros((9, 9, 3), dtype=np.float32)
    picture[4, 4] = 1.0, 2.0, 3.0
    light = spread(picture, np.full((3, 3), 0.5, dtype=np.float32))
    lit = np.argwhere(light.any(axis=2))
    assert lit.min(axis=0).tolist() == [4, 4]
    assert lit.max(axis=0).tolist() == [6, 6]
    np.testing.assert_array_equal(light[5, 5], [0.5, 1.0, 1.5])
