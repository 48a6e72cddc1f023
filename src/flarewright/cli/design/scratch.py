"""`flarewright design scratch`: lenses for ghosts along a line, without a start lens."""

from __future__ import annotations

from typing import Annotated

import typer

from ...errors import OutputError, ProjectError
from ..common import field_angles, pair
from ..shared_options import Json
from .checks import check_fitness, check_time
from .options import Fitness, Lenses, Output, Searches, Seed, Solver, Surfaces, Threads, Time
from .solve import print_search, search

EPILOG = (
    "Examples:\n\nflarewright design scratch --light 10,5 --ghost 4,1.5 --ghost -6,0.8 --ghost -11,3 -o found\n\n"
    "flarewright design scratch --random 10 --unsigned --time 60 -o found"
)


def scratch(
    output: Output,
    light: Annotated[str, typer.Option(metavar="X,Y", help="Field angles in degrees, right and up.")] = "5.45,5.45",
    ghost: Annotated[
        list[str] | None,
        typer.Option(
            metavar="PLACE,RADIUS",
            help="Target ghost: place along the line towards the light and radius, mm; may be repeated.",
        ),
    ] = None,
    random: Annotated[int | None, typer.Option(min=1, max=60, help="Number of random ghosts, by --seed.")] = None,
    surfaces: Surfaces = None,
    stop_diameter: Annotated[float | None, typer.Option(help="Diameter of the stop, mm (default: free).")] = None,
    unsigned: Annotated[
        bool, typer.Option("--unsigned", help="Do not distinguish upright and inverted ghosts.")
    ] = False,
    time_s: Time = 60.0,
    seed: Seed = 0,
    lenses: Lenses = 5,
    searches: Searches = None,
    threads: Threads = None,
    solver: Solver = "pools",
    fitness: Fitness = "ours",
    as_json: Json = False,
) -> None:
    """Search lenses for ghosts along the line through the picture's middle and the light."""
    check_time(time_s)
    measure = check_fitness(fitness)
    angles = field_angles(light)
    if (ghost is None) == (random is None):
        raise ProjectError("no ghosts given; give --ghost PLACE,RADIUS for each, or --random N")
    if stop_diameter is not None and not 0.0 < stop_diameter <= 1000.0:
        raise ProjectError(f"--stop-diameter {stop_diameter:g} is no diameter; give millimetres above 0")
    if output.exists() and (not output.is_dir() or (output / "search.json").exists()):
        raise OutputError(f"{output} exists already; choose another folder")
    places = [pair(text, "--ghost", "4,1.5 (place and radius in mm)") for text in ghost or ()]
    if any(radius == 0.0 or max(abs(place), abs(radius)) > 10000.0 for place, radius in places):
        raise ProjectError("--ghost: a radius of 0 or a distance above 10 m is not possible")
    from ...design.problem.from_scratch import random_ghost_targets, scratch_project
    from ...design.solvers.pool_search import PoolState
    from ...design.solvers.solvers import chosen
    from ...model import GhostTarget
    from ...workflow.searches.search_folder import SearchLimits

    ghost_targets = (
        tuple(GhostTarget(place_mm=place, radius_mm=radius) for place, radius in places)
        if random is None
        else random_ghost_targets(random, seed)
    )
    project = scratch_project(
        ghost_targets, angles, surfaces=surfaces, stop_diameter=stop_diameter, signed=not unsigned
    )
    limits = SearchLimits(time_s, lenses, searches, threads)
    found = search(
        project, output, PoolState(seed), limits, name="From scratch", choice=chosen(solver), measure=measure
    )
    print_search(output, found, as_json)
