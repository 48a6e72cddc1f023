"""Ghosts of an iris of straight blades: found and fitted as such, and round ones as round."""

from dataclasses import replace

import numpy as np
import pytest
from planted_run import shape, views

from flarewright.kernels.measure_hough import outline
from flarewright.kernels.measure_pupil import FIRST_DISC
from flarewright.measure.anew import begun_anew
from flarewright.measure.find import rims_of
from flarewright.measure.fit import render
from flarewright.measure.footprint import overlap
from flarewright.measure.found import Found
from flarewright.measure.fragments import joined
from flarewright.measure.grow import Growth
from flarewright.measure.joint import lit
from flarewright.measure.numbers import blades_of, with_blades
from flarewright.measure.pursuit import pursue
from flarewright.measure.settle import Settling, settle
from flarewright.model.ghost_model import Blades

IRIS = Blades(count=5, first_deg=70.0)


def bladed(kind, *numbers):
    one = shape(*numbers)
    return replace(one, numbers=with_blades(one.numbers, kind))


def test_numbers_tell_the_blades_and_nothing_else_changes():
    numbers = shape(-60.0, 20.0, 1.0).numbers
    assert blades_of(numbers) is None
    assert blades_of(with_blades(numbers, IRIS)) == IRIS
    assert np.array_equal(with_blades(with_blades(numbers, IRIS), None), numbers)


def test_an_odd_iris_may_be_upside_down_and_an_even_one_is_the_same():
    assert rims_of(None) == [None]
    assert rims_of(Blades(count=6, first_deg=1.0)) == [None, Blades(count=6, first_deg=1.0)]
    assert rims_of(IRIS) == [None, IRIS, Blades(count=5, first_deg=250.0)]


@pytest.mark.parametrize("blades", [0, 5, 6])
def test_an_outline_has_the_area_pi_and_its_normals(blades):
    spots = np.empty((4000, 4))
    outline(blades, 0.3, spots)
    x, y = spots[:, 0], spots[:, 1]
    assert abs(0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))) == pytest.approx(np.pi, rel=1e-2)
    along = np.roll(spots[:, :2], -1, axis=0) - spots[:, :2]
    # but at the corners the way along is at right angles to the normal
    assert np.median(np.abs((along * spots[:, 2:]).sum(axis=1))) < 1e-5
    assert ((spots[:, :2] * spots[:, 2:]).sum(axis=1) > 0.0).all()
    if blades:
        # a side lies in direction 0.3, rows counting downwards
        reach = x * np.cos(0.3) - y * np.sin(0.3)
        assert reach.max() == pytest.approx(np.sqrt(np.pi / (blades * np.tan(np.pi / blades))), rel=1e-6)


@pytest.mark.parametrize("rim", rims_of(IRIS))
def test_a_fit_takes_the_rim_that_fits(rim):
    shown = views([bladed(rim, -60.0, 26.0, 1.0)], angles=(8.0, 15.0, 22.0))
    other = rims_of(IRIS)[rims_of(IRIS).index(rim) - 1]
    start = bladed(other, -62.0, 25.0, 0.9)
    how = Settling(rounds=1, most=Growth(order=1, discs=0))
    (ghost,) = settle([Found((start,) * 3, 0, 2)], shown, how=how, iris=IRIS)
    assert [blades_of(one.numbers) for one in ghost.shapes] == [rim] * 3
    assert ghost.shapes[1].numbers[0] == pytest.approx(-60.0, abs=0.2)


def test_a_disc_that_stood_for_blades_goes_when_they_are_known():
    """As a search leaves a polygon that it took for round: a disc cuts one side."""
    shown = views([bladed(IRIS, -60.0, 26.0, 1.0)], angles=(8.0, 15.0, 22.0))
    start = shape(-60.0, 27.0, 0.9)
    start.numbers[FIRST_DISC : FIRST_DISC + 3] = 1.2, 0.0, 1.2
    how = Settling(rounds=1, most=Growth(order=1, discs=1))
    (ghost,) = settle([Found((replace(start, discs=1),) * 3, 0, 2)], shown, how=how, iris=IRIS)
    for one in ghost.shapes:
        assert one.discs == 0
        assert blades_of(one.numbers) == IRIS


@pytest.mark.slow
def test_each_ghost_gets_the_rim_that_it_has():
    kinds = [IRIS, None, Blades(count=5, first_deg=250.0)]
    planted = [bladed(IRIS, -110.0, 26.0, 1.0), bladed(None, 60.0, 20.0, 0.6), bladed(kinds[2], 95.0, 30.0, 0.4)]
    shown = views(planted, angles=np.linspace(2.0, 24.0, 12), roll_deg=20.0)
    masks = [np.ones(shown[0].variance.shape[:2], bool)] * len(shown)
    found = joined(lit(pursue(shown, masks, iris=IRIS, most=6), shown), shown)
    found = lit(begun_anew(found, shown), shown)
    ghosts = settle(found, shown, iris=IRIS)
    assert len(ghosts) == 3
    for one, kind in zip(planted, kinds, strict=True):
        shared = [overlap(one, ghost.shapes[1], shown) for ghost in ghosts]
        assert max(shared) > 0.9
        assert blades_of(ghosts[int(np.argmax(shared))].shapes[1].numbers) == kind


def test_blades_stand_still_when_the_light_rolls():
    one = bladed(IRIS, 0.0, 30.0, 1.0)
    one = replace(one, numbers=np.where(np.arange(one.numbers.size) == 21, 0.0, one.numbers))
    for k in (1, 2, 3, 11, 12, 13, 21, 22):
        one.numbers[k] = 0.0
    pictures = [render(one, views((), angles=[12.0], roll_deg=roll)[0]) for roll in (0.0, 40.0, 180.0)]
    assert np.allclose(pictures[0], pictures[1], atol=2e-2)
    assert np.allclose(pictures[0].sum(), pictures[2].sum())
    assert np.abs(pictures[0] - pictures[2]).max() < 2e-2
