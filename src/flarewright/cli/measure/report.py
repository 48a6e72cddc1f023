"""`flarewright measure report`: an HTML report on a measurement."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ...errors import FlarewrightError
from ..common import check_place, print_json, print_remarks
from ..shared_options import Json, output_option

EPILOG = "Example:\n\nflarewright measure report run"


def report(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="A folder written by `measure run`.")],
    output: Annotated[
        Path | None, output_option(metavar="OUT.html", help="The page (default: DIR/report.html).")
    ] = None,
    model: Annotated[
        Path | None, typer.Option(metavar="FILE", help="A ghost model (default: DIR/compact.json or DIR/model.json).")
    ] = None,
    as_json: Json = False,
) -> None:
    """Write a self-contained HTML page with pictures, geometry, ghosts and replay."""
    place = output or folder / "report.html"
    from ...io.measurement.merged import read_run

    run = read_run(folder)
    check_place(place, (".html", ".htm"))
    from ...io.measurement.ghost_model_file import read_ghost_model, read_ghost_tracks
    from ...measure.report.page import strange, write_report
    from ...sentences import count
    from ...workflow.measure_provenance import COMPACT, MODEL, TRACKS

    known = None
    old, remarks = ([], []) if model else _of_another_model(folder)
    left = [folder / name for name in (COMPACT, MODEL) if name not in old and (folder / name).is_file()]
    for file in [model] if model else left:
        found = read_ghost_model(file)
        why = strange(run, found)
        if why is None:
            known = found
            break
        if model is not None:
            raise FlarewrightError(f"{file} does not belong to the frames in {folder}: {why}; choose another --model")
        remarks.append(
            f"{file} does not belong to the frames and is omitted: {why}; flarewright measure fit recreates it"
        )
    print_remarks(remarks)
    wanted = model is None and (known is not None or not remarks) and TRACKS not in old and (folder / TRACKS).is_file()
    tracks = read_ghost_tracks(folder / TRACKS) if wanted else None
    write_report(folder, run, known, place, tracks, remarks)
    if as_json:
        ghosts = None if known is None else len(known.ghosts)
        print_json({"report": str(place), "ghosts": ghosts, "remarks": remarks})
    else:
        counted = "" if known is None else f", {count(len(known.ghosts), 'ghost')}"
        print(f"{place}: {count(len(run.frames), 'frame')}{counted}")


def _of_another_model(folder: Path) -> tuple[list[str], list[str]]:
    """Return the names of a run's files that belong to another model, and remarks on them."""
    from ...workflow.measure_provenance import COMPACT, FOUND, MODEL, TRACKS, is_of_another

    old, remarks = [], []
    for stage, name, more in (("compress", COMPACT, ", or choose it by --model"), ("track", TRACKS, "")):
        if (folder / name).is_file() and is_of_another(folder, stage):
            old.append(name)
            remarks.append(
                f"{folder / name} was made from another {MODEL} and is omitted: "
                f"recreate it with flarewright measure {stage}{more}"
            )
    if (folder / MODEL).is_file() and is_of_another(folder, "fit"):
        remarks.append(f"{folder / MODEL} was made from another {FOUND}; flarewright measure fit recreates it")
    return old, remarks
