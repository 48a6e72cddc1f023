"""Fit all detected ghosts together, colour by colour; keep each ghost that explains light no other ghost explains."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial

import numpy as np

from ...kernels.ghost_model.pupil_mesh import FIRST_DISC, FIRST_I
from ...model.measurement.ghost_model import AberrationGhost, Blades
from ...sentences import count
from ...typing import Floats, Pixels, Progress, Report
from ..core.checkpoint import Journal
from ..core.parallel import run_concurrently
from ..core.parameter_vector import blades_of, channel_of, with_blades
from ..core.parameters import Shape, free_numbers, without_discs
from ..core.rim_kinds import rims_of
from ..core.views import View
from .amplitudes import usual_amplitude
from .detected_ghost import (
    CHANNELS,
    DetectedGhost,
    by_brightness,
    channel_noise,
    exchange,
    formed,
    isolated_views,
    leading,
    residual_of,
)
from .ghost_fit import Fit, cost_of, fitted_numbers, improve, refine
from .joint_intensities import solve_intensities
from .joint_shapes import fit_shapes_jointly
from .lifetimes import update_ranges
from .model_growth import grow
from .patches import patches_of
from .settings import FitSettings, Growth


def fit_all(
    found: Sequence[DetectedGhost], views: Sequence[View], *, iris: Blades | None = None,
    pool: ThreadPoolExecutor | None = None, report: Report = lambda _: None,
    progress: Progress = lambda _part, _words: None, journal: Journal | None = None,
    settings: FitSettings = FitSettings(),
) -> list[DetectedGhost]:  # fmt: skip
    """Refit every ghost against all others, `settings.rounds` times, and drop unneeded ghosts.

    Parameters
    ----------
    found : sequence of DetectedGhost
    views : sequence of View
        With the glow subtracted; pixels to ignore have infinite variance.
    iris : Blades, optional
        Allows rims of this iris beside a round rim in the first fit of a ghost.
    pool : executor, optional
    report : callable
        Receives one line per round.
    progress : callable
        Receives the finished fraction and a text.
    journal : Journal, optional
        Records the expensive steps.
    settings : FitSettings

    Returns
    -------
    list of DetectedGhost
        The needed ghosts, brightest first.
    """
    ghosts, noise = list(found), channel_noise(views)
    steps = journal or Journal()
    for turn in range(settings.rounds):
        ghosts = solve_intensities(ghosts, views, pool=pool, settings=settings)
        # the joint fit uses small pictures; the later fit of each ghost alone yields the reported errors
        ghosts = _fit_jointly(ghosts, views, noise, pool, steps, settings)
        rest = [residual_of(ghosts, views, m, pool) for m in range(CHANNELS)]
        ghosts, rest = update_ranges(ghosts, views, rest, [leading(ghost, noise) for ghost in ghosts], pool, settings)
        for done, k in enumerate(by_brightness(ghosts)):
            old = ghosts[k]
            ghosts[k] = steps.step(partial(_refit, old, views, rest, leading(old, noise), iris, pool, settings))
            for m in range(CHANNELS):
                exchange(old.shapes[m], ghosts[k].shapes[m], old, views, rest[m], pool)
            progress((turn + (done + 1) / len(ghosts)) / settings.rounds, f"ghost {done + 1} of {len(ghosts)}")
        before = len(ghosts)
        ghosts = solve_intensities(ghosts, views, pool=pool, settings=settings)
        needed = "is needed" if len(ghosts) == 1 else "are needed"
        report(f"round {turn + 1}: {len(ghosts)} of {count(before, 'ghost')} {needed}")
    return [ghosts[k] for k in by_brightness(ghosts)]


def _fit_jointly(
    ghosts: Sequence[DetectedGhost], views: Sequence[View], noise: Floats, pool: ThreadPoolExecutor | None,
    steps: Journal, settings: FitSettings,
) -> list[DetectedGhost]:  # fmt: skip
    """Fit all ghosts at once. The first time, fit the leading colour of most ghosts alone and copy its shapes."""
    out = list(ghosts)
    first = all(ghost.fits[1] is None for ghost in ghosts)
    if not out:
        return out
    common_lead = Counter(leading(ghost, noise) for ghost in out).most_common(1)[0][0]
    for m in (common_lead,) if first else (1, 0, 2):
        pixels = [view.pixels[..., m] for view in views]
        likes = [None if (lead := leading(ghost, noise)) == m else ghost.shapes[lead] for ghost in out]
        fitted = partial(
            fit_shapes_jointly, out, views, pixels, m, steps=settings.joint.shape_steps, likes=[] if first else likes,
            pool=pool, settings=settings,
        )  # fmt: skip
        for k, shape in enumerate(steps.step(fitted)):
            shapes = [formed(shape, old) if first else old for old in out[k].shapes]
            shapes[m] = shape
            out[k] = replace(out[k], shapes=(shapes[0], shapes[1], shapes[2]))
    return out


def _refit(
    ghost: DetectedGhost, views: Sequence[View], rest: list[list[Pixels]], lead: int, iris: Blades | None,
    pool: ThreadPoolExecutor | None, settings: FitSettings,
) -> DetectedGhost:  # fmt: skip
    """Refit one ghost: first in its leading colour, then in the others with a prior towards the leading colour."""
    fits: list[Fit | None] = list(ghost.fits)
    shapes = list(ghost.shapes)

    def leader() -> Fit | None:
        shown = isolated_views(ghost, lead, views, rest[lead], settings.views, pool)
        if ghost.fits[lead] is None:
            # the other ghosts are subtracted: a free background would absorb light of this ghost
            most = replace(settings.most, offset=False)
            return _first_fit(
                _with_best_rim(shapes[lead], shown, lead, iris, pool, settings), shown, lead, most, pool, settings
            )
        return _refine_again(shapes[lead], shown, lead, ghost.fits[lead], pool, settings=settings)

    def like_leader(m: int) -> Fit | None:
        shown = isolated_views(ghost, m, views, rest[m], settings.views, pool)
        start = shapes[m] if ghost.fits[m] is not None else _scaled_lead(shapes[lead], shapes[m], shown, m, settings)
        return _refine_again(start, shown, m, fits[lead], pool, shapes[lead], settings=settings)

    def keep(m: int, fit: Fit | None) -> None:
        if fit is not None:
            fits[m], shapes[m] = fit, fit.shape

    keep(lead, leader())
    others = [m for m in range(CHANNELS) if m != lead]
    for m, fit in zip(others, run_concurrently(*(partial(like_leader, m) for m in others), pool=pool), strict=True):
        keep(m, fit)
    return replace(ghost, shapes=(shapes[0], shapes[1], shapes[2]), fits=(fits[0], fits[1], fits[2]))


def _first_fit(
    start: Shape, shown: Sequence[View], channel: int, most: Growth, pool: ThreadPoolExecutor | None,
    settings: FitSettings,
) -> Fit | None:  # fmt: skip
    """Fit a ghost for the first time, with the rims from detection and without; keep the better.

    Detection added these rims while other ghosts were unknown.
    """

    def grown(shape: Shape) -> Fit | None:
        return grow(shape, shown, channel, most=most, pool=pool, settings=settings)

    if not start.discs:
        return grown(start)
    fit, bare = run_concurrently(partial(grown, start), partial(grown, without_discs(start)), pool=pool)
    if fit is None or bare is None:
        return fit
    patches = patches_of(fit.shape, shown, channel, beside=bare.shape, settings=settings)
    cost = partial(cost_of, offset=most.offset, error=most.error, settings=settings)
    alone = cost(bare.shape, patches) * (1.0 - settings.growth.rim_pays) ** (fit.shape.discs - bare.shape.discs)
    return bare if alone <= cost(fit.shape, patches) else fit


def _with_best_rim(
    shape: Shape, shown: Sequence[View], channel: int, iris: Blades | None, pool: ThreadPoolExecutor | None,
    settings: FitSettings,
) -> Shape:  # fmt: skip
    """Return a shape with the best-fitting rim, round or of blades, from a fit of first-order parameters."""
    patches = patches_of(shape, shown, channel, settings=settings)
    if iris is None or not patches:
        return shape
    few = patches[:: max(1, len(patches) // settings.growth.rim_views)]
    best, least = shape, np.inf
    for start in kinds_of(shape, iris):
        free = free_numbers(1, start.discs, 1)
        trial, cost = improve(
            start, few, free, width=shown[0].size_px[0], steps=4, offset=False, pool=pool, settings=settings
        )
        cost /= (1.0 - settings.growth.rim_pays) ** start.discs
        if cost < least:
            best, least = trial, cost
    return best


def kinds_of(shape: Shape, iris: Blades | None) -> list[Shape]:
    """Return a shape with each possible rim, its present rim first.

    Returns
    -------
    list of Shape
        A disc that cuts into the rim may have imitated a blade: each other rim also comes without discs.
    """
    own = blades_of(shape.numbers)
    found = [shape]
    for kind in rims_of(iris):
        if kind != own:
            numbers = with_blades(shape.numbers, kind)
            found.append(replace(shape, numbers=numbers))
            if shape.discs:
                found.append(without_discs(replace(shape, numbers=numbers)))
    return found


def _scaled_lead(lead: Shape, own: Shape, alone: Sequence[View], channel: int, settings: FitSettings) -> Shape:
    """Return the shape of the leading colour scaled to the brightness of another colour."""
    amplitude = usual_amplitude(lead, alone, channel, settings=settings)
    if amplitude is None:
        return own
    numbers = lead.numbers.copy()
    numbers[FIRST_I:FIRST_DISC] *= amplitude
    return replace(lead, numbers=numbers)


def _refine_again(
    start: Shape, alone: Sequence[View], channel: int, known: Fit | None, pool: ThreadPoolExecutor | None,
    like: Shape | None = None, *, settings: FitSettings,
) -> Fit | None:  # fmt: skip
    """Refit the parameters that were free in the fit `known`; `like` is the shape of the leading colour."""
    patches = patches_of(start, alone, channel, settings=settings)
    if not patches:
        return None
    free = fitted_numbers(known, start)
    return refine(
        start, patches, free, width=alone[0].size_px[0], steps=8, offset=False, like=like, pool=pool, settings=settings
    )


def to_model(ghosts: Sequence[DetectedGhost], views: Sequence[View]) -> tuple[AberrationGhost, ...]:
    """Convert detected ghosts to ghosts of a model, named by number."""
    angles = [view.constellation_deg for view in views]
    out = []
    for number, ghost in enumerate(ghosts, 1):
        channels = [
            channel_of(shape.numbers, shape.discs, None if fit is None else fit.uncertainty)
            for shape, fit in zip(ghost.shapes, ghost.fits, strict=True)
        ]
        # a ghost appears or disappears somewhere between the last view with it and the first without it
        before, after = max(ghost.first - 1, 0), min(ghost.last + 1, len(angles) - 1)
        born = 0.5 * (angles[before] + angles[ghost.first])
        died = 0.5 * (angles[ghost.last] + angles[after])
        out.append(
            AberrationGhost(
                name=str(number),
                red=channels[0],
                green=channels[1],
                blue=channels[2],
                blades=blades_of(ghost.shapes[1].numbers),
                visible_deg=(born, died),
                fade_deg=(angles[ghost.first] - angles[before], angles[after] - angles[ghost.last]),
            )
        )
    return tuple(out)
