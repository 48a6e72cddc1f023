"""Which of a ghost's numbers are needed: the fewest that foretell left-out constellations as well as all do.

Around a fit the cost is a parabola in the numbers, of which every constellation holds its own part. So leaving
constellations and numbers out in turn is linear algebra, without drawing a picture. Directions in which the picture
does not change at all (the pupil stretched, its intensity thinned) cost nothing to leave out, and so none is kept.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from ..kernels.measure_pupil import DISC_NUMBERS, FIRST_DISC, FIRST_G, FIRST_I, LATERAL, SOFT
from .fit import priors
from .numbers import Floats
from .patches import Patch, equations, laid_out, missed
from .shape import Indices, Shape
from .smooth import alike

# constellations are left out by every so many
FOLDS = 4


@dataclass(frozen=True)
class Parabola:
    """The cost around a fit, constellation by constellation: c - 2 b.d + d.H d.

    Attributes
    ----------
    at : ndarray, shape (Q,)
        The fitted numbers.
    cost : ndarray, shape (K,)
    side : ndarray, shape (K, Q)
    matrix : ndarray, shape (K, Q, Q)
    prior : ndarray, shape (Q,)
        Weak inverse variances about 0.
    """

    at: Floats
    cost: Floats
    side: Floats
    matrix: Floats
    prior: Floats


def parabola(
    shape: Shape,
    patches: Sequence[Patch],
    free: Indices,
    width: int,
    error: float,
    pool: ThreadPoolExecutor | None = None,
) -> Parabola:
    """Return the cost of one colour around its fit.

    Parameters
    ----------
    shape : Shape
    patches : sequence of Patch
        One for each constellation.
    free : ndarray of int
        Numbers that were fitted.
    width : int
        Of the picture.
    error : float
        Part of the light that the model may miss.
    pool : executor, optional
    """
    whole = laid_out(patches)
    miss = missed(shape, whole, error=error, pool=pool)
    matrices, sides = equations(shape, free, whole, miss, pool=pool)
    return Parabola(shape.numbers[free], miss.costs, sides, matrices, priors(shape, free, width))


def can_go(free: Indices) -> list[int]:
    """Return the places in `free` of numbers that may be left out: all but place, size, light, and what makes a rim."""
    kept = {0, FIRST_G, FIRST_I}
    return [
        k for k, number in enumerate(free)
        if number not in kept
        and (number < FIRST_DISC or number >= LATERAL or (number < SOFT and (number - FIRST_DISC) % DISC_NUMBERS == 1))
    ]  # fmt: skip


def needed_numbers(colours: Sequence[Parabola], free: Indices) -> Indices:
    """Choose numbers by cross-validation, the same for all colours.

    Parameters
    ----------
    colours : sequence of Parabola
        Over the same `free`; constellations are left out by every fourth.
    free : ndarray of int

    Returns
    -------
    ndarray of int
        Of `free`, as few as foretell no worse than the best choice by one standard error of the difference.

    Notes
    -----
    Numbers go one by one, the one first whose going makes left-out constellations worst foretold by least.
    """
    here = np.ones(free.size, dtype=bool)
    trail = [(here.copy(), _foretelling(colours, here))]
    going = can_go(free)
    while going:
        trials = []
        for k in going:
            here[k] = False
            trials.append((_foretelling(colours, here), k))
            here[k] = True
        costs, k = min(trials, key=lambda one: float(one[0].sum()))
        here[k] = False
        going.remove(k)
        trail.append((here.copy(), costs))
    best = min(trail, key=lambda one: float(one[1].sum()))[1]
    for chosen, costs in reversed(trail):
        if alike(costs, best):
            return np.asarray(free[chosen], dtype=np.int64)
    return free


def _foretelling(colours: Sequence[Parabola], here: np.ndarray) -> Floats:
    """Return what each constellation of each colour costs when it was left out and only some numbers are there."""
    return np.concatenate([_one_colour(one, here) for one in colours])


def _one_colour(one: Parabola, here: np.ndarray) -> Floats:
    count = len(one.cost)
    out = np.empty(count)
    whole, side = one.matrix.sum(axis=0), one.side.sum(axis=0)
    gone = ~here
    moved = np.where(gone, -one.at, 0.0)
    folds = min(FOLDS, count)
    for fold in range(folds):
        left = np.arange(count) % folds == fold
        matrix, b = whole - one.matrix[left].sum(axis=0), side - one.side[left].sum(axis=0)
        prior = one.prior[here]
        right = b[here] - prior * one.at[here] - matrix[np.ix_(here, gone)] @ moved[gone]
        step = moved.copy()
        step[here] = np.linalg.solve(matrix[np.ix_(here, here)] + np.diag(prior), right)
        out[left] = one.cost[left] - 2.0 * one.side[left] @ step + np.einsum("q,kqr,r->k", step, one.matrix[left], step)
    return out
