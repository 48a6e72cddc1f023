"""Merge the photographs of a measurement, on this machine or on a cluster."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from ..jobs.cluster.executor import Cluster, open_cluster
from ..jobs.processes import shares, work_off
from ..jobs.worker import WRITING
from ..measure.pipeline.merge_stage import FrameOutcome, MergePlan, merge_captures, merge_frame
from ..model.measurement.capture import Capture, MergedRun

_MERGE = "flarewright.workflow.measure_merge:frame_on_worker"


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

    Returns
    -------
    MergedRun

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
