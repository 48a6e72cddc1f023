"""`flarewright measure find`, `fit`, `track` and `compress`: from merged frames to a small ghost model."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from ..common import print_json, print_remarks, progress_bar
from ..shared_options import Json, Threads

if TYPE_CHECKING:
    from ...typing import Progress

FIND_EPILOG = "Example:\n\nflarewright measure find run"
FIT_EPILOG = "Example:\n\nflarewright measure fit run\n\nThen: flarewright measure replay run/model.json --help"
TRACK_EPILOG = "Example:\n\nflarewright measure track run"
COMPRESS_EPILOG = (
    "Example:\n\nflarewright measure compress run\n\nThen: flarewright measure replay run/compact.json --help"
)

# singular of the units of facts
_ONE = {"ghosts": "ghost", "lives": "life", "numbers": "number"}

Folder = Annotated[Path, typer.Argument(metavar="DIR", help="A folder written by `measure merge`.")]
Every = Annotated[int, typer.Option(min=1, help="Use only every n-th merged constellation (default: 1).")]
CorrectionsFile = Annotated[
    Path | None,
    typer.Option(
        "--corrections", metavar="FILE",
        help="JSON: ghosts to add and to remove (docs/ghost-model.md; default: those of the last run).",
    ),
]  # fmt: skip
By = Annotated[
    Literal["joint", "walch"],
    typer.Option(
        metavar="joint|walch",
        help="joint: all constellations and ghosts at once. walch: the primitive and gradient descent of Walch (2017), "
        "picture by picture, for comparison; much slower, and its result cannot be tracked or compressed.",
    ),
]
NoResidual = Annotated[
    bool,
    typer.Option(
        "--no-residual",
        help="Omit the residual of ghosts, star and halo: a file of some 150 kB instead of 20 MB, and a replay "
        "without the layer residual.",
    ),
]
TrackThreads = Annotated[
    int | None, typer.Option(min=1, help="Number of threads, up to 2, forward and backward (default: 2).")
]


def find(
    folder: Folder,
    every: Every = 1,
    corrections: CorrectionsFile = None,
    threads: Threads = None,
    as_json: Json = False,
) -> None:
    """Find the ghosts in all merged frames at once, and write DIR/found.json; resumes an interrupted search."""
    _one("find", folder, every, corrections, threads, as_json)


def fit(
    folder: Folder,
    every: Every = 1,
    by: By = "joint",
    no_residual: NoResidual = False,
    threads: Threads = None,
    as_json: Json = False,
) -> None:
    """Fit the ghosts of DIR/found.json to all merged frames at once, and write DIR/model.json; can resume."""
    _one("fit", folder, every, None, threads, as_json, by, not no_residual)


def track(folder: Folder, every: Every = 1, threads: TrackThreads = None, as_json: Json = False) -> None:
    """Track the ghosts of DIR/model.json from frame to frame: births, deaths and crossings, in DIR/tracks.json."""
    _one("track", folder, every, None, threads, as_json)


def compress(
    folder: Folder, every: Every = 1, no_residual: NoResidual = False, threads: Threads = None, as_json: Json = False
) -> None:
    """Remove parts of DIR/model.json without predictive value, add the tracks, and write DIR/compact.json."""
    _one("compress", folder, every, None, threads, as_json, residual=not no_residual)


def _one(
    stage: str,
    folder: Path,
    every: int,
    corrections: Path | None,
    threads: int | None,
    as_json: bool,
    by: str = "joint",
    residual: bool = True,
) -> None:
    facts = run_and_print(folder, [stage], every, corrections, threads, not as_json, by, residual)
    if as_json:
        print_json(facts)


@contextmanager
def _bar(stage: str) -> Iterator[Progress]:
    with progress_bar() as begin:
        yield begin(stage)


def run_and_print(
    folder: Path,
    stages: Sequence[str],
    every: int,
    corrections: Path | None,
    threads: int | None,
    talk: bool,
    by: str = "joint",
    residual: bool = True,
) -> dict[str, Any]:
    """Run stages in a run's folder, with bars and a line for each.

    Returns
    -------
    dict
        Facts for JSON by stage.

    Raises
    ------
    FlarewrightError
        As `measure_run.run_stages`.
    """
    from ...sentences import count
    from ...workflow.measure_run import run_stages

    def report(line: str) -> None:
        if talk:
            print_remarks([line])

    facts: dict[str, Any] = {}
    for result in run_stages(
        folder, stages, every=every, corrections=corrections, by=by, residual=residual, threads=threads,
        report=report, begin=_bar,
    ):  # fmt: skip
        facts[result.stage] = {**result.counts, "file": str(result.file), "kept": result.kept}
        if talk:
            words = ", ".join(count(value, _ONE[key], key) for key, value in result.counts.items())
            kept = ", as before" if result.unchanged else ", ghosts as before" if result.kept else ""
            print(f"{result.file}: {words}{kept}")
    return facts
