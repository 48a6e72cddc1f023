"""Means over squares compared with sums over the pixels' overlaps."""

import numpy as np
import pytest

from flarewright.kernels.ghost_model.box_means import box_means


def overlaps(low, high, count):
    """Return the part of each pixel between two places."""
    return np.clip(np.minimum(high, np.arange(count) + 1.0) - np.maximum(low, np.arange(count)), 0.0, None)


@pytest.mark.parametrize("side", [1.3, 4.0, 30.0])
def test_means_use_measured_pixels_of_the_picture_only(side):
    rng = np.random.default_rng(4)
    picture = rng.normal(2.0, 1.0, (9, 13, 3)).astype(np.float32)
    picture[rng.uniform(size=picture.shape) < 0.2] = np.nan
    x, y = rng.uniform(-3.0, 16.0, 40), rng.uniform(-3.0, 12.0, 40)
    mean, part = np.full((2, 40, 3), np.nan)
    box_means(picture, x, y, side, mean, part)
    known = np.isfinite(picture)
    for k in range(40):
        rows = overlaps(y[k] - 0.5 * side, y[k] + 0.5 * side, 9)
        columns = overlaps(x[k] - 0.5 * side, x[k] + 0.5 * side, 13)
        weight = np.outer(rows, columns)[..., None] * known
        share = weight.sum(axis=(0, 1))
        np.testing.assert_allclose(part[k], share / side**2, atol=1e-9)
        light = (weight * np.where(known, picture, 0.0)).sum(axis=(0, 1))
        wanted = np.where(part[k] > 1e-6, light / np.maximum(share, 1e-30), 0.0)
        np.testing.assert_allclose(mean[k], wanted, rtol=1e-6, atol=1e-6)
