"""`flarewright design benchmark`: the tests of Van Acoleyen 2025, beside the thesis' own results."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

from ..errors import ProjectError
from .common import check_place, console, print_json, tell

EPILOG = (
    "Examples:\n\nflarewright design benchmark heliar --angle 5.45 --seeds 10 --time 10\n\n"
    "flarewright design benchmark canon --time 120 --picture canon.png --json"
)


def benchmark(
    case: Annotated[str, typer.Argument(metavar="heliar|canon", help="Whose ghosts are to be found.")],
    angle_deg: Annotated[float, typer.Option("--angle", help="Yaw and pitch of the light, degrees.")] = 5.45,
    seeds: Annotated[int, typer.Option(min=1, max=1000, help="Run so many seeds, from 0.")] = 1,
    time_s: Annotated[float, typer.Option("--time", help="Seconds a seed.")] = 10.0,
    unsigned: Annotated[
        bool, typer.Option("--unsigned", help="Sizes without sign and no brightness, as the thesis.")
    ] = False,
    fresnel: Annotated[
        bool, typer.Option("--fresnel", help="The irradiance of bare surfaces is known: can the lens be recovered?")
    ] = False,
    picture: Annotated[
        Path | None, typer.Option(help="Write target and result of the last seed side by side, *.png.")
    ] = None,
    threads: Annotated[int | None, typer.Option(min=1, help="All cores when left out.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Find the ghosts of a known lens without knowing the lens, and compare the grey pictures."""
    if case not in ("heliar", "canon"):
        raise ProjectError(f"there is no test {case!r}; choose heliar or canon")
    if not (math.isfinite(time_s) and time_s > 0.0):
        raise ProjectError(f"--time {time_s:g} is no time; give seconds above 0")
    if not 0.0 < angle_deg < 60.0:
        raise ProjectError(f"--angle {angle_deg:g} is no angle for this test; choose one above 0 and below 60 degrees")
    if unsigned and fresnel:
        raise ProjectError("--unsigned leaves the brightness out and --fresnel asks for it; keep one")
    if picture is not None:
        check_place(picture, ".png")
    import numpy as np

    from ..design.benchmark import THESIS, as_data, run_case
    from ..design.picture import png_bytes
    from ..io.atomic import write_atomically

    runs, pictures = [], []
    for seed in range(seeds):
        run, target, found = run_case(
            case, angle_deg, seed=seed, time_limit=time_s, unsigned=unsigned, fresnel=fresnel, threads=threads
        )
        runs.append(run)
        pictures = [target, found]
    if picture is not None:
        data = png_bytes(np.concatenate(pictures, axis=1))
        write_atomically(picture, lambda temporary: _write(temporary, data))
        tell([f"wrote {picture}: the target, and what was found"])
    if as_json:
        print_json(dict(as_data(runs)))
        return
    from rich.table import Table

    thesis = THESIS.get((case, angle_deg))
    told = "" if thesis is None else f" · thesis, best run: {thesis[0]:g} dB, {thesis[1]:g}, {thesis[2]:g} s on 8 cores"
    out = Table(title=f"{case}, {angle_deg:g} degrees{told}")
    for column in ("seed", "seconds", "CPU s", "searches", "Algorithm 1", "fitness mm²", "PSNR dB", "SSIM", "black dB",
                   "with gain dB", "the lens"):  # fmt: skip
        out.add_column(column, justify="right", no_wrap=True)
    for run in runs:
        out.add_row(
            str(run.seed), f"{run.seconds:.1f}", f"{run.cpu_seconds:.1f}", str(run.searches),
            f"{run.fitness_algorithm1:.3g}", f"{run.fitness:.3g}", f"{run.psnr_db:.1f}", f"{run.ssim:.4f}",
            f"{run.psnr_black_db:.1f}", f"{run.psnr_gain_db:.1f}", "yes" if run.recovered else "no",
        )  # fmt: skip
    console().print(out)


def _write(path: Path, data: bytes) -> None:
    path.write_bytes(data)
