"""Averages of a corner's table against SciPy's interpolation and box filter."""

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator
from scipy.ndimage import uniform_filter

from flarewright.kernels.diffraction.corner_table import average_corner

FIRST = 25
TABLE = np.random.default_rng(4).random((21, 60)).astype(np.float32)


def averaged(ratios, shares, side):
    out = np.empty_like(TABLE)
    average_corner(TABLE, FIRST, np.array(ratios), np.array(shares), side, out)
    return out


def test_scales_about_the_corner_are_averaged():
    rows, columns = (np.arange(count, dtype=float) for count in TABLE.shape)
    read = RegularGridInterpolator((rows, columns), TABLE.astype(float))
    ratios, shares = (0.93, 1.0, 1.08), (0.2, 0.5, 0.3)
    expected = np.zeros(TABLE.shape)
    for ratio, share in zip(ratios, shares, strict=True):
        down, across = np.minimum(rows * ratio, 20.0), np.clip((columns - FIRST) * ratio + FIRST, 0.0, 59.0)
        expected += share * read(np.stack(np.meshgrid(down, across, indexing="ij"), axis=-1))
    np.testing.assert_allclose(averaged(ratios, shares, 0), expected, atol=2e-6)


@pytest.mark.parametrize("side", [1, 4, 70])
def test_squares_mirror_the_table_about_its_first_row(side):
    whole = np.concatenate([TABLE[:0:-1], TABLE]).astype(float)
    expected = uniform_filter(whole, 2 * side + 1, mode="nearest")[len(TABLE) - 1 :]
    np.testing.assert_allclose(averaged([1.0], [1.0], side), expected, atol=2e-6)
