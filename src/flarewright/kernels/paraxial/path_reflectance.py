"""Spectral throughput of paths: products of the coatings' R and T, averaged over a few rays."""

from math import sqrt

import numpy as np

from ..jit.decorators import compiled, inner
from ..tracing.sequential import ALIVE, REFLECT, STOP, STOP_X, trace_lanes


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

    Notes
    -----
    R is interpolated over the cosine cubically at the mirrors and linearly elsewhere: near a film's zero its relative
    error counts, and a line is up to 10 % off (1e-5 of the light). T errs by 6e-5 at most.
    """
    product = np.empty(through.shape[1])
    for p in range(through.shape[0]):
        _mean_product(reflectance, rows, actions, starts[p], starts[p + 1], squares, 0, 1, through[p], product)


@compiled
def ray_throughput(steps, lens, light, px, py, crossings, reflectance, through):
    """Trace rays along one path and multiply R and T at their angles of incidence, at every wavelength.

    Parameters
    ----------
    steps, lens, light, px, py
        As in `kernels.tracing.sequential.trace_lanes`, of one path; N rays.
    crossings : int
        Number of times that the path crosses the stop.
    reflectance : ndarray, shape (K, S, L)
        As in `path_throughput`.
    through : ndarray, shape (2, L)
        Filled with the products, averaged over every other ray that reaches the sensor's plane, and over the rest; of
        an odd number of rays the last is left out. Of a single ray both are the same.

    Returns
    -------
    int
        Number of rays that reach the sensor's plane; 0: `through` is not filled.
    """
    data, squares = np.empty((px.shape[0], STOP_X + 2 * crossings)), np.empty((px.shape[0], steps.rows.shape[0]))
    trace_lanes(steps, lens, light, px, py, data, squares)
    reached = 0
    for k in range(px.shape[0]):
        if data[k, ALIVE] > 0.0:
            for step in range(squares.shape[1]):
                squares[reached, step] = squares[k, step]
            reached += 1
    if reached == 0:
        return reached
    used = squares[: max(reached // 2 * 2, 1)]
    product = np.empty(through.shape[1])
    for half in range(2):
        first = min(half, used.shape[0] - 1)
        _mean_product(
            reflectance, steps.rows, steps.actions, 0, steps.rows.shape[0], used, first, 2, through[half], product
        )
    return reached


@inner
def _mean_product(reflectance, rows, actions, begin, end, squares, first, every, through, product):
    """Fill `through` with the product along a path's steps from `begin` to `end`, averaged over every `every`-th ray.

    `product` is working space of the same shape (L,).
    """
    waves = through.shape[0]
    last_place, last_cell = float(reflectance.shape[1] - 1), reflectance.shape[1] - 2
    rays = (squares.shape[0] - first + every - 1) // every
    through[:] = 0.0
    for n in range(first, squares.shape[0], every):
        product[:] = 1.0 / rays
        for step in range(begin, end):
            if actions[step] == STOP:
                continue
            place = sqrt(1.0 - squares[n, step]) * last_place
            cell = min(int(place), last_cell)
            part = place - cell
            low, high = reflectance[rows[step], cell], reflectance[rows[step], cell + 1]
            if actions[step] == REFLECT:
                start = min(max(cell - 1, 0), last_cell - 2)
                a, b, c, d = cubic_weights(place - start)
                table = reflectance[rows[step]]
                one, two, three, four = table[start], table[start + 1], table[start + 2], table[start + 3]
                for m in range(waves):
                    product[m] *= a * one[m] + b * two[m] + c * three[m] + d * four[m]
            else:
                for m in range(waves):
                    product[m] *= 1.0 - low[m] - part * (high[m] - low[m])
        for m in range(waves):
            through[m] += product[m]


@compiled
def throughput_between(reflectance, rows, actions, starts, squares, nodes, shares, through):
    """As `path_throughput`, of one ray of each path whose angles at the mirrors change with the wavelength.

    Parameters
    ----------
    reflectance, rows, actions, starts, through
        As in `path_throughput`.
    squares : ndarray, shape (steps,)
        Squared sines of incidence, used where light is transmitted.
    nodes : ndarray, shape (N, steps)
        Squared sines of incidence at some wavelengths, used at the mirrors.
    shares : ndarray, shape (N, L)
        Part that each of them has in each wavelength of `reflectance`: R is linear between them.

    Notes
    -----
    What a film reflects at a wavelength changes by several per cent over the angles that rays of other colours have.
    """
    waves, count = through.shape[1], nodes.shape[0]
    last_place, last_cell = float(reflectance.shape[1] - 1), reflectance.shape[1] - 2
    mirror, product = np.empty(waves), np.empty(waves)
    # most shares are 0: runs of the others
    runs, used = np.empty((count, waves, 2), np.int64), np.zeros(count, np.int64)
    for n in range(count):
        for m in range(waves):
            if shares[n, m] != 0.0:
                if m == 0 or shares[n, m - 1] == 0.0:
                    runs[n, used[n], 0] = m
                    used[n] += 1
                runs[n, used[n] - 1, 1] = m + 1
    for p in range(through.shape[0]):
        product[:] = 1.0
        for step in range(starts[p], starts[p + 1]):
            if actions[step] == STOP:
                continue
            table = reflectance[rows[step]]
            if actions[step] == REFLECT:
                mirror[:] = 0.0
                for n in range(count):
                    place = sqrt(1.0 - nodes[n, step]) * last_place
                    first = min(max(int(place) - 1, 0), last_cell - 2)
                    a, b, c, d = cubic_weights(place - first)
                    one, two, three, four = table[first], table[first + 1], table[first + 2], table[first + 3]
                    for k in range(used[n]):
                        for m in range(runs[n, k, 0], runs[n, k, 1]):
                            mirror[m] += shares[n, m] * (a * one[m] + b * two[m] + c * three[m] + d * four[m])
                for m in range(waves):
                    product[m] *= mirror[m]
            else:
                place = sqrt(1.0 - squares[step]) * last_place
                cell = min(int(place), last_cell)
                part = place - cell
                low, high = table[cell], table[cell + 1]
                for m in range(waves):
                    product[m] *= 1.0 - low[m] - part * (high[m] - low[m])
        for m in range(waves):
            through[p, m] = product[m]


@inner
def cubic_weights(place):
    """Return the weights of values at 0, 1, 2 and 3 for the cubic through them (Abramowitz and Stegun 1964, 25.2.13).

    Parameters
    ----------
    place : float

    Returns
    -------
    a, b, c, d : float
    """
    p, q, r = place - 1.0, place - 2.0, place - 3.0
    return -p * q * r / 6.0, place * q * r / 2.0, -place * p * r / 2.0, place * p * q / 6.0
