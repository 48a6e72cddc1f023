"""The profile across the spikes of straight blades, summed over wavelengths and averaged over a pixel."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...typing import Floats
from .fraunhofer import BladeWings


@dataclass(frozen=True)
class SpikeProfile:
    """Flux across the spikes, tabulated in v = distance from the spike / (2 N), mm.

    Attributes
    ----------
    cumulative, density : ndarray, shape (D, V, C)
        Flux between 0 and v, and its derivative, at v = k * step, averaged over the pixel's extent.
    half_total, tail : ndarray, shape (C,)
        Beyond the table the cumulative is half_total - tail / v.
    step : float
    """

    cumulative: Floats
    density: Floats
    half_total: Floats
    tail: Floats
    step: float


def spike_profile(
    wings: BladeWings, wavelengths_nm: Floats, weights: Floats, f_number: float, pixel_mm: tuple[float, float]
) -> SpikeProfile:
    """Return the profile across the spikes of straight blades, summed over wavelengths and averaged over a pixel.

    Parameters
    ----------
    wings : BladeWings
    wavelengths_nm : ndarray, shape (M,)
    weights : ndarray, shape (M, C)
        Contribution of each wavelength to each channel.
    f_number : float
    pixel_mm : tuple of float
        Width and height of a pixel.

    Returns
    -------
    SpikeProfile
        For irradiance = profile / r^2, r in mm on the sensor.

    Notes
    -----
    The incoherent sum over the straight edges, each of length l, of the exact polygon transform is
    P = sum l^2 sinc^2(l s_t) / (4 pi^2 A s^2), s_t = s tan(angle from the normal). On the sensor, only the sinc depends
    on the wavelength: E = l^2 / (4 pi^2 A r^2) G(v), G(v) = sum_m w_m sinc^2(l v / lambda_m). So one profile serves the
    whole length of a spike in all colours. sinc^2 is the transform of a triangle and the pixel's projection across the
    spike is a trapezoid, so G and its integral are cosine and sine sums of a smooth compact spectrum. A curved blade's
    fan is the same profile averaged over the fan's width, which the kernel computes from the integral.
    """
    area = math.pi
    lam = wavelengths_nm * 1e-6
    length = wings.length
    per_edge = wings.multiplicity * length**2 / (4.0 * math.pi**2 * area)
    W = weights * per_edge
    narrow, wide = lam.min() / length, lam.max() / length
    sides = np.array(pixel_mm) / (2.0 * f_number)
    span = float(sides.sum()) / 2.0
    end = 24.0 * wide + 12.0 * span
    step = max(narrow / 6.0, span / 48.0)
    v = np.asarray(np.arange(math.ceil(end / step) + 2) * step, dtype=np.float64)
    # an FFT needs step * dq = 1 / a power of two, and repeats its sums with the period 1 / dq. The mean of what other
    # periods add is known; fringes on it, which pixels wider than a fringe do not show, need a longer period
    period = 2 ** math.ceil(math.log2((4 if span > 4.0 * wide else 16) * len(v)))
    dq = 1.0 / (period * step)
    q = np.arange(math.ceil(1.0 / narrow / dq) + 1) * dq
    F = _triangles(q, lam / length, W) * (2.0 * dq)
    F[0] *= 0.5
    tail = (lam**2 @ W) / (2.0 * math.pi**2 * length**2)
    half_total = 0.5 * (lam / length) @ W
    fade = np.clip(2.0 * v / v[-1] - 1.0, 0.0, 1.0)[:, None]
    far = np.maximum(v, step)[:, None]
    sums = _transform(v, q, F, [(sides[0] * math.sin(a), sides[1] * math.cos(a)) for a in wings.angle], period)
    repeated = zip(sums, _repeated_tail(v, period * step), strict=True)
    cumulative, density = (table - tail * others[:, None] for table, others in repeated)
    return SpikeProfile(
        (1.0 - fade) * cumulative + fade * (half_total - tail / far),
        (1.0 - fade) * density + fade * tail / far**2,
        half_total,
        tail,
        step,
    )


def _triangles(q: Floats, widths: Floats, weights: Floats) -> Floats:
    """Return the sums of max(1 - q t, 0) t w over widths t (M,) and weights w (M, C) at rising q (Q,): (Q, C)."""
    order = np.argsort(widths)
    t, w = widths[order, None], weights[order]
    none = np.zeros((1, weights.shape[1]))
    first, second = (np.concatenate([none, np.cumsum(t**power * w, axis=0)]) for power in (1, 2))
    with np.errstate(divide="ignore"):
        lit = np.searchsorted(t[:, 0], 1.0 / q)
    summed: Floats = first[lit] - q[:, None] * second[lit]
    return summed


def _repeated_tail(v: Floats, period: float) -> tuple[Floats, Floats]:
    """Return what tails 1 / (v - k period)^2 of all k but 0 add up to at v, integrated from 0 on, and itself.

    The sum over all k is (pi / period)^2 / sin^2(pi v / period).
    """
    x = math.pi / period * v
    near = x < 0.05
    safe = np.where(near, 1.0, x)
    total = np.where(near, x / 3.0 + x**3 / 45.0, 1.0 / safe - 1.0 / np.tan(safe))
    itself = np.where(near, 1.0 / 3.0 + x**2 / 15.0, np.sin(safe) ** -2 - safe**-2)
    return math.pi / period * total, (math.pi / period) ** 2 * itself


def _transform(
    v: Floats, q: Floats, spectrum: Floats, boxes: list[tuple[float, float]], period: int
) -> tuple[Floats, Floats]:
    """Sum a spectrum (Q, C) times sin(2 pi q v) / (2 pi q), and times cos(2 pi q v), averaged over D pairs of boxes.

    The tables have the shape (D, V, C). Both grids are even and start at 0, and the product of their steps is
    1 / period, so the sums are FFTs. Terms a whole period apart have the same phases.
    """
    folds = -(-len(q) // period)
    over = np.zeros(len(q))
    over[1:] = 0.5 / (math.pi * q[1:])
    channels = spectrum.shape[1]
    # a row for each transform; what follows the spectrum stays 0
    both = np.zeros((2 * channels, folds * period))
    divided, seen = both[:channels, : len(q)], both[channels:, : len(q)]
    integrals = np.empty((len(boxes), len(v), channels))
    values = np.empty_like(integrals)
    for n, (one, other) in enumerate(boxes):
        seen[:] = np.sinc(one * q) * np.sinc(other * q) * spectrum.T
        divided[:] = seen * over
        summed = np.fft.rfft(both.reshape(len(both), folds, period).sum(axis=1), axis=1)[:, : len(v)]
        # sin(2 pi q v) / (2 pi q) tends to v at q = 0
        integrals[n] = v[:, None] * seen[:, 0] - summed[:channels].imag.T
        values[n] = summed[channels:].real.T
    return integrals, values
