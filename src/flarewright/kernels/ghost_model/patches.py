"""Draw and compare a ghost in all patches of a fit with one call: one call per patch took as long as drawing most.

Patches are stored one after another in memory. Several threads share them: each thread processes every n-th patch, from
a different first one.
"""

import numpy as np

from ..jit.decorators import compiled, inner
from .jacobian import draw_changes
from .normal_equations import normal_equations
from .residuals import misfit_of


@inner
def _part(numbers, start, height, width):
    """Return one patch's part of a flat array as a picture."""
    return numbers[start : start + height * width].reshape((height, width))


@compiled
def miss_patches(
    parameters, disc_count, table, sigmas, frames, pixels, known, error, outlier, offset, first, every, room, weight,
    residual, sums,
):  # fmt: skip
    """Draw a ghost in patches and fill residuals and weights; see `weigh_misfit`.

    Parameters
    ----------
    parameters : ndarray, shape (N,), float64
    disc_count : int
    table : ndarray, shape (P, 5), int64
        For each patch: index of its first pixel, height, width, left, top.
    sigmas : ndarray, shape (P,), float64
    frames : ndarray, shape (P, 5), float64
    pixels, known : ndarray, shape (S,), float64
        Photographed pixels and their inverse variances.
    error, outlier : float
    offset : bool
    first, every : int
        First patch of this call, and the stride to the next one.
    room : ndarray, float64
        Scratch, at least height (width + 1) of the largest patch.
    weight, residual : ndarray, shape (S,), float64
        Filled.
    sums : ndarray, shape (P, 3), float64
        Filled: weighted sum of squared residuals, sum of the weights, number of pixels with weight.
    """
    none, no_changes = np.empty(0, np.int64), np.empty((0, 0, 0))
    for p in range(first, table.shape[0], every):
        start, height, width = table[p, 0], table[p, 1], table[p, 2]
        plane = _part(room, 0, height, width + 1)
        plane[:] = 0.0
        draw_changes(parameters, disc_count, sigmas[p], none, frames[p], table[p, 3], table[p, 4], plane, no_changes)
        sums[p, 0], sums[p, 1], sums[p, 2] = misfit_of(
            plane, _part(pixels, start, height, width), _part(known, start, height, width), error, outlier, offset,
            _part(weight, start, height, width), _part(residual, start, height, width),
        )  # fmt: skip


@compiled
def weigh_changes(
    parameters, disc_count, free, table, sigmas, frames, weight, residual, sums, offset, first, every, room,
    matrices, sides,
):  # fmt: skip
    """Sum the normal equations of patches, with each patch's constant background eliminated; see `normal_equations`.

    Parameters
    ----------
    parameters, disc_count, table, sigmas, frames, first, every
        As in `miss_patches`.
    free : ndarray, shape (Q,), int64
        Indices of the parameters to differentiate by.
    weight, residual : ndarray, shape (S,), float64
    sums : ndarray, shape (P, 3), float64
        As filled by `miss_patches`.
    offset : bool
        Whether there is a constant background.
    room : ndarray, float64
        Scratch, at least height (width + 1) (Q + 1) of the largest patch.
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
        total = sums[p, 1]
        if offset and total > 0.0:
            for a in range(count):
                for b in range(count):
                    matrix[a, b] -= mean[a] * mean[b] / total


@compiled
def weigh_presence(table, pixels, weight, residual, outlier, factors):
    """Fit the brightness factor of a ghost in each patch, with a constant background eliminated.

    Parameters
    ----------
    table, pixels, weight, residual
        As in `miss_patches`, with no background subtracted from the residuals.
    outlier : float
        Residual in standard deviations beyond which weights fall.
    factors : ndarray, shape (P, 2), float64
        Filled: factor of the drawn light, and its standard deviation; 0 and infinite where the data do not constrain
        it.
    """
    for p in range(table.shape[0]):
        factors[p, 0], factors[p, 1] = 0.0, np.inf
        start = table[p, 0]
        end = start + table[p, 1] * table[p, 2]
        _, power = _power(pixels, weight, residual, np.inf, start, end)
        # the drawn ghost has no contrast in this patch
        if not power > 1e-9:
            continue
        seen, power = _power(pixels, weight, residual, outlier, start, end)
        power = max(power, 1e-300)
        factors[p, 0], factors[p, 1] = seen / power, power**-0.5


@inner
def _power(pixels, weight, residual, outlier, start, end):
    """Return the weighted products of the drawn light minus its mean with the pixels and with itself."""
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
