"""What a fit expects of ghosts, against traced ghosts of a lens."""

import numpy as np
import pytest
from benchmarks.measure.shoot import setup_of
from benchmarks.measure.terms import TERMS, terms_of

from flarewright.measure.fit import priors
from flarewright.measure.numbers import NUMBERS
from flarewright.measure.shape import Shape

WIDTH = 360


@pytest.fixture(scope="module")
def traced():
    """Numbers of a lens' whole ghosts over the standard deviations that a fit takes them to have, shape (paths, 30)."""
    lens = setup_of("flektogon-35", WIDTH, 100, 5.6).steady
    found = []
    for numbers in terms_of(lens).values():
        shape = Shape(np.concatenate([numbers, np.zeros(NUMBERS - 30)]))
        found.append(numbers * np.sqrt(priors(shape, np.arange(30), WIDTH)))
    return np.abs(np.array(found))


def test_three_in_four_are_no_larger_than_expected(traced):
    assert len(traced) > 30
    # a ghost that grows has brightness of first order
    for k, quantile in enumerate(np.quantile(traced[:, :24], 0.75, axis=0)):
        assert quantile < 2.0, (["f", "g", "I"][k // 10], TERMS[k % 10])


def test_aberrations_of_first_order_are_not_expected_to_be_much_larger_than_they_are(traced):
    # f's u, g's u and v, brightness' u and v: what nine in ten do not exceed is not far below
    for k in (1, 11, 12, 21, 22):
        assert np.quantile(traced[:, k], 0.98) > 0.2, k
