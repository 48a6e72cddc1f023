"""The factor from a median absolute deviation to a standard deviation is that of a normal distribution."""

import numpy as np
import pytest
from scipy.stats import norm

from flarewright.measure.core.robust import MAD_TO_SIGMA


def test_the_factor_is_that_of_a_normal_distribution():
    assert pytest.approx(1.0 / norm.ppf(0.75), abs=5e-5) == MAD_TO_SIGMA
    values = np.random.default_rng(3).normal(2.0, 0.7, 40_000)
    # the standard error of the estimate is 1.17 / sqrt(N) of it (Huber 1981, table 1.1.1); 4 of them
    spread = MAD_TO_SIGMA * np.median(np.abs(values - np.median(values)))
    assert spread == pytest.approx(0.7, rel=4 * 1.17 / 200)
