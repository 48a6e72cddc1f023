"""The figures of Van Acoleyen 2025, chapter 6, for runs of the same tests."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...io.images.html_page import html_page
from ...render.plots.chart import COLOURS, Series, chart, number
from ...render.plots.svg import Chart
from ...typing import Floats
from ..problem.grey_picture import screen_pixels
from .benchmark import BenchmarkRun
from .benchmark_colors import ColorRun
from .trials import Measure, Trial, figures_shown

Run = BenchmarkRun | ColorRun

_SHEET = (620, 330)
_MOMENTS = 80


@dataclass(frozen=True)
class ConvergenceCurve:
    """Fitness of one solver over time, the median of its seeds: seconds, and the values of each measure by its key."""

    solver: str
    seconds: Floats
    values: dict[str, Floats]


def curves(trial: Trial, runs: Sequence[Run]) -> tuple[ConvergenceCurve, ...]:
    """Return each solver's fitness over time.

    Parameters
    ----------
    trial : Trial
    runs : sequence of BenchmarkRun or ColorRun

    Returns
    -------
    tuple of ConvergenceCurve
        NaN until each of a solver's seeds has its first lens.
    """
    latest = max(run.seconds for run in runs)
    moments = np.linspace(0.0, latest, _MOMENTS)
    return tuple(
        ConvergenceCurve(solver, moments, {
            one.key: np.median([_at(run, one.key, moments) for run in runs if run.solver == solver], axis=0)
            for one in trial.measures if one.along
        })
        for solver in solvers_of(runs)
    )  # fmt: skip


def _at(run: Run, key: str, moments: Floats) -> Floats:
    """Return a measure of the best lens at each moment, shape (M,)."""
    when = np.array([point.seconds for point in run.trace])
    known = np.array([getattr(point, key) for point in run.trace], dtype=np.float64)
    last = np.searchsorted(when, moments, side="right") - 1
    out = np.full(len(moments), np.nan)
    out[last >= 0] = known[last[last >= 0]]
    return out


def solvers_of(runs: Sequence[Run]) -> tuple[str, ...]:
    """Return the solvers in the order of their first runs."""
    return tuple(dict.fromkeys(run.solver for run in runs))


def head(trial: Trial) -> tuple[str, ...]:
    """Return the titles of `comparison`'s columns."""
    measured = (word for one in trial.measures for word in (one.title, "best"))
    return ("solver", "seeds", "saw", "seconds", "CPU s", "evaluations", *measured)


def comparison(trial: Trial, runs: Sequence[Run]) -> list[tuple[str, ...]]:
    """Return a row for each solver with the columns of `head`: medians over its seeds, and the best of them.

    Parameters
    ----------
    trial : Trial
    runs : sequence of BenchmarkRun or ColorRun
    """
    rows: list[tuple[str, ...]] = []
    for solver in solvers_of(runs):
        mine = [run for run in runs if run.solver == solver]
        row = [solver, str(len(mine)), mine[0].saw]
        row += [_median(mine, key) for key in ("seconds", "cpu_seconds", "searches")]
        for one in trial.measures:
            values = [float(getattr(run, one.key)) for run in mine]
            row += [_median(mine, one.key), number(min(values) if one.best == "min" else max(values))]
        rows.append(tuple(row))
    return rows


def _median(runs: Sequence[Run], key: str) -> str:
    return number(float(np.median([getattr(run, key) for run in runs])))


def _fitness_charts(trial: Trial, runs: Sequence[Run]) -> tuple[Chart, ...]:
    """Draw fitness against time: as in the thesis, and for lenses also the best matching."""
    drawn, sheets = curves(trial, runs), []
    for place, one in enumerate(one for one in trial.measures if one.along):
        figure = figures_shown(trial, solvers_of(runs))[0]
        title = f"{one.title} (thesis{'' if figure == '-' else f', figure {figure}'})" if place == 0 else one.title
        lines = [
            Series(curve.solver, curve.seconds, curve.values[one.key], COLOURS[k % len(COLOURS)])
            for k, curve in enumerate(drawn)
        ]
        sheets.append(chart(title, lines, x_label="seconds", y_label="median of the seeds", logarithmic=True,
                            size=_SHEET, decades=10))  # fmt: skip
    return tuple(sheets)


def _seeds_chart(trial: Trial, runs: Sequence[Run], one: Measure) -> Chart:
    """Draw PSNR or SSIM of each seed; a line marks the thesis' best."""
    dots, solvers = [], solvers_of(runs)
    for k, solver in enumerate(solvers):
        mine = [run for run in runs if run.solver == solver]
        # side by side, so that equal dots do not overlap
        shift = 0.06 * (k - 0.5 * (len(solvers) - 1))
        dots.append(Series(solver, [run.seed + shift for run in mine], [getattr(run, one.key) for run in mine],
                           COLOURS[k % len(COLOURS)], 0.0))  # fmt: skip
    edge = Series("", [min(run.seed for run in runs) - 0.5, max(run.seed for run in runs) + 0.5], [np.nan] * 2)
    ticks = [(float(seed), str(seed)) for seed in sorted({run.seed for run in runs})]
    best = None if trial.thesis is None else getattr(trial.thesis, one.key)
    return chart(one.title, [*dots, edge], x_label="seed", y_label="line: the thesis' best", size=_SHEET,
                 bands=() if best is None else (best,), x_ticks=ticks)  # fmt: skip


def figure_data(trial: Trial, runs: Sequence[Run]) -> list[dict[str, Any]]:
    """Return what the figures show, ready for JSON.

    Parameters
    ----------
    trial : Trial
    runs : sequence of BenchmarkRun or ColorRun
    """
    about = figures_shown(trial, solvers_of(runs))
    lines = [
        {"solver": c.solver, "seconds": c.seconds.tolist(), **{key: y.tolist() for key, y in c.values.items()}}
        for c in curves(trial, runs)
    ]
    best = [
        {"solver": solver, **{
            one.key: [getattr(run, one.key) for run in runs if run.solver == solver]
            for one in trial.measures if not one.along
        }}
        for solver in solvers_of(runs)
    ]  # fmt: skip
    return [
        {"figure": about[0], "shows": "fitness against time, median of the seeds", "curves": lines},
        {"figure": about[1], "shows": "the picture of each seed", "solvers": best,
         "thesis": None if trial.thesis is None else asdict(trial.thesis)},
    ]  # fmt: skip


def thesis_words(trial: Trial) -> str:
    """Return the thesis' result in words; empty if it has no such test."""
    if trial.thesis is None:
        return ""
    parts = [f"{trial.thesis.psnr_db:g} dB"]
    parts += [] if trial.thesis.ssim is None else [f"SSIM {trial.thesis.ssim:g}"]
    parts += [] if trial.thesis.seconds is None else [f"{trial.thesis.seconds:g} s on eight cores"]
    return f"thesis, best run: {', '.join(parts)}"


def write_figures(trial: Trial, runs: Sequence[Run], pictures: Sequence[tuple[str, Floats]]) -> str:
    """Return the figures as a self-contained HTML page.

    Parameters
    ----------
    trial : Trial
    runs : sequence of BenchmarkRun or ColorRun
    pictures : sequence of (str, ndarray)
        With captions: the target, and the best of each solver.

    Returns
    -------
    str
        HTML.
    """
    thesis = thesis_words(trial)
    titles, keys = zip(*((one.title, one.key) for one in trial.measures), strict=True)
    return html_page(
        "benchmark", title=f"Solvers compared: {trial.title}", trial=trial, thesis=thesis[:1].upper() + thesis[1:],
        about=figures_shown(trial, solvers_of(runs)), head=head(trial), rows=comparison(trial, runs), runs=runs,
        fitness=_fitness_charts(trial, runs),
        seeds=tuple(_seeds_chart(trial, runs, one) for one in trial.measures if not one.along),
        pictures=[(_shown(one), words) for words, one in pictures],
        every_head=("solver", "seed", "seconds", "evaluations", *titles),
        every=[(run.solver, run.seed, number(run.seconds), run.searches, *(number(getattr(run, key)) for key in keys))
               for run in runs],
    )  # fmt: skip


def _shown(picture: Floats) -> NDArray[np.uint8]:
    """Return a picture, row 0 at the bottom, as 8 bit at half its size."""
    return screen_pixels(0.25 * (picture[::2, ::2] + picture[1::2, ::2] + picture[::2, 1::2] + picture[1::2, 1::2]))
