"""`flarewright design benchmark`: the tests of Van Acoleyen 2025, solvers side by side and beside the thesis."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import ProjectError
from .common import check_place, console, interruptible, print_json, tell, write_text
from .design_checks import check_color_fitness, check_films, check_fitness, check_time

if TYPE_CHECKING:
    from ..design.figures import Run
    from ..design.search import State
    from ..design.solvers import Choice, Limits
    from ..design.trials import Name, Trial

EPILOG = (
    "Examples:\n\nflarewright design benchmark heliar --angle 5.45 --seeds 10 --time 10\n\n"
    "flarewright design benchmark canon --time 120 --picture canon.png --json\n\n"
    "flarewright design benchmark heliar --coatings quarter-wave --solver ours --solver sade --time 30\n\n"
    "flarewright design benchmark scratch --ghosts 10 --unsigned --time 60\n\n"
    "flarewright design benchmark heliar --unsigned --solver pools --solver pso --solver sade --report compared.html"
)

Solvers = Annotated[
    list[str] | None,
    typer.Option(
        "--solver", help="pools (ours), pso, sade, de, de1220, gaco, cmaes; pso:5x30 is 5 islands of 30 per gene. "
        "Give it again to compare.",
    ),
]  # fmt: skip


def benchmark(
    case: Annotated[
        str, typer.Argument(metavar="heliar|canon|scratch", help="Whose ghosts are to be found; scratch: nobody's.")
    ],
    angle_deg: Annotated[float, typer.Option("--angle", help="Yaw and pitch of the light, degrees.")] = 5.45,
    coatings: Annotated[
        str | None, typer.Option(help="Find colours instead, by quarter-wave or free films, or 2 or 3 at most.")
    ] = None,
    ghosts: Annotated[int, typer.Option(min=1, max=60, help="How many each seed scatters, for scratch.")] = 5,
    seeds: Annotated[int, typer.Option(min=1, max=1000, help="Run so many seeds, from 0.")] = 1,
    time_s: Annotated[float | None, typer.Option("--time", help="Seconds a seed; 10 when left out.")] = None,
    cpu_s: Annotated[
        float | None,
        typer.Option("--cpu-time", help="Instead: processor seconds a seed, all cores together, for a busy machine."),
    ] = None,
    solver: Solvers = None,
    fitness: Annotated[
        str | None,
        typer.Option(help="What solvers see that evolve: algorithm1 (algorithm2 of colours), as the thesis, or ours."),
    ] = None,
    unsigned: Annotated[
        bool, typer.Option("--unsigned", help="Sizes without sign and no brightness, as the thesis.")
    ] = False,
    fresnel: Annotated[
        bool, typer.Option("--fresnel", help="The irradiance of bare surfaces is known: can the lens be recovered?")
    ] = False,
    picture: Annotated[
        Path | None, typer.Option(help="Write target and result of the last seed side by side, *.png.")
    ] = None,
    report: Annotated[Path | None, typer.Option(help="Write tables, charts and pictures as a page, *.html.")] = None,
    threads: Annotated[int | None, typer.Option(min=1, help="All cores when left out; for ours.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Find the ghosts or colours of a known lens without knowing the lens, and compare the pictures."""
    trial = _trial(case, angle_deg, coatings, ghosts, unsigned, fresnel)
    limits = _limits(time_s, cpu_s)
    seen = _seen(fitness, trial)
    for place, suffix in ((picture, ".png"), (report, ".html")):
        if place is not None:
            check_place(place, suffix)
    import numpy as np

    from ..design.figures import figure_data
    from ..design.figures import report as page
    from ..design.picture import png_bytes
    from ..design.solvers import chosen
    from ..io.atomic import write_atomically

    choices = [chosen(text) for text in solver or ["pools"]]
    with interruptible() as asked, _telling() as progress:
        done = _run_all(trial, seeds, choices, limits, seen, threads, progress, asked)
        cut_off = asked()
    runs = [run for run, _, _ in done]
    if cut_off:
        tell([f"ended after {len(done)} of {seeds * len(choices)} runs, the last one cut off"])
    if picture is not None:
        data = png_bytes(np.concatenate(done[-1][1:], axis=1))
        write_atomically(picture, lambda temporary: _write(temporary, data))
        tell([f"wrote {picture}: the target, and what was found"])
    if report is not None:
        write_text(report, page(trial, runs, _best_pictures(trial, done)))
        tell([f"wrote {report}"])
    if as_json:
        print_json({"runs": [asdict(run) for run in runs], "figures": figure_data(trial, runs)})
        return
    _print(trial, runs)


def _trial(case: str, angle_deg: float, coatings: str | None, ghosts: int, unsigned: bool, fresnel: bool) -> Trial:
    """Return the test that the words ask for, checked."""
    from ..design.trials import Trial

    name: Name
    match case:
        case "heliar" | "canon" | "scratch":
            name = case
        case _:
            raise ProjectError(f"there is no test {case!r}; choose heliar or canon, or scratch")
    if not 0.0 < angle_deg < 60.0:
        raise ProjectError(f"--angle {angle_deg:g} is no angle for this test; choose one above 0 and below 60 degrees")
    if unsigned and fresnel:
        raise ProjectError("--unsigned leaves the brightness out and --fresnel asks for it; keep one")
    if case == "scratch" and (coatings is not None or fresnel):
        raise ProjectError("scratch has no lens, so neither --coatings nor --fresnel; choose heliar or canon")
    kind, layers = (None, 1) if coatings is None else check_films(coatings, "--coatings")
    return Trial(name, angle_deg, ghosts, kind, layers, unsigned, fresnel)


def _limits(time_s: float | None, cpu_s: float | None) -> Limits:
    """Return how long each seed may take, checked."""
    from ..design.solvers import Limits

    if time_s is not None and cpu_s is not None:
        raise ProjectError("--time and --cpu-time both tell when a seed ends; keep one")
    if cpu_s is not None:
        check_time(cpu_s, "--cpu-time")
        return Limits(None, cpu_s=cpu_s)
    limits = Limits(10.0 if time_s is None else time_s)
    check_time(limits.time_s or 0.0)
    return limits


def _seen(fitness: str | None, trial: Trial) -> str:
    """Return what `--fitness` says, checked; the thesis' own when it was left out."""
    if trial.films is not None:
        return "algorithm2" if fitness is None else check_color_fitness(fitness)
    return "algorithm1" if fitness is None else check_fitness(fitness)


def _run_all(
    trial: Trial, seeds: int, choices: Sequence[Choice], limits: Limits, seen: Any, threads: int | None,
    progress: Callable[[str], None] | None, cancelled: Callable[[], bool],
) -> list[tuple[Run, Any, Any]]:  # fmt: skip
    """Run every solver with every seed, until somebody has had enough."""
    from ..design.benchmark import run_trial
    from ..design.benchmark_colors import run_colors

    run_one: Any = run_trial if trial.films is None else run_colors
    done: list[tuple[Run, Any, Any]] = []
    for choice in choices:
        for seed in range(seeds):
            if done and cancelled():
                return done

            def show(now: State, choice: Choice = choice, seed: int = seed) -> None:
                if progress is not None:
                    progress(f"{choice.label}, seed {seed}: {now.searches} {choice.unit}")

            one = replace(limits, progress=show, cancelled=cancelled)
            done.append(run_one(trial, seed=seed, limits=one, choice=choice, measure=seen, threads=threads))
    return done


def _best_pictures(trial: Trial, done: Sequence[tuple[Run, Any, Any]]) -> list[tuple[str, Any]]:
    """Return the target and each solver's best picture; of scattered ghosts each beside its own target."""
    from ..design.benchmark import BenchmarkRun

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

    from ..design.benchmark import BenchmarkRun
    from ..design.figures import beside, comparison, head, solvers_of

    told, several = beside(trial), len(solvers_of(runs)) > 1
    out = Table(title=f"{trial.title}{' · ' if told else ''}{told}")
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


@contextmanager
def _telling() -> Iterator[Callable[[str], None] | None]:
    """Tell which run is under way where someone looks at it."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.status import Status

    with Status("searching", console=Console(stderr=True)) as status:
        yield status.update


def _write(path: Path, data: bytes) -> None:
    path.write_bytes(data)
