"""Run the stages of a measurement after merging, and keep files whose inputs have not changed."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from ..errors import FlarewrightError
from ..io.measurement.ghost_model_file import (
    read_corrections,
    read_ghost_model,
    read_ghost_tracks,
    write_ghost_model,
    write_ghost_tracks,
)
from ..io.measurement.merged import read_run
from ..measure.compression.prune import count_parameters
from ..measure.core.checkpoint import Journal, journal
from ..measure.core.frame_reading import read_views
from ..measure.pipeline import compress_stage, find_stage, fit_stage, track_stage
from ..measure.pipeline.provenance import is_current, note, note_corrections, noted, noted_corrections, run_digest
from ..measure.pipeline.search_images import reference_of
from ..measure.pipeline.settings import MeasureSettings
from ..measure.residual import learn
from ..measure.walch.per_frame_fit import fit_as_walch
from ..measure.walch.settings import WalchSettings
from ..model.measurement.capture import OF_LIGHT, MergedRun
from ..model.measurement.corrections import Corrections
from ..model.measurement.ghost_model import GhostModel
from ..model.measurement.ghost_tracks import Tracks
from ..sentences import count
from ..typing import Progress, Report
from .measure_provenance import COMPACT, FOUND, MODEL, STAGES, TRACKS, as_measured, note_source

Begin = Callable[[str], AbstractContextManager[Progress]]
"""Called with the name of a stage that starts; its context yields the progress callback of the stage."""


@dataclass(frozen=True)
class StageResult:
    """Result of a stage.

    Attributes
    ----------
    stage : str
        One of `STAGES`.
    file : Path
        File that the stage writes.
    counts : dict
        Number of "ghosts", "lives" or "numbers" in the file.
    kept : bool
        Whether the file was up to date, so that the stage did not run.
    unchanged : bool
        Whether the file is unchanged; a kept model can gain or lose its residual.
    """

    stage: str
    file: Path
    counts: dict[str, int]
    kept: bool
    unchanged: bool


class _Files:
    """The files of a run's folder, each parsed once; a model with residual has some 20 MB."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._models: dict[str, GhostModel] = {}
        self._tracks: Tracks | None = None

    def read(self, name: str) -> GhostModel:
        if name not in self._models:
            self._models[name] = read_ghost_model(self._folder / name)
        return self._models[name]

    def write(self, name: str, model: GhostModel) -> None:
        self._models.pop(name, None)
        write_ghost_model(self._folder / name, model)

    def read_tracks(self) -> Tracks:
        if self._tracks is None:
            self._tracks = read_ghost_tracks(self._folder / TRACKS)
        return self._tracks

    def write_tracks(self, tracks: Tracks) -> None:
        self._tracks = None
        write_ghost_tracks(self._folder / TRACKS, tracks)


@dataclass(frozen=True)
class _Job:
    """Input of every stage.

    The models have a residual if `residual`; only a stage with `whole` learns it.
    """

    folder: Path
    run: MergedRun
    every: int
    corrections: Corrections | None
    by: str
    residual: bool
    whole: bool
    threads: int | None
    report: Report
    progress: Progress
    settings: MeasureSettings
    walch: WalchSettings
    files: _Files = field(repr=False)

    def needed(self, name: str, stage: str) -> Path:
        """Return the file of an earlier stage; raise when it is missing."""
        path = self.folder / name
        if not path.is_file():
            raise FlarewrightError(f"{path} does not exist: run flarewright measure {stage} {self.folder} first")
        return path

    def given(self, *parts: str) -> dict[str, object]:
        """Return the inputs besides models, for JSON: `every`, and parts of the settings that are not the default."""
        differ = {name: getattr(self.settings, name) for name in parts}
        default = MeasureSettings()
        return {"every": self.every, **{k: repr(v) for k, v in differ.items() if v != getattr(default, k)}}

    def model(self, name: str, stage: str) -> GhostModel:
        """Read the model of an earlier stage."""
        self.needed(name, stage)
        return self.files.read(name)

    def tracks(self) -> Tracks:
        """Read the tracks of the ghosts."""
        self.needed(TRACKS, "track")
        return self.files.read_tracks()


@dataclass(frozen=True)
class _Stage:
    """Inputs of a stage and its function.

    Attributes
    ----------
    file : str
        File that the stage writes.
    given : callable
        Returns the inputs besides the frames, for JSON; raises when they are missing.
    make : callable
        Runs the stage and writes the file.
    """

    file: str
    given: Callable[[_Job], dict[str, object]]
    make: Callable[[_Job, Journal], None]


def run_stages(
    folder: Path,
    stages: Sequence[str] = STAGES,
    *,
    every: int = 1,
    corrections: Path | None = None,
    by: str = "joint",
    residual: bool = True,
    settings: MeasureSettings | None = None,
    walch: WalchSettings | None = None,
    threads: int | None = None,
    report: Report = lambda _: None,
    begin: Begin = lambda _: nullcontext(lambda _part, _words: None),
) -> Iterator[StageResult]:
    """Run stages in the folder of a merged run; a stage whose inputs have not changed is kept.

    An interrupted stage resumes from its checkpoint.

    Parameters
    ----------
    folder : Path
        Folder of the run, written by `measure.pipeline.merge_stage.merge_captures`.
    stages : sequence of str
        Stages to run, in the order of `STAGES`.
    every : int
        Use only every n-th merged frame.
    corrections : Path, optional
        JSON with ghosts to add and to remove (docs/ghost-model.md). They stay in effect for later searches until
        others are given.
    by : {"joint", "walch"}
        Method of the fit: all constellations jointly, or Walch's gradient descent frame by frame (2017).
    residual : bool
        Whether models contain the residual of ghosts, star and halo.
    settings : MeasureSettings, optional
    walch : WalchSettings, optional
        Settings of the fit by Walch's method.
    threads : int, optional
        Default: all cores; the result does not depend on it.
    report : callable
        Called with lines for the user.
    begin : callable
        Called when each stage starts.

    Yields
    ------
    StageResult
        After each stage.

    Raises
    ------
    FlarewrightError
        When the run cannot be read, or the file of an earlier stage is missing.

    Examples
    --------
    >>> from pathlib import Path
    >>> for result in run_stages(Path("run"), ("find", "fit")):  # doctest: +SKIP
    ...     print(result.stage, result.counts["ghosts"])
    """
    run = read_run(folder)
    chosen = _corrections(folder, corrections, report) if "find" in stages else None
    files, steered = _Files(folder), (settings or MeasureSettings(), walch or WalchSettings())
    for name in (one for one in STAGES if one in stages):
        made = folder / _STAGES[name].file
        with begin(name) as progress:
            # compress learns the residual of the small model, so an earlier stage need not
            whole = residual and (name == "compress" or "compress" not in stages)
            job = _Job(folder, run, every, chosen, by, residual, whole, threads, report, progress, *steered, files)
            kept, unchanged = _kept(job, name, made)
            if made.name != TRACKS:
                _add_light(job, made.name)
        yield StageResult(name, made, _counts(job, made.name), kept, unchanged)


def _kept(job: _Job, name: str, made: Path) -> tuple[bool, bool]:
    """Run a stage unless its file is up to date; return whether it was, and whether the file is unchanged."""
    folder, stage = job.folder, _STAGES[name]
    digest = run_digest(folder, job.run, stage.given(job))
    if is_current(folder, name, digest, made):
        return True, _as_wanted(job, name, digest, made.name)
    with journal(folder / f"{name}.journal", digest, job.report) as steps:
        if steps.remembered:
            job.report(f"{name} resumes after {count(steps.remembered, 'step')} of an earlier run")
        stage.make(job, steps)
    if name == "find":
        note_corrections(folder, job.corrections)
    note_source(folder, name, job.files.read)
    note(folder, name, digest)
    return False, False


def _add_light(job: _Job, name: str) -> None:
    """Update the known values of the light and of clipping in a model; ghosts do not depend on them."""
    model, known = job.files.read(name), reference_of(job.run)
    light = known.model_dump(include=OF_LIGHT, exclude_none=True)
    reference = model.reference.replace(clipping=model.reference.clipping or known.clipping, **light)
    if reference != model.reference:
        job.files.write(name, model.replace(reference=reference))


def _corrections(folder: Path, given: Path | None, report: Report) -> Corrections | None:
    """Return the corrections of a search: the given ones, otherwise those of an earlier search."""
    if given is not None:
        known = read_corrections(given)
        return known if known.add or known.remove else None
    before = noted_corrections(folder)
    if before is not None:
        report("corrections of an earlier search are in effect; give --corrections a file with {} to drop them")
    return before


def _counts(job: _Job, name: str) -> dict[str, int]:
    if name == TRACKS:
        tracks = job.tracks().ghosts
        return {"ghosts": len(tracks), "lives": sum(len(one.lives) for one in tracks)}
    model = job.files.read(name)
    return {"ghosts": len(model.ghosts), **({"numbers": count_parameters(model)} if name == COMPACT else {})}


def _find_given(job: _Job) -> dict[str, object]:
    return {
        **job.given("detection", "glow"),
        "corrections": None if job.corrections is None else job.corrections.model_dump_json(),
    }


def _find(job: _Job, steps: Journal) -> None:
    found = find_stage.find_ghosts(
        job.folder, job.run, every=job.every, corrections=job.corrections, threads=job.threads, report=job.report,
        progress=job.progress, journal=steps, settings=job.settings,
    )  # fmt: skip
    job.files.write(FOUND, found)


def _fit_given(job: _Job) -> dict[str, object]:
    found = {"found": as_measured(job.model(FOUND, "find"))}
    if job.by == "joint":
        return {**job.given("detection", "fit", "glow"), **found}
    steered = {} if job.walch == WalchSettings() else {"walch": repr(job.walch)}
    # change the digest when the same numbers describe another ghost
    return {**job.given(), **found, "by": job.by, "numbers": "by the angle from the axis", **steered}


def _fit(job: _Job, steps: Journal) -> None:
    joint = partial(fit_stage.fit_ghosts, settings=job.settings)
    way = joint if job.by == "joint" else partial(fit_as_walch, settings=job.walch)
    model = way(
        job.folder, job.run, job.files.read(FOUND), every=job.every, residual=job.whole, threads=job.threads,
        report=job.report, progress=job.progress, journal=steps,
    )  # fmt: skip
    job.files.write(MODEL, model)


def _as_wanted(job: _Job, name: str, digest: str, made: str) -> bool:
    """Learn the residual of a kept model that lacks it, or drop one that is not requested.

    Returns
    -------
    bool
        Whether the file is unchanged.
    """
    if name not in ("fit", "compress"):
        return True
    model, left = job.files.read(made), job.folder / f"{name}-residual.journal"
    if model.sprites and not job.residual:
        job.files.write(made, model.replace(sprites=()))
    elif job.whole and not model.sprites:
        with journal(left, digest, job.report) as steps:
            views = read_views(job.folder, job.run, job.every)
            job.files.write(made, learn.with_residual(model, views, job.threads, steps))
    else:
        if not job.residual:
            # an earlier command can have left a checkpoint
            left.unlink(missing_ok=True)
        return True
    return False


def _track_given(job: _Job, *parts: str) -> dict[str, object]:
    # tracking uses the ghosts, halo and star only
    return {**job.given(*parts, "glow"), "model": as_measured(job.model(MODEL, "fit").replace(sprites=()))}


def _track(job: _Job, steps: Journal) -> None:
    tracks = track_stage.track_ghosts(
        job.folder, job.run, job.files.read(MODEL), every=job.every, threads=job.threads, progress=job.progress,
        journal=steps, settings=job.settings,
    )  # fmt: skip
    job.files.write_tracks(tracks)


def _compress_given(job: _Job) -> dict[str, object]:
    tracks, given = job.tracks(), _track_given(job, "tracking")
    if noted(job.folder, "track") not in (None, run_digest(job.folder, job.run, given)):
        raise FlarewrightError(
            f"{job.folder / TRACKS} was made from another {MODEL}, from other frames or with another --every: run "
            f"flarewright measure track {job.folder} again, or measure run, which does what is needed"
        )
    return {**_track_given(job, "compression"), "tracks": tracks.model_dump_json()}


def _compress(job: _Job, steps: Journal) -> None:
    small = compress_stage.compress_ghosts(
        job.folder, job.run, job.files.read(MODEL), job.tracks(), every=job.every, residual=job.whole,
        threads=job.threads, progress=job.progress, journal=steps, settings=job.settings,
    )  # fmt: skip
    job.files.write(COMPACT, small)


_STAGES = {
    "find": _Stage(FOUND, _find_given, _find),
    "fit": _Stage(MODEL, _fit_given, _fit),
    "track": _Stage(TRACKS, lambda job: _track_given(job, "tracking"), _track),
    "compress": _Stage(COMPACT, _compress_given, _compress),
}
