"""The lens tests of Van Acoleyen 2025, chapter 6: find a lens with the ghosts of a known lens."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from ...model.project.design import Bounds
from ...render.scene.resolve import open_lens
from ...typing import Floats
from ..finishing.null_space import lenses_with_same_ghosts
from ..problem.from_scratch import random_ghost_targets, scratch_project, wanted_picture
from ..problem.grey_picture import GAIN, OWN_STOP, grey_picture, psnr, psnr_with_gain, ssim
from ..problem.objective import diagonal_slope, fitness, fitness_thesis, own_objective
from ..problem.prescription import Structure, structure_of, structures, vector_of
from ..problem.problem import LensCandidate, Problem
from ..problem.target import problem_of
from ..solvers.evolution_log import Limits, Solution
from ..solvers.genes import Measure
from ..solvers.polish import STEPS, finer, finest
from ..solvers.solvers import Choice, chosen, make_ready, solve_with
from .trials import CASES, Trial

# number of points of a trace
REPORTED = 60


@dataclass(frozen=True)
class TracePoint:
    """The best lens at a time: seconds, local searches or evaluations so far, and both kinds of fitness."""

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
        The text that the user gave.
    saw : {"ours", "algorithm1"}
        The fitness that it minimised.
    seed : int
    seconds, cpu_seconds : float
        Of the search.
    searches : int
        Local searches; evaluations of a solver that evolves.
    fitness_algorithm1 : float
        As in the thesis: ghosts and targets sorted by size.
    fitness : float
        Best matching, mm^2.
    psnr_db, ssim, psnr_black_db, psnr_gain_db : float
        Of the thesis' grey picture; of a black picture; with the best gain.
    recovered : bool
        Whether it is the original lens: indices to 1e-3, thicknesses to 0.01 mm.
    trace : tuple of TracePoint
        History of the best lens.
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
    """A test, prepared: the problem, and how to draw its pictures.

    Attributes
    ----------
    problem : Problem
    slope : float
        Of the light source.
    blades : int
    gain : float
    lens : (Structure, ndarray) or None
        Lens whose ghosts are the targets; None: random targets.
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
            # new targets have no light level: a lens gets the level at which ghosts of equal size are equally bright
            target = wanted_picture(aim, OWN_STOP, ghosts=aim.wanted, gain=gain)
            gain *= OWN_STOP / float(vector[0]) * len(structure.pairs) / aim.wanted
        else:
            target = grey_picture(*self.lens, self.slope, entrance=aim.entrance, blades=self.blades, gain=gain)
        found = grey_picture(structure, vector, self.slope, entrance=aim.entrance, blades=self.blades, gain=gain)
        return target, found


def task_of(trial: Trial, seed: int = 0) -> Task:
    """Prepare a test.

    Parameters
    ----------
    trial : Trial
        Of a lens.
    seed : int
        For the random ghosts of a test without a lens.

    Returns
    -------
    Task
        Its problem does not contain the lens.
    """
    if trial.name == "scratch":
        ghost_targets = random_ghost_targets(trial.ghosts, seed)
        project = scratch_project(ghost_targets, (trial.angle_deg, trial.angle_deg), signed=not trial.unsigned)
        problem, _ = problem_of(project)
        return Task(problem, float(problem.objective.slopes[0]), 6, GAIN, None)
    case, slope = CASES[trial.name], diagonal_slope(trial.angle_deg)
    # the thesis' lenses have no rims
    bounds, lens = Bounds(hard=()), open_lens(case.lens).lens
    structure = structure_of(lens)
    vector = vector_of(lens, case.stop_diameter, lens.rows[-1].thickness)
    aim = own_objective(
        structure, vector, np.array([slope]), bounds=bounds, signed=not trial.unsigned,
        brightness="fresnel" if trial.fresnel else "none", extra=500.0,
    )  # fmt: skip
    found = structures(structure.rows - 1, len(structure.pairs))
    # the grey picture's levels are stop over ghost height, so brightness determines the stop's diameter
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
        Fitness for evolutionary solvers.
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
    started, cpu = time.perf_counter(), time.process_time()
    solution = solve_with(
        solver, task.problem, limits=limits or Limits(10.0), seed=seed, measure=measure, threads=threads
    )
    best = _best(task.problem, solution, solver)
    spent = time.perf_counter() - started, time.process_time() - cpu
    return _measured(task, solution, best, solver, spent, measure)


def _measured(
    task: Task, solution: Solution, best: LensCandidate, solver: Choice, spent: tuple[float, float], measure: Measure
) -> tuple[BenchmarkRun, Floats, Floats]:
    """Compare a result with its target; `spent` holds seconds of wall time and of processor time."""
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


def _best(problem: Problem, solution: Solution, solver: Choice) -> LensCandidate:
    """Return the best lens of a solver by the fitness that it saw; only the built-in solver polishes it."""
    if solver.evolves:
        return solution.steps[-1].best
    assert solution.state.best is not None
    fine = finer(problem)
    return lenses_with_same_ghosts(fine, finest(fine, solution.state.best, 4 * STEPS), seed=solution.state.seed)[0]


def _trace(problem: Problem, solution: Solution) -> tuple[TracePoint, ...]:
    """Return both kinds of fitness over time, at some tens of steps."""
    steps = solution.steps
    shown = sorted({round(k) for k in np.linspace(0, len(steps) - 1, min(len(steps), REPORTED))})
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
    """Return whether two prescriptions agree: indices to 1e-3, thicknesses to 0.01 mm."""
    rows = (len(one) - 1) // 3
    lengths, indices = slice(1, 1 + rows), slice(1 + 2 * rows, None)
    return bool(
        np.abs(one[lengths] - other[lengths]).max() < 0.01 and np.abs(one[indices] - other[indices]).max() < 1e-3
    )
