"""Merge the photographs of a measurement, on this machine or on a cluster."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Generator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from ..io.measurement.captures import AngleRule, captures_folder, read_camera, read_capture_list
from ..jobs.cluster.executor import Cluster, open_cluster
from ..jobs.processes import shares, work_off
from ..jobs.worker import WRITING
from ..measure.core.frame_reading import check_every
from ..measure.merging.settings import MergeSettings
from ..measure.pipeline.merge_stage import (
    FrameOutcome,
    MergePlan,
    check_same_run,
    exposure_groups,
    merge_captures,
    merge_frame,
)
from ..measure.report.overview import write_overview
from ..model.measurement.capture import CameraNoise, Capture, MergedRun
from ..typing import Progress, Report

_MERGE = "flarewright.workflow.measure_merge:frame_on_worker"


def merge_photographs(
    captures: Path,
    output: Path,
    *,
    rule: AngleRule | None = None,
    camera: Path | None = None,
    settings: MergeSettings = MergeSettings(),
    every: int = 1,
    threads: int | None = None,
    cluster: str | None = None,
    progress: Progress | None = None,
    report: Report = lambda _: None,
) -> MergedRun:
    """Merge the exposures of a list of photographs, and draw an overview; resumes an interrupted run.

    Parameters
    ----------
    captures : Path
        captures.csv, or a folder of photographs, which needs a rule.
    output : Path
        Folder of the run.
    rule : AngleRule, optional
        Angles of the photographs (`io.measurement.captures.parse_rule`).
    camera : Path, optional
        Black and white level and noise. None: camera.json beside the list, if present.
    settings : MergeSettings
    every : int
        Later stages use every n-th frame; whether they can is checked before the work.
    threads : int, optional
        Default: all cores; the pixels do not depend on it.
    cluster : str, optional
        As of `merge_on`.
    progress : callable, optional
    report : callable
        Called with sentences on the run and on the cluster as they arise.

    Raises
    ------
    FlarewrightError
        When the list, the camera or a photograph cannot be used, or the folder holds another run.
    """
    known = _camera(captures, camera)
    check_same_run(output)
    if progress is not None:
        progress(0.0, "reading the list")
    listed, remarks = read_capture_list(captures, rule)
    rolls = Counter(group[0].roll_deg for group in exposure_groups(listed))
    check_every(list(rolls.values()), every, captures)
    merged = merge_on(
        cluster, listed, captures_folder(captures), output, camera=known, settings=settings, threads=threads,
        progress=progress, remarks=remarks, report=report, announce=report,
    )  # fmt: skip
    write_overview(output, merged)
    return merged


def _camera(captures: Path, camera: Path | None) -> CameraNoise | None:
    """Read what is known about the camera."""
    if camera is not None:
        return read_camera(camera)
    beside = captures_folder(captures) / "camera.json"
    return read_camera(beside) if beside.is_file() else None


def merge_on(
    cluster: str | None,
    captures: Sequence[Capture],
    folder: Path,
    output: Path,
    *,
    announce: Callable[[str], None] | None = None,
    **more: Any,
) -> MergedRun:
    """Merge all constellations, each on a worker of a cluster.

    Parameters
    ----------
    cluster : str or None
        Workers of a Dask cluster: "local:4", "tcp://HOST:PORT" or "slurm:FILE" (docs/many-machines.md). None: threads
        of this process. The frames do not depend on it.
    captures, folder, output, **more
        As of `measure.pipeline.merge_stage.merge_captures`.
    announce : callable, optional
        Called with sentences about the cluster as they arise.

    Raises
    ------
    FlarewrightError
        As of `merge_captures`, or there is no such cluster.

    Examples
    --------
    >>> from flarewright.io.measurement.captures import read_captures
    >>> listed = read_captures("photos/captures.csv")                                   # doctest: +SKIP
    >>> merge_on("local:2", listed, Path("photos"), Path("run"))                        # doctest: +SKIP
    """
    # the run's folder is made when the photographs are checked
    there = next((each for each in (output, *output.parents) if each.is_dir()), Path())
    with open_cluster(cluster, there, announce) as executor:
        spread = None if executor is None else partial(_spread, executor)
        return merge_captures(captures, folder, output, spread=spread, **more)


def frame_on_worker(plan: MergePlan, number: int, threads: int | None) -> FrameOutcome:
    """Merge a frame in a process that can be ended; a frame has one thread."""
    del threads
    return merge_frame(plan, number, WRITING)


def _spread(
    executor: Cluster, plan: MergePlan, frames: Sequence[int], workers: int
) -> Generator[FrameOutcome, None, None]:
    number, _ = shares(len(frames), executor.chosen or workers, None)
    for done in work_off(_MERGE, plan, frames, processes=number, threads=1, what="frame", executor=executor):
        yield done.result
