"""Overhead of an item on Dask against processes of our own, and frames a minute on both.

The items of the first rows do nothing, so their time is that of the way there and back. Frames are drafts, small enough
that this way can be seen. The first items of a list wait for imports and the start of workers, and do not count.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Iterable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from flarewright import Camera, Light, LightKey, Output, Project, Quality
from flarewright.jobs.answers import Done
from flarewright.jobs.cluster.executor import Cluster, open_cluster
from flarewright.jobs.processes import work_off
from flarewright.workflow.shot_frame import ShotPlan

Row = Callable[..., dict[str, Any]]

ITEMS, FRAMES = 1000, 48
_DRAW = "flarewright.workflow.shot_frame:draw_frame"


def nothing(context: None, item: int, threads: int | None) -> int:  # noqa: ARG001 - as each such function
    return item


def cluster(row: Row, cores: int) -> list[dict[str, Any]]:
    """Return the time of an item that does nothing, and the frames a minute."""
    rows = [row("cluster", "item, 2 processes", 1e3 * _item_seconds(None), "ms")]
    numbers = sorted({1, min(2, cores)})
    for number in numbers:
        rows.append(row("cluster", f"frames, {number} process(es)", 60.0 / _frame_seconds(number, None), "1/min"))
    if find_spec("distributed") is None:
        return rows
    with tempfile.TemporaryDirectory() as folder, open_cluster("local", folder) as dask:
        rows.append(row("cluster", "item, Dask, 2 workers", 1e3 * _item_seconds(dask), "ms"))
    for number in numbers:
        # another cluster each time: one never gets smaller
        with tempfile.TemporaryDirectory() as folder, open_cluster("local", folder) as dask:
            name = f"frames, Dask, {number} worker(s)"
            rows.append(row("cluster", name, 60.0 / _frame_seconds(number, dask), "1/min"))
    return rows


def _item_seconds(dask: Cluster | None) -> float:
    done = work_off("benchmarks.cluster:nothing", None, range(ITEMS), processes=2, threads=1, executor=dask)
    return _seconds_each(done, ITEMS, ITEMS // 10)


def _frame_seconds(processes: int, dask: Cluster | None) -> float:
    path = (LightKey(at_s=0.0, field_deg=(-6.0, 3.0)), LightKey(at_s=4.0, field_deg=(6.0, 3.0)))
    project = Project(
        lens="heliar-tronnier",
        f_number=8,
        lights=[Light(field_deg=(5.0, 5.0), keyframes=path)],
        camera=Camera(size_px=(960, 540)),
        quality=Quality(mode="draft"),
        output=Output(starburst=False),
    )
    with tempfile.TemporaryDirectory() as folder:
        plan = ShotPlan(project, str(Path(folder) / "f.####.exr"))
        frames = range(1, FRAMES + 1)
        done = work_off(_DRAW, plan, frames, processes=processes, threads=1, what="frame", executor=dask)
        return _seconds_each(done, FRAMES, FRAMES // 4)


def _seconds_each(done: Iterable[Done], items: int, first: int) -> float:
    """Return the time of an item behind the first ones, which wait for the start of processes and their imports."""
    started = 0.0
    for count, _ in enumerate(done, 1):
        if count == first:
            started = time.perf_counter()
    return (time.perf_counter() - started) / (items - first)
