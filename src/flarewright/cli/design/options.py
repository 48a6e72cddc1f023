"""Options that several commands of searches share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ...design.solvers.restart_limit import MOST_RESTARTS
from ..shared_options import output_option

Output = Annotated[Path, output_option(metavar="DIR", help="Folder for lenses and report.")]
Seed = Annotated[int, typer.Option(min=0, help="Seed of the random numbers (default: 0).")]
Time = Annotated[
    float, typer.Option("--time", help="Seconds to search; Ctrl-C ends the search earlier and keeps the best.")
]
Lenses = Annotated[int, typer.Option("--lenses", min=1, max=50, help="Largest number of lenses to write (default: 5).")]
Threads = Annotated[
    int | None, typer.Option(min=1, help="Number of threads, without effect on the lenses (default: all cores).")
]
Searches = Annotated[
    int | None, typer.Option(min=1, help="Approximate number of local searches (evaluations) after which to end.")
]
Restarts = Annotated[
    int,
    typer.Option(
        "--restarts", min=1, max=MOST_RESTARTS,
        help="Number of independent searches, each of --time and --searches, whose best lenses are merged.",
    ),
]  # fmt: skip
Processes = Annotated[
    int | None, typer.Option(min=1, help="Number of processes that search, for --restarts (default: one per core).")
]
Cluster = Annotated[
    str | None,
    typer.Option(
        metavar="WHERE", help="Search on a Dask cluster, for --restarts: local:N, tcp://HOST:PORT or slurm:FILE."
    ),
]
Solver = Annotated[
    str,
    typer.Option(
        help="Solver: pools (ours), pso, sade, de, de1220, gaco or cmaes; pso:5x30 is 5 islands of 30 per gene."
    ),
]
Fitness = Annotated[str, typer.Option(help="Fitness of evolutionary solvers: ours, or algorithm1 of the thesis.")]
MostGhosts = Annotated[
    int, typer.Option(min=1, max=60, help="Largest number of ghosts, most visible first (default: 12).")
]
Surfaces = Annotated[
    int | None, typer.Option(min=2, max=60, help="Number of surfaces without the stop (default: the fewest possible).")
]
