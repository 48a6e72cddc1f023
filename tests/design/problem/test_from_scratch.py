"""Design from scratch, without a start lens."""

import numpy as np
import pytest

from flarewright.design.finishing.candidate import outcomes
from flarewright.design.problem.from_scratch import random_ghost_targets, scratch_project, wanted_picture
from flarewright.design.problem.target import problem_of
from flarewright.design.solvers.pool_search import solve
from flarewright.model.project.design import GhostTarget


@pytest.mark.parametrize("searches", [250, pytest.param(4000, marks=pytest.mark.slow)])
def test_ghosts_along_a_line_are_met(searches):
    ghost_targets = tuple(GhostTarget(place_mm=p, radius_mm=r) for p, r in ((5.0, 2.0), (-8.0, 1.0), (12.0, 4.0)))
    problem, _ = problem_of(scratch_project(ghost_targets, (6.0, 6.0), surfaces=6, signed=False))
    state = solve(problem, seed=0, time_limit=None, most_searches=searches)
    best = outcomes(state, problem, count=1)[0]
    assert np.abs(best.residuals).max() < 0.2
    # ghosts without a target are large, so faint
    from flarewright.design.problem.ghosts import evaluate

    radii = np.abs(evaluate(best.structure, best.vector[None], 100.0)[0, :, 1])
    assert np.median(np.sort(radii)[3:]) > 20.0


def test_random_targets_follow_their_seed():
    assert random_ghost_targets(10, 3) == random_ghost_targets(10, 3)
    assert random_ghost_targets(10, 3) != random_ghost_targets(10, 4)
    assert len(random_ghost_targets(15, 0)) == 15


def test_the_wanted_picture_is_lit_where_ghosts_are():
    problem, _ = problem_of(scratch_project((GhostTarget(place_mm=10.0, radius_mm=2.0),), (5.0, 5.0)))
    picture = wanted_picture(problem.objective, 5.0, ghosts=10)
    y, x = np.nonzero(picture)
    assert (x.mean() + 0.5) * 46.6 / 512 - 23.3 == pytest.approx(10.0 / 2**0.5, abs=0.05)
    assert (y.mean() + 0.5) * 46.6 / 512 - 23.3 == pytest.approx(10.0 / 2**0.5, abs=0.05)
    # compare sums, as edge pixels are partly covered
    assert picture.sum() / picture.max() * (46.6 / 512) ** 2 == pytest.approx(2.598 * 2.0**2, rel=0.03)
