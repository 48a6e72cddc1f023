"""`flarewright measure find`, `fit`, `track` and `compress`: from merged frames to a small ghost model."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from ..errors import FlarewrightError
from .common import print_json, progress_bar, tell
from .measure_sources import COMPACT, FOUND, MODEL, TRACKS, as_measured, note_source

if TYPE_CHECKING:
    from ..measure.journal import Journal
    from ..model.capture import MergedRun
    from ..model.corrections import Corrections
    from ..model.ghost_model import GhostModel

FIND_EPILOG = "Example:\n\nflarewright measure find run"
FIT_EPILOG = "Example:\n\nflarewright measure fit run\n\nThen: flarewright measure replay run/model.json --help"
TRACK_EPILOG = "Example:\n\nflarewright measure track run"
COMPRESS_EPILOG = (
    "Example:\n\nflarewright measure compress run\n\nThen: flarewright measure replay run/compact.json --help"
)

# what facts are counted in, one of each
_ONE = {"ghosts": "ghost", "lives": "life", "numbers": "number"}
# in their order; later stages need the earlier ones
STAGES = ("find", "fit", "track", "compress")

Folder = Annotated[Path, typer.Argument(metavar="DIR", help="A folder that `measure merge` has written.")]
Every = Annotated[int, typer.Option(min=1, help="Use every n-th merged constellation only; the others never enter.")]
CorrectionsFile = Annotated[
    Path | None,
    typer.Option(
        "--corrections", metavar="FILE",
        help="JSON: ghosts to add and to remove (docs/ghost-model.md); those given before hold until others are given.",
    ),
]  # fmt: skip
By = Annotated[
    Literal["joint", "walch"],
    typer.Option(
        metavar="joint|walch",
        help="joint: all constellations and ghosts at once. walch: his primitive by his gradient descent, picture by "
        "picture (2017), for comparison; slower by far, and what it writes is not tracked or compressed again.",
    ),
]
NoResidual = Annotated[
    bool,
    typer.Option(
        "--no-residual",
        help="Leave out what ghosts, star and halo do not explain: a file of some 150 kB, not 20 MB, and a replay "
        "without the layer residual.",
    ),
]
Threads = Annotated[int | None, typer.Option(min=1, help="All cores when left out.")]
TrackThreads = Annotated[
    int | None, typer.Option(min=1, help="Two at most, forward and backward; so many when left out.")
]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object.")]


def find(
    folder: Folder,
    every: Every = 1,
    corrections: CorrectionsFile = None,
    threads: Threads = None,
    as_json: Json = False,
) -> None:
    """Find the ghosts in all merged frames at once, and write DIR/found.json; a stopped search goes on."""
    _one("find", folder, every, corrections, threads, as_json)


def fit(
    folder: Folder,
    every: Every = 1,
    by: By = "joint",
    no_residual: NoResidual = False,
    threads: Threads = None,
    as_json: Json = False,
) -> None:
    """Fit the ghosts of DIR/found.json to all merged frames at once, and write DIR/model.json; goes on when stopped."""
    _one("fit", folder, every, None, threads, as_json, by, not no_residual)


def track(folder: Folder, every: Every = 1, threads: TrackThreads = None, as_json: Json = False) -> None:
    """Follow the ghosts of DIR/model.json from frame to frame: births, deaths and crossings, in DIR/tracks.json."""
    _one("track", folder, every, None, threads, as_json)


def compress(
    folder: Folder,
    every: Every = 1,
    no_residual: NoResidual = False,
    threads: Threads = None,
    as_json: Json = False,
) -> None:
    """Leave out of DIR/model.json what foretells nothing, add what the tracks tell, and write DIR/compact.json."""
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
    facts = run_stages(folder, [stage], every, corrections, threads, not as_json, by, residual)
    if as_json:
        print_json(facts)


@dataclass(frozen=True)
class _Job:
    """What every stage is told.

    A model shall also tell what is left beside the ghosts when that is wanted (`residual`), but it is learned only by
    a stage that is told the `whole`.
    """

    folder: Path
    run: MergedRun
    every: int
    corrections: Corrections | None
    by: str
    residual: bool
    whole: bool
    threads: int | None
    told: Callable[[str], None]
    progress: Callable[[float, str], None]

    def needed(self, name: str, stage: str) -> Path:
        """Return the file of an earlier stage."""
        path = self.folder / name
        if not path.is_file():
            raise FlarewrightError(f"{path} does not exist: run flarewright measure {stage} {self.folder} first")
        return path


@dataclass(frozen=True)
class _Stage:
    """What a stage is made from, and how it is made.

    Attributes
    ----------
    file : str
        That it writes.
    given : callable
        Returns what it is made from besides the frames, for JSON; raises when that is not there.
    make : callable
        Writes the file.
    """

    file: str
    given: Callable[[_Job], dict[str, object]]
    make: Callable[[_Job, Path, Journal], None]


def run_stages(
    folder: Path,
    stages: Sequence[str],
    every: int,
    corrections: Path | None,
    threads: int | None,
    talk: bool,
    by: str = "joint",
    residual: bool = True,
) -> dict[str, Any]:
    """Run stages in a run's folder; one is not repeated while what it is made from is the same.

    Corrections that the folder's search was told hold until others are given.

    Returns
    -------
    dict
        Facts for JSON by stage.

    Raises
    ------
    FlarewrightError
        When the run cannot be read, or an earlier stage is missing.
    """
    from ..io.merged import read_run
    from ..io.sentences import count

    run = read_run(folder)
    told_of = _corrections(folder, corrections) if "find" in stages else None
    facts: dict[str, Any] = {}

    def told(line: str) -> None:
        if talk:
            tell([line])

    for name in (one for one in STAGES if one in stages):
        made = folder / _STAGES[name].file
        with progress_bar() as begin:
            # what is left is learned anew for the small model: once is enough
            whole = residual and (name == "compress" or "compress" not in stages)
            job = _Job(folder, run, every, told_of, by, residual, whole, threads, told, begin(name))
            kept, as_it_was = _kept(job, name, made)
            if made.name != TRACKS:
                _tell_light(run, made)
        # a model with its sprites is some 20 MB to read
        counted = _facts(made)
        facts[name] = {**counted, "file": str(made), "kept": kept}
        if talk:
            words = ", ".join(count(value, _ONE[key], key) for key, value in counted.items())
            print(f"{made}: {words}" + (", as before" if as_it_was else ", ghosts as before" if kept else ""))
    return facts


def _kept(job: _Job, name: str, made: Path) -> tuple[bool, bool]:
    """Make a stage's file unless it is there; return whether it was, and whether all in it is as it was."""
    from ..io.sentences import count
    from ..measure.journal import journal
    from ..measure.notes import is_current, note, note_corrections, run_digest

    folder, stage = job.folder, _STAGES[name]
    digest = run_digest(folder, job.run, stage.given(job))
    if is_current(folder, name, digest, made):
        return True, _as_wanted(job, name, digest, made)
    with journal(folder / f"{name}.journal", digest) as steps:
        if steps.remembered:
            job.told(f"{name} goes on after {count(steps.remembered, 'step')} that an earlier run had done")
        stage.make(job, made, steps)
    if name == "find":
        note_corrections(folder, job.corrections)
    note_source(folder, name)
    note(folder, name, digest)
    return False, False


def _tell_light(run: MergedRun, made: Path) -> None:
    """Write what is known by now of the light and of clipping into a model, which knows no ghost better for it."""
    from ..io.ghost_model_file import write_ghost_model
    from ..measure.stages import reference_of
    from ..model.capture import OF_LIGHT

    model, known = _model(made), reference_of(run)
    told = known.model_dump(include=OF_LIGHT, exclude_none=True)
    reference = model.reference.replace(clipping=model.reference.clipping or known.clipping, **told)
    if reference != model.reference:
        write_ghost_model(made, model.replace(reference=reference))


def _corrections(folder: Path, given: Path | None) -> Corrections | None:
    """Return what the search is told: what is given now, or else what it was told before."""
    from ..io.ghost_model_file import read_corrections
    from ..measure.notes import noted_corrections

    if given is not None:
        known = read_corrections(given)
        return known if known.add or known.remove else None
    before = noted_corrections(folder)
    if before is not None:
        tell(["the corrections that were given before still hold; give --corrections a file with {} to drop them"])
    return before


def _facts(made: Path) -> dict[str, int]:
    from ..io.ghost_model_file import read_ghost_model, read_tracks
    from ..measure.compact import numbers_in

    if made.name == TRACKS:
        tracks = read_tracks(made).ghosts
        return {"ghosts": len(tracks), "lives": sum(len(one.lives) for one in tracks)}
    model = read_ghost_model(made)
    return {"ghosts": len(model.ghosts), **({"numbers": numbers_in(model)} if made.name == COMPACT else {})}


def _find_given(job: _Job) -> dict[str, object]:
    return {"every": job.every, "corrections": None if job.corrections is None else job.corrections.model_dump_json()}


def _find(job: _Job, made: Path, steps: Journal) -> None:
    from ..io.ghost_model_file import write_ghost_model
    from ..measure.stages import find_ghosts

    found = find_ghosts(
        job.folder, job.run, every=job.every, corrections=job.corrections, threads=job.threads, tell=job.told,
        progress=job.progress, journal=steps,
    )  # fmt: skip
    write_ghost_model(made, found)


def _fit_given(job: _Job) -> dict[str, object]:
    given = {"every": job.every, "found": as_measured(_model(job.needed(FOUND, "find")))}
    # told anew when the same numbers mean another ghost
    return given if job.by == "joint" else {**given, "by": job.by, "numbers": "by the angle from the axis"}


def _fit(job: _Job, made: Path, steps: Journal) -> None:
    from ..io.ghost_model_file import write_ghost_model
    from ..measure.stages import fit_ghosts
    from ..measure.walch_fit import fit_as_walch

    rough = _model(job.folder / FOUND)
    way = fit_ghosts if job.by == "joint" else fit_as_walch
    model = way(
        job.folder, job.run, rough, every=job.every, rest=job.whole, threads=job.threads, tell=job.told,
        progress=job.progress, journal=steps,
    )  # fmt: skip
    write_ghost_model(made, model)


def _as_wanted(job: _Job, name: str, digest: str, made: Path) -> bool:
    """Learn what is left beside a kept model's ghosts when it lacks that, or drop it when it is not wanted.

    Returns
    -------
    bool
        Whether the file is as it was.
    """
    from ..io.ghost_model_file import write_ghost_model
    from ..measure.journal import journal
    from ..measure.reading import read_views
    from ..measure.rest_fit import with_rest

    if name not in ("fit", "compress"):
        return True
    model, left = _model(made), job.folder / f"{name}-residual.journal"
    if model.sprites and not job.residual:
        write_ghost_model(made, model.replace(sprites=()))
    elif job.whole and not model.sprites:
        with journal(left, digest) as steps:
            views = read_views(job.folder, job.run, job.every)
            write_ghost_model(made, with_rest(model, views, job.threads, steps))
    else:
        if not job.residual:
            # nobody wants to know what an earlier command had begun to learn
            left.unlink(missing_ok=True)
        return True
    return False


def _track_given(job: _Job) -> dict[str, object]:
    # ghosts are followed beside halo and star alone
    model = _model(job.needed(MODEL, "fit")).replace(sprites=())
    return {"every": job.every, "model": as_measured(model)}


def _track(job: _Job, made: Path, steps: Journal) -> None:
    from ..io.ghost_model_file import write_tracks
    from ..measure.track_stage import track_ghosts

    tracks = track_ghosts(
        job.folder, job.run, _model(job.folder / MODEL), every=job.every, threads=job.threads, tell=job.progress,
        journal=steps,
    )  # fmt: skip
    write_tracks(made, tracks)


def _compress_given(job: _Job) -> dict[str, object]:
    from ..io.ghost_model_file import read_tracks
    from ..measure.notes import noted, run_digest

    tracks, given = read_tracks(job.needed(TRACKS, "track")), _track_given(job)
    if noted(job.folder, "track") not in (None, run_digest(job.folder, job.run, given)):
        raise FlarewrightError(
            f"{job.folder / TRACKS} was made from another {MODEL}, from other frames or with another --every: run "
            f"flarewright measure track {job.folder} again, or measure run, which does what is needed"
        )
    return {**given, "tracks": tracks.model_dump_json()}


def _compress(job: _Job, made: Path, steps: Journal) -> None:
    from ..io.ghost_model_file import read_tracks, write_ghost_model
    from ..measure.track_stage import compress_ghosts

    small = compress_ghosts(
        job.folder, job.run, _model(job.folder / MODEL), read_tracks(job.folder / TRACKS), every=job.every,
        rest=job.whole, threads=job.threads, tell=job.progress, journal=steps,
    )  # fmt: skip
    write_ghost_model(made, small)


def _model(path: Path) -> GhostModel:
    from ..io.ghost_model_file import read_ghost_model

    return read_ghost_model(path)


_STAGES = {
    "find": _Stage(FOUND, _find_given, _find),
    "fit": _Stage(MODEL, _fit_given, _fit),
    "track": _Stage(TRACKS, _track_given, _track),
    "compress": _Stage(COMPACT, _compress_given, _compress),
}
