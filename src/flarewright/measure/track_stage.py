"""The stages after the fit: follow the ghosts of a model through a run's frames, and make the model small."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

from ..errors import FlarewrightError
from ..model.capture import MergedRun
from ..model.ghost_model import AberrationGhost, GhostModel
from ..model.ghost_tracks import Tracks
from .compact import compact
from .dimmed import beside
from .journal import Journal
from .numbers import channel_numbers
from .reading import read_views
from .rest_fit import with_rest
from .shape import Shape, enlarged
from .shared_out import shared_out
from .together import Shapes, halvings
from .track import follow
from .views import coarse

Tell = Callable[[float, str], None]


def track_ghosts(
    folder: Path,
    run: MergedRun,
    model: GhostModel,
    *,
    every: int = 1,
    threads: int | None = None,
    tell: Tell = lambda _part, _words: None,
    journal: Journal | None = None,
) -> Tracks:
    """Follow a model's ghosts through the frames of a run.

    Parameters
    ----------
    folder : Path
    run : MergedRun
    model : GhostModel
        From `fit_ghosts`.
    every : int
        Only every n-th constellation is looked at.
    threads : int, optional
        The tracks do not depend on it.
    tell : callable
        Gets the finished part and words.
    journal : Journal, optional
        Of an earlier run that was stopped; the result is the same with and without.

    Returns
    -------
    Tracks
        Shifts in pixels of the frames, though wide pictures are followed in smaller ones (`WIDTH`).

    Raises
    ------
    FlarewrightError
        When frames cannot be read or are too few, or a ghost has no aberrations to be followed by.
    """
    _check_size(run, model)
    times = halvings(run.size_px[0])
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        views = beside(read_views(folder, run, every, pool), model.halo, model.star, pool)
        small = shared_out(partial(coarse, times=times), views, pool=pool)
    ghosts = [_shapes(ghost, 0.5**times) for ghost in _checked(model)]
    tracks = follow([ghost.name for ghost in model.ghosts], ghosts, small, threads=threads, tell=tell, journal=journal)
    return tracks if times == 0 else _enlarged(tracks, 2.0**times)


def compress_ghosts(
    folder: Path,
    run: MergedRun,
    model: GhostModel,
    tracks: Tracks,
    *,
    every: int = 1,
    rest: bool = True,
    threads: int | None = None,
    tell: Tell = lambda _part, _words: None,
    journal: Journal | None = None,
) -> GhostModel:
    """Make a model small, judged by the frames of a run; see `compact.compact`.

    Parameters
    ----------
    folder : Path
    run : MergedRun
    model : GhostModel
        From `fit_ghosts`.
    tracks : Tracks
        Of its ghosts, from `track_ghosts`.
    every : int
        As for `track_ghosts`.
    rest : bool
        Also learn what is left beside the ghosts; without, the model has no sprites.
    threads : int, optional
    tell : callable
        Gets the finished part and words.

    Returns
    -------
    GhostModel

    Raises
    ------
    FlarewrightError
        When frames cannot be read or are too few, or the tracks are of another model.
    """
    _checked(model)
    names = {ghost.name for ghost in model.ghosts}
    if names != {track.name for track in tracks.ghosts}:
        raise FlarewrightError("the tracks are of other ghosts than the model's; run flarewright measure track again")
    _check_size(run, model)
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        views = read_views(folder, run, every, pool)
        dim = beside(views, model.halo, model.star, pool)
    small = compact(model, tracks, dim, threads=threads, tell=tell, journal=journal)
    # they need not be there beside what `with_rest` makes
    del dim
    if rest:
        return with_rest(small, views, threads, journal)
    out: GhostModel = small.replace(sprites=())
    return out


def _check_size(run: MergedRun, model: GhostModel) -> None:
    if tuple(run.size_px) != tuple(model.size_px):
        raise FlarewrightError(
            f"the model was fitted to pictures of {model.size_px[0]}x{model.size_px[1]} pixels and the frames have "
            f"{run.size_px[0]}x{run.size_px[1]}; run flarewright measure fit again"
        )


def _checked(model: GhostModel) -> list[AberrationGhost]:
    ghosts = [ghost for ghost in model.ghosts if isinstance(ghost, AberrationGhost)]
    if len(ghosts) < len(model.ghosts):
        raise FlarewrightError(
            "a Bezier ghost has its numbers over the constellation already: replay the model as it is, or take it out"
        )
    return ghosts


def _shapes(ghost: AberrationGhost, factor: float) -> Shapes:
    colours = ghost.red, ghost.green, ghost.blue
    red, green, blue = (
        enlarged(Shape(channel_numbers(each, ghost.blades), len(each.discs)), factor) for each in colours
    )
    return red, green, blue


def _enlarged(tracks: Tracks, factor: float) -> Tracks:
    """Return tracks in pixels that are smaller by a factor."""
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
    out: Tracks = tracks.replace(ghosts=tuple(ghosts))
    return out
