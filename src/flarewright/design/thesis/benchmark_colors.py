"""The thesis' coating tests: find coatings with the ghost colours of known coatings (section 6.7)."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np

from ...model.project.design import Bounds
from ...render.scene.resolve import open_lens
from ...typing import Floats
from ..coatings.color_genes import ColorMeasure, colors_with
from ..coatings.color_search import ColorStep
from ..coatings.colors import ColorProblem, colors_of, indices_of, mirrors_of
from ..problem.grey_picture import grey_picture, psnr
from ..problem.objective import algorithm_2, diagonal_slope
from ..problem.prescription import Structure, structure_of, vector_of
from ..solvers.evolution_log import Limits
from ..solvers.solvers import Choice, chosen
from .trials import CASES, Trial

# centre wavelength where the thesis' program names none, nm
ELSEWHERE_NM = 550.0
# number of points of a trace
REPORTED = 60


@dataclass(frozen=True)
class ColorPoint:
    """The best coatings at a time: seconds, descents or evaluations so far, and Algorithm 2."""

    seconds: float
    searches: int
    fitness_algorithm2: float


@dataclass(frozen=True)
class ColorRun:
    """One seed of a test of coatings.

    Attributes
    ----------
    solver : str
        The text that the user gave.
    saw : {"ours", "algorithm2"}
        The fitness that it minimised.
    seed : int
    seconds, cpu_seconds : float
        Of the search.
    searches : int
        Descents; evaluations of a solver that evolves.
    fitness_algorithm2 : float
        As in the thesis: colours as fractions of their sum.
    psnr_db, psnr_black_db : float
        Of the picture in colour; of a black picture.
    recovered : bool
        Whether the centre wavelengths equal those of the target to 0.1 nm.
    trace : tuple of ColorPoint
        History of the best coatings.
    """

    solver: str
    saw: ColorMeasure
    seed: int
    seconds: float
    cpu_seconds: float
    searches: int
    fitness_algorithm2: float
    psnr_db: float
    psnr_black_db: float
    recovered: bool
    trace: tuple[ColorPoint, ...] = ()


@dataclass(frozen=True)
class ColorTask:
    """A test, prepared: the problem, the original coatings (M, 1) in nm, and the lens for the pictures."""

    problem: ColorProblem
    planted: Floats
    structure: Structure
    vector: Floats


def color_task(trial: Trial) -> ColorTask:
    """Prepare a test of coatings.

    Parameters
    ----------
    trial : Trial
        With `films`.

    Returns
    -------
    ColorTask
        For any kind of film its targets are the colours of quarter waves, as in the thesis' program, clipped to the
        bounds.
    """
    assert trial.films is not None
    case, bounds = CASES[trial.name], Bounds()
    lens = open_lens(case.lens).lens
    structure = structure_of(lens)
    vector = vector_of(lens, case.stop_diameter, lens.rows[-1].thickness)
    rows = mirrors_of(structure)
    wanted = [case.coatings_nm.get(int(k), ELSEWHERE_NM) for k in rows]
    planted = np.clip(np.array(wanted), *bounds.center_wavelength_nm)[:, None]
    count = len(structure.pairs)
    blank = ColorProblem(
        structure, indices_of(lens), np.ones((count, 3)), np.ones(count), np.zeros(count, np.bool_), "quarter-wave",
        bounds,
    )  # fmt: skip
    problem = replace(blank, targets=colors_of(blank, planted), kind=trial.films, layers=trial.layers)
    return ColorTask(problem, planted, structure, vector)


def run_colors(
    trial: Trial,
    *,
    seed: int = 0,
    limits: Limits | None = None,
    choice: Choice | None = None,
    measure: ColorMeasure = "algorithm2",
    threads: int | None = None,
) -> tuple[ColorRun, Floats, Floats]:
    """Run one seed of a test of coatings.

    Parameters
    ----------
    trial : Trial
        With `films`.
    seed : int
    limits : Limits, optional
        None: 10 seconds.
    choice : Choice, optional
        None: the built-in solver.
    measure : {"ours", "algorithm2"}
        Fitness for evolutionary solvers.
    threads : int, optional

    Returns
    -------
    run : ColorRun
    target, found : ndarray, shape (512, 512, 3)
    """
    task, solver = color_task(trial), chosen("ours") if choice is None else choice
    limits, steps = limits or Limits(10.0), list[ColorStep]()
    began, cpu = time.perf_counter(), time.process_time()
    found = colors_with(
        solver, task.problem, limits=limits, starts=limits.most or 10**6, seed=seed, measure=measure, threads=threads,
        note=steps.append,
    )  # fmt: skip
    seconds, cpu = time.perf_counter() - began, time.process_time() - cpu
    # as bright as the grey picture of the same ghosts: the thesis does not state the light's intensity
    gain = 2.0 / len(task.structure.pairs) / float(task.problem.targets.mean())
    pictures = [_picture(trial, task, gain * colors) for colors in (task.problem.targets, found.colors)]
    run = ColorRun(
        solver.label, measure if solver.evolves else "ours", seed, seconds, cpu, steps[-1].work,
        float(algorithm_2(task.problem.targets, found.colors)), psnr(pictures[0], pictures[1]),
        psnr(pictures[0], np.zeros_like(pictures[0])),
        trial.films == "quarter-wave" and bool(np.abs(found.values - task.planted).max() < 0.1),
        _trace(task.problem, steps),
    )  # fmt: skip
    return run, pictures[0], pictures[1]


def _picture(trial: Trial, task: ColorTask, colors: Floats) -> Floats:
    case = CASES[trial.name]
    return grey_picture(
        task.structure, task.vector, diagonal_slope(trial.angle_deg), blades=case.blades, gain=case.gain, colors=colors
    )


def _trace(problem: ColorProblem, steps: list[ColorStep]) -> tuple[ColorPoint, ...]:
    """Return Algorithm 2 over time, at some tens of steps."""
    shown = sorted({round(k) for k in np.linspace(0, len(steps) - 1, min(len(steps), REPORTED))})
    values = np.array([steps[k].values for k in shown])
    fitness = algorithm_2(problem.targets, colors_of(problem, values))
    return tuple(ColorPoint(steps[k].seconds, steps[k].work, float(one)) for k, one in zip(shown, fitness, strict=True))
