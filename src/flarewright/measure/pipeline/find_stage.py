"""Find stage (second of a measurement): detect the ghosts of a merged run."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from ...model.measurement.capture import MergedRun
from ...model.measurement.corrections import Corrections
from ...model.measurement.ghost_model import GhostModel
from ...typing import Progress, Report
from ..core.checkpoint import Journal
from ..core.frame_reading import read_views
from ..core.sampling import evenly_spaced
from ..core.views import all_finite
from ..detection.channel_mix import channel_weights
from ..detection.join_ghosts import join_ghosts
from ..detection.matching_pursuit import pursue
from ..detection.split_ghosts import split_ghosts
from ..detection.user_hints import candidate, report_marks, without_removed
from ..fitting.alternating_fit import to_model
from ..fitting.joint_intensities import solve_intensities
from ..fitting.restart import restart_jointly
from ..glow.fit import iris_of
from ..glow.rejection import is_residual_glow
from ..glow.subtraction import fit_and_subtract_glow
from .search_images import mixed_for_search, model_of_run, scaled_ghost, search_views, star_of
from .settings import MeasureSettings


def find_ghosts(
    folder: Path, run: MergedRun, *, every: int = 1, corrections: Corrections | None = None, max_ghosts: int = 60,
    threads: int | None = None, report: Report = lambda _: None, progress: Progress = lambda _part, _words: None,
    journal: Journal | None = None, settings: MeasureSettings = MeasureSettings(),
) -> GhostModel:  # fmt: skip
    """Detect the ghosts of a merged run.

    Parameters
    ----------
    folder : Path
    run : MergedRun
    every : int
        Step between the constellations used; the others are not read.
    corrections : Corrections, optional
        Ghosts that the user adds or removes.
    max_ghosts : int
        Largest number of ghosts.
    threads : int, optional
    report : callable
        Called with a line for each ghost.
    progress : callable
        Called with the finished part (0 to 1) and a description.
    journal : Journal, optional
        Journal of an interrupted run to resume; it does not change the result.
    settings : MeasureSettings

    Returns
    -------
    GhostModel
        Rough model: all colours of a ghost share one shape.

    Raises
    ------
    FlarewrightError
        When frames cannot be read or are too few, or a correction points at no light.
    """
    known, detection, fit = corrections or Corrections(), settings.detection, settings.detection.fit
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        views = read_views(folder, run, every, pool)
        dim = fit_and_subtract_glow([], views, star_of(views, pool, settings.glow), pool, settings.glow)
        searched, subtracted = evenly_spaced(views, detection.views), evenly_spaced(dim.views, detection.views)
        times, small = search_views(subtracted, detection)
        seen = mixed_for_search(searched, subtracted, channel_weights(subtracted), pool, settings)
        iris = iris_of(dim.star, settings.glow.star)
        factor = 2.0**times
        pointed = [candidate(each, views, run, looked=len(seen), factor=factor) for each in known.add]
        measured = [all_finite(view.variance) for view in small]
        found = pursue(
            seen, measured, most=max_ghosts, first=pointed, iris=iris, factor=factor, pool=pool, report=report,
            progress=progress, journal=journal, settings=detection,
        )  # fmt: skip
        found = solve_intensities(found, seen, pool=pool, settings=fit)
        found = join_ghosts(found, seen, factor=factor, pool=pool, report=report, settings=detection)
        found = restart_jointly(found, seen, pool=pool, journal=journal, settings=fit)
        found = solve_intensities(found, small, pool=pool, settings=fit)
        found = split_ghosts(
            found, small, iris=iris, factor=factor, pool=pool, report=report, journal=journal, settings=detection
        )
        found = solve_intensities(found, small, pool=pool, settings=fit)
    report_marks(known, pointed, found, report)
    whole = [scaled_ghost(ghost, factor) for ghost in found]
    ghosts = to_model(whole, searched)
    rejected = is_residual_glow(whole, searched, settings.glow.rejection)
    glow = [ghost.name for ghost, left in zip(ghosts, rejected, strict=True) if left]
    for name in glow:
        report(f"ghost {name} is no brighter than the residual of halo and star: left out")
    wanted = tuple(ghost for ghost in without_removed(known, ghosts, report) if ghost.name not in glow)
    return model_of_run(run, wanted, dim, views).replace(
        removed=tuple(ghost for ghost in ghosts if ghost not in wanted)
    )
