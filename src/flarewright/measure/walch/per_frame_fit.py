"""Fit a run's ghosts with Walch's method, for comparison (2017, chapters 7 and 8).

Each ghost is fitted in one frame after the other by online gradient descent of his primitive; each fit starts from the
result of the frame before. Then each parameter becomes a polynomial over the constellation. Walch's images are grey:
here green determines the shape, and red and blue only their brightness.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from ...kernels.ghost_model.bezier import BORDER, INNER, NUMBERS
from ...model.measurement.capture import MergedRun
from ...model.measurement.ghost_model import BezierGhost, GhostModel
from ...sentences import count
from ...typing import Floats, Progress, Report
from ..core.checkpoint import Journal
from ..core.frame_reading import read_views
from ..core.parameter_vector import away_from_axis
from ..core.views import View, all_finite, halved_view
from ..detection.single_image import Spot, spots_of_model
from ..glow.subtraction import subtract_glow
from ..replay.model_image import draw
from ..residual.learn import with_residual
from .gradient_descent import circle, descend_gradient, window_with_margin
from .gradient_descent import draw_single as drawn
from .polynomials import fit_polynomial
from .settings import WalchSettings

# ghosts per step of the journal, independent of the number of threads
_AT_ONCE = 8
# the first numbers are lengths
_LENGTHS = 11


def fit_as_walch(
    folder: Path, run: MergedRun, rough: GhostModel, *, every: int = 1, residual: bool = True,
    threads: int | None = None, report: Report = lambda _: None, progress: Progress = lambda _part, _words: None,
    journal: Journal | None = None, settings: WalchSettings = WalchSettings(),
) -> GhostModel:  # fmt: skip
    """Fit the detected ghosts with Walch's primitive and method.

    Parameters
    ----------
    folder : Path
    run : MergedRun
    rough : GhostModel
        From `find_ghosts`: the start position of each ghost, and the other light over it.
    every : int
        Step between the constellations used, as for `find_ghosts`.
    residual : bool
        Whether to learn the residual beside the ghosts too.
    threads : int, optional
    report, progress, journal
        As for `find_ghosts`.
    settings : WalchSettings

    Returns
    -------
    GhostModel
        Bezier ghosts, halo and star. A ghost in too few images is left out.

    Raises
    ------
    FlarewrightError
        When frames cannot be read or are too few.
    """
    views = read_views(folder, run, every)
    seen = subtract_glow(views, rough.halo, rough.star, settings=settings.glow)
    bare = rough.replace(sprites=(), removed=())
    whole = [draw(bare, view.constellation_deg, view.roll_deg, view.size_px) for view in seen]
    spots = [{spot.name: spot for spot in _spots(bare, view)} for view in seen]
    steps, found = journal or Journal(), []
    names = [ghost.name for ghost in rough.ghosts]

    def follow(name: str) -> list[Floats]:
        return list(_fitted_over_images(name, bare, seen, whole, spots, settings))

    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        for begin in range(0, len(names), _AT_ONCE):
            some = names[begin : begin + _AT_ONCE]

            def look(some: Sequence[str] = some) -> list[list[Floats]]:
                return list(pool.map(follow, some))

            for name, (angles, numbers) in zip(some, steps.step(look), strict=True):
                if len(angles) < settings.least_images:
                    report(f"ghost {name}: fewer than {settings.least_images} pictures show it, left out")
                    continue
                found.append(_compressed(name, angles, numbers, settings))
                report(f"ghost {name}: {count(len(angles), 'picture')}")
            progress(min(begin + _AT_ONCE, len(names)) / len(names), f"ghost {some[-1]}")
    remark = "fitted with Walch's primitive and by his gradient descent (2017), for comparison"
    model = bare.replace(ghosts=tuple(found), remarks=(*rough.remarks, remark))
    return with_residual(model, views, threads, journal) if residual else model


def _spots(model: GhostModel, view: View) -> tuple[Spot, ...]:
    low, high = model.constellation_deg
    return spots_of_model(model, min(max(view.constellation_deg, low), high))


def _fitted_over_images(
    name: str, model: GhostModel, views: Sequence[View], whole: Sequence[Floats], spots: Sequence[dict[str, Spot]],
    settings: WalchSettings,
) -> tuple[Floats, Floats]:  # fmt: skip
    """Fit one ghost from image to image; return its constellations, shape (K,), and its numbers, (K, 19)."""
    ghost = next(one for one in model.ghosts if one.name == name)
    alone = model.replace(ghosts=(ghost,))
    angles, fitted = [], []
    before: tuple[Floats, Spot] | None = None
    for view, light, there in zip(views, whole, spots, strict=True):
        spot, numbers = there.get(name), None
        if spot is not None and spot.radius_px > settings.least_radius_px and max(spot.rgb) > 0.0:
            own = draw(alone, view.constellation_deg, view.roll_deg, view.size_px)
            numbers = _fitted_in_image(
                view.showing((view.pixels - light + own).astype(np.float32)), spot, before, settings
            )
        before = None if spot is None or numbers is None else (numbers, spot)
        if numbers is not None:
            angles.append(view.constellation_deg)
            fitted.append(numbers)
    return np.array(angles), np.array(fitted).reshape(-1, NUMBERS)


def _fitted_in_image(
    view: View, spot: Spot, before: tuple[Floats, Spot] | None, settings: WalchSettings
) -> Floats | None:
    """Fit one ghost in one image; None where too little of it was measured."""
    times = max(0, int(np.ceil(np.log2(2.0 * spot.radius_px / settings.most_width_px))))
    small, side = halved_view(view, times), 0.5**times
    start = circle(spot.place_px, spot.radius_px, np.array(spot.rgb), np.array(spot.rgb))
    if before is not None:
        # start from the result of the image before, shifted by the motion that the search found
        start = before[0].copy()
        start[0] += spot.place_px - before[1].place_px
    start[:_LENGTHS] *= side
    margin = settings.margin_px + int(settings.margin * side * spot.radius_px)
    left, top, width, height = window_with_margin(start, small.frame, small.size_px, margin)
    if min(width, height) < settings.margin_px:
        return None
    part = np.s_[top : top + height, left : left + width]
    known = all_finite(small.variance[part])
    if known.mean() < settings.least_measured:
        return None
    window = left, top, width, height
    # where nothing was measured the target equals the start
    wanted = np.where(known[..., None], small.pixels[part], drawn(start, small.frame, window))
    numbers = descend_gradient(start, wanted[..., 1], small.frame, window, rounds=settings.rounds).numbers
    numbers = _coloured(numbers, wanted, drawn(numbers, small.frame, window)[..., 1])
    numbers[:_LENGTHS] /= side
    return numbers


def _coloured(numbers: Floats, wanted: Floats, green: Floats) -> Floats:
    """Return numbers whose red and blue levels match an image; the shape stays that of green."""
    out = numbers.copy()
    power = max(float((green**2).sum()), 1e-300)
    for m in (0, 2):
        times = max(float((green * wanted[..., m]).sum()) / power, 0.0)
        out[BORDER + m], out[INNER + m] = times * numbers[BORDER + 1], times * numbers[INNER + 1]
    return out


def _compressed(name: str, constellation_deg: Floats, numbers: Floats, settings: WalchSettings) -> BezierGhost:
    """Fit a polynomial over the constellation to each number; both sides of the axis share it."""
    span = float(constellation_deg.min()), float(constellation_deg.max())
    away, ends = np.abs(constellation_deg), away_from_axis(span)
    curves = [fit_polynomial(away, values, np.ones(values.size), ends, settings) for values in numbers.T]
    return BezierGhost(
        name=name, numbers=tuple(curve.coefficients for curve in curves), visible_deg=span,
        uncertainty=tuple(curve.deviation for curve in curves),
    )  # fmt: skip
