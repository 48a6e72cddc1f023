"""Compress stage (fifth of a measurement): replace the tracks of ghosts by curves over the constellation angle."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from ...errors import FlarewrightError
from ...model.measurement.capture import MergedRun
from ...model.measurement.ghost_model import GhostModel
from ...model.measurement.ghost_tracks import Tracks
from ...typing import Progress
from ..compression.prune import compact_model
from ..core.checkpoint import Journal
from ..core.frame_reading import read_views
from ..glow.subtraction import subtract_glow
from ..residual.learn import with_residual
from .removed_light import without_removed
from .settings import MeasureSettings
from .track_stage import check_size, checked_ghosts


def compress_ghosts(
    folder: Path, run: MergedRun, model: GhostModel, tracks: Tracks, *, every: int = 1, residual: bool = True,
    threads: int | None = None, progress: Progress = lambda _part, _words: None, journal: Journal | None = None,
    settings: MeasureSettings = MeasureSettings(),
) -> GhostModel:  # fmt: skip
    """Reduce a model to the curves that the frames of a run require; see `prune.compact_model`.

    Parameters
    ----------
    folder : Path
    run : MergedRun
    model : GhostModel
        From `fit_ghosts`.
    tracks : Tracks
        Tracks of the model's ghosts, from `track_ghosts`.
    every : int
        Step between the constellations used, as for `track_ghosts`.
    residual : bool
        Whether to learn the residual beside the ghosts too. Without it the model has no sprites.
    threads : int, optional
    progress : callable
        Called with the finished part (0 to 1) and a description.
    journal : Journal, optional
        As for `find_ghosts`.
    settings : MeasureSettings

    Raises
    ------
    FlarewrightError
        When frames cannot be read or are too few, or the tracks belong to another model.
    """
    checked_ghosts(model)
    names = {ghost.name for ghost in model.ghosts}
    if names != {track.name for track in tracks.ghosts}:
        raise FlarewrightError("the tracks are of other ghosts than the model's; run flarewright measure track again")
    check_size(run, model)
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        views = read_views(folder, run, every, pool)
        dim = subtract_glow(views, model.halo, model.star, pool, settings.glow)
        dim = without_removed(dim, model, settings.fit.model_error, pool)
    small = compact_model(
        model, tracks, dim, threads=threads, progress=progress, journal=journal, settings=settings.compression
    )
    # free the memory before `with_residual` computes its own views
    del dim
    if residual:
        return with_residual(small, views, threads, journal)
    return small.replace(sprites=())
