"""The assignment of least cost, compared with scipy's."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linear_sum_assignment

from flarewright.kernels.design.assignment import match


@given(st.integers(1, 12), st.integers(0, 6), st.integers(0, 2**32 - 1), st.booleans())
@settings(max_examples=150, deadline=None)
def test_no_assignment_costs_less(count, more, seed, whole):
    random = np.random.default_rng(seed)
    cost = random.normal(size=(count, count + more)) * 10.0 ** random.integers(-3, 6)
    if whole:
        # many ties
        cost = np.round(random.uniform(0.0, 4.0, cost.shape))
    chosen = np.empty(count, np.int64)
    match(cost, chosen)
    assert len(set(chosen.tolist())) == count
    least = cost[linear_sum_assignment(cost)].sum()
    assert np.isclose(cost[np.arange(count), chosen].sum(), least, rtol=1e-12, atol=1e-12 * np.abs(cost).max())
