"""A cancelled search ends soon at any step and keeps its result; the tests count steps."""

from dataclasses import replace

import numpy as np
import pytest
from planted import planted

from flarewright.design.coatings import color_search
from flarewright.design.coatings.color_search import solve_colors
from flarewright.design.coatings.colors import color_problem
from flarewright.design.finishing import candidate, glass_rounding, null_space, traced_polish
from flarewright.design.finishing.candidate import nearest_outcomes, outcomes
from flarewright.design.problem.glass_list import glass_list
from flarewright.design.problem.problem import SOLVED
from flarewright.design.solvers.evolution_log import GRACE_S, until
from flarewright.design.solvers.least_squares import TRIES
from flarewright.design.solvers.pool_search import solve
from flarewright.model import Light, Project


class Flag:
    """A request to stop that becomes true at the n-th call."""

    def __init__(self, after):
        self.after, self.asked = after, 0

    def __call__(self):
        self.asked += 1
        return self.up

    @property
    def up(self):
        return self.asked > self.after


def counted(monkeypatch, module, name, flag):
    """Count calls of a function after the flag is up."""
    late, true = [], getattr(module, name)

    def call(*arguments, **named):
        if flag.up:
            late.append(name)
        return true(*arguments, **named)

    monkeypatch.setattr(module, name, call)
    return late


@pytest.fixture(scope="module")
def searched():
    problem, _, _ = planted()
    return problem, solve(problem, seed=0, time_limit=None, most_searches=100)


@pytest.mark.parametrize("after", [0, 3])
def test_glasses_are_chosen_to_the_end_with_few_steps(searched, monkeypatch, after):
    problem, state = searched
    listed = glass_list(("SCHOTT",), problem.bounds.n_d)
    bounds = problem.bounds.replace(n_d=(float(listed.n_d[0]), float(listed.n_d[-1])))
    problem = replace(problem, glasses=listed, bounds=bounds)
    flag = Flag(after)
    late = counted(monkeypatch, glass_rounding, "polish_within", flag)
    (found,) = outcomes(state, problem, count=3, over=flag)
    gaps = sum(found.structure.glass)
    assert len(found.glasses) == gaps
    # one glass per gap, one joint step, and the steps already running
    assert len(late) <= gaps + 1 + (glass_rounding.NEAREST * glass_rounding.WIDEST if after else 0)


def test_traced_rays_stop_bending_a_lens(searched, monkeypatch):
    problem, state = searched
    problem = replace(problem, traced=True)
    flag = Flag(0)
    late = counted(monkeypatch, traced_polish, "bounded_step", flag)
    judged = counted(monkeypatch, candidate, "traced_misfits", flag)
    (found,) = outcomes(state, problem, count=3, over=flag)
    assert late == judged == []
    assert found.fitness_traced[0] == found.fitness_traced[1]
    # a little later: the running step ends, and no further one starts
    flag = Flag(traced_polish.STEPS)
    late = counted(monkeypatch, traced_polish, "bounded_step", flag)
    outcomes(state, problem, count=3, over=flag)
    assert len(late) <= 1


def test_other_lenses_with_the_same_ghosts_are_not_looked_for_any_more(monkeypatch):
    problem, _, _ = planted(signed=False, begin=True)
    state = solve(problem, seed=0, time_limit=None, most_searches=60)
    assert state.best.cost <= SOLVED
    flag = Flag(0)
    late = counted(monkeypatch, null_space, "solve", flag) + counted(monkeypatch, null_space, "polish", flag)
    assert null_space.lenses_with_same_ghosts(problem, state.best, over=flag) == (state.best,)
    assert late == []


def test_lenses_that_break_their_limits_are_reported_in_time(searched):
    problem, state = searched
    problem = replace(problem, bounds=problem.bounds.replace(length=2.0, hard=("length",)))
    assert len(nearest_outcomes(state, problem, count=3, over=Flag(0))) == 1


@pytest.fixture(scope="module")
def coatings():
    """Return coatings of a lens, and the uninterrupted descents of a first batch."""
    problem, _ = color_problem(Project(lens="heliar-tronnier", lights=(Light(field_deg=(5.0, 5.0)),)), "film")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(color_search, "INDICES", 4)
        yield problem, solve_colors(problem, threads=1, starts=color_search.ROUND)


@pytest.mark.parametrize("after", [1, 40])
def test_descents_of_coatings_are_cut_off(coatings, monkeypatch, after):
    problem, whole = coatings
    flag = Flag(after)
    late = counted(monkeypatch, color_search, "_residuals", flag)
    found = solve_colors(problem, threads=1, cancelled=flag)
    low, high = problem.limits()
    assert np.all((found.values >= low) & (found.values <= high))
    # each descent of the first batch returns its cost once; a running step retries at most `TRIES` times
    assert len(late) <= color_search.ROUND + TRIES
    assert whole.cost <= found.cost


def test_what_time_is_left_to_finish():
    now, wanted = [0.0], [False]

    def clock():
        return now[0]

    over = until(10.0, lambda: wanted[0], clock=clock)
    now[0] = 9.9
    assert not over()
    now[0] = 10.0
    assert over()
    # Ctrl-C during finishing ends it at once
    now[0] = 0.0
    wanted[0] = True
    assert over()
    # after a search that Ctrl-C ended, a short grace time remains
    hurried = until(10.0, lambda: wanted[0], clock=clock)
    now[0] = 0.9 * GRACE_S
    assert not hurried()
    now[0] = GRACE_S
    assert hurried()
    # so does after the time limit
    wanted[0] = False
    late = until(-3.0, lambda: wanted[0], clock=clock)
    assert not late()
    now[0] += GRACE_S
    assert late()
