"""`flarewright design benchmark`: the tests of Van Acoleyen 2025, to compare solvers with each other and the thesis."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ...errors import ProjectError
from ..common import check_place, console, print_json, print_remark, search_status, stop_on_interrupt, write_text
from ..option_record import with_options
from ..partial_work import partial_work
from ..shared_options import Json
from .checks import check_color_fitness, check_films, check_fitness, check_time

if TYPE_CHECKING:
    from ...design.solvers.evolution_log import Limits
    from ...design.solvers.pool_search import Observer
    from ...design.solvers.solvers import Choice
    from ...design.thesis.figures import Run
    from ...design.thesis.trials import Name, Trial
    from ...typing import Floats, Report

    # a run, the picture of its target, and that of what it found
    Done = tuple[Run, Floats, Floats]

EPILOG = (
    "Examples:\n\nflarewright design benchmark heliar --angle 5.45 --seeds 10 --time 10\n\n"
    "flarewright design benchmark canon --time 120 --picture canon.png --json\n\n"
    "flarewright design benchmark heliar --coatings quarter-wave --solver ours --solver sade --time 30\n\n"
    "flarewright design benchmark scratch --ghosts 10 --unsigned --time 60\n\n"
    "flarewright design benchmark heliar --unsigned --solver pools --solver pso --solver sade --report compared.html"
)


@dataclass(frozen=True, kw_only=True)
class BenchmarkOptions:
    """Options of `flarewright design benchmark`. None or empty: not given."""

    case: Annotated[
        str,
        typer.Argument(
            metavar="heliar|canon|scratch", help="Lens whose ghosts are the targets; scratch: random ghosts."
        ),
    ]
    angle_deg: Annotated[float, typer.Option("--angle", help="Yaw and pitch of the light, degrees.")] = 5.45
    coatings: Annotated[
        str | None, typer.Option(help="Find colours instead, by quarter-wave or free films, or up to 2 or 3 films.")
    ] = None
    ghosts: Annotated[int, typer.Option(min=1, max=60, help="Number of random ghosts per seed, for scratch.")] = 5
    seeds: Annotated[int, typer.Option(min=1, max=1000, help="Number of seeds, from 0 (default: 1).")] = 1
    time_s: Annotated[float | None, typer.Option("--time", help="Seconds per seed (default: 10).")] = None
    cpu_s: Annotated[
        float | None,
        typer.Option(
            "--cpu-time", help="Processor seconds per seed of all cores, instead of --time, for a busy computer."
        ),
    ] = None
    solvers: Annotated[
        list[str],
        typer.Option(
            "--solver",
            help="Solver: pools (ours), pso, sade, de, de1220, gaco or cmaes; pso:5x30 is 5 islands of 30 per "
            "gene. May be repeated to compare.",
        ),
    ] = field(default_factory=list)
    fitness: Annotated[
        str | None,
        typer.Option(
            help="Fitness of evolutionary solvers: algorithm1 (algorithm2 for colours), as the thesis, or ours."
        ),
    ] = None
    unsigned: Annotated[
        bool, typer.Option("--unsigned", help="Use sizes without sign and no brightness, as the thesis.")
    ] = False
    fresnel: Annotated[
        bool, typer.Option("--fresnel", help="Use the irradiance of bare surfaces too, to recover the lens itself.")
    ] = False
    picture: Annotated[
        Path | None, typer.Option(help="Write target and result of the last seed side by side, *.png.")
    ] = None
    report: Annotated[Path | None, typer.Option(help="Write tables, charts and pictures as a page, *.html.")] = None
    threads: Annotated[int | None, typer.Option(min=1, help="Number of threads, for ours (default: all cores).")] = None
    as_json: Json = False


@with_options(BenchmarkOptions)
def benchmark(options: BenchmarkOptions) -> None:
    """Search lenses or coatings with the ghosts of a known lens, and compare the pictures.

    Finished runs are kept until the end: after an interruption, the same command continues.
    """
    trial = _trial(options)
    limits = _limits(options.time_s, options.cpu_s)
    measure = _fitness(options.fitness, trial)
    for place, suffix in ((options.picture, ".png"), (options.report, ".html")):
        if place is not None:
            check_place(place, suffix)
    from ...design.thesis.figures import figure_data

    done = _run_all(trial, options, limits, measure)
    runs = [run for run, _, _ in done]
    _write(trial, options, done)
    if options.as_json:
        print_json({"runs": [asdict(run) for run in runs], "figures": figure_data(trial, runs)})
    else:
        _print(trial, runs)


def _trial(options: BenchmarkOptions) -> Trial:
    """Return the test of the options, checked."""
    from ...design.thesis.trials import Trial

    name: Name
    match options.case:
        case "heliar" | "canon" | "scratch":
            name = options.case
        case _:
            raise ProjectError(f"there is no test {options.case!r}; choose heliar or canon, or scratch")
    if not 0.0 < options.angle_deg < 60.0:
        raise ProjectError(
            f"--angle {options.angle_deg:g} is no angle for this test; choose one above 0 and below 60 degrees"
        )
    if options.unsigned and options.fresnel:
        raise ProjectError("--unsigned excludes the brightness and --fresnel needs it; keep one")
    if name == "scratch" and (options.coatings is not None or options.fresnel):
        raise ProjectError("scratch has no lens, so neither --coatings nor --fresnel; choose heliar or canon")
    kind, layers = (None, 1) if options.coatings is None else check_films(options.coatings, "--coatings")
    return Trial(name, options.angle_deg, options.ghosts, kind, layers, options.unsigned, options.fresnel)


def _limits(time_s: float | None, cpu_s: float | None) -> Limits:
    """Return the time limits of each seed, checked."""
    from ...design.solvers.evolution_log import Limits

    if time_s is not None and cpu_s is not None:
        raise ProjectError("--time and --cpu-time both limit a seed; keep one")
    if cpu_s is not None:
        check_time(cpu_s, "--cpu-time")
        return Limits(None, cpu_s=cpu_s)
    limits = Limits(10.0 if time_s is None else time_s)
    check_time(limits.time_s or 0.0)
    return limits


def _fitness(fitness: str | None, trial: Trial) -> str:
    """Return the fitness of `--fitness`, checked; that of the thesis by default."""
    if trial.films is not None:
        return "algorithm2" if fitness is None else check_color_fitness(fitness)
    return "algorithm1" if fitness is None else check_fitness(fitness)


def _run_all(trial: Trial, options: BenchmarkOptions, limits: Limits, measure: Any) -> list[Done]:
    """Run every solver with every seed until Ctrl-C, from where an interrupted command was."""
    from ...design.solvers.solvers import chosen

    choices = [chosen(text) for text in options.solvers or ["pools"]]
    place = options.report or options.picture
    labels = [one.label for one in choices]
    inputs = [repr(trial), options.seeds, labels, options.time_s, options.cpu_s, measure]
    _register_runs()
    with (
        stop_on_interrupt() as asked,
        partial_work(place, inputs, "run", "runs") as steps,
        search_status() as progress,
    ):
        run_one = partial(_run_one(trial), trial, measure=measure, threads=options.threads)
        done: list[Done] = []
        for choice, seed in product(choices, range(options.seeds)):
            if done and asked():
                break
            shown = replace(limits, progress=_shown(progress, choice, seed), cancelled=asked)
            done.append(steps.step(partial(run_one, seed=seed, limits=shown, choice=choice), asked))
        cut_off = steps.unfinished = asked()
    if cut_off:
        of = options.seeds * len(choices)
        print_remark(f"ended after {len(done)} of {of} runs, the last one cut off; to resume: the same command")
    return done


def _run_one(trial: Trial) -> Callable[..., Done]:
    """Return the function that runs a test with one solver and seed."""
    from ...design.thesis.benchmark import run_trial
    from ...design.thesis.benchmark_colors import run_colors

    return run_trial if trial.films is None else run_colors


def _shown(progress: Report | None, choice: Choice, seed: int) -> Observer | None:
    """Return a callback that shows a solver's state; None: not on a terminal."""
    if progress is None:
        return None
    return lambda now: progress(f"{choice.label}, seed {seed}: {now.searches} {choice.unit}")


def _register_runs() -> None:
    """Let a journal hold finished runs."""
    from ...design.thesis.benchmark import BenchmarkRun, TracePoint
    from ...design.thesis.benchmark_colors import ColorPoint, ColorRun
    from ...measure.core.checkpoint import recorded

    for record in (BenchmarkRun, TracePoint, ColorRun, ColorPoint):
        recorded(record)


def _write(trial: Trial, options: BenchmarkOptions, done: Sequence[Done]) -> None:
    """Write the picture and the report, where they are wanted."""
    import numpy as np

    from ...design.problem.grey_picture import png_bytes
    from ...design.thesis.figures import write_figures
    from ...io.files.atomic_write import write_bytes_atomically

    if options.picture is not None:
        write_bytes_atomically(options.picture, png_bytes(np.concatenate(done[-1][1:], axis=1)))
        print_remark(f"wrote {options.picture}: the target, and what was found")
    if options.report is not None:
        page = write_figures(trial, [run for run, _, _ in done], _best_pictures(trial, done))
        write_text(options.report, page)
        print_remark(f"wrote {options.report}")


def _best_pictures(trial: Trial, done: Sequence[Done]) -> list[tuple[str, Any]]:
    """Return the target and each solver's best picture; for random ghosts, each beside its target."""
    from ...design.thesis.benchmark import BenchmarkRun

    best = {}
    for run, target, found in sorted(done, key=lambda one: one[0].psnr_db):
        ssim = f", SSIM {run.ssim:.4f}" if isinstance(run, BenchmarkRun) else ""
        words = f"{run.solver}, seed {run.seed}: {run.psnr_db:.2f} dB{ssim}"
        best[run.solver] = [(f"target of seed {run.seed}", target), (words, found)]
    if trial.name == "scratch":
        return [one for both in best.values() for one in both]
    return [("target", done[0][1]), *(both[1] for both in best.values())]


def _print(trial: Trial, runs: Sequence[Run]) -> None:
    from rich.table import Table

    from ...design.thesis.benchmark import BenchmarkRun
    from ...design.thesis.figures import comparison, head, solvers_of, thesis_words

    thesis, several = thesis_words(trial), len(solvers_of(runs)) > 1
    out = Table(title=f"{trial.title}{' · ' if thesis else ''}{thesis}")
    unit = "searches" if solvers_of(runs) in (("pools",), ("ours",)) else "evaluations"
    for column in (*(("solver",) if several else ()), "seed", "seconds", "CPU s", unit,
                   *(one.title for one in trial.measures), "black dB",
                   *(("with gain dB",) if trial.films is None else ()), "the same"):  # fmt: skip
        out.add_column(column, justify="right", no_wrap=True)
    for run in runs:
        measured = (_figure(one.key, getattr(run, one.key)) for one in trial.measures)
        out.add_row(
            *((run.solver,) if several else ()), str(run.seed), f"{run.seconds:.1f}", f"{run.cpu_seconds:.1f}",
            str(run.searches), *measured, f"{run.psnr_black_db:.1f}",
            *((f"{run.psnr_gain_db:.1f}",) if isinstance(run, BenchmarkRun) else ()),
            "yes" if run.recovered else "no",
        )  # fmt: skip
    console().print(out)
    if several:
        beside_each_other = Table(title="side by side: medians over the seeds, and the best of them")
        for column in head(trial):
            beside_each_other.add_column(column, justify="right", no_wrap=True)
        for row in comparison(trial, runs):
            beside_each_other.add_row(*row)
        console().print(beside_each_other)


def _figure(key: str, value: float) -> str:
    return f"{value:.1f}" if key == "psnr_db" else (f"{value:.4f}" if key == "ssim" else f"{value:.3g}")
