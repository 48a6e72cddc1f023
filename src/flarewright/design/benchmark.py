"""The tests of Van Acoleyen 2025, chapter 6: find the ghosts of a known lens without knowing the lens."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from ..model.design import Bounds
from ..render.prepare import load_lens
from .genes import Measure
from .hunt import Limits, Solution
from .objective import diagonal_slope, fitness, fitness_thesis, own_objective
from .picture import GAIN, grey_picture, psnr, psnr_with_gain, ssim
from .prescription import Structure, structure_of, structures, vector_of
from .search import STEPS, Candidate, Problem, State, polish
from .solvers import Choice, chosen, make_ready, solve_with

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Case:
    """A lens of the thesis and how its program draws it.

    Attributes
    ----------
    lens : str
        Shipped name.
    stop_diameter : float
        mm.
    blades : int
    gain : float
        For `picture.grey_picture`: the thesis does not tell the light's intensity, so that of each test makes a black
        picture as far from the target as its own is.
    """

    lens: str
    stop_diameter: float
    blades: int
    gain: float


CASES = {
    "heliar": Case("heliar-tronnier", 4.5, 6, GAIN),
    "canon": Case("canon-28-80", 10.5, 8, 0.76),
}

# what the thesis reached, best run: PSNR in dB, SSIM, seconds on eight cores
THESIS = {
    ("heliar", 5.45): (25.89, 0.9146, 600.0),
    ("heliar", 13.40): (30.38, 0.8512, 600.0),
    ("canon", 5.45): (27.20, 0.8898, 3600.0),
}

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


def problem_of_case(
    name: str, angle_deg: float, *, unsigned: bool = False, fresnel: bool = False
) -> tuple[Problem, Structure, Floats]:
    """Set a test up.

    Parameters
    ----------
    name : {"heliar", "canon"}
    angle_deg : float
        Yaw and pitch of the light.
    unsigned : bool
        Neither signs nor brightness, as the thesis.
    fresnel : bool
        The irradiance of bare surfaces is known as well.

    Returns
    -------
    problem : Problem
        The lens itself is not in it.
    structure : Structure
    vector : ndarray
        The lens, to compare with.
    """
    # the thesis' lenses have no rims
    case, bounds = CASES[name], Bounds(hard=())
    lens = load_lens(case.lens)
    structure = structure_of(lens)
    vector = vector_of(lens, case.stop_diameter, lens.rows[-1].thickness)
    aim = own_objective(
        structure, vector, np.array([diagonal_slope(angle_deg)]), bounds=bounds, signed=not unsigned,
        brightness="fresnel" if fresnel else "none", extra=500.0,
    )  # fmt: skip
    found = structures(structure.rows - 1, len(structure.pairs))
    # the grey picture's levels are stop over ghost height, so brightness tells the stop's diameter
    return Problem(aim, found, bounds, stop_diameter=None if unsigned else case.stop_diameter), structure, vector


def run_case(
    name: str,
    angle_deg: float,
    *,
    seed: int = 0,
    time_limit: float | None = 10.0,
    most: int | None = None,
    choice: Choice | None = None,
    measure: Measure = "algorithm1",
    unsigned: bool = False,
    fresnel: bool = False,
    threads: int | None = None,
    progress: Callable[[str], None] | None = None,
    cancelled: Callable[[], bool] | None = None,
) -> tuple[BenchmarkRun, Floats, Floats]:
    """Run one seed of a test.

    Parameters
    ----------
    name, angle_deg, unsigned, fresnel
        As in `problem_of_case`.
    seed : int
    time_limit : float, optional
        Seconds; None: no limit.
    most : int, optional
        End after about so many local searches or evaluations.
    choice : Choice, optional
        None: pools of local minima.
    measure : {"ours", "algorithm1"}
        The fitness that a solver sees that evolves.
    threads : int, optional
    progress : callable, optional
        Gets a line now and then.
    cancelled : callable, optional
        Asked now and then.

    Returns
    -------
    run : BenchmarkRun
    target, found : ndarray, shape (512, 512)
        Grey pictures.
    """
    problem, structure, vector = problem_of_case(name, angle_deg, unsigned=unsigned, fresnel=fresnel)
    solver = chosen("pools") if choice is None else choice
    make_ready(solver, problem, measure)

    def tell(now: State) -> None:
        if progress is not None:
            progress(f"{solver.label}, seed {seed}: {now.searches} {solver.unit}")

    cpu = time.process_time()
    limits = Limits(time_limit, most, tell, cancelled)
    solution = solve_with(solver, problem, limits=limits, seed=seed, measure=measure, threads=threads)
    cpu = time.process_time() - cpu
    return _measured(name, angle_deg, problem, (structure, vector), solution, solver, cpu, measure)


def _measured(
    name: str, angle_deg: float, problem: Problem, lens: tuple[Structure, Floats], solution: Solution, solver: Choice,
    cpu: float, measure: Measure,
) -> tuple[BenchmarkRun, Floats, Floats]:  # fmt: skip
    """Compare what a solver found with the lens."""
    best, state = _best(problem, solution, solver), solution.state
    found = problem.variables(best.structure).prescription(best.x)
    case, slope = CASES[name], diagonal_slope(angle_deg)
    pictures = [
        grey_picture(s, v, slope, entrance=problem.objective.entrance, blades=case.blades, gain=case.gain)
        for s, v in (lens, (best.structure, found))
    ]
    run = BenchmarkRun(
        solver.label, measure if solver.evolves else "ours", state.seed, state.seconds, cpu, state.searches,
        fitness_thesis(problem.objective, best.structure, found), fitness(problem.objective, best.structure, found),
        psnr(*pictures), ssim(*pictures), psnr(pictures[0], np.zeros_like(pictures[0])), psnr_with_gain(*pictures),
        best.structure == lens[0] and same_lens(lens[1], found), _trace(problem, solution),
    )  # fmt: skip
    return run, pictures[0], pictures[1]


def _best(problem: Problem, solution: Solution, solver: Choice) -> Candidate:
    """Return what a solver made best: what it saw counts, and nobody but ours polishes."""
    if solver.evolves:
        return solution.steps[-1].best
    assert solution.state.best is not None
    return _finest(problem, solution.state.best)


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


def _finest(problem: Problem, best: Candidate) -> Candidate:
    """Polish the best a last time."""
    polished = polish(problem, [(best.structure, best.x)], steps=4 * STEPS)[0]
    return min(polished, best, key=lambda one: one.cost)


def same_lens(one: Floats, other: Floats) -> bool:
    """Whether two prescriptions agree: indices to 1e-3, thicknesses to 0.01 mm."""
    rows = (len(one) - 1) // 3
    lengths, indices = slice(1, 1 + rows), slice(1 + 2 * rows, None)
    return bool(
        np.abs(one[lengths] - other[lengths]).max() < 0.01 and np.abs(one[indices] - other[indices]).max() < 1e-3
    )


def as_data(runs: list[BenchmarkRun]) -> dict[str, list[dict[str, object]]]:
    """Return runs ready for JSON."""
    return {"runs": [asdict(run) for run in runs]}
