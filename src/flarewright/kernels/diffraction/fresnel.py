"""Fresnel propagation of an opening: its samples, and its spectrum times phase factors averaged over a band."""

from __future__ import annotations

from math import pi, sin, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...typing import Pixels
from ..jit.decorators import compiled
from ..tracing.clip import blade_value


@compiled
def open_softly(blades, x, y, light):
    """Sample an opening of blades, its border averaged over a triangle two samples wide.

    Parameters
    ----------
    blades : ndarray, shape (B, 4)
        From `optics.pupil.iris.blade_edges`, one at least.
    x, y : ndarray, shapes (Nx,) and (Ny,)
        Places, evenly spaced in each, mm.
    light : ndarray, shape (Ny, Nx), float32
        Filled.

    Notes
    -----
    Across a border between both axes two samples are as wide as an ellipse is along its normal.
    """
    step_x, step_y = abs(x[1] - x[0]), abs(y[1] - y[0])
    for i in range(y.size):
        for j in range(x.size):
            worst = -np.inf
            for b in range(blades.shape[0]):
                worst = max(worst, blade_value(blades, b, x[j], y[i]))
            # a border's value is the distance from it, and grows faster the farther out
            if abs(worst) > 2.0 * max(step_x, step_y):
                light[i, j] = np.float32(1.0) if worst < 0.0 else np.float32(0.0)
                continue
            worst = -np.inf
            for b in range(blades.shape[0]):
                back = 1.0 - blades[b, 3] * blades[b, 2]
                across = step_x * (back * blades[b, 0] + blades[b, 3] * x[j])
                down = step_y * (back * blades[b, 1] + blades[b, 3] * y[i])
                own = blade_value(blades, b, x[j], y[i])
                worst = max(worst, own / sqrt(across * across + down * down))
            part = min(max(0.5 - 0.5 * worst, 0.0), 1.0)
            light[i, j] = np.float32(2.0 * part * part if part < 0.5 else 1.0 - 2.0 * (1.0 - part) * (1.0 - part))


@compiled
def sharpen(across, down, spectrum):
    """Give back to a spectrum what a border's average over a triangle two samples wide took: sinc^2 of its frequency.

    Parameters
    ----------
    across, down : ndarray, shapes (Nx // 2 + 1,) and (Ny,)
        Frequencies, cycles a sample.
    spectrum : ndarray, shape (Ny, Nx // 2 + 1), complex64
        Changed. In the corners, beyond half a cycle, which the grid does not resolve, there is nothing to give back.
    """
    for i in range(down.size):
        for j in range(across.size):
            turn = pi * sqrt(min(across[j] * across[j] + down[i] * down[i], 0.25))
            soft = sin(turn) / turn if turn > 0.0 else 1.0
            spectrum[i, j] *= np.float32(1.0 / (soft * soft))


@compiled
def sum_turns(rows, columns, table):
    """Sum the phase factors of a band's colours at uniform steps.

    Parameters
    ----------
    rows, columns : ndarray, shape (K, N), complex128
        For each colour: the phase factors at the first step of each row of the table, times the colour's weight, and
        at the steps of the first row.
    table : ndarray, shape (N * N,), complex64
        Filled with the sums at all steps, row by row.
    """
    colors, count = rows.shape
    real, imaginary = np.empty(count), np.empty(count)
    for i in range(count):
        real[:] = 0.0
        imaginary[:] = 0.0
        for k in range(colors):
            a, b = rows[k, i].real, rows[k, i].imag
            for j in range(count):
                c, d = columns[k, j].real, columns[k, j].imag
                real[j] += a * c - b * d
                imaginary[j] += a * d + b * c
        for j in range(count):
            table[i * count + j] = np.complex64(complex(real[j], imaginary[j]))


class BandAreas(NamedTuple):
    """The mean of |lambda L| over a band in x and y, mm^2, and the sign of their product.

    Attributes
    ----------
    x, y : float
    side : float
        1 if both areas have the same sign, else -1: then the phase depends on the difference of both terms, the fade on
        their sum.
    """

    x: float
    y: float
    side: float


class FrequencyLimits(NamedTuple):
    """Where the spectrum of a grid ends.

    Attributes
    ----------
    finest : tuple of float
        Squares of the grid's highest frequencies in x and y, 1/mm^2.
    ends : tuple of float
        Parts of these between which the spectrum fades out smoothly; infinite for no fade.
    """

    finest: tuple[float, float]
    ends: tuple[float, float]


class PhaseTables(NamedTuple):
    """A band's phase factors, by steps of f^2 times the area.

    Attributes
    ----------
    turns : ndarray, shape (S,), complex64
        Phase factors (`sum_turns`).
    fades : ndarray, shape (S,), float32
        Amplitude factors; 0 at the last step and beyond.
    to_step : float
        Steps per f^2 times the area.
    """

    turns: NDArray[np.complex64]
    fades: Pixels
    to_step: float


@compiled
def turn_frequencies(spectrum, across, down, areas, limits, tables, turned):
    """Multiply an opening's spectrum by the real and the imaginary part of a band's phase factor.

    Parameters
    ----------
    spectrum : ndarray, shape (Ny, Nx // 2 + 1), complex64
        Half spectrum of a real opening, Nx even.
    across, down : ndarray, shape (C,) and (Ny,)
        Squared frequencies in x and y, 1/mm^2; those in x up to the last that is not 0.
    areas : BandAreas
    limits : FrequencyLimits
    tables : PhaseTables
    turned : ndarray, shape (2, Ny, C), complex64
        Filled.

    Returns
    -------
    float
        Sum of |spectrum * phase factor|^2 over all frequencies, negative ones included.
    """
    area_x, area_y, side = areas
    (first, beyond), finest = limits.ends, limits.finest
    table, fades, to_step = tables
    last = fades.size - 1
    part_x, part_y = 1.0 / finest[0], 1.0 / finest[1]
    light = 0.0
    for i in range(down.size):
        y = area_y * down[i]
        row = 0.0
        for j in range(across.size):
            x = area_x * across[j]
            far = (x + y) * to_step + 0.5
            left = np.float32(0.0)
            if far < last:
                left = fades[np.int64(far)]
            f2 = across[j] * part_x + down[i] * part_y
            if left > 0.0 and f2 > first * first:
                part = min(max((beyond - sqrt(f2)) / (beyond - first), 0.0), 1.0)
                left *= np.float32(part * part * (3.0 - 2.0 * part))
            turn = table[np.int64(min(abs(x + side * y) * to_step + 0.5, last * 1.0))]
            real, imaginary = left * turn.real, left * turn.imag
            if x + side * y < 0.0:
                imaginary = -imaginary
            wave = spectrum[i, j]
            turned[0, i, j], turned[1, i, j] = wave * real, wave * imaginary
            own = (wave.real * wave.real + wave.imag * wave.imag) * (real * real + imaginary * imaginary)
            # columns between the first and the last also count for their mirror images
            row += own if j == 0 or j == spectrum.shape[1] - 1 else np.float32(2.0) * own
        light += row
    return light
