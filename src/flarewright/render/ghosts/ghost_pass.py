"""The ghost pass: draw the ghosts of all paths and lights in the quality of the project."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

from ...model import Quality
from ...optics.lens.paths import LightPath
from ...typing import Progress
from ..image.ghost_ranking import GhostRanking
from ..image.partial_picture import PartialPicture
from ..scene.art_rules import PathArt
from ..scene.shot import Shot
from .cost import CostMeter
from .draft_ghosts import draw_drafts
from .final_ghosts import draw_finals
from .ghost_sums import GhostPass, GhostWork, ProgressMeter


def render_ghosts(
    shots: Sequence[Shot],
    paths: Sequence[LightPath],
    quality: Quality,
    *,
    singles: int | None = 0,
    art: Mapping[str, PathArt] | None = None,
    level: float = 0.0,
    faintest: float = 0.0,
    threads: int | None = None,
    progress: Progress | None = None,
    costs: CostMeter | None = None,
    kept: PartialPicture | None = None,
    ranking: GhostRanking | None = None,
) -> GhostPass:
    """Draw the ghosts of all paths and lights.

    Parameters
    ----------
    shots : sequence of Shot
    paths : sequence of LightPath
    quality : Quality
    singles : int or None
        How many of the brightest paths also get a separate layer; None: all.
    art : mapping of str to PathArt, optional
        Overrides by path name.
    level : float
        Final quality: `GhostPass.level` of other ghosts in the same picture; these ghosts are drawn with no more detail
        than is visible among them.
    faintest : float
        Final quality: paths with a lower level are left out; art gains do not count.
    threads : int, optional
        None: all cores. The pixels do not depend on it.
    progress : callable, optional
        Called with the finished part (0 to 1) and the name of the step.
    costs : CostMeter, optional
        Final quality: gets the time and the work of each ghost.
    kept : PartialPicture, optional
        Final quality: keeps the drawn ghosts in files.
    ranking : GhostRanking, optional
        Gets the luminance of each ghost; all are drawn separately then, as for layers of single ghosts.
    """
    art = art or {}
    shown = [path for path in paths if path.name not in art or art[path.name].enabled]
    meter = ProgressMeter(len(shown) * (2 if quality.mode == "final" else 1), progress)
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        work = GhostWork(shots, shown, quality, singles, art, pool, meter, ranking)
        try:
            if quality.mode == "draft":
                done = draw_drafts(work)
            else:
                done = draw_finals(work, level=level, faintest=faintest, costs=costs, kept=kept)
            return replace(done, muted=len(paths) - len(shown))
        except BaseException:
            # Ctrl-C arrives here: workers stop at their next wavelength
            meter.cancelled.set()
            pool.shutdown(wait=True, cancel_futures=True)
            raise
