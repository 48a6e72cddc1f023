"""A ghost drawn in all patches of a fit, one call for many: handing over each alone took as long as most take to draw.

Patches lie one after the other in memory. Calls by several threads share them out: each takes every so many, from its
own first one on.
"""

import numpy as np

from ._jit import compiled, inner
from .measure_changes import draw_changes
from .measure_misfit import misfit_of
from .measure_normal import normal_equations


@inner
def _part(numbers, start, height, width):
    """Return one patch's numbers as a picture."""
    return numbers[start : start + height * width].reshape((height, width))


@compiled
def miss_patches(
    parameters, disc_count, table, sigmas, frames, pixels, known, error, outlier, offset, first, every, room, weight,
    residual, told,
):  # fmt: skip
    """Draw a ghost in patches and weigh what it misses; see `weigh_misfit`.

    Parameters
    ----------
    parameters : ndarray, shape (N,), float64
    disc_count : int
    table : ndarray, shape (P, 5), int64
        Of each patch: where its pixels begin, height, width, left, top.
    sigmas : ndarray, shape (P,), float64
    frames : ndarray, shape (P, 5), float64
    pixels, known : ndarray, shape (S,), float64
        Photographed, and its inverse variances.
    error, outlier : float
    offset : bool
    first, every : int
        Which patches.
    room : ndarray, float64
        To work in, at least height (width + 1) of the largest patch.
    weight, residual : ndarray, shape (S,), float64
        Filled.
    told : ndarray, shape (P, 3), float64
        Filled: weighted squares, sum of the weights, how many pixels have weight.
    """
    none, no_changes = np.empty(0, np.int64), np.empty((0, 0, 0))
    for p in range(first, table.shape[0], every):
        start, height, width = table[p, 0], table[p, 1], table[p, 2]
        plane = _part(room, 0, height, width + 1)
        plane[:] = 0.0
        draw_changes(parameters, disc_count, sigmas[p], none, frames[p], table[p, 3], table[p, 4], plane, no_changes)
        told[p, 0], told[p, 1], told[p, 2] = misfit_of(
            plane, _part(pixels, start, height, width), _part(known, start, height, width), error, outlier, offset,
            _part(weight, start, height, width), _part(residual, start, height, width),
        )  # fmt: skip


@compiled
def weigh_changes(
    parameters, disc_count, free, table, sigmas, frames, weight, residual, told, offset, first, every, room, matrices,
    sides,
):  # fmt: skip
    """Sum the normal equations of patches, each patch's even background solved for; see `normal_equations`.

    Parameters
    ----------
    parameters, disc_count, table, sigmas, frames, first, every
        As for `miss_patches`.
    free : ndarray, shape (Q,), int64
        Which parameters to derive by.
    weight, residual : ndarray, shape (S,), float64
    told : ndarray, shape (P, 3), float64
        As `miss_patches` fills them.
    offset : bool
        There is an even background.
    room : ndarray, float64
        To work in, at least height (width + 1) (Q + 1) of the largest patch.
    matrices : ndarray, shape (P, Q, Q), float64
    sides : ndarray, shape (P, Q), float64
        Filled.
    """
    count = free.size
    mean = np.empty(count)
    for p in range(first, table.shape[0], every):
        start, height, width = table[p, 0], table[p, 1], table[p, 2]
        size = height * (width + 1)
        room[: size * (count + 1)] = 0.0
        plane = _part(room, 0, height, width + 1)
        changes = room[size : size * (count + 1)].reshape((height, width + 1, count))
        draw_changes(parameters, disc_count, sigmas[p], free, frames[p], table[p, 3], table[p, 4], plane, changes)
        matrix = matrices[p]
        normal_equations(
            changes, _part(weight, start, height, width), _part(residual, start, height, width), matrix, sides[p], mean
        )
        total = told[p, 1]
        if offset and total > 0.0:
            for a in range(count):
                for b in range(count):
                    matrix[a, b] -= mean[a] * mean[b] / total


@compiled
def weigh_presence(table, pixels, weight, residual, outlier, told):
    """Fit how bright a ghost is in each patch, an even background solved for.

    Parameters
    ----------
    table, pixels, weight, residual
        As for `miss_patches`; no background taken off the residuals.
    outlier : float
        Standard deviations beyond which a pixel counts less and less.
    told : ndarray, shape (P, 2), float64
        Filled: the factor on what was drawn, and its standard deviation; 0 and infinite where nothing tells.
    """
    for p in range(table.shape[0]):
        told[p, 0], told[p, 1] = 0.0, np.inf
        start = table[p, 0]
        end = start + table[p, 1] * table[p, 2]
        _, power = _power(pixels, weight, residual, np.inf, start, end)
        # as the ghost is drawn, nothing stands out
        if not power > 1e-9:
            continue
        seen, power = _power(pixels, weight, residual, outlier, start, end)
        power = max(power, 1e-300)
        told[p, 0], told[p, 1] = seen / power, power**-0.5


@inner
def _power(pixels, weight, residual, outlier, start, end):
    """Return the products of what was drawn, its mean taken off, with what was seen and with itself."""
    scale = 1.0 / outlier**2
    total, mean, seen, power = 0.0, 0.0, 0.0, 0.0
    for k in range(start, end):
        w = weight[k] / (1.0 + weight[k] * (residual[k] * residual[k] * scale))
        total += w
        mean += w * (pixels[k] - residual[k])
    if not total > 0.0:
        return 0.0, 0.0
    mean /= total
    for k in range(start, end):
        w = weight[k] / (1.0 + weight[k] * (residual[k] * residual[k] * scale))
        light = pixels[k] - residual[k] - mean
        seen += w * light * pixels[k]
        power += w * light * light
    return seen, power
