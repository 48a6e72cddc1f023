"""`flarewright design benchmark`: the tests of Van Acoleyen 2025, solvers side by side and beside the thesis."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import ProjectError
from .common import check_place, console, interruptible, print_json, tell, write_text

if TYPE_CHECKING:
    from ..design.benchmark import BenchmarkRun
    from ..design.genes import Measure
    from ..design.solvers import Choice

EPILOG = (
    "Examples:\n\nflarewright design benchmark heliar --angle 5.45 --seeds 10 --time 10\n\n"
    "flarewright design benchmark canon --time 120 --picture canon.png --json\n\n"
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
    case: Annotated[str, typer.Argument(metavar="heliar|canon", help="Whose ghosts are to be found.")],
    angle_deg: Annotated[float, typer.Option("--angle", help="Yaw and pitch of the light, degrees.")] = 5.45,
    seeds: Annotated[int, typer.Option(min=1, max=1000, help="Run so many seeds, from 0.")] = 1,
    time_s: Annotated[float, typer.Option("--time", help="Seconds a seed.")] = 10.0,
    solver: Solvers = None,
    fitness: Annotated[
        str, typer.Option(help="What solvers see that evolve: algorithm1, as the thesis, or ours.")
    ] = "algorithm1",
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
    threads: Annotated[int | None, typer.Option(min=1, help="All cores when left out; for pools.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Find the ghosts of a known lens without knowing the lens, and compare the grey pictures."""
    _check(case, angle_deg, time_s, unsigned, fresnel, fitness)
    for place, suffix in ((picture, ".png"), (report, ".html")):
        if place is not None:
            check_place(place, suffix)
    import numpy as np

    from ..design.benchmark import as_data
    from ..design.figures import figure_data
    from ..design.figures import report as page
    from ..design.picture import png_bytes
    from ..design.solvers import chosen
    from ..io.atomic import write_atomically

    choices = [chosen(text) for text in solver or ["pools"]]
    options = {
        "time_limit": time_s, "measure": fitness, "unsigned": unsigned, "fresnel": fresnel, "threads": threads,
    }  # fmt: skip
    with interruptible() as asked, _telling() as progress:
        done = _run_all(case, angle_deg, seeds, choices, {**options, "progress": progress, "cancelled": asked})
        cut_off = asked()
    runs, target = [run for run, _, _ in done], done[0][1]
    if cut_off:
        tell([f"ended after {len(done)} of {seeds * len(choices)} runs, the last one cut off"])
    if picture is not None:
        data = png_bytes(np.concatenate([target, done[-1][2]], axis=1))
        write_atomically(picture, lambda temporary: _write(temporary, data))
        tell([f"wrote {picture}: the target, and what was found"])
    if report is not None:
        best = {}
        for run, _, found in sorted(done, key=lambda one: one[0].psnr_db):
            best[run.solver] = (f"{run.solver}, seed {run.seed}: {run.psnr_db:.2f} dB, SSIM {run.ssim:.4f}", found)
        write_text(report, page(case, angle_deg, runs, [("target", target), *best.values()]))
        tell([f"wrote {report}"])
    if as_json:
        print_json({**as_data(runs), "figures": figure_data(case, angle_deg, runs)})
        return
    _print(case, angle_deg, runs)


def _check(case: str, angle_deg: float, time_s: float, unsigned: bool, fresnel: bool, fitness: str) -> None:
    if case not in ("heliar", "canon"):
        raise ProjectError(f"there is no test {case!r}; choose heliar or canon")
    if not (math.isfinite(time_s) and time_s > 0.0):
        raise ProjectError(f"--time {time_s:g} is no time; give seconds above 0")
    if not 0.0 < angle_deg < 60.0:
        raise ProjectError(f"--angle {angle_deg:g} is no angle for this test; choose one above 0 and below 60 degrees")
    if unsigned and fresnel:
        raise ProjectError("--unsigned leaves the brightness out and --fresnel asks for it; keep one")
    check_fitness(fitness)


def check_fitness(text: str) -> Measure:
    """Return what `--fitness` says, checked."""
    if text == "ours":
        return "ours"
    if text == "algorithm1":
        return "algorithm1"
    raise ProjectError(f"there is no fitness {text!r}; choose ours or algorithm1")


def _run_all(
    case: str, angle_deg: float, seeds: int, choices: Sequence[Choice], options: dict[str, Any]
) -> list[tuple[BenchmarkRun, Any, Any]]:
    """Run every solver with every seed, until somebody has had enough."""
    from ..design.benchmark import run_case

    done: list[tuple[BenchmarkRun, Any, Any]] = []
    for choice in choices:
        for seed in range(seeds):
            if done and options["cancelled"]():
                return done
            done.append(run_case(case, angle_deg, seed=seed, choice=choice, **options))
    return done


def _print(case: str, angle_deg: float, runs: Sequence[BenchmarkRun]) -> None:
    from rich.table import Table

    from ..design.benchmark import THESIS
    from ..design.figures import HEAD, comparison, solvers_of

    thesis = THESIS.get((case, angle_deg))
    told = "" if thesis is None else f" · thesis, best run: {thesis[0]:g} dB, {thesis[1]:g}, {thesis[2]:g} s on 8 cores"
    several = len(solvers_of(runs)) > 1
    out = Table(title=f"{case}, {angle_deg:g} degrees{told}")
    for column in (*(("solver",) if several else ()), "seed", "seconds", "CPU s",
                   "searches" if solvers_of(runs) == ("pools",) else "evaluations", "Algorithm 1", "fitness mm²",
                   "PSNR dB", "SSIM", "black dB", "with gain dB", "the lens"):  # fmt: skip
        out.add_column(column, justify="right", no_wrap=True)
    for run in runs:
        out.add_row(
            *((run.solver,) if several else ()), str(run.seed), f"{run.seconds:.1f}", f"{run.cpu_seconds:.1f}",
            str(run.searches), f"{run.fitness_algorithm1:.3g}", f"{run.fitness:.3g}", f"{run.psnr_db:.1f}",
            f"{run.ssim:.4f}", f"{run.psnr_black_db:.1f}", f"{run.psnr_gain_db:.1f}", "yes" if run.recovered else "no",
        )  # fmt: skip
    console().print(out)
    if several:
        beside = Table(title="side by side: medians over the seeds, and the best of them")
        for column in HEAD:
            beside.add_column(column, justify="right", no_wrap=True)
        for row in comparison(runs):
            beside.add_row(*row)
        console().print(beside)


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
