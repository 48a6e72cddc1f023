"""Resample diffraction patterns to pixels: the Fourier core by summed-area tables, the wings by closed forms.

Coordinates are in mm from the centre of the pattern, x to the right, y up; the kernels process rows from the top.
`optics/diffraction/fraunhofer.py` computes and documents the tables.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...typing import Floats
from ..jit.decorators import borrowing, compiled, inlined

Picture = NDArray[np.floating]


@inlined
def _spline_weights(t):
    """Return the first of the four knots of a cubic B-spline at the fractional index t, and their weights."""
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
    """Add the flux of a scaled pattern to every pixel, from its summed-area table at the pixel's corners.

    Cubic B-spline interpolation of the table keeps pixels finer than the table's cells smooth and positive. It
    conserves flux, because each corner's value is used with both signs.

    Parameters
    ----------
    table : (K, K) float64
        Flux of the pattern below and left of each knot; row index rises with y, the centre is at (K - 1) / 2.
    knots_per_mm : (M,) float64
        Scale of each wavelength.
    weights : (M, C) float64
        Weight of each wavelength in each channel.
    x_edges, y_edges : (W + 1,), (H + 1,) float64
        Pixel borders from left to right and from top to bottom.
    out : (H, W, C) float64
        Flux, added to.
    """
    last = table.shape[0] - 1
    middle = 0.5 * last
    height, width, channels = out.shape
    strip = np.empty(last + 1)
    above = np.empty(width + 1)
    below = np.empty(width + 1)
    knot = np.empty((width + 1, 4), dtype=np.int64)
    share = np.empty((width + 1, 4))
    for m in range(knots_per_mm.shape[0]):
        scale = knots_per_mm[m]
        for j in range(width + 1):
            k, w0, w1, w2, w3 = _spline_weights(min(max(x_edges[j] * scale + middle, -4.0), last + 4.0))
            share[j, 0], share[j, 1], share[j, 2], share[j, 3] = w0, w1, w2, w3
            for q in range(4):
                knot[j, q] = min(max(k + q, 0), last)
        first, final = knot[0, 0], knot[width, 3]
        # few corners on a fine table: read each corner's sixteen knots instead of the whole row
        sparse = final - first + 1 > 4 * (width + 1)
        for i in range(height + 1):
            k, w0, w1, w2, w3 = _spline_weights(min(max(y_edges[i] * scale + middle, -4.0), last + 4.0))
            k0, k1 = min(max(k, 0), last), min(max(k + 1, 0), last)
            k2, k3 = min(max(k + 2, 0), last), min(max(k + 3, 0), last)
            # Interpolate along y, then every corner of this row along x.
            if sparse:
                for j in range(width + 1):
                    value = 0.0
                    for q in range(4):
                        a = knot[j, q]
                        value += share[j, q] * (
                            w0 * table[k0, a] + w1 * table[k1, a] + w2 * table[k2, a] + w3 * table[k3, a]
                        )
                    below[j] = value
            else:
                for a in range(first, final + 1):
                    strip[a] = w0 * table[k0, a] + w1 * table[k1, a] + w2 * table[k2, a] + w3 * table[k3, a]
                for j in range(width + 1):
                    below[j] = (
                        share[j, 0] * strip[knot[j, 0]]
                        + share[j, 1] * strip[knot[j, 1]]
                        + share[j, 2] * strip[knot[j, 2]]
                        + share[j, 3] * strip[knot[j, 3]]
                    )
            if i > 0:
                for j in range(width):
                    flux = above[j + 1] - above[j] - below[j + 1] + below[j]
                    for c in range(channels):
                        out[i - 1, j, c] += weights[m, c] * flux
            above, below = below, above


@inlined
def _window(r, inner, outer):
    """Return a smooth step: 0 up to the inner radius, 1 from the outer radius."""
    t = min(max((r - inner) / (outer - inner), 0.0), 1.0)
    return t * t * t * (t * (6.0 * t - 15.0) + 10.0)


@inlined
def _turned(cumulative, turns):
    """Return the integral of the angular profile up to an angle in half turns, which may lie outside one period."""
    count = cumulative.shape[0] - 1
    at = (turns - math.floor(turns)) * count
    k = min(int(at), count - 1)
    inside = cumulative[k] + (at - k) * (cumulative[k + 1] - cumulative[k])
    return math.floor(turns) * cumulative[count] + inside


@compiled
def blend_fan_wings(
    x: Floats, y: Floats, pixel: Floats, cumulative: Floats, colour: Floats, inner: float, outer: float, out: Picture
) -> None:
    """Cross-fade from the core to the wings g(phi) colour / r^3; g is averaged over the angle that a pixel subtends.

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
        Radii of the cross-fade from core to wings.
    out : (H, W, C) float
        Irradiance of the core on entry, of core and wings on return.
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
            # The last factor converts the value at the centre to the mean over the pixel, to second order.
            wing = w * g / (r * r * r) * (1.0 + 0.1875 * area / (r * r))
            for c in range(out.shape[2]):
                out[i, j, c] = (1.0 - w) * out[i, j, c] + wing * colour[c]


class SpikeTables(NamedTuple):
    """The profiles of the spikes of an iris of blades, averaged over fringes.

    Attributes
    ----------
    angle : ndarray, shape (B,)
        Direction of each blade's normal; a blade sends light in both directions along it.
    half_fan : float
        Half the angle that a curved blade subtends at its centre of curvature; 0 for a straight blade.
    cumulative, slopes : ndarray, shape (B, V, C)
        Cumulative profile across each spike at v = k * step, and the profile.
    half_total, tail : ndarray, shape (C,)
        Asymptote of the cumulative profile far from the spike: half_total - tail / v.
    step : float
        Step of the tables in v.
    scale : float
        v per mm across the spike.
    """

    angle: Floats
    half_fan: float
    cumulative: Floats
    slopes: Floats
    half_total: Floats
    tail: Floats
    step: float
    scale: float


@compiled
def blend_blade_wings(
    x: Floats, y: Floats, pixel: Floats, spikes: SpikeTables, inner: float, outer: float, out: Picture
) -> None:
    """Cross-fade from the core to the fringe-averaged wings of the blades' edges.

    Parameters
    ----------
    x, y : (W,), (H,) float64
        Pixel centres.
    pixel : (2,) float64
        Width and height of a pixel.
    spikes : SpikeTables
    inner, outer : float
        Radii of the cross-fade from core to wings.
    out : (H, W, C) float
        Irradiance of the core on entry, of core and wings on return.
    """
    width, channels = x.shape[0], out.shape[2]
    half_total, tail = spikes.half_total, spikes.tail
    total = np.empty((channels, width))
    # single precision for the vectorised loop over all pixels; v^2 - half^2 does not cancel outside the table
    x32, far, flat = x.astype(np.float32), np.empty(width, np.float32), np.empty(width, np.float32)
    near = np.empty(width, np.uint8)
    area = pixel[0] * pixel[0] + pixel[1] * pixel[1]
    for i in range(y.shape[0]):
        for j in range(width):
            far[j], flat[j] = np.float32(0.0), np.float32(0.0)
        total[:, :] = 0.0
        for b in range(spikes.angle.shape[0]):
            _add_outside_table(spikes, b, x32, np.float32(y[i]), far, flat, near)
            _add_from_table(spikes, b, x, y[i], near, total)
        for j in range(width):
            r2 = x[j] * x[j] + y[i] * y[i]
            w = 1.0
            if r2 < outer * outer:
                w = _window(math.sqrt(r2), inner, outer)
                if w <= 0.0:
                    continue
            # The mean of 1 / r^2 along a spike over the pixel, to second order.
            share = w / r2 * (1.0 + 0.125 * area / r2)
            for c in range(channels):
                out[i, j, c] = (1.0 - w) * out[i, j, c] + share * (
                    total[c, j] + far[j] * tail[c] + flat[j] * half_total[c]
                )


@inlined
def _least_half(spikes):
    """Return the least half width of a fan in v.

    A straight blade has no fan: the cumulative profile is differenced over a quarter step each way to give its slope.
    """
    return 0.25 * spikes.step


@borrowing
def _add_outside_table(spikes, b, x, y, far, flat, near):
    """Add one blade's light to a row of pixels by closed forms that all channels share: beside the fan, deep inside it.

    Parameters
    ----------
    spikes : SpikeTables
    b : int
    x : ndarray, shape (W,), float32
    y : float32
    far, flat : ndarray, shape (W,), float32
        Added to: factors of `tail` and of `half_total`.
    near : ndarray, shape (W,), uint8
        Filled: 1 where the table is needed.
    """
    zero, one = np.float32(0.0), np.float32(1.0)
    nx, ny = np.float32(math.cos(spikes.angle[b])), np.float32(math.sin(spikes.angle[b]))
    cos_fan, sin_fan = np.float32(math.cos(spikes.half_fan)), np.float32(math.sin(spikes.half_fan))
    scale, fan = np.float32(spikes.scale), np.float32(spikes.half_fan)
    end, least = np.float32((spikes.cumulative.shape[1] - 2) * spikes.step), np.float32(_least_half(spikes))
    for j in range(x.shape[0]):
        r = math.sqrt(x[j] * x[j] + y * y)
        along, across = abs(nx * x[j] + ny * y), abs(nx * y - ny * x[j])
        N, D = across * cos_fan - along * sin_fan, along * cos_fan + across * sin_fan
        wide = r * fan * scale
        wide = wide if wide > least else least
        v = r * scale * (fan * D + N)
        # half_fan - theta is its sine, -N / r, to a few percent of a term that is itself a few per mille
        depth = -N * scale
        beside, inside = v > (end + wide) * D, depth > end
        # within the table `depth` may be 0: divide 0 by 1
        over = v * v - wide * wide * D * D if beside else depth * (depth - wide - wide) if inside else one
        far[j] += (D * D if beside else one if inside else zero) / over
        flat[j] += (one if inside else zero) / wide
        near[j] = 0 if beside or inside else 1


@borrowing
def _add_from_table(spikes, b, x, y, near, total):
    """Add one blade's light where its profile is tabulated, from one side of the fan to the other.

    Parameters
    ----------
    spikes : SpikeTables
    b : int
    x : ndarray, shape (W,)
    y : float
    near : ndarray, shape (W,), uint8
        From `_add_outside_table`.
    total : ndarray, shape (C, W)
        Irradiance times r^2, added to.
    """
    half_fan, scale, step = spikes.half_fan, spikes.scale, spikes.step
    tables, slopes, half_total, tail = spikes.cumulative, spikes.slopes, spikes.half_total, spikes.tail
    nx, ny = math.cos(spikes.angle[b]), math.sin(spikes.angle[b])
    cos_fan, sin_fan = math.cos(half_fan), math.sin(half_fan)
    per_step, least = 1.0 / step, _least_half(spikes)
    for j in range(x.shape[0]):
        if not near[j]:
            continue
        r = math.sqrt(x[j] * x[j] + y * y)
        along, across = abs(nx * x[j] + ny * y), abs(nx * y - ny * x[j])
        N, D = across * cos_fan - along * sin_fan, along * cos_fan + across * sin_fan
        half = max(r * half_fan * scale, least)
        theta = half_fan + N / D if N > 0.0 else math.atan2(across, along)
        v = r * theta * scale
        for side in range(2):
            at = v + half if side == 0 else v - half
            sign = (1.0 if at >= 0.0 else -1.0) * (0.5 - side) / half
            at = abs(at)
            k = int(at * per_step)
            if k >= tables.shape[1] - 1:
                for c in range(total.shape[0]):
                    total[c, j] += sign * (half_total[c] - tail[c] / at)
                continue
            # a Hermite cubic in the table
            f = at * per_step - k
            g = 1.0 - f
            w0, w1 = sign * (1.0 + 2.0 * f) * g * g, sign * (1.0 + 2.0 * g) * f * f
            h0, h1 = sign * step * f * g * g, -sign * step * f * f * g
            for c in range(total.shape[0]):
                total[c, j] += (
                    w0 * tables[b, k, c] + w1 * tables[b, k + 1, c] + h0 * slopes[b, k, c] + h1 * slopes[b, k + 1, c]
                )
