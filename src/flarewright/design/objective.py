"""How far the ghosts of a prescription are from those that are wanted."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from ..kernels import design_ghosts as columns
from ..kernels.design_cost import irradiance_of_ghosts
from ..kernels.design_fitness import HIDDEN, sorted_misfit
from ..kernels.design_match import match
from ..model.design import Bounds
from .canvas import Canvas
from .ghosts import evaluate
from .prescription import Structure
from .rims import STEEPEST

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# what too few ghosts are worth there
TOO_FEW = 100000.0
# a ghost of 100 mm without a target costs a tenth of a wanted one that misses by its own radius
RELATIVE_EXTRA = 0.02
# a ghost smaller than this is not weighted any more than one of this radius, mm
LEAST_RADIUS = 0.3


@dataclass(frozen=True)
class Objective:
    """Wanted ghosts as arrays, and what else a lens shall keep.

    Attributes
    ----------
    slopes : ndarray, shape (L,)
        Tangent of each light's field angle.
    spans : ndarray, shape (L + 1,), int64
        Where each light's targets begin.
    targets : ndarray, shape (N, 3)
        Place on the line (mm), radius (mm), log irradiance.
    weights : ndarray, shape (N, 3)
        Of the residuals; 0 leaves one out. A target whose weights are all 0 takes up one ghost, whatever it does.
    signed : bool
    extra : float
        A ghost without a target costs this over its radius.
    entrance : float
        mm.
    wishes : ndarray, shape (4, 3)
        Least, largest and weight of 1/efl, 1/f-number and length; least edge, steepest surface and their weight.
    names : tuple of str
        What each target is, for reports.
    extra_part : float
        Part of `extra` that the search charges, which has no unit of mm^2 where its weights are relative.
    picture : Canvas or None
        What a search makes least is the error of this picture, once it is near; None: of places and sizes.
    """

    slopes: Floats
    spans: Integers
    targets: Floats
    weights: Floats
    signed: bool
    extra: float
    entrance: float
    wishes: Floats
    names: tuple[str, ...]
    extra_part: float = 1.0
    picture: Canvas | None = None

    @property
    def wanted(self) -> int:
        """Largest number of targets at one light: a lens needs as many ghosts."""
        return int(np.diff(self.spans).max())


def wishes_of(bounds: Bounds) -> Floats:
    """Return the limits that no box of variables can hold.

    Parameters
    ----------
    bounds : Bounds

    Returns
    -------
    ndarray, shape (4, 3)
        The weights make an offence of one per cent of the limit worth a millimetre of misfit, and so an edge that is
        0.2 mm too thin.
    """
    focal, speed = bounds.focal_length, bounds.f_number
    longest = 1e9 if bounds.length is None else bounds.length
    return np.array([
        [1.0 / focal[1], 1.0 / focal[0], 100.0 * focal[0]],
        [1.0 / speed[1], 1.0 / speed[0], 100.0 * speed[0]],
        [0.0, longest, 0.0 if bounds.length is None else 100.0 / longest],
        [bounds.edge, STEEPEST, 5.0 if "edges" in bounds.hard else 0.0],
    ])  # fmt: skip


def relative_weights(radii: Floats) -> Floats:
    """Weight place and size by what a displaced ghost does to a picture: the smaller it is, the more.

    Parameters
    ----------
    radii : ndarray, shape (N,)

    Returns
    -------
    ndarray, shape (N,)
    """
    return np.asarray(1.0 / (np.abs(radii) + LEAST_RADIUS), dtype=np.float64)


def seen(values: Floats, slope: float, *, thesis: bool = False) -> Floats:
    """Return place on the line and signed radius of every ghost for one light; one that is hidden is huge.

    Parameters
    ----------
    values : ndarray, shape (G, 6)
    slope : float
    thesis : bool
        Hide as the thesis' program does, when both radii are below the distance of the centres, instead of when the
        two discs miss each other.

    Returns
    -------
    ndarray, shape (G, 2)
    """
    out = np.stack([values[:, columns.PLACE] * slope, values[:, columns.RADIUS]], axis=1)
    hidden = slope > values[:, columns.REACH_THESIS if thesis else columns.REACH]
    out[hidden, 1] = HIDDEN
    return out


def fitness(objective: Objective, structure: Structure, vector: Floats) -> float:
    """Mean squared misfit in mm^2, ghosts matched to targets at least cost.

    Parameters
    ----------
    objective : Objective
        Its weights do not count but for being 0.
    structure : Structure
    vector : ndarray, shape (1 + 3 K,)

    Returns
    -------
    float
        As Algorithm 1 of Van Acoleyen 2025, but the sum over the best matching, with signs if the objective has them.
    """
    residuals, extras, _ = misfits(objective, structure, vector)
    if residuals is None:
        return TOO_FEW
    return float((residuals**2).sum() + extras) / len(objective.targets)


def misfits(
    objective: Objective, structure: Structure, vector: Floats
) -> tuple[Floats | None, float, tuple[tuple[int, int], ...]]:
    """Tell for every target how far its ghost is off.

    Parameters
    ----------
    objective : Objective
    structure : Structure
    vector : ndarray, shape (1 + 3 K,)

    Returns
    -------
    residuals : ndarray, shape (N, 2), or None
        Place and size, mm; None when there are too few ghosts.
    extras : float
        Cost of ghosts without a target.
    ghosts : tuple of (int, int)
        Mirrors of the ghost that stands for each target.
    """
    if len(structure.pairs) < objective.wanted:
        return None, 0.0, ()
    values = evaluate(structure, vector[None], objective.entrance)[0]
    residuals, extras = np.zeros((len(objective.targets), 2)), 0.0
    chosen_pairs: list[tuple[int, int]] = []
    on = objective.weights[:, :2] > 0.0
    for light, slope in enumerate(objective.slopes):
        span = slice(objective.spans[light], objective.spans[light + 1])
        found = seen(values, float(slope))
        radius = found[:, 1] if objective.signed else np.abs(found[:, 1])
        place_off = (found[None, :, 0] - objective.targets[span, 0, None]) * on[span, 0, None]
        size_off = (radius[None] - objective.targets[span, 1, None]) * on[span, 1, None]
        penalty = objective.extra / np.maximum(np.abs(found[:, 1]), 1e-3)
        cost = np.minimum(place_off**2 + size_off**2, 1e30) - penalty[None]
        chosen = np.empty(len(cost), np.int64)
        match(np.ascontiguousarray(cost), chosen)
        rows = np.arange(len(cost))
        residuals[span, 0], residuals[span, 1] = place_off[rows, chosen], size_off[rows, chosen]
        extras += float(np.delete(penalty, chosen).sum())
        chosen_pairs += [structure.pairs[g] for g in chosen]
    return residuals, extras, tuple(chosen_pairs)


def fitness_thesis(objective: Objective, structure: Structure, vector: Floats) -> float:
    """Algorithm 1 of Van Acoleyen 2025 as printed: ghosts and targets sorted by size, no signs.

    Parameters
    ----------
    objective : Objective
    structure : Structure
    vector : ndarray, shape (1 + 3 K,)

    Returns
    -------
    float
        Mean over the lights.

    Notes
    -----
    Centres are (x, y) and the light stands on the diagonal of the thesis' tests; along the line it is the same
    distance. A swap of two ghosts of equal size costs hundreds here and nothing in a picture.
    """
    if len(structure.pairs) < objective.wanted:
        return TOO_FEW
    values = evaluate(structure, vector[None], objective.entrance)[0]
    total = 0.0
    for light, slope in enumerate(objective.slopes):
        targets = objective.targets[objective.spans[light] : objective.spans[light + 1]]
        total += algorithm_1(np.abs(targets[:, 1]), targets[:, 0], seen(values, float(slope), thesis=True))
    return total / len(objective.slopes)


def algorithm_1(sizes: Floats, places: Floats, found: Floats) -> float:
    """Sum the squared errors of ghosts sorted by size, and what extra ghosts cost, over the number of targets.

    Parameters
    ----------
    sizes : ndarray, shape (N,)
        Radii without sign.
    places : ndarray, shape (N,)
    found : ndarray, shape (G, 2)
        Places and radii; G >= N.

    Returns
    -------
    float
    """
    return float(sorted_misfit(np.ascontiguousarray(sizes), np.ascontiguousarray(places), np.ascontiguousarray(found)))


def algorithm_2(targets: Floats, found: Floats) -> Floats:
    """Colour fitness of Van Acoleyen 2025: distances of normalised RGB, summed over the ghosts.

    Parameters
    ----------
    targets : ndarray, shape (N, 3)
    found : ndarray, shape (..., N, 3)

    Returns
    -------
    ndarray, shape (...)

    Notes
    -----
    The thesis' program normalises by the sum of the three.
    """

    def normalised(rgb: Floats) -> Floats:
        return np.asarray(rgb / np.maximum(rgb.sum(axis=-1, keepdims=True), 1e-300), dtype=np.float64)

    off = normalised(targets) - normalised(found)
    return np.asarray(np.sqrt((off**2).sum(axis=-1)).sum(axis=-1), dtype=np.float64)


def own_objective(
    structure: Structure,
    vector: Floats,
    slopes: Floats,
    *,
    bounds: Bounds,
    signed: bool = True,
    brightness: str = "none",
    weights: str = "relative",
    extra: float = 0.0,
    entrance: float = 100.0,
) -> Objective:
    """Aim at the ghosts that a prescription has, to find it or another with the same ghosts.

    Parameters
    ----------
    structure : Structure
    vector : ndarray, shape (1 + 3 K,)
    slopes : ndarray, shape (L,)
    bounds : Bounds
    signed, brightness, weights, extra, entrance
        As in `model.design.Design`.

    Returns
    -------
    Objective
        Ghosts that cannot be seen at a light are no targets of it; one whose middle cannot may do what it wants.
    """
    values = evaluate(structure, vector[None], entrance)[0]
    irradiance = np.empty(len(values))
    irradiance_of_ghosts(vector, structure.stop, structure.mirrors, values, irradiance)
    targets, names, spans, counts = [], [], [0], []
    for light, slope in enumerate(slopes):
        here, middles = seen(values, float(slope)), seen(values, float(slope), thesis=True)
        for g, (j, i) in enumerate(structure.pairs):
            if here[g, 1] != HIDDEN:
                radius = here[g, 1] if signed else abs(here[g, 1])
                targets.append((here[g, 0], radius, irradiance[g]))
                counts.append(middles[g, 1] != HIDDEN)
                names.append(f"{j}-{i}" if len(slopes) == 1 else f"{j}-{i} at light {light}")
        spans.append(len(targets))
    table = np.array(targets).reshape(-1, 3)
    weight = relative_weights(table[:, 1]) if weights == "relative" else np.ones(len(table))
    # of the irradiance a tenth is worth as much as a tenth of the radius
    light_weight = np.full(len(table), 0.5 if brightness == "fresnel" else 0.0)
    three = np.stack([weight, weight, light_weight], axis=1) * np.array(counts, dtype=np.float64)[:, None]
    return Objective(
        slopes=np.asarray(slopes, dtype=np.float64), spans=np.array(spans, dtype=np.int64), targets=table,
        weights=three, signed=signed, extra=extra, entrance=entrance,
        wishes=wishes_of(bounds), names=tuple(names), extra_part=RELATIVE_EXTRA if weights == "relative" else 1.0,
    )  # fmt: skip


def diagonal_slope(angle_deg: float) -> float:
    """Return the slope of the thesis' lights, yaw = pitch = the angle in radians, no tangent."""
    return float(np.radians(angle_deg)) * sqrt(2.0)
