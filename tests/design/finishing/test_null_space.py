"""The most moderate of the lenses with the same ghosts: its ghosts are unchanged, and it is nearer to the middle."""

from dataclasses import replace

import numpy as np
import pytest
from planted import planted

from flarewright.design.finishing import null_space
from flarewright.design.finishing.null_space import lenses_with_same_ghosts, moderation, to_the_middle
from flarewright.design.problem.prescription import Structure
from flarewright.design.problem.problem import SOLVED, LensCandidate
from flarewright.design.solvers.polish import polish


def free_planted(*, signed):
    """Return the planted lens as a solution of a problem with a free stop diameter."""
    problem, structure, vector = planted(signed=signed)
    problem = replace(problem, stop_diameter=None)
    x = problem.variables(structure).search_point(vector)
    return problem, LensCandidate(0.0, structure, x)


@pytest.mark.parametrize("signed", [True, False])
def test_the_middle_has_the_same_ghosts_and_is_nearer(signed):
    problem, solved = free_planted(signed=signed)
    known = problem.variables(solved.structure)
    moved = to_the_middle(problem, solved)
    assert moved.cost <= SOLVED
    # take the cost from the kernel, independent of the code that moved the lens
    assert polish(problem, [(moved.structure, moved.x)], steps=0)[0].cost <= SOLVED
    assert moderation(known, moved.x) < 0.9 * moderation(known, solved.x)
    assert np.all((moved.x >= known.low) & (moved.x <= known.high))


def test_the_middle_does_not_depend_on_where_one_comes_from():
    problem, solved = free_planted(signed=True)
    one = to_the_middle(problem, solved)
    # another lens with the same ghosts, by a step in the null space
    known = problem.variables(solved.structure)
    pushed = np.clip(solved.x + 0.1 * np.random.default_rng(0).normal(size=len(solved.x)), known.low, known.high)
    pushed[1 + solved.structure.rows :] = solved.x[1 + solved.structure.rows :]
    other = polish(problem, [(solved.structure, pushed)], steps=300)[0]
    assert other.cost <= SOLVED
    assert np.abs(other.x - solved.x).max() > 0.01
    assert np.allclose(to_the_middle(problem, other).x, one.x, atol=1e-3)


def test_what_is_unsolved_stays():
    problem, solved = free_planted(signed=True)
    far = LensCandidate(1.0, solved.structure, solved.x)
    assert to_the_middle(problem, far) is far
    assert lenses_with_same_ghosts(problem, far) == (far,)


# one of the three other structures has the same ghosts
OTHER = Structure(4, (True, True, True, False, False, True, False))


@pytest.mark.parametrize("others", [(OTHER,), pytest.param(None, marks=pytest.mark.slow)])
def test_other_structures_have_the_ghosts_too(monkeypatch, others):
    problem, solved = free_planted(signed=False)
    if others:
        monkeypatch.setattr(null_space, "SEARCHES", 1000)
        assert {solved.structure, *others} < set(problem.structures)
        problem = replace(problem, structures=(solved.structure, *others))
    found = lenses_with_same_ghosts(problem, solved, seed=1)
    assert {one.structure for one in found} == {solved.structure, OTHER}
    assert len({one.structure for one in found}) == len(found)
    assert all(one.cost <= SOLVED for one in found)
    by = [moderation(problem.variables(one.structure), one.x) for one in found]
    assert by == sorted(by)
