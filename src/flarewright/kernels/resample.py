"""Diffraction patterns onto pixels: the Fourier core by summed areas, the wings by closed forms.

Arrays in, arrays out. Coordinates are in mm from the centre of the pattern, x to the right, y up; the kernels sweep
rows from the top. `optics/diffraction.py` makes the tables and says what they mean.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ._jit import compiled, inlined

Floats = NDArray[np.float64]
Picture = NDArray[np.floating]


@inlined
def _spline_weights(t):
    """Cubic B-spline: index of the first of four knots and their weights at the fractional index t."""
    base = math.floor(t)
    f = t - base
    g = 1.0 - f
    w0 = g * g * g / 6.0
    w3 = f * f * f / 6.0
    w1 = (4.0 - 6.0 * f * f + 3.0 * f * f * f) / 6.0
    return int(base) - 1, w0, w1, 1.0 - w0 - w1 - w3, w3


@compiled
def deposit_core(
    table: Floats, knots_per_mm: Floats, weights: Floats, x_edges: Floats, y_edges: Floats, out: Floats
) -> None:
    """Add the flux of a scaled pattern in every pixel: differences of its summed-area table at the pixel's corners.

    The cubic B-spline through the table keeps pixels finer than its cells smooth and positive, and loses no flux: each
    corner's value is used with both signs.

    Parameters
    ----------
    table : (K, K) float64
        Flux of the pattern below and left of each knot; row index rises with y, the centre is at (K - 1) / 2.
    knots_per_mm : (M,) float64
        Scale of each wavelength.
    weights : (M, C) float64
        What each wavelength adds to each channel.
    x_edges, y_edges : (W + 1,), (H + 1,) float64
        Pixel borders from left to right and from top to bottom.
    out : (H, W, C) float64
        Flux is added.
    """
    last = table.shape[0] - 1
    middle = 0.5 * last
    height, width, channels = out.shape
    strip = np.empty(last + 1)
    above = np.empty(width + 1)
    below = np.empty(width + 1)
    for m in range(knots_per_mm.shape[0]):
        scale = knots_per_mm[m]
        first = min(max(int(math.floor(x_edges[0] * scale + middle)) - 1, 0), last)
        final = min(max(int(math.floor(x_edges[width] * scale + middle)) + 2, 0), last)
        for i in range(height + 1):
            # Interpolate along y once, then every corner of this row along x.
            k, w0, w1, w2, w3 = _spline_weights(min(max(y_edges[i] * scale + middle, -4.0), last + 4.0))
            k0, k1 = min(max(k, 0), last), min(max(k + 1, 0), last)
            k2, k3 = min(max(k + 2, 0), last), min(max(k + 3, 0), last)
            for j in range(first, final + 1):
                strip[j] = w0 * table[k0, j] + w1 * table[k1, j] + w2 * table[k2, j] + w3 * table[k3, j]
            for j in range(width + 1):
                k, w0, w1, w2, w3 = _spline_weights(min(max(x_edges[j] * scale + middle, -4.0), last + 4.0))
                below[j] = (
                    w0 * strip[min(max(k, first), final)]
                    + w1 * strip[min(max(k + 1, first), final)]
                    + w2 * strip[min(max(k + 2, first), final)]
                    + w3 * strip[min(max(k + 3, first), final)]
                )
            if i > 0:
                for j in range(width):
                    flux = above[j + 1] - above[j] - below[j + 1] + below[j]
                    for c in range(channels):
                        out[i - 1, j, c] += weights[m, c] * flux
            above, below = below, above


@inlined
def _window(r, inner, outer):
    """0 up to the inner radius, 1 from the outer one, smooth between."""
    t = min(max((r - inner) / (outer - inner), 0.0), 1.0)
    return t * t * t * (t * (6.0 * t - 15.0) + 10.0)


@inlined
def _turned(cumulative, turns):
    """Integral of the angular profile up to an angle in half turns, which may lie outside one period."""
    count = cumulative.shape[0] - 1
    at = (turns - math.floor(turns)) * count
    k = min(int(at), count - 1)
    inside = cumulative[k] + (at - k) * (cumulative[k + 1] - cumulative[k])
    return math.floor(turns) * cumulative[count] + inside


@compiled
def blend_fan_wings(
    x: Floats,
    y: Floats,
    pixel: Floats,
    cumulative: Floats,
    colour: Floats,
    inner: float,
    outer: float,
    out: Picture,
) -> None:
    """Fade the core out and the wings g(phi) colour / r^3 in; g is averaged over the angle that a pixel subtends.

    Parameters
    ----------
    x, y : (W,), (H,) float64
        Pixel centres.
    pixel : (2,) float64
        Width and height of a pixel.
    cumulative : (A + 1,) float64
        Integral of g d(phi / pi) over one period, pi, from half a bin below 0; g is a histogram.
    colour : (C,) float64
    inner, outer : float
        Radii between which the core gives way to the wings.
    out : (H, W, C) float
        Irradiance of the core on entry, of both on return.
    """
    count = cumulative.shape[0] - 1
    area = pixel[0] * pixel[0] + pixel[1] * pixel[1]
    for i in range(y.shape[0]):
        for j in range(x.shape[0]):
            r = math.sqrt(x[j] * x[j] + y[i] * y[i])
            w = _window(r, inner, outer)
            if w <= 0.0:
                continue
            g = cumulative[count]
            if count > 1:
                a, b = 0.5 * pixel[0] * y[i] / r, 0.5 * pixel[1] * x[j] / r
                spread = min(math.sqrt(a * a + b * b) / (r * math.pi), 0.5)
                turns = math.atan2(y[i], x[j]) / math.pi + 0.5 / count
                g = (_turned(cumulative, turns + spread) - _turned(cumulative, turns - spread)) / (2.0 * spread)
            # The last factor turns the value at the centre into the mean over the pixel, to second order.
            wing = w * g / (r * r * r) * (1.0 + 0.1875 * area / (r * r))
            for c in range(out.shape[2]):
                out[i, j, c] = (1.0 - w) * out[i, j, c] + wing * colour[c]


@inlined
def _cumulative(table, slope, c, v, per_step, half_total, tail):
    """Flux of a spike's profile between 0 and v in channel c: Hermite cubic in the table, closed form beyond it."""
    a = abs(v)
    at = a * per_step
    k = int(at)
    if k >= table.shape[0] - 1:
        value = half_total - tail / a
    else:
        f = at - k
        h = 1.0 / per_step
        value = (
            (1.0 + 2.0 * f) * (1.0 - f) ** 2 * table[k, c]
            + f * f * (3.0 - 2.0 * f) * table[k + 1, c]
            + h * f * (1.0 - f) ** 2 * slope[k, c]
            - h * f * f * (1.0 - f) * slope[k + 1, c]
        )
    return value if v >= 0.0 else -value


@compiled
def blend_blade_wings(
    x: Floats,
    y: Floats,
    pixel: Floats,
    angle: Floats,
    half_fan: float,
    tables: Floats,
    slopes: Floats,
    half_total: Floats,
    tail: Floats,
    step: float,
    scale: float,
    inner: float,
    outer: float,
    out: Picture,
) -> None:
    """Fade the core out and the fringe-averaged waves of the blades' edges in.

    Parameters
    ----------
    x, y : (W,), (H,) float64
        Pixel centres.
    pixel : (2,) float64
        Width and height of a pixel.
    angle : (B,) float64
        Direction of each blade's normal; a blade sends light along it both ways.
    half_fan : float
        Half the angle that a curved blade subtends at its own centre; 0 when straight.
    tables, slopes : (B, V, C) float64
        Cumulative profile across each spike at v = k * step, and the profile itself.
    half_total, tail : (C,) float64
        Far from the spike the cumulative profile is half_total - tail / v.
    step : float
        Step of the tables in v.
    scale : float
        v per mm across the spike.
    inner, outer : float
        Radii between which the core gives way to the wings.
    out : (H, W, C) float
        Irradiance of the core on entry, of both on return.
    """
    blades = angle.shape[0]
    channels = out.shape[2]
    per_step = 1.0 / step
    end = (tables.shape[1] - 2) * step
    cos_fan, sin_fan = math.cos(half_fan), math.sin(half_fan)
    normal = np.empty((blades, 2))
    for b in range(blades):
        normal[b, 0], normal[b, 1] = math.cos(angle[b]), math.sin(angle[b])
    total = np.empty(channels)
    area = pixel[0] * pixel[0] + pixel[1] * pixel[1]
    for i in range(y.shape[0]):
        for j in range(x.shape[0]):
            r = math.sqrt(x[j] * x[j] + y[i] * y[i])
            w = _window(r, inner, outer)
            if w <= 0.0:
                continue
            total[:] = 0.0
            far = 0.0
            # A fan's width in v; for a straight blade a quarter step, which turns the difference into the slope.
            half = max(r * half_fan * scale, 0.25 * step)
            phi = math.atan2(y[i], x[j]) if half_fan > 0.0 else 0.0
            for b in range(blades):
                along = abs(normal[b, 0] * x[j] + normal[b, 1] * y[i])
                across = abs(normal[b, 0] * y[i] - normal[b, 1] * x[j])
                theta = 1.0
                if half_fan > 0.0:
                    turn = (phi - angle[b]) / math.pi
                    theta = math.pi * abs(turn - math.floor(turn + 0.5))
                if half_fan == 0.0:
                    v = r * across / along * scale
                elif theta <= half_fan:
                    v = r * theta * scale
                elif across * sin_fan + along * cos_fan > 0.0:
                    beyond = (across * cos_fan - along * sin_fan) / (along * cos_fan + across * sin_fan)
                    v = r * (half_fan + beyond) * scale
                if v - half > end:
                    far += 1.0 / (v * v - half * half)
                else:
                    for c in range(channels):
                        high = _cumulative(tables[b], slopes[b], c, v + half, per_step, half_total[c], tail[c])
                        low = _cumulative(tables[b], slopes[b], c, v - half, per_step, half_total[c], tail[c])
                        total[c] += (high - low) / (2.0 * half)
            # The mean of 1 / r^2 along a spike over the pixel, to second order.
            share = w / (r * r) * (1.0 + 0.125 * area / (r * r))
            for c in range(channels):
                out[i, j, c] = (1.0 - w) * out[i, j, c] + share * (total[c] + far * tail[c])
