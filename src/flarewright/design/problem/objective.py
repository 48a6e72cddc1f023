"""Misfit between the ghosts of a prescription and the target ghosts."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np

from ...kernels.design import ghosts as columns
from ...kernels.design.arguments import GhostAims
from ...kernels.design.assignment import match
from ...kernels.design.cost import irradiance_of_ghosts
from ...kernels.design.fitness import HIDDEN, sorted_misfit
from ...model.project.design import Bounds
from ...typing import Floats, Indices
from .ghosts import evaluate
from .prescription import Structure
from .rims import STEEPEST
from .target_image import TargetCanvas

# fitness of a lens with too few ghosts
TOO_FEW = 100000.0
# a ghost of 100 mm without a target costs a tenth of a target ghost that misses by its own radius
RELATIVE_EXTRA = 0.02
# ghosts smaller than this have the weight of this radius, mm
LEAST_RADIUS = 0.3


@dataclass(frozen=True)
class Objective:
    """Target ghosts as arrays, and the limits of the lens.

    Attributes
    ----------
    slopes : ndarray, shape (L,)
        Tangent of each light's field angle.
    spans : ndarray, shape (L + 1,), int64
        Index of each light's first target.
    targets : ndarray, shape (N, 3)
        Place on the line (mm), radius (mm), log irradiance.
    weights : ndarray, shape (N, 3)
        Of the residuals; 0 drops one. A target whose weights are all 0 uses up one ghost, whatever its place and size.
    signed : bool
    extra : float
        A ghost without a target costs this divided by its radius.
    entrance : float
        mm.
    limits : ndarray, shape (4, 3)
        Least, largest and weight of 1/efl, 1/f-number and length; least edge, steepest surface and their weight.
    names : tuple of str
        Name of each target, for reports.
    extra_part : float
        Factor on `extra` in a search whose weights are relative, where `extra` has no unit of mm^2.
    picture : TargetCanvas or None
        Near a solution the search minimises the error of this picture; None: that of places and sizes.
    """

    slopes: Floats
    spans: Indices
    targets: Floats
    weights: Floats
    signed: bool
    extra: float
    entrance: float
    limits: Floats
    names: tuple[str, ...]
    extra_part: float = 1.0
    picture: TargetCanvas | None = None

    @property
    def for_kernels(self) -> GhostAims:
        """The target ghosts as the searches take them."""
        return GhostAims(self.slopes, self.spans, self.targets, self.weights, self.signed, self.extra * self.extra_part)

    @property
    def wanted(self) -> int:
        """Largest number of targets at one light: the number of ghosts that a lens needs."""
        return int(np.diff(self.spans).max())


def limits_of(bounds: Bounds) -> Floats:
    """Return the limits that are not bounds of a single variable.

    Returns
    -------
    ndarray, shape (4, 3)
        With these weights, breaking a limit by one per cent (an edge: by 0.2 mm) costs as much as a millimetre of
        misfit.
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
    """Return weights of place and size by the effect of a displaced ghost on a picture: larger for smaller ghosts.

    Parameters
    ----------
    radii : ndarray, shape (N,)

    Returns
    -------
    ndarray, shape (N,)
    """
    return np.asarray(1.0 / (np.abs(radii) + LEAST_RADIUS), dtype=np.float64)


def seen(values: Floats, slope: float, *, thesis: bool = False) -> Floats:
    """Return place on the line and signed radius of every ghost for one light; a hidden ghost gets huge values.

    Parameters
    ----------
    values : ndarray, shape (G, 6)
    slope : float
    thesis : bool
        Use the rule of the thesis' program: a ghost is hidden when both radii are below the distance of the centres.
        Otherwise it is hidden when the two discs do not overlap.

    Returns
    -------
    ndarray, shape (G, 2)
    """
    out = np.stack([values[:, columns.PLACE] * slope, values[:, columns.RADIUS]], axis=1)
    hidden = slope > values[:, columns.REACH_THESIS if thesis else columns.REACH]
    out[hidden, 1] = HIDDEN
    return out


def fitness(objective: Objective, structure: Structure, vector: Floats) -> float:
    """Return the mean squared misfit in mm^2, with ghosts matched to targets at least cost.

    Parameters
    ----------
    objective : Objective
        Only zero weights count; the others are ignored.
    structure : Structure
    vector : ndarray, shape (1 + 3 K,)

    Returns
    -------
    float
        As Algorithm 1 of Van Acoleyen 2025, but summed over the best matching, with signs if the objective has them.
    """
    residuals, extras, _ = misfits(objective, structure, vector)
    if residuals is None:
        return TOO_FEW
    return float((residuals**2).sum() + extras) / len(objective.targets)


def misfits(
    objective: Objective, structure: Structure, vector: Floats
) -> tuple[Floats | None, float, tuple[tuple[int, int], ...]]:
    """Return the place and size error of every target.

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
        Mirrors of the ghost matched to each target.
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
    """Compute Algorithm 1 of Van Acoleyen 2025 as printed: ghosts and targets sorted by size, no signs.

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
    Centres are (x, y) with the light on the diagonal, as in the thesis' tests; distances along the line are the same.
    A swap of two ghosts of equal size costs hundreds here and does not change the picture.
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
    """Return the squared errors of ghosts sorted by size plus the cost of extra ghosts, divided by the target count.

    Parameters
    ----------
    sizes : ndarray, shape (N,)
        Radii without sign.
    places : ndarray, shape (N,)
    found : ndarray, shape (G, 2)
        Places and radii; G >= N.
    """
    return float(sorted_misfit(np.ascontiguousarray(sizes), np.ascontiguousarray(places), np.ascontiguousarray(found)))


def algorithm_2(targets: Floats, found: Floats) -> Floats:
    """Compute the colour fitness of Van Acoleyen 2025: distances of normalised RGB, summed over the ghosts.

    Parameters
    ----------
    targets : ndarray, shape (N, 3)
    found : ndarray, shape (..., N, 3)

    Returns
    -------
    ndarray, shape (...)

    Notes
    -----
    Normalised by R + G + B, as in the thesis' program.
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
    """Use the ghosts of a prescription as targets, to find it again or another lens with the same ghosts.

    Parameters
    ----------
    structure : Structure
    vector : ndarray, shape (1 + 3 K,)
    slopes : ndarray, shape (L,)
    bounds : Bounds
    signed, brightness, weights, extra, entrance
        As in `model.project.design.Design`.

    Returns
    -------
    Objective
        A ghost invisible at a light is no target of it; a ghost whose middle is invisible gets zero weights.
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
    # a tenth of the irradiance weighs as much as a tenth of the radius
    light_weight = np.full(len(table), 0.5 if brightness == "fresnel" else 0.0)
    three = np.stack([weight, weight, light_weight], axis=1) * np.array(counts, dtype=np.float64)[:, None]
    return Objective(
        slopes=np.asarray(slopes, dtype=np.float64), spans=np.array(spans, dtype=np.int64), targets=table,
        weights=three, signed=signed, extra=extra, entrance=entrance,
        limits=limits_of(bounds), names=tuple(names),
        extra_part=RELATIVE_EXTRA if weights == "relative" else 1.0, )  # fmt: skip


def diagonal_slope(angle_deg: float) -> float:
    """Return the slope of the thesis' light sources: yaw = pitch = the angle in radians, without the tangent."""
    return float(np.radians(angle_deg)) * sqrt(2.0)
