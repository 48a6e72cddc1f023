"""The figures of Van Acoleyen 2025, chapter 6, drawn from runs of the same tests."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..render.chart import COLOURS, Series, chart, number
from ..render.figure import Figure
from ..render.page import figures, image, page, paragraph, section, table
from .benchmark import THESIS, BenchmarkRun

Floats = NDArray[np.float64]

# the thesis' figures: fitness against time, and the best picture
_ABOUT = {
    ("heliar", 5.45): ("6.1", "6.3"),
    ("heliar", 13.40): ("6.2", "6.4"),
    ("canon", 5.45): ("6.6", "6.7"),
}
# population sizes, compared at this test
_SIZES = ("heliar", 13.40, "6.5")
_SHEET = (620, 330)
_MOMENTS = 80

HEAD = ("solver", "seeds", "saw", "seconds", "CPU s", "evaluations", "Algorithm 1", "best", "fitness mm²", "best",
        "PSNR dB", "best", "SSIM", "best")  # fmt: skip


@dataclass(frozen=True)
class Curve:
    """One solver's fitness over time, the median of its seeds: seconds, Algorithm 1, and ours in mm²."""

    solver: str
    seconds: Floats
    algorithm1: Floats
    fitness: Floats


def curves(runs: Sequence[BenchmarkRun]) -> tuple[Curve, ...]:
    """Return each solver's fitness over time.

    Parameters
    ----------
    runs : sequence of BenchmarkRun

    Returns
    -------
    tuple of Curve
        NaN before the last of a solver's seeds has its first lens.
    """
    latest = max(run.seconds for run in runs)
    moments = np.linspace(0.0, latest, _MOMENTS)
    found = []
    for solver in solvers_of(runs):
        mine = [run for run in runs if run.solver == solver]
        values = np.array([_at(run, moments) for run in mine])
        middle = np.median(values, axis=0)
        found.append(Curve(solver, moments, middle[0], middle[1]))
    return tuple(found)


def _at(run: BenchmarkRun, moments: Floats) -> Floats:
    """Return both kinds of fitness of the best lens at each moment, shape (2, M)."""
    when = np.array([point.seconds for point in run.trace])
    known = np.array([[point.fitness_algorithm1, point.fitness] for point in run.trace]).reshape(-1, 2)
    last = np.searchsorted(when, moments, side="right") - 1
    out = np.full((2, len(moments)), np.nan)
    out[:, last >= 0] = known[last[last >= 0]].T
    return out


def solvers_of(runs: Sequence[BenchmarkRun]) -> tuple[str, ...]:
    """Return the solvers in the order of their first runs."""
    return tuple(dict.fromkeys(run.solver for run in runs))


def comparison(runs: Sequence[BenchmarkRun]) -> list[tuple[str, ...]]:
    """Return a row for each solver, as `HEAD` says: medians over its seeds, and the best of them.

    Parameters
    ----------
    runs : sequence of BenchmarkRun

    Returns
    -------
    list of tuple of str
    """
    rows: list[tuple[str, ...]] = []
    for solver in solvers_of(runs):
        mine = [run for run in runs if run.solver == solver]

        def median(key: str, mine: list[BenchmarkRun] = mine) -> str:
            return number(float(np.median([getattr(run, key) for run in mine])))

        def best(key: str, way: Any, mine: list[BenchmarkRun] = mine) -> str:
            return number(way(getattr(run, key) for run in mine))

        rows.append((
            solver, str(len(mine)), mine[0].saw, median("seconds"), median("cpu_seconds"), median("searches"),
            median("fitness_algorithm1"), best("fitness_algorithm1", min), median("fitness"), best("fitness", min),
            median("psnr_db"), best("psnr_db", max), median("ssim"), best("ssim", max),
        ))  # fmt: skip
    return rows


def fitness_charts(case: str, angle_deg: float, runs: Sequence[BenchmarkRun]) -> tuple[Figure, Figure]:
    """Draw fitness against time: Algorithm 1, as the thesis does, and the best matching.

    Parameters
    ----------
    case : str
    angle_deg : float
    runs : sequence of BenchmarkRun

    Returns
    -------
    tuple of Figure
    """
    drawn = curves(runs)
    names = (f"Algorithm 1 (thesis, figure {figure_numbers(case, angle_deg, runs)[0]})", "Best matching, mm²")
    sheets = []
    for title, values in zip(names, ([c.algorithm1 for c in drawn], [c.fitness for c in drawn]), strict=True):
        lines = [
            Series(curve.solver, curve.seconds, y, COLOURS[k % len(COLOURS)])
            for k, (curve, y) in enumerate(zip(drawn, values, strict=True))
        ]
        sheets.append(chart(title, lines, x_label="seconds", y_label="median of the seeds", logarithmic=True,
                            size=_SHEET, decades=10))  # fmt: skip
    return sheets[0], sheets[1]


def picture_charts(case: str, angle_deg: float, runs: Sequence[BenchmarkRun]) -> tuple[Figure, Figure]:
    """Draw PSNR and SSIM of each seed; a line is the thesis' best.

    Parameters
    ----------
    case : str
    angle_deg : float
    runs : sequence of BenchmarkRun

    Returns
    -------
    tuple of Figure
    """
    thesis = THESIS.get((case, angle_deg))
    sheets = []
    for place, (key, title) in enumerate((("psnr_db", "PSNR, dB"), ("ssim", "SSIM"))):
        dots = []
        for k, solver in enumerate(solvers_of(runs)):
            mine = [run for run in runs if run.solver == solver]
            # side by side, so that equal ones do not hide each other
            shift = 0.06 * (k - 0.5 * (len(solvers_of(runs)) - 1))
            dots.append(Series(solver, [run.seed + shift for run in mine], [getattr(run, key) for run in mine],
                               COLOURS[k % len(COLOURS)], 0.0))  # fmt: skip
        edge = Series("", [min(run.seed for run in runs) - 0.5, max(run.seed for run in runs) + 0.5], [np.nan] * 2)
        ticks = [(float(seed), str(seed)) for seed in sorted({run.seed for run in runs})]
        sheets.append(chart(title, [*dots, edge], x_label="seed", y_label="line: the thesis' best", size=_SHEET,
                            bands=() if thesis is None else (thesis[place],), x_ticks=ticks))  # fmt: skip
    return sheets[0], sheets[1]


def figure_numbers(case: str, angle_deg: float, runs: Sequence[BenchmarkRun]) -> tuple[str, str]:
    """Return which figures of the thesis show these tests: fitness against time, and the picture; "-" for none."""
    numbers = _ABOUT.get((case, angle_deg), ("-", "-"))
    names = [solver.partition(":") for solver in solvers_of(runs)]
    one_algorithm = len({name for name, _, _ in names}) == 1 and len(names) > 1
    return (_SIZES[2], numbers[1]) if one_algorithm and (case, angle_deg) == _SIZES[:2] else numbers


def figure_data(case: str, angle_deg: float, runs: Sequence[BenchmarkRun]) -> list[dict[str, Any]]:
    """Return what the figures show, ready for JSON.

    Parameters
    ----------
    case : str
    angle_deg : float
    runs : sequence of BenchmarkRun

    Returns
    -------
    list of dict
    """
    about = figure_numbers(case, angle_deg, runs)
    thesis = THESIS.get((case, angle_deg))
    lines = [
        {"solver": c.solver, "seconds": c.seconds.tolist(), "fitness_algorithm1": c.algorithm1.tolist(),
         "fitness": c.fitness.tolist()}
        for c in curves(runs)
    ]  # fmt: skip
    best = [
        {"solver": solver, "psnr_db": [run.psnr_db for run in mine], "ssim": [run.ssim for run in mine]}
        for solver in solvers_of(runs)
        for mine in [[run for run in runs if run.solver == solver]]
    ]
    return [
        {"figure": about[0], "shows": "fitness against time, median of the seeds", "curves": lines},
        {"figure": about[1], "shows": "PSNR and SSIM of each seed", "solvers": best,
         "thesis": None if thesis is None else {"psnr_db": thesis[0], "ssim": thesis[1], "seconds": thesis[2]}},
    ]  # fmt: skip


def report(case: str, angle_deg: float, runs: Sequence[BenchmarkRun], pictures: Sequence[tuple[str, Floats]]) -> str:
    """Write the figures as a page that needs nothing but itself.

    Parameters
    ----------
    case : str
    angle_deg : float
    runs : sequence of BenchmarkRun
    pictures : sequence of (str, ndarray)
        Grey pictures with words below them: the target, and each solver's best.

    Returns
    -------
    str
        HTML.
    """
    thesis, about = THESIS.get((case, angle_deg)), figure_numbers(case, angle_deg, runs)
    beside = "" if thesis is None else (
        f" The thesis' best run: {thesis[0]:g} dB, SSIM {thesis[1]:g}, {thesis[2]:g} s on eight cores."
    )  # fmt: skip
    black = runs[0].psnr_black_db
    shown = "".join(image(_shown(one), words, 256) for words, one in pictures)
    every = table(
        ("solver", "seed", "seconds", "evaluations", "Algorithm 1", "fitness mm²", "PSNR dB", "SSIM", "with gain dB"),
        [(r.solver, str(r.seed), number(r.seconds), str(r.searches), number(r.fitness_algorithm1), number(r.fitness),
          number(r.psnr_db), number(r.ssim), number(r.psnr_gain_db)) for r in runs],
    )  # fmt: skip
    return page(
        f"Solvers compared: {case}, {angle_deg:g} degrees",
        "The ghosts of a known lens are looked for without knowing the lens (Van Acoleyen 2025, chapter 6)." + beside,
        [
            section("Side by side", paragraph("Medians over the seeds, and the best of them."),
                    table(HEAD, comparison(runs))),
            section(f"Fitness against time (figure {about[0]})", figures(*fitness_charts(case, angle_deg, runs))),
            section(f"Pictures (figure {about[1]})", paragraph(f"A black picture has {black:.1f} dB."),
                    figures(*picture_charts(case, angle_deg, runs)), shown),
            section("Every run", every),
        ],
    )  # fmt: skip


def _shown(picture: Floats) -> NDArray[np.uint8]:
    """Return a grey picture, row 0 at the bottom, as eight bits, at a gamma of 2.2 and half its size."""
    small = 0.25 * (picture[::2, ::2] + picture[1::2, ::2] + picture[::2, 1::2] + picture[1::2, 1::2])
    grey = (np.power(np.clip(small[::-1], 0.0, 1.0), 1.0 / 2.2) * 255.0 + 0.5).astype(np.uint8)
    return np.repeat(grey[..., None], 3, axis=2)
