"""Fit stage (third of a measurement): fit the detected ghosts in all colours and at all constellations."""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np

from ...errors import FlarewrightError
from ...model.measurement.capture import MergedRun
from ...model.measurement.ghost_model import AberrationGhost, Blades, GhostModel
from ...typing import Progress, Report
from ..core.checkpoint import Journal
from ..core.frame_reading import read_views
from ..core.parameter_vector import channel_numbers
from ..core.parameters import Shape
from ..core.sampling import evenly_spaced
from ..core.views import View, all_finite
from ..detection.channel_mix import channel_weights, mixture
from ..detection.join_ghosts import join_ghosts
from ..detection.matching_pursuit import pursue
from ..detection.settings import DetectionSettings
from ..detection.split_ghosts import split_ghosts
from ..fitting.alternating_fit import fit_all, to_model
from ..fitting.detected_ghost import CHANNELS, DetectedGhost, by_brightness, residual_of
from ..glow.fit import iris_of
from ..glow.rejection import with_glow_among_removed, with_glow_unwanted, without_glow
from ..glow.subtraction import fit_and_subtract_glow
from ..residual.learn import with_residual
from .search_images import mixed_for_search, model_of_run, scaled_ghost, search_views, star_of
from .settings import MeasureSettings


def fit_ghosts(
    folder: Path, run: MergedRun, rough: GhostModel, *, every: int = 1, extra_searches: int = 1, max_ghosts: int = 60,
    residual: bool = True, threads: int | None = None, report: Report = lambda _: None,
    progress: Progress = lambda _part, _words: None, journal: Journal | None = None,
    settings: MeasureSettings = MeasureSettings(),
) -> GhostModel:  # fmt: skip
    """Fit the detected ghosts in all colours and at all constellations.

    Parameters
    ----------
    folder : Path
    run : MergedRun
    rough : GhostModel
        From `find_ghosts`, optionally edited by the user.
    every : int
        Step between the constellations used, as for `find_ghosts`.
    extra_searches : int
        Number of additional searches for ghosts in the residual.
    max_ghosts : int
        Largest number of ghosts.
    residual : bool
        Whether to learn the residual beside the ghosts too; `compress_ghosts` recomputes it.
    threads : int, optional
    report, progress, journal
        As for `find_ghosts`.
    settings : MeasureSettings

    Raises
    ------
    FlarewrightError
        When frames cannot be read, or the model has a ghost of another kind than `AberrationGhost`.
    """
    given = (*rough.ghosts, *rough.removed)
    ghosts = [ghost for ghost in given if isinstance(ghost, AberrationGhost)]
    if len(ghosts) < len(given):
        raise FlarewrightError("a Bezier ghost cannot be fitted over all constellations; remove it from the model")
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        views = read_views(folder, run, every, pool)
        # keep the removed ghosts in the fit: without them the search would detect them again, and the other ghosts
        # would absorb their light
        found = [replace(_to_found(ghost, views), unwanted=k >= len(rough.ghosts)) for k, ghost in enumerate(ghosts)]
        found = with_glow_among_removed(found, views, settings.glow.rejection)
        # a fixed order: sums in another order differ in their last digits, and the searches amplify that
        found = [found[k] for k in by_brightness(found)]
        dim = fit_and_subtract_glow(found, views, star_of(views, pool, settings.glow), pool, settings.glow)
        iris = iris_of(dim.star, settings.glow.star)
        parts = iter(_parts(2 * extra_searches + 1, progress))
        settled = fit_all(
            found, dim.views, iris=iris, pool=pool, report=report, progress=next(parts), journal=journal,
            settings=settings.fit,
        )  # fmt: skip
        for _ in range(extra_searches):
            # with more ghosts known the glow is estimated better, and fainter ghosts can be detected
            dim = fit_and_subtract_glow(settled, views, dim.star, pool, settings.glow)
            more = _search_residual(
                settled, views, dim.views, max_ghosts - len(settled), iris, pool, report, next(parts), journal, settings
            )
            settled += with_glow_unwanted(more, views, settings.glow.rejection)
            settled = _rejoined(settled, dim.views, pool, report, settings.detection)
            settled = split_ghosts(
                settled, dim.views, iris=iris, pool=pool, report=report, journal=journal, settings=settings.detection
            )
            settled = fit_all(
                settled, dim.views, iris=iris, pool=pool, report=report, progress=next(parts),
                journal=journal, settings=settings.fit,
            )  # fmt: skip
        dim = fit_and_subtract_glow(settled, views, dim.star, pool, settings.glow)
    wanted = without_glow(settled, views, settings.glow.rejection)
    # later stages account for the light of what the user removed, too
    removed = [ghost for ghost in settled if ghost.unwanted and not ghost.glow]
    known = to_model([*wanted, *removed], views)
    model = model_of_run(run, known[: len(wanted)], dim, views).replace(removed=known[len(wanted) :])
    return with_residual(model, views, threads, journal) if residual else model


def _parts(count: int, progress: Progress) -> list[Progress]:
    """Divide progress evenly among consecutive parts of the work."""
    return [lambda part, words, k=k: progress((k + part) / count, words) for k in range(count)]  # type: ignore[misc]


def _search_residual(
    known: Sequence[DetectedGhost], views: Sequence[View], subtracted: Sequence[View], most: int, iris: Blades | None,
    pool: ThreadPoolExecutor, report: Report, progress: Progress, journal: Journal | None, settings: MeasureSettings,
) -> list[DetectedGhost]:  # fmt: skip
    """Search more ghosts in the residual of the known ones, at the search's resolution."""
    numbers = evenly_spaced(range(len(views)), settings.detection.views)
    searched = [subtracted[k] for k in numbers]
    share = channel_weights(searched)
    times, small = search_views(searched, settings.detection)
    seen = mixed_for_search([views[k] for k in numbers], searched, share, pool, settings)
    measured = [all_finite(view.variance) for view in small]
    ghosts = [_in_subset(scaled_ghost(ghost, 0.5**times), numbers) for ghost in known]
    left = np.stack([residual_of(ghosts, small, m, pool) for m in range(CHANNELS)], axis=-1)
    found = pursue(
        seen, measured, most=max(most, 0), rest=[mixture(each, share) for each in left], iris=iris,
        factor=2.0**times, pool=pool, report=report, progress=progress, journal=journal, settings=settings.detection,
    )  # fmt: skip
    return [
        replace(scaled_ghost(ghost, 2.0**times), first=numbers[ghost.first], last=numbers[ghost.last])
        for ghost in found
    ]


def _in_subset(ghost: DetectedGhost, numbers: Sequence[int]) -> DetectedGhost:
    """Return a ghost with its visible range as indices into some of the views; the range can be empty."""
    first, beyond = np.searchsorted(numbers, (ghost.first, ghost.last + 1))
    return replace(ghost, first=int(first), last=int(beyond) - 1)


def _rejoined(
    ghosts: Sequence[DetectedGhost], views: Sequence[View], pool: ThreadPoolExecutor, report: Report,
    settings: DetectionSettings,
) -> list[DetectedGhost]:  # fmt: skip
    """Join fragments of one ghost at the search's resolution; after a fit they are easier to recognise."""
    times, small = search_views(views, settings)
    smaller = [scaled_ghost(ghost, 0.5**times) for ghost in ghosts]
    found = join_ghosts(smaller, small, factor=2.0**times, pool=pool, report=report, settings=settings)
    return [scaled_ghost(ghost, 2.0**times) for ghost in found]


def _to_found(ghost: AberrationGhost, views: Sequence[View]) -> DetectedGhost:
    """Convert a ghost of a model to the form that the fitter uses."""
    shapes = [
        Shape(channel_numbers(each, ghost.blades), len(each.discs)) for each in (ghost.red, ghost.green, ghost.blue)
    ]
    there = [
        k for k, view in enumerate(views) if ghost.visible_deg[0] <= view.constellation_deg <= ghost.visible_deg[1]
    ]
    first, last = (there[0], there[-1]) if there else (0, len(views) - 1)
    return DetectedGhost((shapes[0], shapes[1], shapes[2]), first, last)
