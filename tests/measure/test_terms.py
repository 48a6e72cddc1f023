"""What a fit expects of ghosts, against traced ghosts of a lens."""

from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest
from benchmarks.measure import terms
from benchmarks.measure.shoot import setup_of
from benchmarks.measure.terms import TERMS, differences, mapped_by, terms_of, whole_ghosts

from flarewright.measure.colours import ties
from flarewright.measure.fit import priors
from flarewright.measure.numbers import NUMBERS
from flarewright.measure.shape import Shape

WIDTH = 360
SETUP = setup_of("flektogon-35", WIDTH, 100, 5.6).steady


@contextmanager
def few_rays():
    """Trace less than half of the rays: of smooth ghosts they report the same numbers."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(terms, "_RAYS", (16, 16))
        yield


@pytest.fixture(scope="module")
def ghosts():
    """Rays of a lens' whole ghosts."""
    return list(whole_ghosts(SETUP).values())


@pytest.fixture(scope="module")
def traced(ghosts):
    """Numbers of a lens' whole ghosts over the standard deviations that a fit takes them to have, shape (paths, 30)."""
    found = []
    for rays in ghosts:
        numbers = terms_of(rays)
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


def test_colours_differ_by_what_ties_let_them():
    """Of blue and red against green: place, size and what changes with the field, within what a fit takes for usual."""
    with few_rays():
        apart = differences(SETUP)
    assert len(apart) > 60
    over = []
    for size, *numbers in apart:
        shape = Shape(np.zeros(NUMBERS))
        shape.numbers[10] = size
        over.append(np.array(numbers) * np.sqrt(ties(shape, np.arange(20), WIDTH, 0)))
    over = np.array(over)
    for k in (0, 3, 10, 13):
        # neither tight against most nor so loose that it tells nothing
        assert np.quantile(over[:, k], 0.6) < 1.5, k
        assert np.quantile(over[:, k], 0.95) > 0.3, k


def test_what_place_and_size_are_divided_by_follows_ghosts_that_terms_do_not(ghosts):
    for count in (4, 10):
        plain = np.array([mapped_by(rays, count, ())[0] for rays in ghosts])
        divided = np.array([mapped_by(rays, count, (2, 3))[0] for rays in ghosts])
        assert (divided < 1.05 * plain).all()
        for quantile in (0.5, 0.9):
            assert np.quantile(divided, quantile) < 0.7 * np.quantile(plain, quantile)
    # of some ghosts most of what ten terms miss is gone
    assert min(divided / plain) < 0.35


def test_a_map_that_is_divided_is_found_to_be_that(ghosts):
    rays = ghosts[0]
    ten = rays.ten
    numbers = np.array([40.0, 3.0, -2.0, 9.0, 25.0, 1.0, -3.0, 2.0])
    across, along = rays.maps(ten[:, :4])
    value = 1.0 + ten[:, [2, 3]] @ np.array([0.2, -0.6])
    planted = replace(rays, places=np.stack([across @ numbers, along @ numbers], axis=1) / value[:, None])
    off, divides = mapped_by(planted, 4, (2, 3))
    assert off < 1e-6
    assert divides == pytest.approx([0.2, -0.6], abs=1e-6)
    assert mapped_by(planted, 10, ())[0] > 1e-3
