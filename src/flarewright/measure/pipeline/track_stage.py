"""Track stage (fourth of a measurement): fit each ghost of a model in each frame of a run."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

from ...errors import FlarewrightError
from ...model.measurement.capture import MergedRun
from ...model.measurement.ghost_model import AberrationGhost, GhostModel
from ...model.measurement.ghost_tracks import Tracks
from ...typing import Progress
from ..core.checkpoint import Journal
from ..core.frame_reading import read_views
from ..core.parallel import map_batched
from ..core.parameter_vector import channel_numbers
from ..core.parameters import Shape, rescaled
from ..core.views import halved_view
from ..glow.subtraction import subtract_glow
from ..tracking.follow import follow
from ..tracking.frame_fit import Shapes, frame_halvings
from .removed_light import without_removed
from .settings import MeasureSettings


def track_ghosts(
    folder: Path, run: MergedRun, model: GhostModel, *, every: int = 1, threads: int | None = None,
    progress: Progress = lambda _part, _words: None, journal: Journal | None = None,
    settings: MeasureSettings = MeasureSettings(),
) -> Tracks:  # fmt: skip
    """Track a model's ghosts through the frames of a run.

    Parameters
    ----------
    folder : Path
    run : MergedRun
    model : GhostModel
        From `fit_ghosts`.
    every : int
        Step between the constellations used.
    threads : int, optional
        The tracks do not depend on it.
    progress : callable
        Called with the finished part (0 to 1) and a description.
    journal : Journal, optional
        Journal of an interrupted run to resume; it does not change the result.
    settings : MeasureSettings

    Returns
    -------
    Tracks
        Shifts in pixels of the frames, also where reduced frames were used (`FrameFitSettings.width_px`).

    Raises
    ------
    FlarewrightError
        When frames cannot be read or are too few, or a ghost is not an `AberrationGhost`.
    """
    check_size(run, model)
    times = frame_halvings(run.size_px[0], settings.tracking.frame)
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        views = subtract_glow(read_views(folder, run, every, pool), model.halo, model.star, pool, settings.glow)
        views = without_removed(views, model, settings.fit.model_error, pool)
        small = map_batched(partial(halved_view, times=times), views, pool=pool)
    known = checked_ghosts(model)
    ghosts, spans = [_shapes(ghost, 0.5**times) for ghost in known], [_shown(ghost) for ghost in known]
    names, how = [ghost.name for ghost in model.ghosts], settings.tracking
    tracks = follow(
        names, ghosts, small, spans=spans, threads=threads, progress=progress, journal=journal, settings=how
    )
    return tracks if times == 0 else _enlarged(tracks, 2.0**times)


def check_size(run: MergedRun, model: GhostModel) -> None:
    """Raise when a model was fitted to frames of another size than the run's."""
    if tuple(run.size_px) != tuple(model.size_px):
        raise FlarewrightError(
            f"the model was fitted to pictures of {model.size_px[0]}x{model.size_px[1]} pixels and the frames have "
            f"{run.size_px[0]}x{run.size_px[1]}; run flarewright measure fit again"
        )


def checked_ghosts(model: GhostModel) -> list[AberrationGhost]:
    """Return the ghosts of a model; raise when one is not an `AberrationGhost`."""
    ghosts = [ghost for ghost in model.ghosts if isinstance(ghost, AberrationGhost)]
    if len(ghosts) < len(model.ghosts):
        raise FlarewrightError(
            "a Bezier ghost is a function of the constellation already: replay the model as it is, or remove the ghost"
        )
    return ghosts


def _shapes(ghost: AberrationGhost, factor: float) -> Shapes:
    colours = ghost.red, ghost.green, ghost.blue
    red, green, blue = (
        rescaled(Shape(channel_numbers(each, ghost.blades), len(each.discs)), factor) for each in colours
    )
    return red, green, blue


def _shown(ghost: AberrationGhost) -> tuple[float, float]:
    """Return the first and the last constellation at which all light of a ghost is there."""
    (low, high), (rise, fall) = ghost.visible_deg, ghost.fade_deg
    return round(low + 0.5 * rise, 6), round(high - 0.5 * fall, 6)


def _enlarged(tracks: Tracks, factor: float) -> Tracks:
    """Return tracks in units of pixels that are smaller by a factor."""
    ghosts = []
    for track in tracks.ghosts:
        steps = tuple(
            step.replace(
                along_px=None if step.along_px is None else step.along_px * factor,
                along_error_px=None if step.along_error_px is None else step.along_error_px * factor,
            )
            for step in track.steps
        )
        ghosts.append(track.replace(steps=steps))
    return tracks.replace(ghosts=tuple(ghosts))
