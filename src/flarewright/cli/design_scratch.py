"""`flarewright design scratch`: lenses for ghosts along a line, without a lens to begin with."""

from __future__ import annotations

from typing import Annotated

import typer

from ..errors import OutputError, ProjectError
from .common import field_angles, pair
from .design_checks import check_fitness, check_time
from .design_solve import Fitness, Json, Lenses, Output, Searches, Seed, Solver, Threads, Time, search

EPILOG = (
    "Examples:\n\nflarewright design scratch --light 10,5 --ghost 4,1.5 --ghost -6,0.8 --ghost -11,3 -o found\n\n"
    "flarewright design scratch --random 10 --unsigned --time 60 -o found"
)


def scratch(
    output: Output,
    light: Annotated[str, typer.Option(metavar="X,Y", help="Field angles in degrees, right and up.")] = "5.45,5.45",
    ghost: Annotated[
        list[str] | None,
        typer.Option(metavar="PLACE,RADIUS", help="mm along the line towards the light, mm; may be repeated."),
    ] = None,
    random: Annotated[int | None, typer.Option(min=1, max=60, help="So many ghosts, scattered by --seed.")] = None,
    surfaces: Annotated[
        int | None, typer.Option(min=2, max=60, help="Without the stop; as few as can be when left out.")
    ] = None,
    stop_diameter: Annotated[float | None, typer.Option(help="Of the stop, mm; free when left out.")] = None,
    unsigned: Annotated[bool, typer.Option("--unsigned", help="Upright or upside down is the same.")] = False,
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
        raise ProjectError("say which ghosts: --ghost PLACE,RADIUS for each, or --random N")
    if stop_diameter is not None and not 0.0 < stop_diameter <= 1000.0:
        raise ProjectError(f"--stop-diameter {stop_diameter:g} is no diameter; give millimetres above 0")
    if output.exists() and (not output.is_dir() or (output / "search.json").exists()):
        raise OutputError(f"{output} is there already; choose another folder")
    places = [pair(text, "--ghost", "4,1.5 (place and radius in mm)") for text in ghost or ()]
    if any(radius == 0.0 or max(abs(place), abs(radius)) > 10000.0 for place, radius in places):
        raise ProjectError("--ghost: a radius is not 0, and nothing is farther off than 10 m")
    from ..design.scratch import random_wishes, scratch_project
    from ..design.search import State
    from ..design.solvers import chosen
    from ..model import GhostWish

    wishes = (
        tuple(GhostWish(place_mm=place, radius_mm=radius) for place, radius in places)
        if random is None
        else random_wishes(random, seed)
    )
    project = scratch_project(wishes, angles, surfaces=surfaces, stop_diameter=stop_diameter, signed=not unsigned)
    search(
        project, output, time_s, State(seed), lenses, searches, threads, as_json, name="From scratch",
        choice=chosen(solver), measure=measure,
    )  # fmt: skip
