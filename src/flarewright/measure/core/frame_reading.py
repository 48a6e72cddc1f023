"""Read the frames of a merged run as views."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np

from ...errors import FlarewrightError
from ...io.measurement.merged import read_frame
from ...model.measurement.capture import FrameInfo, MergedRun
from .parallel import map_batched
from .views import View, views_of


def read_views(
    folder: Path, run: MergedRun, every: int = 1, pool: ThreadPoolExecutor | None = None
) -> tuple[View, ...]:
    """Read every n-th frame of each roll of a run, in order of rising constellation; other files are not opened.

    Raises
    ------
    FlarewrightError
        When a frame cannot be read, fewer than three remain, or nothing was measured in any of them.
    """
    largest = max((abs(each.constellation_deg) for each in run.frames), default=0.0)
    rolls: dict[float, list[FrameInfo]] = {}
    for each in sorted(run.frames, key=lambda one: (one.nominal_deg, one.constellation_deg)):
        rolls.setdefault(each.nominal_roll_deg, []).append(each)
    check_every([len(turned) for turned in rolls.values()], every, folder)
    frames = [each for turned in rolls.values() for each in turned[::every]]
    frames.sort(key=lambda each: (each.constellation_deg, each.roll_deg))
    views = views_of(map_batched(partial(read_frame, folder), frames, pool=pool), largest)
    if not any(np.isfinite(view.variance).any() for view in views):
        raise FlarewrightError(
            f"{folder}: every pixel of every frame counts as clipped (its variance is not finite), so nothing is "
            "measured: merge again with shorter exposures, or correct the white level in camera.json"
        )
    return views


def check_every(sizes: Sequence[int], every: int, where: Path) -> None:
    """Check that every n-th frame of each roll leaves enough to follow a ghost.

    Parameters
    ----------
    sizes : sequence of int
        Number of frames of each roll.
    every : int
    where : Path
        For the message.

    Raises
    ------
    FlarewrightError
        When fewer than three of at least three frames remain.
    """
    total, kept = sum(sizes), sum(len(range(0, size, every)) for size in sizes)
    if kept < 3 <= total:
        raise FlarewrightError(
            f"{where}: --every {every} leaves {kept} of {total} constellations, too few to follow a ghost; use at most "
            f"--every {max(1, (total - 1) // 2)}"
        )
