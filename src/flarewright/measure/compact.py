"""From a fitted model and the tracks of its ghosts to a small one: fewer numbers, and curves where they are needed."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from math import ceil, floor, isfinite, log10

import numpy as np

from ..io.sentences import count
from ..kernels.measure_pupil import DISC_NUMBERS, FIRST_DISC, FIRST_G
from ..model.ghost_model import AberrationGhost, Channel, Curve, Curves, GhostModel
from ..model.ghost_tracks import GhostTrack, Tracks
from .curves import Pose
from .fit import MODEL_ERROR, Fit, cost_of, refine
from .found import CHANNELS, Found, alone, by_light, exchange, leading, noise_of, rest_of
from .journal import Journal
from .normal import inverse
from .numbers import NUMBERS, Floats, channel_deviation, channel_numbers, channel_of
from .orders import needed_numbers, parabola
from .patches import patches_of
from .shape import Indices, Shape, enlarged, free_numbers
from .shared_out import done_by
from .smooth import smooth_curve
from .together import Measured, Shapes, halvings, measure_together
from .views import Pixels, View, coarse

Tell = Callable[[float, str], None]

# views that one ghost's numbers are judged by, at most
_VIEWS = 32
# fewer numbers may cost so much of what the views hold, and so much with an even background held at none
_WORSE, _UNEVEN = 0.002, 0.05
# views that are asked at once
_AT_ONCE = 8
# numbers are written to this part of the standard deviation that they have with all others held
_DIGITS = 0.05


def compact(
    model: GhostModel,
    tracks: Tracks,
    views: Sequence[View],
    *,
    threads: int | None = None,
    tell: Tell = lambda _part, _words: None,
    journal: Journal | None = None,
) -> GhostModel:
    """Make a model small.

    Parameters
    ----------
    model : GhostModel
        As fitted: one set of numbers for each ghost.
    tracks : Tracks
        Of its ghosts.
    views : sequence of View
        By rising constellation, halo and star taken off.
    threads : int, optional
    tell : callable
        Gets the finished part and words.
    journal : Journal, optional
        Of an earlier run that was stopped; the result is the same with and without.

    Returns
    -------
    GhostModel
        Ghosts that are never seen are left out.

    Notes
    -----
    Numbers of the fit that do not help to foretell left-out constellations are dropped (`orders`) and the others fitted
    once more, all ghosts against each other. Then every frame is asked again how bright, where and how large each ghost
    is, and what differs becomes a curve, its knots chosen by leaving frames out (`smooth`). At last numbers are rounded
    to a twentieth of the standard deviation that each has with the others held, for together they are known far better.
    """
    lived = {track.name: track for track in tracks.ghosts if track.lives}
    kept = [ghost for ghost in model.ghosts if isinstance(ghost, AberrationGhost) and ghost.name in lived]
    spans = [span_of(ghost, lived[ghost.name]) for ghost in kept]
    found = [_found(ghost, span, views) for ghost, span in zip(kept, spans, strict=True)]
    tell(0.0, count(len(kept), "ghost"))
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        steps = journal or Journal()
        found = _fewer(found, kept, views, pool, steps, lambda part, words: tell(0.7 * part, words))
        curves = curves_of(found, spans, views, pool, steps, lambda part, words: tell(0.7 + 0.3 * part, words))
    ghosts = tuple(
        _written(ghost, each, span, curve)
        for ghost, each, span, curve in zip(kept, found, spans, curves, strict=True)
    )  # fmt: skip
    never = [ghost.name for ghost in model.ghosts if ghost.name not in lived]
    remarks = (*model.remarks, f"left out, for no frame shows them: {', '.join(never)}") if never else model.remarks
    out: GhostModel = model.replace(ghosts=ghosts, remarks=remarks)
    return out


def span_of(ghost: AberrationGhost, track: GhostTrack) -> tuple[float, float]:
    """Return from where to where a ghost is drawn: all its lives, with room to fade."""
    first, last = track.lives[0], track.lives[-1]
    low, high = first.birth.constellation_deg, last.death.constellation_deg
    # what a frame cannot tell, the fit's own range tells
    if first.birth.how == "hidden":
        low = min(low, ghost.visible_deg[0])
    if last.death.how == "hidden":
        high = max(high, ghost.visible_deg[1])
    angles = [step.constellation_deg for step in track.steps]
    below, above = [angle for angle in angles if angle < low], [angle for angle in angles if angle > high]
    if first.birth.how in ("fade", "frame") and below:
        low = below[-1]
    if last.death.how in ("fade", "frame") and above:
        high = above[0]
    return low, high


def _found(ghost: AberrationGhost, span: tuple[float, float], views: Sequence[View]) -> Found:
    colours = ghost.red, ghost.green, ghost.blue
    red, green, blue = (Shape(channel_numbers(each, ghost.blades), len(each.discs)) for each in colours)
    there = [k for k, view in enumerate(views) if span[0] <= view.constellation_deg <= span[1]]
    return Found((red, green, blue), there[0], there[-1])


def _fewer(
    ghosts: Sequence[Found],
    kept: Sequence[AberrationGhost],
    views: Sequence[View],
    pool: ThreadPoolExecutor,
    steps: Journal,
    tell: Tell,
) -> list[Found]:
    """Drop numbers that do not help and fit the others, each ghost against all others, brightest first."""
    out = list(ghosts)
    rest, noise = [rest_of(out, views, m, pool) for m in range(CHANNELS)], noise_of(views)
    for done, k in enumerate(by_light(out)):
        old = out[k]
        new = steps.step(partial(_smaller, old, fitted_numbers(kept[k]), views, rest, noise, pool))
        for m in range(CHANNELS):
            exchange(old.shapes[m], new.shapes[m], old, views, rest[m], pool)
        out[k] = new
        fit = new.fits[1]
        numbers = count(0 if fit is None else fit.free.size, "number")
        tell((done + 1) / len(out), f"ghost {kept[k].name}: {numbers} a colour")
    return out


def fitted_numbers(ghost: AberrationGhost) -> Indices:
    """Return which numbers of a ghost the fit was free to choose, by what is told of their uncertainty."""
    known = np.flatnonzero(channel_deviation(ghost.green) > 0.0)
    return known.astype(np.int64) if known.size else free_numbers(2, len(ghost.green.discs), 2)


def _smaller(
    ghost: Found, free: Indices, views: Sequence[View], rest: Sequence[list[Pixels]], noise: Floats,
    pool: ThreadPoolExecutor,
) -> Found:  # fmt: skip
    width = views[0].size_px[0]
    shown = [alone(ghost, m, views, rest[m], _VIEWS, pool) for m in range(CHANNELS)]
    patches = [patches_of(ghost.shapes[m], shown[m], m) for m in range(CHANNELS)]
    if not all(patches):
        return ghost
    bowls = [parabola(ghost.shapes[m], patches[m], free, width, MODEL_ERROR, pool) for m in range(CHANNELS)]
    fewer = needed_numbers(bowls, free)
    best: list[Fit | None] = [None, None, None]
    shapes = list(ghost.shapes)
    # the colour that tells most of it first: the others are like it
    lead = leading(ghost, noise)
    for m in sorted(range(CHANNELS), key=lambda m: m != lead):
        like = None if m == lead else shapes[lead]
        before, level = (cost_of(ghost.shapes[m], patches[m], offset=offset) for offset in (True, False))
        for numbers in (fewer, free):
            start = ghost.shapes[m].numbers.copy()
            start[np.setdiff1d(free, numbers)] = 0.0
            fewer_numbers = replace(ghost.shapes[m], numbers=start)
            fit = refine(fewer_numbers, patches[m], numbers, width=width, steps=10, like=like, pool=pool)
            # the parabola may have been too far off: then all numbers stay
            even = cost_of(fit.shape, patches[m], offset=False) <= (1.0 + _UNEVEN) * level
            if even and cost_of(fit.shape, patches[m]) <= before + _WORSE * before + 2.0 * numbers.size:
                break
        if not even:
            # of a ghost that fills every picture only an even background tells how bright it is
            fit = refine(ghost.shapes[m], patches[m], free, width=width, steps=10, offset=False, like=like, pool=pool)
        best[m], shapes[m] = fit, fit.shape
    return replace(ghost, shapes=(shapes[0], shapes[1], shapes[2]), fits=(best[0], best[1], best[2]))


@dataclass(frozen=True)
class _Said:
    """What one frame says of one ghost."""

    constellation_deg: float
    values: tuple[float, float, float]
    error: tuple[float, float, float]


def curves_of(
    ghosts: Sequence[Found],
    spans: Sequence[tuple[float, float]],
    views: Sequence[View],
    pool: ThreadPoolExecutor,
    steps: Journal,
    tell: Tell,
) -> list[Curves]:
    """Ask every frame again and turn what differs over the constellation into curves.

    Parameters
    ----------
    ghosts : sequence of Found
    spans : sequence of tuple of float
        Where each is drawn, degrees.
    views : sequence of View
    pool : executor
    steps : Journal
    tell : callable

    Returns
    -------
    list of Curves
    """
    said: list[list[_Said]] = [[] for _ in ghosts]
    times = halvings(views[0].size_px[0])
    factor = 2.0**times
    shapes = [_sized(ghost, 1.0 / factor) for ghost in ghosts]
    alive = [
        [g for g, span in enumerate(spans) if span[0] <= view.constellation_deg <= span[1]] for view in views
    ]  # fmt: skip

    def one(view: View, there: list[int]) -> Measured:
        return measure_together([shapes[g] for g in there], [Pose()] * len(there), coarse(view, times))

    measured: list[Measured] = []
    for at in range(0, len(views), _AT_ONCE):
        some = slice(at, at + _AT_ONCE)
        measured += steps.step(partial(done_by, pool, one, views[some], alive[some]))
        tell(len(measured) / len(views), f"{views[len(measured) - 1].constellation_deg:.1f} degrees")
    for view, there, here in zip(views, alive, measured, strict=True):
        for g, pose, error, inside in zip(there, here.poses, here.error, here.inside, strict=True):
            if inside > 0.0 and isfinite(error[0]):
                values = (pose.brightness, factor * pose.along_px, pose.size)
                # a ghost too faint to be seen has no place
                placed = pose.brightness > 0.35
                told = (error[0], factor * error[1] if placed else np.inf, error[2] if placed else np.inf)
                said[g].append(_Said(view.constellation_deg, values, told))
    return [_curves(each, ghost, span) for each, ghost, span in zip(said, ghosts, spans, strict=True)]


def _sized(ghost: Found, factor: float) -> Shapes:
    red, green, blue = (enlarged(shape, factor) for shape in ghost.shapes)
    return red, green, blue


def _curves(said: Sequence[_Said], ghost: Found, span: tuple[float, float]) -> Curves:
    radius = abs(float(ghost.shapes[1].numbers[FIRST_G]))
    found: list[Curve | None] = []
    for n, (usual, spread, least) in enumerate(((1.0, 0.5, 0.01), (0.0, 0.3 * radius + 1.0, 0.05), (1.0, 0.2, 0.003))):
        known = [one for one in said if isfinite(one.error[n])]
        at = np.array([one.constellation_deg for one in known])
        values, error = np.array([one.values[n] for one in known]), np.array([one.error[n] for one in known])
        found.append(smooth_curve(at, values, error, span, usual=usual, spread=spread, least=least))
    return Curves(brightness=_rounded_curve(found[0]), along_px=_rounded_curve(found[1]), size=_rounded_curve(found[2]))


def _written(ghost: AberrationGhost, found: Found, span: tuple[float, float], curves: Curves) -> AberrationGhost:
    colours: list[Channel] = []
    for shape, fit in zip(found.shapes, found.fits, strict=True):
        deviation = None if fit is None else fit.uncertainty
        numbers = shape.numbers
        if deviation is not None:
            numbers = written_numbers(shape, held_error(fit))
            deviation = np.array([float(f"{d:.2g}") for d in deviation])
        colours.append(channel_of(numbers, shape.discs, deviation))
    # a life's own end has room in which its curve fades
    same = zip(span, ghost.visible_deg, ghost.fade_deg, strict=True)
    out: AberrationGhost = ghost.replace(
        red=colours[0], green=colours[1], blue=colours[2], curves=curves,
        visible_deg=(floor(1e4 * span[0]) / 1e4, ceil(1e4 * span[1]) / 1e4),
        fade_deg=tuple(fade if end == old else 0.0 for end, old, fade in same),
    )  # fmt: skip
    return out


def written_numbers(shape: Shape, held: Floats) -> Floats:
    """Return the numbers of one colour, rounded; a rim that nothing tells the size of stays one."""
    numbers = np.array([rounded(float(a), float(d)) for a, d in zip(shape.numbers, held, strict=True)])
    radii = FIRST_DISC + DISC_NUMBERS * np.arange(shape.discs) + 2
    for at in radii[numbers[radii] <= 0.0]:
        numbers[at] = rounded(float(shape.numbers[at]), 0.0)
    return numbers


def held_error(fit: Fit | None) -> Floats:
    """Return each number's standard deviation with all others held: what rounding one of them may cost."""
    out = np.zeros(NUMBERS)
    if fit is not None:
        known = np.diag(inverse(fit.covariance))
        out[fit.free] = np.where(known > 0.0, 1.0 / np.sqrt(np.maximum(known, 1e-300)), 0.0)
    return out


def rounded(value: float, deviation: float) -> float:
    """Round a number to a twentieth of its standard deviation or finer; to nine digits when it has none."""
    if not (deviation > 0.0 and isfinite(deviation)):
        return float(f"{value:.9g}")
    return round(value, ceil(-log10(_DIGITS * deviation)))


def _rounded_curve(curve: Curve | None) -> Curve | None:
    if curve is None:
        return None
    values = tuple(rounded(value, error) for value, error in zip(curve.values, curve.error, strict=True))
    return Curve(values=values, error=tuple(float(f"{error:.2g}") for error in curve.error))


def numbers_in(model: GhostModel) -> int:
    """Count the numbers by which a model's ghosts are drawn, curves and colours included."""
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
