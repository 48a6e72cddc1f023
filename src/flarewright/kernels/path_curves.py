"""What the coatings along paths leave of their light, over the wavelengths."""

import numpy as np

from ._jit import compiled


@compiled
def multiply_mirrors(reflectance, log_through, mirrors, ends, squares, through):
    """Multiply R and T along paths, over the wavelengths.

    Parameters
    ----------
    reflectance : ndarray, shape (K, S, L)
        R of each row against the squared sine on the side of the lower index, uniform over [0, 1].
    log_through : ndarray, shape (K + 1, L)
        Sum of log T of all rows before each.
    mirrors : ndarray, shape (P, M), int64
        Rows of the mirrors of each path, in the order in which light meets them.
    ends : ndarray, shape (P,), int64
        Behind the last row.
    squares : ndarray, shape (P, N, M)
        Of N rays of each path, at its mirrors.
    through : ndarray, shape (P, L)
        Filled with the mean over the rays.
    """
    rays, waves = squares.shape[1], through.shape[1]
    last_place, last_cell = float(reflectance.shape[1] - 1), reflectance.shape[1] - 2
    product = np.empty(waves)
    for p in range(through.shape[0]):
        for m in range(waves):
            through[p, m] = 0.0
        for n in range(rays):
            for m in range(waves):
                product[m] = 1.0
            for k in range(mirrors.shape[1]):
                place = min(max(squares[p, n, k], 0.0), 1.0) * last_place
                cell = min(int(place), last_cell)
                part = place - cell
                low, high = reflectance[mirrors[p, k], cell], reflectance[mirrors[p, k], cell + 1]
                for m in range(waves):
                    product[m] *= low[m] + part * (high[m] - low[m])
            for m in range(waves):
                through[p, m] += product[m]
        for m in range(waves):
            log = log_through[ends[p], m]
            for k in range(mirrors.shape[1]):
                # light goes forth as far as every other mirror and comes back as far as the one between; neither is
                # passed
                log += 2.0 * log_through[mirrors[p, k], m] if k % 2 == 0 else -2.0 * log_through[mirrors[p, k] + 1, m]
            through[p, m] *= np.exp(log) / rays


@compiled
def compare_with_lines(through, at_traced, joined, most, bend):
    """Compare curves with straight lines between some of their wavelengths.

    Parameters
    ----------
    through : ndarray, shape (P, L)
    at_traced : ndarray, shape (L, W)
        Reads a curve at these wavelengths.
    joined : ndarray, shape (W, L)
        Joins what was read by straight lines.
    most : float
        A curve is no more times its line than this.
    bend : ndarray, shape (P, L)
        Filled with how many times the line it is; 1 where the line is next to 0.
    """
    waves, traced = joined.shape[1], joined.shape[0]
    read, line = np.empty(traced), np.empty(waves)
    for p in range(through.shape[0]):
        for w in range(traced):
            read[w] = 0.0
        brightest = 0.0
        for m in range(waves):
            value = through[p, m]
            brightest = max(brightest, value)
            line[m] = 0.0
            for w in range(traced):
                read[w] += value * at_traced[m, w]
        for w in range(traced):
            for m in range(waves):
                line[m] += read[w] * joined[w, m]
        for m in range(waves):
            dark = line[m] <= 1e-9 * brightest
            bend[p, m] = 1.0 if dark else min(through[p, m] / line[m], most)
