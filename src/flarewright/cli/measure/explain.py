"""`flarewright measure explain`: search lenses that make the ghosts of a measured flare."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ...errors import FlarewrightError, OutputError
from ..common import print_json, print_remarks, write_text
from ..design.checks import check_sensor_width, check_time
from ..design.solve import Json, Lenses, Output, Searches, Seed, Threads, Time, search

if TYPE_CHECKING:
    from ...design.solvers.pool_search import PoolState
    from ...model import Project
    from ...model.measurement.ghost_model import GhostModel

EPILOG = (
    "Example:\n\nflarewright measure explain run/compact.json --sensor-width 23.5 -o lenses\n\n"
    "Then: flarewright design identify lenses/lens-1.toml --help"
)

# number of constellations of the measured range among which the one with most ghosts is chosen
_TRIED = 40
# on the axis all ghosts lie at the middle
_LEAST_DEG = 0.5


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
    most: Annotated[
        int, typer.Option(min=1, max=60, help="Largest number of ghosts, most visible first (default: 12).")
    ] = 12,
    surfaces: Annotated[
        int | None,
        typer.Option(min=2, max=60, help="Number of surfaces without the stop (default: the fewest possible)."),
    ] = None,
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
    from ...design.results.explain import explain_misfit as judge
    from ...design.results.explain import sentences
    from ...design.solvers.pool_search import PoolState
    from ...io.files.sentences import count
    from ...io.measurement.ghost_model_file import read_ghost_model
    from ..design.target import project_of_model

    known = read_ghost_model(model)
    angle = _busiest(known) if light is None else light
    if not abs(angle) < 90.0:
        raise FlarewrightError(f"--light must be between -90 and 90 degrees, not {angle:g}")
    if abs(angle) < _LEAST_DEG:
        raise FlarewrightError(f"--light {angle:g} puts every ghost at the middle; choose another constellation")
    project = project_of_model(model, [(angle, 0.0)], sensor_width, most)
    if surfaces is not None and project.design is not None:
        project = project.replace(design=project.design.replace(surfaces=surfaces))
    problem, found, data = search(
        project,
        output,
        time_s,
        _state(output, project, seed) if (output / "search.json").exists() else PoolState(seed),
        lenses,
        searches,
        threads,
        as_json,
        name="From a measured flare",
        talk=False,
        resume_by="the same command",
    )
    if not found:
        raise FlarewrightError("no lens was found that forms an image; search longer, or increase --surfaces")
    one = judge(problem, found)
    names = [f"at {place:.2f} mm" for place in problem.objective.targets[:, 0]]
    lines = [
        f"{len(names)} of the model's {count(len(known.ghosts), 'ghost')}, at {angle:.3g} degrees",
        *sentences(one, names),
    ]
    write_text(output / "explanation.txt", "\n".join(lines) + "\n")
    if as_json:
        print_json({
            "folder": str(output), "constellation_deg": angle, "explained": list(one.explained), "extra": one.extra,
            "numbers": one.numbers, "rank": one.known.rank, "unknowns": one.known.unknowns, "fixed": one.known.fixed,
            "free": one.known.free, "remedies": one.known.remedies, "alike": one.alike, "index_spread": one.spread,
            "statement": lines, **data,
        })  # fmt: skip
        return
    print_remarks(lines)
    print(f"{output}: {count(len(found), 'lens', 'lenses')}, the report is report.html")


def _state(folder: Path, project: Project, seed: int) -> PoolState:
    """Read the search in a folder; raise if it belongs to another model or other options."""
    from ...design.solvers.search_state import read_state
    from ...io.files.text_file import read_text
    from ...io.project.project_file import project_text

    state = read_state(folder / "search.json")
    try:
        same = read_text(folder / "project.toml", "a project file") == project_text(project, folder=folder)
    except FlarewrightError:
        same = False
    if not same or state.seed != seed:
        raise OutputError(f"{folder} holds the search of another model, or of other options; choose another folder")
    return state


def _busiest(model: GhostModel) -> float:
    """Return the constellation at which most ghosts are visible, the smallest of several."""
    import numpy as np

    from ...measure.core.parameter_vector import visible

    low, high = model.constellation_deg
    tried = [float(angle) for angle in np.linspace(low, high, _TRIED) if abs(angle) >= _LEAST_DEG]
    if not tried or not model.ghosts:
        raise FlarewrightError("the model has no ghosts off the axis, so there is nothing to explain")
    return max(tried, key=lambda angle: (float(visible(model.ghosts, angle).sum()), -abs(angle)))
