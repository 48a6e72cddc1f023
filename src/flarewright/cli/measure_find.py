"""`flarewright measure find` and `fit`: from merged frames to a ghost model."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from ..errors import FlarewrightError
from .common import print_json, tell

FIND_EPILOG = "Example:\n\nflarewright measure find run"
FIT_EPILOG = "Example:\n\nflarewright measure fit run\n\nThen: flarewright measure replay run/model.json --help"

FOUND, MODEL = "found.json", "model.json"

Folder = Annotated[Path, typer.Argument(metavar="DIR", help="A folder that `measure merge` has written.")]
Every = Annotated[int, typer.Option(min=1, help="Use every n-th constellation only; the others never enter.")]
Threads = Annotated[int | None, typer.Option(min=1, help="All cores when left out.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object.")]


def find(
    folder: Folder,
    every: Every = 1,
    corrections: Annotated[
        Path | None, typer.Option(metavar="FILE", help="JSON: ghosts to add and to remove (docs/ghost-model.md).")
    ] = None,
    threads: Threads = None,
    as_json: Json = False,
) -> None:
    """Find the ghosts in all merged frames at once, and write DIR/found.json."""
    facts = run_stages(folder, ["find"], every, corrections, threads, not as_json)
    if as_json:
        print_json(facts)


def fit(folder: Folder, every: Every = 1, threads: Threads = None, as_json: Json = False) -> None:
    """Fit the ghosts of DIR/found.json to all merged frames at once, and write DIR/model.json."""
    facts = run_stages(folder, ["fit"], every, None, threads, not as_json)
    if as_json:
        print_json(facts)


def run_stages(
    folder: Path, stages: Sequence[str], every: int, corrections: Path | None, threads: int | None, talk: bool
) -> dict[str, Any]:
    """Run finding and fitting in a run's folder; a stage is not repeated while what it is made from is the same.

    Returns
    -------
    dict
        Facts for JSON by stage.

    Raises
    ------
    FlarewrightError
        When the run cannot be read, or there is nothing to fit.
    """
    from ..io.ghost_model_file import read_corrections, read_ghost_model, write_ghost_model
    from ..io.merged import read_run
    from ..measure.notes import is_current, note, run_digest
    from ..measure.stages import find_ghosts, fit_ghosts

    run = read_run(folder)
    facts: dict[str, Any] = {}

    def told(line: str) -> None:
        if talk:
            tell([line])

    def done(stage: str, made: Path, kept: bool, **more: int) -> None:
        ghosts = len(read_ghost_model(made).ghosts)
        facts[stage] = {"ghosts": ghosts, **more, "file": str(made), "kept": kept}
        if talk:
            print(f"{made}: {ghosts} ghosts" + (", as before" if kept else ""))

    if "find" in stages:
        known = None if corrections is None else read_corrections(corrections)
        given = {"every": every, "corrections": None if known is None else known.model_dump_json()}
        digest = run_digest(folder, run, given)
        kept = is_current(folder, "find", digest, folder / FOUND)
        if not kept:
            found = find_ghosts(folder, run, every=every, corrections=known, threads=threads, tell=told)
            write_ghost_model(folder / FOUND, found)
            note(folder, "find", digest)
        done("find", folder / FOUND, kept)
    if "fit" in stages:
        if not (folder / FOUND).is_file():
            raise FlarewrightError(f"{folder / FOUND} does not exist: run flarewright measure find {folder} first")
        rough = read_ghost_model(folder / FOUND)
        digest = run_digest(folder, run, {"every": every, "found": rough.model_dump_json()})
        kept = is_current(folder, "fit", digest, folder / MODEL)
        if not kept:
            model = fit_ghosts(folder, run, rough, every=every, threads=threads, tell=told)
            write_ghost_model(folder / MODEL, model)
            note(folder, "fit", digest)
        done("fit", folder / MODEL, kept, found=len(rough.ghosts))
    return facts
