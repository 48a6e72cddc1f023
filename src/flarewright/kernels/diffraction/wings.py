"""Wings of many equal starbursts in one picture: sharp along the spikes and around the centres, coarse elsewhere.

A partition of unity divides each starburst: near its centre and along its spikes it is evaluated pixel by pixel; the
rest is smooth and needs only coarse samples. Patterns without a closed form are drawn once and translated.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...typing import Floats, Indices, Pixels
from ..jit.decorators import compiled, inlined, inner

# columns of `look`: parameters that all starbursts of a set share
PIXEL_X, PIXEL_Y = 0, 1  # mm
SCALE = 2  # v per mm across a spike
STEP = 3  # of the profile in v
SPIKE_IN, SPIKE_OUT = 4, 5  # range of distances from a spike's axis over which the coarse part fades in, mm
DISC_IN, DISC_OUT = 6, 7  # the same for the distance from the centre, mm
LOOK = 8


@inlined
def _rise(t):
    """Return a smooth step: 0 below 0, 1 above 1."""
    t = min(max(t, 0.0), 1.0)
    return t * t * t * (t * (6.0 * t - 15.0) + 10.0)


@inlined
def _round(look, x, y):
    """Return the sharp part of a round opening's light at a place, and the factor of its colour."""
    r = math.sqrt(x * x + y * y)
    part = _rise((r - look[DISC_IN]) / (look[DISC_OUT] - look[DISC_IN]))
    area = look[PIXEL_X] * look[PIXEL_X] + look[PIXEL_Y] * look[PIXEL_Y]
    return 1.0 - part, (1.0 + 0.1875 * area / (r * r)) / (r * r * r)


@inlined
def _far(scale, nx, ny, dx, dy):
    """Return r^2, the distance from a straight blade's spike, and 1 / v^2, the factor of `tail` / r^2.

    The same function as in `kernels.diffraction.resample.blend_blade_wings`, without fans: with v = r tan(angle from
    the spike) times the scale, irradiance times r^2 is the profile at v, and tail / v^2 beyond the profile.
    """
    along, across = nx * dx + ny * dy, nx * dy - ny * dx
    r2 = dx * dx + dy * dy
    crossed = r2 * across * across * scale * scale
    return r2, abs(across), along * along / max(crossed, 1e-300)


@inner
def _add_near(profile, b, step, far, share, gains, m, out, i, j):
    """Add the light of a place within a spike's profile, where v = 1 / sqrt(far)."""
    at = 1.0 / (math.sqrt(far) * step)
    k = int(at)
    upper = share * (at - k)
    lower = share - upper
    for c in range(3):
        out[i, j, c] += gains[m, c] * (lower * profile[b, k, c] + upper * profile[b, k + 1, c])


class StarSet(NamedTuple):
    """Many starbursts that differ in place and colour.

    Attributes
    ----------
    look : ndarray, shape (LOOK,)
        Parameters, by the columns above.
    normals : ndarray, shape (B, 2)
        Normals of straight blades; none for a round opening.
    profile : ndarray, shape (B, V, 3)
        Irradiance times r^2 across each spike at v = k * step.
    tail : ndarray, shape (3,)
        Irradiance times r^2 beyond the profile is tail / v^2.
    fan : ndarray, shape (3,)
        Irradiance times r^3 of a round opening.
    centres : ndarray, shape (L, 2)
        x to the right and y up, mm.
    gains : ndarray, shape (L, 3)
        Factors of each starburst's channels.
    """

    look: Floats
    normals: Floats
    profile: Floats
    tail: Floats
    fan: Floats
    centres: Floats
    gains: Floats


@compiled
def add_coarse_wings(stars: StarSet, x: Floats, y: Floats, out: Floats) -> None:
    """Add the smooth part of many starbursts, at coarse samples.

    Parameters
    ----------
    stars : StarSet
    x, y : (W,), (H,) float64
        Samples, mm.
    out : (H, W, 3) float64
        Irradiance, added to.
    """
    look, normals, profile, tail, fan, centres, gains = stars
    scale, step, area = look[SCALE], look[STEP], look[PIXEL_X] * look[PIXEL_X] + look[PIXEL_Y] * look[PIXEL_Y]
    spike_in, by_spike = look[SPIKE_IN], 1.0 / (look[SPIKE_OUT] - look[SPIKE_IN])
    disc_in, by_disc = look[DISC_IN], 1.0 / (look[DISC_OUT] - look[DISC_IN])
    # places with a smaller 1 / v^2 lie beyond the profile
    least = 1.0 / (max(profile.shape[1] - 2, 1) * step) ** 2 if normals.shape[0] > 0 else 0.0
    sums, disc, near = np.empty(x.size), np.empty(x.size), np.empty(x.size)
    for i in range(y.size):
        for m in range(centres.shape[0]):
            at_x, dy = centres[m, 0], y[i] - centres[m, 1]
            for j in range(x.size):
                dx = x[j] - at_x
                sums[j] = 0.0
                disc[j] = _rise((math.sqrt(dx * dx + dy * dy) - disc_in) * by_disc)
            for b in range(normals.shape[0]):
                nx, ny = normals[b, 0], normals[b, 1]
                found = 0.0
                for j in range(x.size):
                    _, across, far = _far(scale, nx, ny, x[j] - at_x, dy)
                    part = _rise((across - spike_in) * by_spike) * disc[j]
                    near[j] = part if far > least else 0.0
                    found += near[j]
                    sums[j] += 0.0 if far > least else part * far
                if found == 0.0:
                    continue
                for j in range(x.size):
                    if near[j] > 0.0:
                        r2, _, far = _far(scale, nx, ny, x[j] - at_x, dy)
                        share = near[j] * (1.0 + 0.125 * area / r2) / r2
                        _add_near(profile, b, step, far, share, gains, m, out, i, j)
            for j in range(x.size):
                dx = x[j] - at_x
                inverse = 1.0 / max(dx * dx + dy * dy, 1e-300)
                if normals.shape[0] == 0:
                    share = disc[j] * (1.0 + 0.1875 * area * inverse) * inverse * math.sqrt(inverse)
                    for c in range(3):
                        out[i, j, c] += share * gains[m, c] * fan[c]
                else:
                    share = sums[j] * (1.0 + 0.125 * area * inverse) * inverse
                    for c in range(3):
                        out[i, j, c] += share * gains[m, c] * tail[c]


@inner
def _pixels(low, high, start, width, count):
    """Return the pixels that touch an interval in mm: first and one past the last."""
    first, last = math.floor((low - start) / width), math.ceil((high - start) / width) + 1.0
    return int(min(max(first, 0.0), count)), int(min(max(last, 0.0), count))


@inner
def _in_disc(look, y, start, count):
    """Return the pixels of a row within DISC_OUT of the centre: first and one past the last."""
    if abs(y) >= look[DISC_OUT]:
        return 0, 0
    reach = math.sqrt(look[DISC_OUT] * look[DISC_OUT] - y * y)
    return _pixels(-reach, reach, start, look[PIXEL_X], count)


@inner
def _on_spike(look, nx, ny, y, start, count):
    """Return the pixels of a row with |nx y - ny x| < SPIKE_OUT from a spike: first and one past the last."""
    if abs(ny) < 1e-9:
        return (0, count) if abs(y) < look[SPIKE_OUT] else (0, 0)
    middle, reach = nx * y / ny, look[SPIKE_OUT] / abs(ny)
    return _pixels(middle - reach, middle + reach, start, look[PIXEL_X], count)


@compiled
def add_sharp_wings(stars: StarSet, windows: Indices, x: Floats, y: Floats, first_row: int, out: Pixels) -> None:
    """Add the sharp part of the starbursts, which `add_coarse_wings` leaves out, pixel by pixel.

    Parameters
    ----------
    stars : StarSet
    windows : (L, 4) int64
        Columns and rows (first, one past the last) around each centre that are left out: the caller fills them.
    x, y : (W,), (H,) float64
        Pixel centres, mm.
    first_row : int
        Row of the picture of the first row of `y` and `out`.
    out : (H, W, 3) float32
        Irradiance, added to.
    """
    look, normals, profile, tail, fan, centres, gains = stars
    count, step, scale = x.size, look[STEP], look[SCALE]
    area = look[PIXEL_X] * look[PIXEL_X] + look[PIXEL_Y] * look[PIXEL_Y]
    spike_in, by_spike = look[SPIKE_IN], 1.0 / (look[SPIKE_OUT] - look[SPIKE_IN])
    disc_in, by_disc, disc_out = look[DISC_IN], 1.0 / (look[DISC_OUT] - look[DISC_IN]), look[DISC_OUT]
    least = 1.0 / (max(profile.shape[1] - 2, 1) * step) ** 2 if normals.shape[0] > 0 else 0.0
    for i in range(y.size):
        for m in range(centres.shape[0]):
            inside = windows[m, 2] <= i + first_row < windows[m, 3]
            # the part of this row that is left out
            hole, shut = (windows[m, 0], windows[m, 1]) if inside else (np.int64(0), np.int64(0))
            at_x, dy = centres[m, 0], y[i] - centres[m, 1]
            start = x[0] - at_x - 0.5 * look[PIXEL_X]
            left, right = _in_disc(look, dy, start, count)
            if normals.shape[0] == 0:
                for j in range(left, right):
                    if not hole <= j < shut:
                        sharp, share = _round(look, x[j] - at_x, dy)
                        for c in range(3):
                            out[i, j, c] += sharp * share * gains[m, c] * fan[c]
            for b in range(normals.shape[0]):
                nx, ny = normals[b, 0], normals[b, 1]
                low, high = _on_spike(look, nx, ny, dy, start, count)
                for j in range(min(low, left) if right > left else low, max(high, right)):
                    if not (low <= j < high or left <= j < right) or hole <= j < shut:
                        continue
                    r2, across, far = _far(scale, nx, ny, x[j] - at_x, dy)
                    sharp = 1.0
                    if across > spike_in:
                        sharp = 1.0 - _rise((across - spike_in) * by_spike) * (
                            _rise((math.sqrt(r2) - disc_in) * by_disc) if r2 < disc_out * disc_out else 1.0
                        )
                    if sharp <= 0.0:
                        continue
                    share = sharp * (1.0 + 0.125 * area / r2) / r2
                    if far > least:
                        _add_near(profile, b, step, far, share, gains, m, out, i, j)
                    else:
                        share *= far
                        for c in range(3):
                            out[i, j, c] += share * gains[m, c] * tail[c]


@compiled
def add_moved(
    samples: Pixels, first: int, left: int, rows: int, centres: Floats, gains: Floats,
    windows: Indices, first_row: int, out: Pixels,
) -> None:  # fmt: skip
    """Add a drawn starburst, or some rows of it, at many places with bilinear interpolation.

    Parameters
    ----------
    samples : (N, N, 3, S, T) float32
        Irradiance sampled at all N x N subpixel phases, 1 / N of a pixel apart; within a phase at whole pixels.
    first, left : int
        Offset in pixels from the centre to the first row and column of phase 0.
    rows : int
        Number of rows of `samples` at which rows of the picture may start.
    centres : (L, 2) float64
        Columns and rows of the picture; `samples` must cover all columns of the picture for each centre.
    gains : (L, 3) float64
        Factors of each starburst's channels.
    windows : (L, 4) int64
        As in `add_sharp_wings`.
    first_row : int
        Row of the picture of the first row of `out`.
    out : (H, W, 3) float32
        Added to.
    """
    height, width, parts = out.shape[0], out.shape[1], samples.shape[0]
    total = np.empty((3, width), np.float32)
    for i in range(height):
        row, lit = i + first_row, False
        for m in range(centres.shape[0]):
            r, y, lower = _phase(row + 0.5 - centres[m, 1] - first, parts)
            if r < 0 or r >= rows or r + 1 >= samples.shape[3]:
                continue
            if not lit:
                total[:, :] = np.float32(0.0)
                lit = True
            c, x, right = _phase(0.5 - centres[m, 0] - left, parts)
            # row and column of the next phase, which may be phase 0 of the next pixel
            q, d, below, beside = r, c, y + 1, x + 1
            if below == parts:
                q, below = r + 1, np.int64(0)
            if beside == parts:
                d, beside = c + 1, np.int64(0)
            inside = windows[m, 2] <= row < windows[m, 3]
            hole = min(max(windows[m, 0], 0), width) if inside else np.int64(width)
            shut = min(max(windows[m, 1], 0), width) if inside else np.int64(width)
            for k in range(3):
                gain = gains[m, k]
                w0, w1 = np.float32(gain * (1.0 - lower) * (1.0 - right)), np.float32(gain * (1.0 - lower) * right)
                w2, w3 = np.float32(gain * lower * (1.0 - right)), np.float32(gain * lower * right)
                one, two = samples[y, x, k, r, c : c + width], samples[y, beside, k, r, d : d + width]
                three, four = samples[below, x, k, q, c : c + width], samples[below, beside, k, q, d : d + width]
                sums = total[k]
                for j in range(hole):
                    sums[j] += w0 * one[j] + w1 * two[j] + w2 * three[j] + w3 * four[j]
                for j in range(shut, width):
                    sums[j] += w0 * one[j] + w1 * two[j] + w2 * three[j] + w3 * four[j]
        if lit:
            for j in range(width):
                for k in range(3):
                    out[i, j, k] += total[k, j]


@inner
def _phase(at, parts):
    """Split a position into whole pixels, phase, and fraction of a phase."""
    whole = math.floor(at)
    fine = (at - whole) * parts
    part = min(math.floor(fine), parts - 1.0)
    return int(whole), int(part), fine - part
