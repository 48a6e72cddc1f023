"""The tests of Van Acoleyen 2025, chapter 6: find the ghosts of a known lens without knowing the lens."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..model.design import Bounds
from ..render.prepare import load_lens
from .freedom import alike
from .genes import Measure
from .hunt import Limits, Solution
from .objective import diagonal_slope, fitness, fitness_thesis, own_objective
from .picture import GAIN, OWN_STOP, grey_picture, psnr, psnr_with_gain, ssim
from .polish import STEPS, finer, finest
from .prescription import Structure, structure_of, structures, vector_of
from .problem import Candidate, Problem
from .scratch import random_wishes, scratch_project, wanted_picture
from .solvers import Choice, chosen, make_ready, solve_with
from .target import problem_of
from .trials import CASES, Trial

Floats = NDArray[np.float64]


# points of a trace
TOLD = 60


@dataclass(frozen=True)
class TracePoint:
    """The best lens at some time: seconds, local searches or evaluations so far, and both kinds of fitness."""

    seconds: float
    searches: int
    fitness_algorithm1: float
    fitness: float


@dataclass(frozen=True)
class BenchmarkRun:
    """One seed of a test.

    Attributes
    ----------
    solver : str
        As it was asked for.
    saw : {"ours", "algorithm1"}
        The fitness that it made least.
    seed : int
    seconds, cpu_seconds : float
        Of the search.
    searches : int
        Local searches; evaluations of a solver that evolves.
    fitness_algorithm1 : float
        The thesis' own, sorted by size.
    fitness : float
        Best matching, mm^2.
    psnr_db, ssim, psnr_black_db, psnr_gain_db : float
        Of the thesis' grey picture; of a black one; with the best gain.
    recovered : bool
        Whether it is the lens itself: indices to 1e-3, thicknesses to 0.01 mm.
    trace : tuple of TracePoint
        How the best lens came about.
    """

    solver: str
    saw: Measure
    seed: int
    seconds: float
    cpu_seconds: float
    searches: int
    fitness_algorithm1: float
    fitness: float
    psnr_db: float
    ssim: float
    psnr_black_db: float
    psnr_gain_db: float
    recovered: bool
    trace: tuple[TracePoint, ...] = ()


@dataclass(frozen=True)
class Task:
    """A test set up: what is searched, and how pictures of it are drawn.

    Attributes
    ----------
    problem : Problem
    slope : float
        Of the light.
    blades : int
    gain : float
    lens : (Structure, ndarray) or None
        Whose ghosts are to be found; None: those of nobody.
    """

    problem: Problem
    slope: float
    blades: int
    gain: float
    lens: tuple[Structure, Floats] | None

    def pictures(self, structure: Structure, vector: Floats) -> tuple[Floats, Floats]:
        """Draw the target and a lens, each of shape (512, 512)."""
        aim, gain = self.problem.objective, self.gain
        if self.lens is None:
            # wanted ghosts have no light of their own; a lens gets as much as makes a ghost of one size as bright
            target = wanted_picture(aim, OWN_STOP, ghosts=aim.wanted, gain=gain)
            gain *= OWN_STOP / float(vector[0]) * len(structure.pairs) / aim.wanted
        else:
            target = grey_picture(*self.lens, self.slope, entrance=aim.entrance, blades=self.blades, gain=gain)
        found = grey_picture(structure, vector, self.slope, entrance=aim.entrance, blades=self.blades, gain=gain)
        return target, found


def task_of(trial: Trial, seed: int = 0) -> Task:
    """Set a test up.

    Parameters
    ----------
    trial : Trial
        Of a lens.
    seed : int
        Scatters the ghosts where there is no lens.

    Returns
    -------
    Task
        The lens itself is not in its problem.
    """
    if trial.name == "scratch":
        wishes = random_wishes(trial.ghosts, seed)
        project = scratch_project(wishes, (trial.angle_deg, trial.angle_deg), signed=not trial.unsigned)
        problem, _ = problem_of(project)
        return Task(problem, float(problem.objective.slopes[0]), 6, GAIN, None)
    case, slope = CASES[trial.name], diagonal_slope(trial.angle_deg)
    # the thesis' lenses have no rims
    bounds, lens = Bounds(hard=()), load_lens(case.lens)
    structure = structure_of(lens)
    vector = vector_of(lens, case.stop_diameter, lens.rows[-1].thickness)
    aim = own_objective(
        structure, vector, np.array([slope]), bounds=bounds, signed=not trial.unsigned,
        brightness="fresnel" if trial.fresnel else "none", extra=500.0,
    )  # fmt: skip
    found = structures(structure.rows - 1, len(structure.pairs))
    # the grey picture's levels are stop over ghost height, so brightness tells the stop's diameter
    problem = Problem(aim, found, bounds, stop_diameter=None if trial.unsigned else case.stop_diameter)
    return Task(problem, slope, case.blades, case.gain, (structure, vector))


def run_trial(
    trial: Trial,
    *,
    seed: int = 0,
    limits: Limits | None = None,
    choice: Choice | None = None,
    measure: Measure = "algorithm1",
    threads: int | None = None,
) -> tuple[BenchmarkRun, Floats, Floats]:
    """Run one seed of a test of a lens.

    Parameters
    ----------
    trial : Trial
    seed : int
    limits : Limits, optional
        None: 10 seconds.
    choice : Choice, optional
        None: pools of local minima.
    measure : {"ours", "algorithm1"}
        The fitness that a solver sees that evolves.
    threads : int, optional

    Returns
    -------
    run : BenchmarkRun
    target, found : ndarray, shape (512, 512)
        Grey pictures.
    """
    task = task_of(trial, seed)
    solver = chosen("pools") if choice is None else choice
    make_ready(solver, task.problem, measure)
    begun, cpu = time.perf_counter(), time.process_time()
    solution = solve_with(
        solver, task.problem, limits=limits or Limits(10.0), seed=seed, measure=measure, threads=threads
    )
    best = _best(task.problem, solution, solver)
    spent = time.perf_counter() - begun, time.process_time() - cpu
    return _measured(task, solution, best, solver, spent, measure)


def _measured(
    task: Task, solution: Solution, best: Candidate, solver: Choice, spent: tuple[float, float], measure: Measure
) -> tuple[BenchmarkRun, Floats, Floats]:
    """Compare what a solver found with what it should find; `spent` are seconds, by the clock and of processors."""
    problem, state = task.problem, solution.state
    found = problem.variables(best.structure).prescription(best.x)
    pictures = task.pictures(best.structure, found)
    lens = task.lens
    run = BenchmarkRun(
        solver.label, measure if solver.evolves else "ours", state.seed, *spent, state.searches,
        fitness_thesis(problem.objective, best.structure, found), fitness(problem.objective, best.structure, found),
        psnr(*pictures), ssim(*pictures), psnr(pictures[0], np.zeros_like(pictures[0])), psnr_with_gain(*pictures),
        lens is not None and best.structure == lens[0] and same_lens(lens[1], found), _trace(problem, solution),
    )  # fmt: skip
    return run, pictures[0], pictures[1]


def _best(problem: Problem, solution: Solution, solver: Choice) -> Candidate:
    """Return what a solver made best: what it saw counts, and nobody but ours polishes and uses what is free."""
    if solver.evolves:
        return solution.steps[-1].best
    assert solution.state.best is not None
    fine = finer(problem)
    return alike(fine, finest(fine, solution.state.best, 4 * STEPS), seed=solution.state.seed)[0]


def _trace(problem: Problem, solution: Solution) -> tuple[TracePoint, ...]:
    """Tell both kinds of fitness along the way, at some tens of steps."""
    steps = solution.steps
    shown = sorted({round(k) for k in np.linspace(0, len(steps) - 1, min(len(steps), TOLD))})
    points = []
    for k in shown:
        best = steps[k].best
        vector = problem.variables(best.structure).prescription(best.x)
        points.append(
            TracePoint(
                steps[k].seconds, steps[k].work, fitness_thesis(problem.objective, best.structure, vector),
                fitness(problem.objective, best.structure, vector),
            )
        )  # fmt: skip
    return tuple(points)


def same_lens(one: Floats, other: Floats) -> bool:
    """Whether two prescriptions agree: indices to 1e-3, thicknesses to 0.01 mm."""
    rows = (len(one) - 1) // 3
    lengths, indices = slice(1, 1 + rows), slice(1 + 2 * rows, None)
    return bool(
        np.abs(one[lengths] - other[lengths]).max() < 0.01 and np.abs(one[indices] - other[indices]).max() < 1e-3
    )
