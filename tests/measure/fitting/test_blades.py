"""Ghosts of an iris with straight blades are detected and fitted as polygons, and round ones as round."""

from dataclasses import replace

import numpy as np
import pytest
from planted_run import shape, views

from flarewright.kernels.ghost_model.hough import rim_outline_points
from flarewright.kernels.ghost_model.pupil_mesh import FIRST_DISC
from flarewright.measure.core.parameter_vector import blades_of, with_blades
from flarewright.measure.core.rim_kinds import rims_of
from flarewright.measure.detection.join_ghosts import join_ghosts
from flarewright.measure.detection.matching_pursuit import pursue
from flarewright.measure.fitting.alternating_fit import fit_all
from flarewright.measure.fitting.detected_ghost import DetectedGhost
from flarewright.measure.fitting.footprint import overlap
from flarewright.measure.fitting.ghost_fit import render
from flarewright.measure.fitting.joint_intensities import solve_intensities
from flarewright.measure.fitting.restart import restart_jointly
from flarewright.measure.fitting.settings import FitSettings, Growth
from flarewright.model.measurement.ghost_model import Blades

IRIS = Blades(count=5, first_deg=70.0)


def bladed(kind, *numbers):
    one = shape(*numbers)
    return replace(one, numbers=with_blades(one.numbers, kind))


def test_blades_are_stored_in_the_parameters():
    numbers = shape(-60.0, 20.0, 1.0).numbers
    assert blades_of(numbers) is None
    assert blades_of(with_blades(numbers, IRIS)) == IRIS
    assert np.array_equal(with_blades(with_blades(numbers, IRIS), None), numbers)


def test_an_odd_iris_may_be_inverted():
    assert rims_of(None) == [None]
    assert rims_of(Blades(count=6, first_deg=1.0)) == [None, Blades(count=6, first_deg=1.0)]
    assert rims_of(IRIS) == [None, IRIS, Blades(count=5, first_deg=250.0)]


@pytest.mark.parametrize("blades", [0, 5, 6])
def test_an_outline_has_the_area_pi_and_its_normals(blades):
    spots = np.empty((4000, 4))
    rim_outline_points(blades, 0.3, spots)
    x, y = spots[:, 0], spots[:, 1]
    assert abs(0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))) == pytest.approx(np.pi, rel=1e-2)
    along = np.roll(spots[:, :2], -1, axis=0) - spots[:, :2]
    # except at the corners the tangent is at right angles to the normal
    assert np.median(np.abs((along * spots[:, 2:]).sum(axis=1))) < 1e-5
    assert ((spots[:, :2] * spots[:, 2:]).sum(axis=1) > 0.0).all()
    if blades:
        # the normal of a side has direction 0.3; rows count downwards
        reach = x * np.cos(0.3) - y * np.sin(0.3)
        assert reach.max() == pytest.approx(np.sqrt(np.pi / (blades * np.tan(np.pi / blades))), rel=1e-6)


@pytest.mark.parametrize("rim", rims_of(IRIS))
def test_a_fit_selects_the_true_rim(rim):
    shown = views([bladed(rim, -60.0, 26.0, 1.0)], angles=(8.0, 15.0, 22.0))
    other = rims_of(IRIS)[rims_of(IRIS).index(rim) - 1]
    start = bladed(other, -62.0, 25.0, 0.9)
    how = FitSettings(rounds=1, most=Growth(order=1, discs=0))
    (ghost,) = fit_all([DetectedGhost((start,) * 3, 0, 2)], shown, settings=how, iris=IRIS)
    assert [blades_of(one.numbers) for one in ghost.shapes] == [rim] * 3
    assert ghost.shapes[1].numbers[0] == pytest.approx(-60.0, abs=0.2)


def test_a_disc_that_imitated_a_blade_is_removed():
    """Detection may fit a polygon as a round ghost with a disc that cuts one side."""
    shown = views([bladed(IRIS, -60.0, 26.0, 1.0)], angles=(8.0, 15.0, 22.0))
    start = shape(-60.0, 27.0, 0.9)
    start.numbers[FIRST_DISC : FIRST_DISC + 3] = 1.2, 0.0, 1.2
    how = FitSettings(rounds=1, most=Growth(order=1, discs=1))
    (ghost,) = fit_all([DetectedGhost((replace(start, discs=1),) * 3, 0, 2)], shown, settings=how, iris=IRIS)
    for one in ghost.shapes:
        assert one.discs == 0
        assert blades_of(one.numbers) == IRIS


@pytest.mark.slow
def test_each_ghost_gets_its_true_rim():
    kinds = [IRIS, None, Blades(count=5, first_deg=250.0)]
    planted = [bladed(IRIS, -110.0, 26.0, 1.0), bladed(None, 60.0, 20.0, 0.6), bladed(kinds[2], 95.0, 30.0, 0.4)]
    shown = views(planted, angles=np.linspace(2.0, 24.0, 12), roll_deg=20.0)
    masks = [np.ones(shown[0].variance.shape[:2], bool)] * len(shown)
    found = join_ghosts(solve_intensities(pursue(shown, masks, iris=IRIS, most=6), shown), shown)
    found = solve_intensities(restart_jointly(found, shown), shown)
    ghosts = fit_all(found, shown, iris=IRIS, settings=FitSettings(rounds=2))
    assert len(ghosts) == 3
    for one, kind in zip(planted, kinds, strict=True):
        shared = [overlap(one, ghost.shapes[1], shown) for ghost in ghosts]
        assert max(shared) > 0.9
        assert blades_of(ghosts[int(np.argmax(shared))].shapes[1].numbers) == kind


def test_blades_keep_their_orientation_when_the_light_rolls():
    one = bladed(IRIS, 0.0, 30.0, 1.0)
    one = replace(one, numbers=np.where(np.arange(one.numbers.size) == 21, 0.0, one.numbers))
    for k in (1, 2, 3, 11, 12, 13, 21, 22):
        one.numbers[k] = 0.0
    pictures = [render(one, views((), angles=[12.0], roll_deg=roll)[0]) for roll in (0.0, 40.0, 180.0)]
    assert np.allclose(pictures[0], pictures[1], atol=2e-2)
    assert np.allclose(pictures[0].sum(), pictures[2].sum())
    assert np.abs(pictures[0] - pictures[2]).max() < 2e-2
