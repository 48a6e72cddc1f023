"""Vectorised powers compared with NumPy's."""

import numpy as np

from flarewright.kernels.diffraction.fast_power import raise_lanes
from flarewright.kernels.jit.decorators import for_python

raised = for_python(raise_lanes)


def test_powers_are_those_of_numpy():
    rng = np.random.default_rng(1)
    base = np.concatenate([[0.0, 1.0, 0.5, 1e-12, 1e-200, 1.0 - 1e-16, 1e-310], rng.uniform(0.0, 1.0, 2000)])
    for power in (1e-6, 0.05, 1.0, 1.5, 2.0, 30.0):
        out = np.empty(base.size)
        raised(base, np.full(base.size, power), out, np.empty(base.size, np.int64))
        with np.errstate(under="ignore"):
            exact = np.where(base > 1e-300, base, 0.0) ** power
        np.testing.assert_allclose(out, exact, rtol=1e-12, atol=1e-300)
    out = np.empty(3)
    raised(np.array([0.0, 1.0, 1.0]), np.array([0.3, 0.3, 7.0]), out, np.empty(3, np.int64))
    assert list(out) == [0.0, 1.0, 1.0]
