"""Of the lenses with the same ghosts the most moderate: it has them still, and lies nearer to the middle."""

from dataclasses import replace

import numpy as np
import pytest
from planted import planted

from flarewright.design import freedom
from flarewright.design.freedom import alike, moderation, to_the_middle
from flarewright.design.polish import polish
from flarewright.design.prescription import Structure
from flarewright.design.problem import SOLVED, Candidate


def free_planted(*, signed):
    """The planted lens as a solution of a problem that leaves its stop's diameter free."""
    problem, structure, vector = planted(signed=signed)
    problem = replace(problem, stop_diameter=None)
    x = problem.variables(structure).search_point(vector)
    return problem, Candidate(0.0, structure, x)


@pytest.mark.parametrize("signed", [True, False])
def test_the_middle_has_the_same_ghosts_and_is_nearer(signed):
    problem, solved = free_planted(signed=signed)
    known = problem.variables(solved.structure)
    moved = to_the_middle(problem, solved)
    assert moved.cost <= SOLVED
    # the cost is told by the kernel, not by what moved it
    assert polish(problem, [(moved.structure, moved.x)], steps=0)[0].cost <= SOLVED
    assert moderation(known, moved.x) < 0.9 * moderation(known, solved.x)
    assert np.all((moved.x >= known.low) & (moved.x <= known.high))


def test_the_middle_does_not_depend_on_where_one_comes_from():
    problem, solved = free_planted(signed=True)
    one = to_the_middle(problem, solved)
    # another lens with the same ghosts, by a step along what they leave free
    known = problem.variables(solved.structure)
    pushed = np.clip(solved.x + 0.1 * np.random.default_rng(0).normal(size=len(solved.x)), known.low, known.high)
    pushed[1 + solved.structure.rows :] = solved.x[1 + solved.structure.rows :]
    other = polish(problem, [(solved.structure, pushed)], steps=300)[0]
    assert other.cost <= SOLVED
    assert np.abs(other.x - solved.x).max() > 0.01
    assert np.allclose(to_the_middle(problem, other).x, one.x, atol=1e-3)


def test_what_is_unsolved_stays():
    problem, solved = free_planted(signed=True)
    far = Candidate(1.0, solved.structure, solved.x)
    assert to_the_middle(problem, far) is far
    assert alike(problem, far) == (far,)


# one of the three other structures has the ghosts too
OTHER = Structure(4, (True, True, True, False, False, True, False))


@pytest.mark.parametrize("others", [(OTHER,), pytest.param(None, marks=pytest.mark.slow)])
def test_other_structures_have_the_ghosts_too(monkeypatch, others):
    problem, solved = free_planted(signed=False)
    if others:
        monkeypatch.setattr(freedom, "SEARCHES", 1000)
        assert {solved.structure, *others} < set(problem.structures)
        problem = replace(problem, structures=(solved.structure, *others))
    found = alike(problem, solved, seed=1)
    assert {one.structure for one in found} == {solved.structure, OTHER}
    assert len({one.structure for one in found}) == len(found)
    assert all(one.cost <= SOLVED for one in found)
    by = [moderation(problem.variables(one.structure), one.x) for one in found]
    assert by == sorted(by)
