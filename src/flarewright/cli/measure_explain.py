"""`flarewright measure explain`: a prescription that makes the ghosts of a measured flare."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import FlarewrightError, OutputError, ProjectError
from .common import print_json, tell, write_text
from .design_checks import check_time
from .design_solve import Json, Lenses, Output, Searches, Seed, Threads, Time, search

if TYPE_CHECKING:
    from ..model.ghost_model import GhostModel

EPILOG = (
    "Example:\n\nflarewright measure explain run/compact.json --sensor-width 23.5 -o lenses\n\n"
    "Then: flarewright design identify lenses/lens-1.toml --help"
)

# the light stands at one of so many constellations of the measured range: where most ghosts are seen
_TRIED = 40
# on the axis all ghosts lie at the middle
_LEAST_DEG = 0.5


def explain(
    model: Annotated[Path, typer.Argument(metavar="MODEL.json", help="A ghost model, as `measure run` writes it.")],
    output: Output,
    sensor_width: Annotated[float, typer.Option(help="Width of the sensor that the captures show, mm.")] = 36.0,
    light: Annotated[
        float | None,
        typer.Option(metavar="DEG", help="Constellation whose ghosts are explained; where most are seen if left out."),
    ] = None,
    most: Annotated[int, typer.Option(min=1, max=60, help="Of the ghosts only so many, the most striking.")] = 12,
    surfaces: Annotated[
        int | None, typer.Option(min=2, max=60, help="Without the stop; as few as can be when left out.")
    ] = None,
    time_s: Time = 60.0,
    seed: Seed = 0,
    lenses: Lenses = 5,
    searches: Searches = None,
    threads: Threads = None,
    as_json: Json = False,
) -> None:
    """Search lenses that make the measured ghosts, and say how much of a lens these can tell."""
    check_time(time_s)
    if not 0.1 <= sensor_width <= 10000.0:
        raise ProjectError(f"--sensor-width {sensor_width:g} is no width of a sensor; give millimetres above 0.1")
    if output.exists() and (not output.is_dir() or (output / "search.json").exists()):
        raise OutputError(f"{output} is there already; choose another folder")
    from ..design.explain import explain as judge
    from ..design.explain import sentences
    from ..design.search import State
    from ..io.ghost_model_file import read_ghost_model
    from ..io.sentences import count
    from .design_target import project_of_model

    known = read_ghost_model(model)
    angle = _busiest(known) if light is None else light
    if abs(angle) < _LEAST_DEG:
        raise FlarewrightError(f"--light {angle:g} puts every ghost at the middle; choose another constellation")
    project = project_of_model(model, [(angle, 0.0)], sensor_width, most)
    if surfaces is not None and project.design is not None:
        project = project.replace(design=project.design.replace(surfaces=surfaces))
    problem, found, data = search(
        project,
        output,
        time_s,
        State(seed),
        lenses,
        searches,
        threads,
        as_json,
        name="From a measured flare",
        talk=False,
    )
    if not found:
        raise FlarewrightError("no lens was found that makes an image; search longer, or give --surfaces more")
    one = judge(problem, found)
    names = [f"at {place:.2f} mm" for place in problem.objective.targets[:, 0]]
    said = [
        f"{len(names)} of the model's {count(len(known.ghosts), 'ghost')}, at {angle:.3g} degrees",
        *sentences(one, names),
    ]
    write_text(output / "explanation.txt", "\n".join(said) + "\n")
    if as_json:
        print_json({
            "folder": str(output), "constellation_deg": angle, "explained": list(one.explained), "extra": one.extra,
            "numbers": one.numbers, "rank": one.known.rank, "unknowns": one.known.unknowns, "fixed": one.known.fixed,
            "free": one.known.free, "remedies": one.known.remedies, "alike": one.alike, "index_spread": one.spread,
            "statement": said, **data,
        })  # fmt: skip
        return
    tell(said)
    print(f"{output}: {count(len(found), 'lens', 'lenses')}, the report is report.html")


def _busiest(model: GhostModel) -> float:
    """Return the constellation at which most ghosts are seen, the smallest of several."""
    import numpy as np

    from ..measure.numbers import visible

    low, high = model.constellation_deg
    tried = [float(angle) for angle in np.linspace(low, high, _TRIED) if abs(angle) >= _LEAST_DEG]
    if not tried or not model.ghosts:
        raise FlarewrightError("the model has no ghosts off the axis, so there is nothing to explain")
    return max(tried, key=lambda angle: (float(visible(model.ghosts, angle).sum()), -abs(angle)))
