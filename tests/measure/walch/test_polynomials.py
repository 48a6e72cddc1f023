"""Deviation of a polynomial: the scatter of its values, and 0 where it passes through all that count."""

import numpy as np
import pytest

from flarewright.measure.walch.polynomials import fit_polynomial

SPAN = (0.0, 18.0)


def curve_of(values):
    values = np.array(values)
    return fit_polynomial(np.linspace(*SPAN, values.size), values, np.ones(values.size), SPAN)


# one of several values is such an outlier that only the others count
@pytest.mark.parametrize(
    ("values", "off"),
    [([7.0], 1), ([70.02, 9.84, 9.88], 0), ([10.01, 69.94, 9.99, 10.02], 1), ([9.99, 9.97, 9.98, 70.01, 10.06], 3)],
)
def test_where_no_value_is_left_to_judge_by_no_deviation_is_known(values, off):
    curve = curve_of(values)
    through = np.polynomial.polynomial.polyval(np.linspace(-1.0, 1.0, len(values)), curve.coefficients)
    if len(values) > 1:
        assert np.delete(through, off) == pytest.approx(np.delete(values, off), abs=1e-6)
    assert curve.deviation == 0.0


@pytest.mark.parametrize("count", [4, 40])
def test_a_deviation_is_how_far_values_scatter(count):
    rng = np.random.default_rng(5)
    reported = [curve_of(3.0 + rng.normal(0.0, 0.2, count)).deviation for _ in range(200)]
    assert np.median(reported) == pytest.approx(0.2, rel=0.35)
    assert np.count_nonzero(reported) > 190


def test_one_value_far_off_many_takes_nothing_from_the_deviation():
    values = 3.0 + np.random.default_rng(6).normal(0.0, 0.2, 40)
    values[11] += 50.0
    assert curve_of(values).deviation == pytest.approx(0.2, rel=0.3)
