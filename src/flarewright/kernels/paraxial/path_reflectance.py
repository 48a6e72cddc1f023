"""Spectral throughput of paths: products of the coatings' R and T, averaged over a few rays."""

from math import sqrt

import numpy as np

from ..jit.decorators import compiled
from ..tracing.sequential import REFLECT, STOP


@compiled
def path_throughput(reflectance, rows, actions, starts, squares, through):
    """Multiply R and T along paths, at every wavelength.

    Parameters
    ----------
    reflectance : ndarray, shape (K, S, L)
        R of each row against the cosine on the side of the lower index, uniform over [0, 1].
    rows, actions : ndarray, int64
        The steps of all paths, one after another.
    starts : ndarray, shape (P + 1,), int64
        Index of the first step of each path.
    squares : ndarray, shape (N, steps)
        Squared sines of incidence of N rays of each path at its steps.
    through : ndarray, shape (P, L)
        Filled with the products, averaged over the rays.
    """
    rays, waves = squares.shape[0], through.shape[1]
    last_place, last_cell = float(reflectance.shape[1] - 1), reflectance.shape[1] - 2
    product = np.empty(waves)
    for p in range(through.shape[0]):
        through[p, :] = 0.0
        for n in range(rays):
            product[:] = 1.0 / rays
            for step in range(starts[p], starts[p + 1]):
                if actions[step] == STOP:
                    continue
                place = sqrt(1.0 - squares[n, step]) * last_place
                cell = min(int(place), last_cell)
                part = place - cell
                low, high = reflectance[rows[step], cell], reflectance[rows[step], cell + 1]
                if actions[step] == REFLECT:
                    for m in range(waves):
                        product[m] *= low[m] + part * (high[m] - low[m])
                else:
                    for m in range(waves):
                        product[m] *= 1.0 - low[m] - part * (high[m] - low[m])
            for m in range(waves):
                through[p, m] += product[m]
