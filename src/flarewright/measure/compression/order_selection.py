"""Select the needed parameters of a ghost: the fewest that predict left-out constellations as well as all do.

Around a fit the cost is a quadratic form in the parameters, a sum over constellations. Leaving out constellations and
parameters in turn is thus linear algebra and needs no drawing. Directions that do not change the picture, such as a
stretched pupil with reduced intensity, cost nothing to drop and are dropped.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from ...kernels.ghost_model.pupil_mesh import DISC_NUMBERS, FIRST_DISC, FIRST_G, FIRST_I, LATERAL, SOFT
from ...typing import Floats, Indices
from ..core.parameters import Shape
from ..fitting.ghost_fit import priors
from ..fitting.patches import Patch, equations, laid_out, residual_in
from ..fitting.settings import FitSettings
from ..tracking.smoothing_spline import within_standard_error
from .settings import CompressionSettings


@dataclass(frozen=True)
class Parabola:
    """Quadratic cost around a fit for each of K constellations, c - 2 b.d + d.H d with d the change of the parameters.

    Attributes
    ----------
    at : ndarray, shape (Q,)
        The fitted parameters.
    cost : ndarray, shape (K,)
        c.
    side : ndarray, shape (K, Q)
        b.
    matrix : ndarray, shape (K, Q, Q)
        H.
    prior : ndarray, shape (Q,)
        Inverse variances of a weak prior with mean 0.
    """

    at: Floats
    cost: Floats
    side: Floats
    matrix: Floats
    prior: Floats


def parabola(
    shape: Shape, patches: Sequence[Patch], free: Indices, width: int, error: float,
    pool: ThreadPoolExecutor | None = None, settings: FitSettings = FitSettings(),
) -> Parabola:  # fmt: skip
    """Return the quadratic cost of one colour around its fit.

    Parameters
    ----------
    shape : Shape
    patches : sequence of Patch
        One for each constellation.
    free : ndarray of int
        Indices of the fitted parameters.
    width : int
        Width of the picture, pixels.
    error : float
        Expected model error, as a fraction of the light.
    pool : executor, optional
    settings : FitSettings
    """
    whole = laid_out(patches)
    miss = residual_in(shape, whole, error=error, pool=pool, settings=settings)
    matrices, sides = equations(shape, free, whole, miss, pool=pool)
    return Parabola(shape.numbers[free], miss.costs, sides, matrices, priors(shape, free, width, settings.priors))


def can_go(free: Indices) -> list[int]:
    """Return the positions in `free` of droppable parameters: all but position, size, brightness, rims and softness."""
    kept = {0, FIRST_G, FIRST_I}
    return [
        k for k, number in enumerate(free)
        if number not in kept
        and (number < FIRST_DISC or number >= LATERAL or (number < SOFT and (number - FIRST_DISC) % DISC_NUMBERS == 1))
    ]  # fmt: skip


def needed_numbers(
    colours: Sequence[Parabola], free: Indices, settings: CompressionSettings = CompressionSettings()
) -> Indices:
    """Select parameters by cross-validation, the same for all colours.

    Parameters
    ----------
    colours : sequence of Parabola
        All over the same parameters `free`.
    free : ndarray of int
    settings : CompressionSettings

    Returns
    -------
    ndarray of int
        The smallest subset of `free` whose prediction is within one standard error of that of the best subset.

    Notes
    -----
    Backward elimination: each step drops the parameter whose removal raises the cost of left-out constellations least.
    """
    here = np.ones(free.size, dtype=bool)
    subsets = [(here.copy(), _left_out_costs(colours, here, settings))]
    droppable = can_go(free)
    while droppable:
        trials = []
        for k in droppable:
            here[k] = False
            trials.append((_left_out_costs(colours, here, settings), k))
            here[k] = True
        costs, k = min(trials, key=lambda one: float(one[0].sum()))
        here[k] = False
        droppable.remove(k)
        subsets.append((here.copy(), costs))
    best = min(subsets, key=lambda one: float(one[1].sum()))[1]
    for chosen, costs in reversed(subsets):
        if within_standard_error(costs, best):
            return np.asarray(free[chosen], dtype=np.int64)
    return free


def _left_out_costs(colours: Sequence[Parabola], here: np.ndarray, settings: CompressionSettings) -> Floats:
    """Return the cost of each left-out constellation of each colour, predicted with the parameters `here` only."""
    return np.concatenate([_left_out_costs_of(one, here, settings) for one in colours])


def _left_out_costs_of(one: Parabola, here: np.ndarray, settings: CompressionSettings) -> Floats:
    count = len(one.cost)
    out = np.empty(count)
    whole, side = one.matrix.sum(axis=0), one.side.sum(axis=0)
    dropped = ~here
    moved = np.where(dropped, -one.at, 0.0)
    folds = min(settings.folds, count)
    for fold in range(folds):
        left = np.arange(count) % folds == fold
        matrix, b = whole - one.matrix[left].sum(axis=0), side - one.side[left].sum(axis=0)
        prior = one.prior[here]
        right = b[here] - prior * one.at[here] - matrix[np.ix_(here, dropped)] @ moved[dropped]
        step = moved.copy()
        step[here] = np.linalg.solve(matrix[np.ix_(here, here)] + np.diag(prior), right)
        out[left] = one.cost[left] - 2.0 * one.side[left] @ step + np.einsum("q,kqr,r->k", step, one.matrix[left], step)
    return out
