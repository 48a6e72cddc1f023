"""Rays of a bundle at wavelengths between those at which it is traced."""

import numpy as np

from ..jit.decorators import borrowing, compiled
from .clip import inscribed_square
from .representative_rays import is_seen, passes
from .sequential import ALIVE, REL, WEIGHT

# rounding error of a sum of weights that is 1
_ROUNDING = 1e-9


@compiled
def rays_between(short, long, part, carried_short, carried_long):
    """Interpolate a bundle between two wavelengths; a ray is alive if it is alive at both.

    Parameters
    ----------
    short, long : ndarray, shape (N, 5 + 2 C)
        The same rays at both (`kernels.tracing.sequential.trace_lanes`).
    part : float
        0 at `short`, 1 at `long`.
    carried_short, carried_long : float
        Mean weight of rays there. Weights are interpolated relative to it: where coatings pass far more at one
        wavelength than at the other, the dark one is as informative about the distribution of light as the bright one.

    Returns
    -------
    ndarray, shape (N, 5 + 2 C)
    """
    data = np.empty_like(short)
    rest = 1.0 - part
    relative = carried_short != carried_long and min(carried_short, carried_long) > 0.0
    mean = rest * carried_short + part * carried_long
    of_short, of_long = rest * mean / carried_short, part * mean / carried_long
    for k in range(short.shape[0]):
        for column in range(short.shape[1]):
            data[k, column] = rest * short[k, column] + part * long[k, column]
        if relative:
            data[k, WEIGHT] = of_short * short[k, WEIGHT] + of_long * long[k, WEIGHT]
        data[k, ALIVE] = min(short[k, ALIVE], long[k, ALIVE])
    return data


@compiled
def visible_areas(traced, shares, nearest, pupil, triangles, iris_radius, blades, axes, places, width, height):
    """Return the area of the pupil whose rays pass and land in the picture, at wavelengths between the traced ones.

    Parameters
    ----------
    traced : ndarray, shape (T, N, 5 + 2 C)
        The rays of a bundle at T wavelengths (`kernels.tracing.sequential.trace_lanes`).
    shares : ndarray, shape (M, T)
        Weights of these for the rays at M wavelengths.
    nearest : ndarray, shape (M,), int64
        The nearest of the T: a ray that ends at any of them counts as there.
    pupil : ndarray, shape (N, 2)
    triangles : ndarray, shape (K, 3), int64
    iris_radius, blades, width, height
        As in `kernels.tracing.representative_rays.seen_rays`.
    axes, places : ndarray, shape (H, 2, 2) and (H, 2, 3)
        The same for each half of the bundle.

    Returns
    -------
    ndarray, shape (M,)
        mm^2, of all halves; each node represents a third of the area of its triangles.
    """
    areas, own = np.zeros(shares.shape[0]), np.zeros(pupil.shape[0])
    for t in range(triangles.shape[0]):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        x1, y1 = pupil[b, 0] - pupil[a, 0], pupil[b, 1] - pupil[a, 1]
        x2, y2 = pupil[c, 0] - pupil[a, 0], pupil[c, 1] - pupil[a, 1]
        third = abs(x1 * y2 - y1 * x2) / 6.0
        own[a] += third
        own[b] += third
        own[c] += third
    ray, inner2 = np.empty((1, traced.shape[2])), inscribed_square(blades)
    for m in range(shares.shape[0]):
        near = nearest[m]
        exact = shares[m, near] == 1.0
        for k in range(pupil.shape[0]):
            between = False
            if not exact:
                alive = 0.0
                for t in range(traced.shape[0]):
                    alive += shares[m, t] * traced[t, k, ALIVE]
                between = abs(alive - 1.0) < _ROUNDING
            # most rays fail at a rim, where nothing else of them counts
            ray[0, REL] = _column_at(traced, shares, m, near, between, k, REL)
            if not ray[0, REL] <= 1.0:
                continue
            for column in range(traced.shape[2]):
                if column != REL:
                    ray[0, column] = _column_at(traced, shares, m, near, between, k, column)
            # the same at both halves
            if not passes(ray, 0, iris_radius):
                continue
            for half in range(axes.shape[0]):
                if is_seen(ray, 0, inner2, blades, axes[half], places[half], width, height):
                    areas[m] += own[k]
    return areas


@borrowing
def _column_at(traced, shares, m, near, between, k, column):
    """Return a column of a ray at the m-th wavelength: interpolated, or that of the nearest traced one."""
    if not between:
        return traced[near, k, column]
    value = 0.0
    for t in range(traced.shape[0]):
        value += shares[m, t] * traced[t, k, column]
    return value
