"""Priors of a fit against traced ghosts of a lens."""

from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest
from benchmarks.measure import terms
from benchmarks.measure.shoot import setup_of
from benchmarks.measure.terms import TERMS, differences, mapped_by, terms_of, whole_ghosts

from flarewright.measure.core.parameter_vector import NUMBERS
from flarewright.measure.core.parameters import Shape
from flarewright.measure.fitting.colour_prior import ties
from flarewright.measure.fitting.ghost_fit import priors

WIDTH = 360
SETUP = setup_of("flektogon-35", WIDTH, 100, 5.6).steady


@contextmanager
def few_rays():
    """Trace a quarter of the rays: smooth ghosts yield the same parameters."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(terms, "_RAYS", (12, 12))
        yield


@pytest.fixture(scope="module")
def ghosts():
    """Return the rays of the unvignetted ghosts of a lens."""
    return list(whole_ghosts(SETUP).values())


@pytest.fixture(scope="module")
def traced(ghosts):
    """Return parameters of the unvignetted ghosts of a lens over the standard deviations of the prior, (paths, 30)."""
    found = []
    for rays in ghosts:
        numbers = terms_of(rays)
        shape = Shape(np.concatenate([numbers, np.zeros(NUMBERS - 30)]))
        found.append(numbers * np.sqrt(priors(shape, np.arange(30), WIDTH)))
    return np.abs(np.array(found))


def test_three_in_four_ghosts_are_within_the_prior(traced):
    assert len(traced) > 30
    # brightness has first order only, as in a fit
    for k, quantile in enumerate(np.quantile(traced[:, :24], 0.75, axis=0)):
        assert quantile < 2.0, (["f", "g", "I"][k // 10], TERMS[k % 10])


def test_the_prior_of_first_order_aberrations_is_not_too_wide(traced):
    # u of f, u and v of g, u and v of the brightness: the 98th percentile is not far below the prior
    for k in (1, 11, 12, 21, 22):
        assert np.quantile(traced[:, k], 0.98) > 0.2, k


@pytest.mark.slow
def test_colours_differ_within_the_prior():
    """Blue and red against green: position, size and their change with the field are within the prior spread."""
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
        # the prior is neither too tight for most ghosts nor too loose to matter
        assert np.quantile(over[:, k], 0.6) < 1.5, k
        assert np.quantile(over[:, k], 0.95) > 0.3, k


def test_a_denominator_describes_ghosts_better_than_more_terms(ghosts):
    for count in (4, 10):
        plain = np.array([mapped_by(rays, count, ())[0] for rays in ghosts])
        divided = np.array([mapped_by(rays, count, (2, 3))[0] for rays in ghosts])
        assert (divided < 1.05 * plain).all()
        for quantile in (0.5, 0.9):
            assert np.quantile(divided, quantile) < 0.7 * np.quantile(plain, quantile)
    # for some ghosts the denominator removes most of the misfit of ten terms
    assert min(divided / plain) < 0.35


def test_a_planted_denominator_is_recovered(ghosts):
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
