"""Join two detected ghosts, such as body and core of one path, where one ghost explains the views as well."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np

from ...kernels.ghost_model.pupil_mesh import FIRST_G, FIRST_I
from ...typing import Floats, Pixels, Report
from ..core.parameters import Shape, free_numbers, largest_size
from ..core.sampling import evenly_spaced
from ..core.views import View
from ..fitting.detected_ghost import DetectedGhost, by_brightness, residual_of
from ..fitting.ghost_fit import brightens, cost_of, improve, render
from ..fitting.patches import Patch, patches_of
from ..fitting.settings import FitSettings
from .settings import DetectionSettings, JoinSettings

# model error of a trial: almost 0, as the views' variance includes it, but positive, for the tolerance of a search
_NO_ERROR = 1e-9


def join_ghosts(
    ghosts: Sequence[DetectedGhost], views: Sequence[View], *, factor: float = 1.0,
    pool: ThreadPoolExecutor | None = None, report: Report = lambda _: None,
    settings: DetectionSettings = DetectionSettings(),
) -> list[DetectedGhost]:  # fmt: skip
    """Join pairs of detected ghosts that are one ghost.

    Parameters
    ----------
    ghosts : sequence of DetectedGhost
    views : sequence of View
        With the glow subtracted; pixels to ignore have infinite variance.
    factor : float
        Pixels of a capture per pixel of these views; the report is in pixels of the captures.
    pool : executor, optional
    report : callable
        Receives one line per joined pair.
    settings : DetectionSettings

    Returns
    -------
    list of DetectedGhost
        All colours of a joined ghost have the shape of green.

    Notes
    -----
    A lens of revolution maps the pupil by g(u), u the square of the distance from its centre
    (`kernels.ghost_model.pupil_mesh`). Small g near the centre makes a bright core; a fit that starts from a uniform
    disc does not reach it.
    Blobs are not joined: a larger ghost cannot draw a caustic of one or two pixels that is many times brighter.
    """
    out = list(ghosts)
    rest = residual_of(out, views, 1, pool)
    for ghost in [out[k] for k in reversed(by_brightness(out))]:
        if _is_blob(ghost, views, settings.joining):
            continue
        for other in _hosts(ghost, out, settings.joining):
            one = _joined_pair(other, ghost, views, rest, pool, settings)
            if one is None:
                continue
            out = [each for each in out if each is not ghost and each is not other] + [one]
            rest = residual_of(out, views, 1, pool)
            size, speed = abs(other.shapes[1].numbers[FIRST_G]), ghost.shapes[1].numbers[0]
            report(f"joined the ghost of speed {factor * speed:.0f} px with the one of size {factor * size:.0f} px")
            break
    return out


def _is_blob(ghost: DetectedGhost, views: Sequence[View], settings: JoinSettings) -> bool:
    """Return whether a ghost is a blob in all its views."""
    there = views[ghost.first : ghost.last + 1]
    return largest_size(ghost.shapes[1], [view.sigma for view in there]) <= settings.blob_size * views[0].size_px[0]


def _hosts(ghost: DetectedGhost, ghosts: Sequence[DetectedGhost], settings: JoinSettings) -> list[DetectedGhost]:
    """Return at most two larger ghosts that a ghost may be a part of, nearest first."""
    own, size = ghost.shapes[1].numbers, abs(float(ghost.shapes[1].numbers[FIRST_G]))
    hosts = []
    for other in ghosts:
        theirs = other.shapes[1].numbers
        larger = abs(float(theirs[FIRST_G]))
        shared = min(ghost.last, other.last) - max(ghost.first, other.first) + 1
        apart = abs(float(own[0] - theirs[0])) / max(larger, 1e-9)
        if ghost.unwanted or other.unwanted or other is ghost:
            continue
        enough = settings.least_shared * (ghost.last - ghost.first)
        if larger >= size and apart < settings.most_distance and shared > enough:
            hosts.append((apart, other))
    return [other for _, other in sorted(hosts, key=lambda pair: pair[0])[:2]]


def _joined_pair(
    host: DetectedGhost, part: DetectedGhost, views: Sequence[View], rest: Sequence[Pixels],
    pool: ThreadPoolExecutor | None, settings: DetectionSettings,
) -> DetectedGhost | None:  # fmt: skip
    """Fit one ghost to the light of two; return None when it explains the views worse."""
    both = DetectedGhost(host.shapes, min(host.first, part.first), max(host.last, part.last))
    few = evenly_spaced(range(both.first, both.last + 1), settings.joining.trial_views)
    shape, core = host.shapes[1], part.shapes[1]
    as_two, as_one = [], []
    for k in few:
        alone = render(shape, views[k])
        light = render(core, views[k]) if part.first <= k <= part.last else np.zeros_like(alone)
        there = rest[k] + (alone if host.first <= k <= host.last else 0.0) + light
        # both trials use the same weights: the brighter model would gain from its larger model error
        level = np.maximum(np.abs(there), np.abs(alone + light))
        as_two.append(_green(views[k], rest[k] + alone, level, settings.fit))
        as_one.append(_green(views[k], there, level, settings.fit))
    # the windows include the light of the smaller ghost outside the larger one
    patches = patches_of(shape, as_one, 1, beside=core, area=settings.joining.area_px, settings=settings.fit)
    if not patches:
        return None
    width, fit = views[0].size_px[0], settings.fit

    def fitted(light: Floats, look: Sequence[Patch]) -> Shape:
        # without reduced weights for outliers, which would hide the misfit of one ghost
        starts = [_improved(start, look, 1, 5, width, pool, fit) for start in _starts(shape, light, settings.joining)]
        return _improved(min(starts, key=lambda trial: _cost(trial, look, fit)), look, 2, 8, width, pool, fit)

    best = fitted(core.numbers, patches)
    # refit the larger ghost alone with equal freedom, so that the comparison excludes its gain from the refit
    apart = patches_of(shape, as_two, 1, beside=core, area=settings.joining.area_px, settings=settings.fit)
    if _loss(
        best, fitted(np.zeros_like(core.numbers), apart), patches, apart, settings.fit
    ) > settings.joining.most_loss or not brightens(best, as_one):
        return None
    # also refit it from the end of the joint fit: the larger ghost alone must not find a better minimum from there
    larger = _improved(best, apart, 2, 8, width, pool, fit)
    if _loss(best, larger, patches, apart, fit) > settings.joining.most_loss:
        return None
    return replace(both, shapes=(best, best, best))


def _loss(one: Shape, larger: Shape, whole: Sequence[Patch], apart: Sequence[Patch], settings: FitSettings) -> float:
    """Return the squares that one joined ghost loses, over the squares that the smaller ghost explains."""
    two = _cost(larger, apart, settings)
    return (_cost(one, whole, settings) - two) / max(_cost(larger, whole, settings) - two, 1e-300)


def _improved(
    start: Shape, look: Sequence[Patch], order: int, steps: int, width: int, pool: ThreadPoolExecutor | None,
    settings: FitSettings,
) -> Shape:  # fmt: skip
    free = free_numbers(order, start.discs, 1)
    return improve(
        start, look, free, width=width, steps=steps, error=_NO_ERROR, tails=False, pool=pool, settings=settings
    )[0]


def _cost(shape: Shape, look: Sequence[Patch], settings: FitSettings) -> float:
    return cost_of(shape, look, error=_NO_ERROR, tails=False, settings=settings)


def _green(view: View, pixels: Floats, level: Floats, settings: FitSettings) -> View:
    """Return a view with one picture in all colours, and the variance of green plus that of the model error."""
    variance = (view.variance[..., 1] + (settings.model_error * level) ** 2).astype(np.float32)
    shape = view.pixels.shape
    return replace(
        view, pixels=np.broadcast_to(pixels.astype(np.float32)[..., None], shape),
        variance=np.broadcast_to(variance[..., None], shape),
    )  # fmt: skip


def _starts(shape: Shape, light: Floats, settings: JoinSettings) -> list[Shape]:
    """Return start shapes of the joined ghost: the larger one plus the light, with cores of different brightness."""
    starts = []
    for part in settings.core_starts:
        numbers = shape.numbers.copy()
        size = float(numbers[FIRST_G])
        numbers[FIRST_G], numbers[FIRST_G + 1] = part * size, numbers[FIRST_G + 1] + (1.0 - part) * size
        numbers[FIRST_I] += max(float(light[FIRST_I]), 0.0)
        starts.append(replace(shape, numbers=numbers))
    return starts
