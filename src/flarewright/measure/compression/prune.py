"""Compact a fitted model with the tracks of its ghosts: fewer parameters, curves where needed, rounded numbers."""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from math import ceil, floor, isfinite, log10

import numpy as np

from ...kernels.ghost_model.pupil_mesh import DISC_NUMBERS, FIRST_DISC, FIRST_G
from ...model.measurement.ghost_model import AberrationGhost, Channel, Curve, Curves, GhostModel
from ...model.measurement.ghost_tracks import GhostTrack, Tracks
from ...sentences import count
from ...typing import Floats, Indices, Pixels, Progress
from ..core.checkpoint import Journal
from ..core.parallel import done_by
from ..core.parameter_vector import NUMBERS, channel_deviation, channel_numbers, channel_of
from ..core.parameters import Shape, free_numbers, rescaled
from ..core.pose_curves import Pose
from ..core.views import View, halved_view
from ..fitting.detected_ghost import (
    CHANNELS,
    DetectedGhost,
    by_brightness,
    channel_noise,
    exchange,
    isolated_views,
    leading,
    residual_of,
)
from ..fitting.ghost_fit import Fit, cost_of, refine
from ..fitting.normal_equations import inverse
from ..fitting.patches import patches_of
from ..tracking.frame_fit import Measured, Shapes, frame_halvings, measure_together
from ..tracking.smoothing_spline import smooth_curve
from .order_selection import needed_numbers, parabola
from .settings import CompressionSettings

# number of views that one step of the journal measures
_BATCH = 8


def compact_model(
    model: GhostModel, tracks: Tracks, views: Sequence[View], *, threads: int | None = None,
    progress: Progress = lambda _part, _words: None, journal: Journal | None = None,
    settings: CompressionSettings = CompressionSettings(),
) -> GhostModel:  # fmt: skip
    """Compact a fitted model.

    Parameters
    ----------
    model : GhostModel
        As fitted: one set of parameters for each ghost.
    tracks : Tracks
        Tracks of its ghosts.
    views : sequence of View
        In order of rising constellation, with halo and star subtracted.
    threads : int, optional
    progress : callable
        Receives the finished fraction and a text.
    journal : Journal, optional
        Resumes an interrupted run; the result does not depend on it.
    settings : CompressionSettings

    Returns
    -------
    GhostModel
        Without ghosts that no frame shows.

    Notes
    -----
    First, parameters that do not improve the prediction of left-out constellations are dropped (`order_selection`), and
    the others are refitted, each ghost against all others. Second, brightness, shift and size of each ghost are
    measured in every frame, and their deviations become curves with cross-validated knots (`smoothing_spline`). Third,
    parameters are rounded to a twentieth of their standard deviation with all others fixed. The marginal deviation
    would be too coarse a step, as combinations of parameters are known far better than each alone.
    """
    tracked = {track.name: track for track in tracks.ghosts if track.lives}
    kept = [ghost for ghost in model.ghosts if isinstance(ghost, AberrationGhost) and ghost.name in tracked]
    drawn = [drawn_range(ghost, tracked[ghost.name], settings) for ghost in kept]
    spans = [span for span, _ in drawn]
    found = [_found(ghost, span, views) for ghost, span in zip(kept, spans, strict=True)]
    progress(0.0, count(len(kept), "ghost"))
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        steps = journal or Journal()
        found = _with_fewer_numbers(
            found, kept, views, pool, steps, lambda part, words: progress(0.7 * part, words), settings
        )
        curves = curves_of(
            found, spans, views, pool, steps, lambda part, words: progress(0.7 + 0.3 * part, words), settings
        )
    ghosts = tuple(
        _model_ghost(ghost, each, span, fade, curve, settings)
        for ghost, each, (span, fade), curve in zip(kept, found, drawn, curves, strict=True)
    )  # fmt: skip
    unseen = [ghost.name for ghost in model.ghosts if ghost.name not in tracked]
    remarks = (*model.remarks, f"dropped, as no frame shows them: {', '.join(unseen)}") if unseen else model.remarks
    return model.replace(ghosts=ghosts, remarks=remarks)


def drawn_range(
    ghost: AberrationGhost, track: GhostTrack, settings: CompressionSettings = CompressionSettings()
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the range of constellations in which a ghost is drawn, and the widths over which it fades at the ends.

    The range holds all its lives, plus one frame to fade. Where that frame shows nothing at all, it ends halfway to it:
    no curve of few knots follows a step.
    """
    first, last = track.lives[0], track.lives[-1]
    low, high = first.birth.constellation_deg, last.death.constellation_deg
    # where the frames are undecided, use the range of the fit
    if first.birth.how == "hidden":
        low = min(low, ghost.visible_deg[0])
    if last.death.how == "hidden":
        high = max(high, ghost.visible_deg[1])
    angles = [step.constellation_deg for step in track.steps]
    below, above = [angle for angle in angles if angle < low], [angle for angle in angles if angle > high]
    fade = [0.0, 0.0]
    if first.birth.how in ("fade", "frame") and below:
        low, fade[0] = _faded(track, first.birth.how, below[-1], angles[len(below)], settings)
    if last.death.how in ("fade", "frame") and above:
        high, fade[1] = _faded(track, last.death.how, above[0], angles[-len(above) - 1], settings)
    return (low, high), (fade[0], fade[1])


def _faded(
    track: GhostTrack, how: str, beyond: float, inside: float, settings: CompressionSettings
) -> tuple[float, float]:
    """Return an end of the drawn range and the width of its fade, from the frames on both sides of a birth or death."""
    step = next(one for one in track.steps if one.constellation_deg == beyond)
    if how == "fade" and step.brightness is not None and step.brightness < settings.gone:
        return 0.5 * (beyond + inside), abs(inside - beyond)
    return beyond, 0.0


def _found(ghost: AberrationGhost, span: tuple[float, float], views: Sequence[View]) -> DetectedGhost:
    colours = ghost.red, ghost.green, ghost.blue
    red, green, blue = (Shape(channel_numbers(each, ghost.blades), len(each.discs)) for each in colours)
    there = [k for k, view in enumerate(views) if span[0] <= view.constellation_deg <= span[1]]
    return DetectedGhost((red, green, blue), there[0], there[-1])


def _with_fewer_numbers(
    ghosts: Sequence[DetectedGhost], kept: Sequence[AberrationGhost], views: Sequence[View], pool: ThreadPoolExecutor,
    steps: Journal, progress: Progress, settings: CompressionSettings,
) -> list[DetectedGhost]:  # fmt: skip
    """Drop unneeded parameters and refit the others, each ghost against all others, brightest first."""
    out = list(ghosts)
    rest, noise = [residual_of(out, views, m, pool) for m in range(CHANNELS)], channel_noise(views)
    for done, k in enumerate(by_brightness(out)):
        old = out[k]
        new = steps.step(partial(_reduced, old, fitted_in_model(kept[k]), views, rest, noise, pool, settings))
        for m in range(CHANNELS):
            exchange(old.shapes[m], new.shapes[m], old, views, rest[m], pool)
        out[k] = new
        fit = new.fits[1]
        numbers = count(0 if fit is None else fit.free.size, "number")
        progress((done + 1) / len(out), f"ghost {kept[k].name}: {numbers} a colour")
    return out


def fitted_in_model(ghost: AberrationGhost) -> Indices:
    """Return the fitted parameters of a ghost: those with a stored uncertainty, or all when none is stored."""
    known = np.flatnonzero(channel_deviation(ghost.green) > 0.0)
    return known.astype(np.int64) if known.size else free_numbers(2, len(ghost.green.discs), 2)


def _reduced(
    ghost: DetectedGhost, free: Indices, views: Sequence[View], rest: Sequence[list[Pixels]], noise: Floats,
    pool: ThreadPoolExecutor, settings: CompressionSettings,
) -> DetectedGhost:  # fmt: skip
    width = views[0].size_px[0]
    shown = [isolated_views(ghost, m, views, rest[m], settings.views, pool) for m in range(CHANNELS)]
    patches = [patches_of(ghost.shapes[m], shown[m], m, settings=settings.fit) for m in range(CHANNELS)]
    if not all(patches):
        return ghost
    error = settings.fit.model_error
    quadratics = [
        parabola(ghost.shapes[m], patches[m], free, width, error, pool, settings.fit) for m in range(CHANNELS)
    ]  # fmt: skip
    fewer = needed_numbers(quadratics, free, settings)
    refit = partial(refine, width=width, steps=10, pool=pool, settings=settings.fit)
    cost = partial(cost_of, settings=settings.fit)
    best: list[Fit | None] = [None, None, None]
    shapes = list(ghost.shapes)
    # the leading colour first: the others have a prior towards it
    lead = leading(ghost, noise)
    for m in sorted(range(CHANNELS), key=lambda m: m != lead):
        like = None if m == lead else shapes[lead]
        before, level = (cost(ghost.shapes[m], patches[m], offset=offset) for offset in (True, False))
        for numbers in (fewer, free):
            start = ghost.shapes[m].numbers.copy()
            start[np.setdiff1d(free, numbers)] = 0.0
            fewer_numbers = replace(ghost.shapes[m], numbers=start)
            fit = refit(fewer_numbers, patches[m], numbers, like=like)
            # the quadratic approximation may be too inaccurate: keep all parameters then
            bare, full = (cost(fit.shape, patches[m], offset=offset) for offset in (False, True))
            even = bare <= (1.0 + settings.most_increase_bare) * level
            if even and full <= before + settings.most_increase * before + 2.0 * numbers.size:
                break
        if not even:
            # the ghost fills every picture: only without a background is its brightness determined
            fit = refit(ghost.shapes[m], patches[m], free, offset=False, like=like)
        best[m], shapes[m] = fit, fit.shape
    return replace(ghost, shapes=(shapes[0], shapes[1], shapes[2]), fits=(best[0], best[1], best[2]))


@dataclass(frozen=True)
class _Measurement:
    """Pose of one ghost in one frame, and its errors: brightness, shift and size."""

    constellation_deg: float
    values: tuple[float, float, float]
    error: tuple[float, float, float]


def curves_of(
    ghosts: Sequence[DetectedGhost], spans: Sequence[tuple[float, float]], views: Sequence[View],
    pool: ThreadPoolExecutor, steps: Journal, progress: Progress, settings: CompressionSettings = CompressionSettings(),
) -> list[Curves]:  # fmt: skip
    """Measure the poses of all ghosts in every frame and fit curves to them.

    Parameters
    ----------
    ghosts : sequence of DetectedGhost
    spans : sequence of tuple of float
        Range in which each is drawn, degrees.
    views : sequence of View
    pool : executor
    steps : Journal
    progress : callable
    settings : CompressionSettings
    """
    measurements: list[list[_Measurement]] = [[] for _ in ghosts]
    times = frame_halvings(views[0].size_px[0], settings.tracking.frame)
    factor = 2.0**times
    shapes = [_sized(ghost, 1.0 / factor) for ghost in ghosts]
    visible = [[g for g, span in enumerate(spans) if span[0] <= view.constellation_deg <= span[1]] for view in views]

    def one(view: View, there: list[int]) -> Measured:
        some, frame = [shapes[g] for g in there], settings.tracking.frame
        return measure_together(some, [Pose()] * len(there), halved_view(view, times), settings=frame)

    measured: list[Measured] = []
    for at in range(0, len(views), _BATCH):
        some = slice(at, at + _BATCH)
        measured += steps.step(partial(done_by, pool, one, views[some], visible[some]))
        progress(len(measured) / len(views), f"{views[len(measured) - 1].constellation_deg:.1f} degrees")
    for view, there, here in zip(views, visible, measured, strict=True):
        for g, pose, error, inside in zip(there, here.poses, here.error, here.inside, strict=True):
            if inside > 0.0 and isfinite(error[0]):
                values = (pose.brightness, factor * pose.along_px, pose.size)
                # a ghost too faint to be seen does not determine shift and size
                placed = pose.brightness > settings.tracking.there
                errors = (error[0], factor * error[1] if placed else np.inf, error[2] if placed else np.inf)
                measurements[g].append(_Measurement(view.constellation_deg, values, errors))
    return [_curves(each, ghost, span, settings) for each, ghost, span in zip(measurements, ghosts, spans, strict=True)]


def _sized(ghost: DetectedGhost, factor: float) -> Shapes:
    red, green, blue = (rescaled(shape, factor) for shape in ghost.shapes)
    return red, green, blue


def _curves(
    measurements: Sequence[_Measurement], ghost: DetectedGhost, span: tuple[float, float], settings: CompressionSettings
) -> Curves:
    radius = abs(float(ghost.shapes[1].numbers[FIRST_G]))
    found: list[Curve | None] = []
    for n, (usual, spread, least) in enumerate(((1.0, 0.5, 0.01), (0.0, 0.3 * radius + 1.0, 0.05), (1.0, 0.2, 0.003))):
        known = [one for one in measurements if isfinite(one.error[n])]
        at = np.array([one.constellation_deg for one in known])
        values, error = np.array([one.values[n] for one in known]), np.array([one.error[n] for one in known])
        how = settings.tracking.curves
        curve = smooth_curve(at, values, error, span, usual=usual, spread=spread, least=least, settings=how)
        found.append(_rounded_curve(curve, settings))
    return Curves(brightness=found[0], along_px=found[1], size=found[2])


def _model_ghost(
    ghost: AberrationGhost, found: DetectedGhost, span: tuple[float, float], fade_deg: tuple[float, float],
    curves: Curves, settings: CompressionSettings,
) -> AberrationGhost:  # fmt: skip
    colours: list[Channel] = []
    for shape, fit in zip(found.shapes, found.fits, strict=True):
        deviation = None if fit is None else fit.uncertainty
        numbers = shape.numbers
        if deviation is not None:
            numbers = written_numbers(shape, held_error(fit), settings)
            deviation = np.array([float(f"{d:.2g}") for d in deviation])
        colours.append(channel_of(numbers, shape.discs, deviation))
    # keep the fade of the fit where its range is unchanged; elsewhere the brightness curve fades, or the end
    same = zip(span, ghost.visible_deg, ghost.fade_deg, fade_deg, strict=True)
    return ghost.replace(
        red=colours[0], green=colours[1], blue=colours[2], curves=curves,
        visible_deg=(floor(1e4 * span[0]) / 1e4, ceil(1e4 * span[1]) / 1e4),
        fade_deg=tuple(fade if end == old else own for end, old, fade, own in same),
    )  # fmt: skip


def written_numbers(shape: Shape, held: Floats, settings: CompressionSettings = CompressionSettings()) -> Floats:
    """Return the parameters of one colour, rounded; the radius of an undetermined rim is not rounded to 0 or below."""
    numbers = np.array(
        [rounded_to_error(float(a), float(d), settings) for a, d in zip(shape.numbers, held, strict=True)]
    )
    radii = FIRST_DISC + DISC_NUMBERS * np.arange(shape.discs) + 2
    for at in radii[numbers[radii] <= 0.0]:
        numbers[at] = rounded_to_error(float(shape.numbers[at]), 0.0, settings)
    return numbers


def held_error(fit: Fit | None) -> Floats:
    """Return the standard deviation of each parameter with all others fixed; it limits the rounding step."""
    out = np.zeros(NUMBERS)
    if fit is not None:
        known = np.diag(inverse(fit.covariance))
        out[fit.free] = np.where(known > 0.0, 1.0 / np.sqrt(np.maximum(known, 1e-300)), 0.0)
    return out


def rounded_to_error(value: float, deviation: float, settings: CompressionSettings = CompressionSettings()) -> float:
    """Round a number to a twentieth of its standard deviation or finer; to nine digits without one."""
    if not (deviation > 0.0 and isfinite(deviation)):
        return float(f"{value:.9g}")
    return round(value, ceil(-log10(settings.rounding * deviation)))


def _rounded_curve(curve: Curve | None, settings: CompressionSettings) -> Curve | None:
    if curve is None:
        return None
    values = tuple(
        rounded_to_error(value, error, settings) for value, error in zip(curve.values, curve.error, strict=True)
    )
    return Curve(values=values, error=tuple(float(f"{error:.2g}") for error in curve.error))


def count_parameters(model: GhostModel) -> int:
    """Return the number of parameters that draw the ghosts of a model, including curves and all colours."""
    total = 0
    for ghost in model.ghosts:
        if isinstance(ghost, AberrationGhost):
            for colour in (ghost.red, ghost.green, ghost.blue):
                total += int(np.count_nonzero(channel_numbers(colour, None)))
            curves = ghost.curves
            total += sum(
                len(one.values) for one in (curves.brightness, curves.along_px, curves.size) if one is not None
            )
        else:
            total += sum(len(row) for row in ghost.numbers)
    return total
