"""`flarewright measure explain`: search lenses that make the ghosts of a measured flare."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ...errors import FlarewrightError, OutputError
from ..common import print_json, print_remarks, write_text
from ..design.checks import check_sensor_width, check_time
from ..design.options import Lenses, MostGhosts, Output, Searches, Seed, Surfaces, Threads, Time
from ..design.solve import search
from ..shared_options import Json

if TYPE_CHECKING:
    from ...design.problem.problem import Problem
    from ...design.results.explain import Explanation

EPILOG = (
    "Example:\n\nflarewright measure explain run/compact.json --sensor-width 23.5 -o lenses\n\n"
    "Then: flarewright design identify lenses/lens-1.toml --help"
)


def explain(
    model: Annotated[Path, typer.Argument(metavar="MODEL.json", help="A ghost model, as `measure run` writes it.")],
    output: Output,
    sensor_width: Annotated[
        float | None, typer.Option(help="Width of the sensor in the captures, mm (default: the model's, else 36).")
    ] = None,
    light: Annotated[
        float | None,
        typer.Option(metavar="DEG", help="Constellation of the ghosts to explain (default: where most are visible)."),
    ] = None,
    most: MostGhosts = 12,
    surfaces: Surfaces = None,
    time_s: Time = 60.0,
    seed: Seed = 0,
    lenses: Lenses = 5,
    searches: Searches = None,
    threads: Threads = None,
    as_json: Json = False,
) -> None:
    """Search lenses that make the measured ghosts, and report how much of a lens these determine.

    The search is stored every 10 s; the same command continues it.
    """
    check_time(time_s)
    check_sensor_width(sensor_width)
    if output.exists() and not output.is_dir():
        raise OutputError(f"{output} is a file; give a folder for the lenses")
    from ...design.results.explain import explain_misfit
    from ...io.measurement.ghost_model_file import read_ghost_model
    from ...sentences import count
    from ...workflow.searches.flare_targets import busiest_constellation, project_of_model
    from ...workflow.searches.search_folder import SearchLimits, search_to_resume

    known = read_ghost_model(model)
    angle = busiest_constellation(known) if light is None else _explainable(light)
    project = project_of_model(model, [(angle, 0.0)], sensor_width, most)
    if surfaces is not None and project.design is not None:
        project = project.replace(design=project.design.replace(surfaces=surfaces))
    found = search(
        project, output, search_to_resume(output, project, seed), SearchLimits(time_s, lenses, searches, threads),
        name="From a measured flare", resume_by="the same command",
    )  # fmt: skip
    problem, outcomes = found.search.problem, found.search.outcomes
    if not outcomes:
        raise FlarewrightError("no lens was found that forms an image; search longer, or increase --surfaces")
    explained = explain_misfit(problem, outcomes)
    lines = _lines(explained, problem, f"{count(len(known.ghosts), 'ghost')}, at {angle:.3g} degrees")
    write_text(output / "explanation.txt", "\n".join(lines) + "\n")
    if as_json:
        print_json(
            {"folder": str(output), "constellation_deg": angle, **_data(explained), "statement": lines, **found.summary}
        )
        return
    print_remarks(lines)
    print(f"{output}: {count(len(outcomes), 'lens', 'lenses')}, the report is report.html")


def _explainable(light_deg: float) -> float:
    """Return the constellation of `--light`, checked."""
    from ...workflow.searches.flare_targets import LEAST_DEG

    if not abs(light_deg) < 90.0:
        raise FlarewrightError(f"--light must be between -90 and 90 degrees, not {light_deg:g}")
    if abs(light_deg) < LEAST_DEG:
        raise FlarewrightError(f"--light {light_deg:g} puts every ghost at the middle; choose another constellation")
    return light_deg


def _lines(explained: Explanation, problem: Problem, of: str) -> list[str]:
    """Return the statement on the lenses that were found."""
    from ...design.results.explain import sentences

    names = [f"at {place:.2f} mm" for place in problem.objective.targets[:, 0]]
    return [f"{len(names)} of the model's {of}", *sentences(explained, names)]


def _data(explained: Explanation) -> dict[str, Any]:
    known = explained.known
    return {
        "explained": list(explained.explained), "extra": explained.extra, "numbers": explained.numbers,
        "rank": known.rank, "unknowns": known.unknowns, "fixed": known.fixed, "free": known.free,
        "remedies": known.remedies, "alike": explained.alike, "index_spread": explained.spread,
    }  # fmt: skip
