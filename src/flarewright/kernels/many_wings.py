"""Wings of many equal starbursts on one picture: sharp along the spikes and around the centres, coarse elsewhere.

A partition of unity divides each starburst: near its centre and along its spikes it is evaluated pixel by pixel, away
from both it is so smooth that few samples tell it. Where no closed form tells what is smooth, a drawn one is moved.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ._jit import compiled, inlined, inner

Floats = NDArray[np.float64]

# columns of a look: what a set of starbursts shares
PIXEL_X, PIXEL_Y = 0, 1  # mm
SCALE = 2  # v per mm across a spike
STEP = 3  # of the profile in v
SPIKE_IN, SPIKE_OUT = 4, 5  # mm from a spike's middle between which coarse samples take over
DISC_IN, DISC_OUT = 6, 7  # and mm from the centre
LOOK = 8


@inlined
def _rise(t):
    """0 below 0, 1 above 1, smooth between."""
    t = min(max(t, 0.0), 1.0)
    return t * t * t * (t * (6.0 * t - 15.0) + 10.0)


@inlined
def _round(look, x, y):
    """Return which part of a round border's light at a place is sharp, and what its colour is multiplied by."""
    r = math.sqrt(x * x + y * y)
    part = _rise((r - look[DISC_IN]) / (look[DISC_OUT] - look[DISC_IN]))
    area = look[PIXEL_X] * look[PIXEL_X] + look[PIXEL_Y] * look[PIXEL_Y]
    return 1.0 - part, (1.0 + 0.1875 * area / (r * r)) / (r * r * r)


@inlined
def _far(scale, nx, ny, dx, dy):
    """Place a point beside a straight blade's spike: r^2, distance across, and what `tail` / r^2 is multiplied by.

    The same function as in `kernels.resample.blend_blade_wings`, without fans: with v = r tan(angle from the spike)
    times the scale, irradiance times r^2 is the profile at v, and tail / v^2 beyond it.
    """
    along, across = nx * dx + ny * dy, nx * dy - ny * dx
    r2 = dx * dx + dy * dy
    crossed = r2 * across * across * scale * scale
    return r2, abs(across), along * along / max(crossed, 1e-300)


@inner
def _add_near(profile, b, step, far, share, gains, m, out, i, j):
    """Add the light of a place that lies on a spike's profile, where v = 1 / sqrt(far)."""
    at = 1.0 / (math.sqrt(far) * step)
    k = int(at)
    upper = share * (at - k)
    lower = share - upper
    for c in range(3):
        out[i, j, c] += gains[m, c] * (lower * profile[b, k, c] + upper * profile[b, k + 1, c])


@compiled
def add_coarse_wings(
    look: Floats, normals: Floats, profile: Floats, tail: Floats, fan: Floats, centres: Floats, gains: Floats,
    x: Floats, y: Floats, out: Floats,
) -> None:  # fmt: skip
    """Add what is smooth of many starbursts, at coarse samples.

    Parameters
    ----------
    look : (LOOK,) float64
        The columns above.
    normals : (B, 2) float64
        Of straight blades; none for a round opening.
    profile : (B, V, 3) float64
        Irradiance times r^2 across each spike at v = k * step.
    tail : (3,) float64
        Beyond the profile it is tail / v^2.
    fan : (3,) float64
        Irradiance times r^3 of a round opening.
    centres : (L, 2) float64
        x to the right and y up, mm.
    gains : (L, 3) float64
        Multiply each starburst's channels.
    x, y : (W,), (H,) float64
        Samples, mm.
    out : (H, W, 3) float64
        Irradiance, added to.
    """
    scale, step, area = look[SCALE], look[STEP], look[PIXEL_X] * look[PIXEL_X] + look[PIXEL_Y] * look[PIXEL_Y]
    spike_in, by_spike = look[SPIKE_IN], 1.0 / (look[SPIKE_OUT] - look[SPIKE_IN])
    disc_in, by_disc = look[DISC_IN], 1.0 / (look[DISC_OUT] - look[DISC_IN])
    # beyond the profile
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
    """Turn an interval in mm into the pixels that touch it: first and one past the last."""
    first, last = math.floor((low - start) / width), math.ceil((high - start) / width) + 1.0
    return int(min(max(first, 0.0), count)), int(min(max(last, 0.0), count))


@inner
def _in_disc(look, y, start, count):
    """Pixels of a row within DISC_OUT of the centre."""
    if abs(y) >= look[DISC_OUT]:
        return 0, 0
    reach = math.sqrt(look[DISC_OUT] * look[DISC_OUT] - y * y)
    return _pixels(-reach, reach, start, look[PIXEL_X], count)


@inner
def _on_spike(look, nx, ny, y, start, count):
    """Pixels of a row within SPIKE_OUT of a spike: |nx y - ny x| < SPIKE_OUT."""
    if abs(ny) < 1e-9:
        return (0, count) if abs(y) < look[SPIKE_OUT] else (0, 0)
    middle, reach = nx * y / ny, look[SPIKE_OUT] / abs(ny)
    return _pixels(middle - reach, middle + reach, start, look[PIXEL_X], count)


@compiled
def add_sharp_wings(
    look: Floats, normals: Floats, profile: Floats, tail: Floats, fan: Floats, centres: Floats, gains: Floats,
    windows: NDArray[np.int64], x: Floats, y: Floats, first_row: int, out: NDArray[np.float32],
) -> None:  # fmt: skip
    """Add the rest of what `add_coarse_wings` adds, pixel by pixel.

    Parameters
    ----------
    look ... gains
        As in `add_coarse_wings`.
    windows : (L, 4) int64
        Columns and rows (first, one past the last) that another fills around each centre.
    x, y : (W,), (H,) float64
        Pixel centres, mm.
    first_row : int
        Row of the picture at which `y` and `out` begin.
    out : (H, W, 3) float32
        Irradiance, added to.
    """
    count, step, scale = x.size, look[STEP], look[SCALE]
    area = look[PIXEL_X] * look[PIXEL_X] + look[PIXEL_Y] * look[PIXEL_Y]
    spike_in, by_spike = look[SPIKE_IN], 1.0 / (look[SPIKE_OUT] - look[SPIKE_IN])
    disc_in, by_disc, disc_out = look[DISC_IN], 1.0 / (look[DISC_OUT] - look[DISC_IN]), look[DISC_OUT]
    least = 1.0 / (max(profile.shape[1] - 2, 1) * step) ** 2 if normals.shape[0] > 0 else 0.0
    for i in range(y.size):
        for m in range(centres.shape[0]):
            inside = windows[m, 2] <= i + first_row < windows[m, 3]
            # what another fills, as a span of this row
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
    sheets: NDArray[np.float32], first: int, left: int, rows: int, centres: Floats, gains: Floats,
    windows: NDArray[np.int64], first_row: int, out: NDArray[np.float32],
) -> None:  # fmt: skip
    """Add a drawn starburst, or some rows of it, at many places, interpolated linearly.

    Parameters
    ----------
    sheets : (N, N, 3, S, T) float32
        Irradiance at places 1 / N of a pixel apart from each other, down and across, in each of them pixels apart.
    first, left : int
        Pixels from the centre to the middle of the first sheet's first row and column.
    rows : int
        They stand for those rows of the picture that begin in one of so many of their rows.
    centres : (L, 2) float64
        Columns and rows of the picture; the sheets hold all that each light sees.
    gains : (L, 3) float64
        Multiply each starburst's channels.
    windows : (L, 4) int64
        As in `add_sharp_wings`.
    first_row : int
        Row of the picture at which `out` begins.
    out : (H, W, 3) float32
        Added to.
    """
    height, width, parts = out.shape[0], out.shape[1], sheets.shape[0]
    total = np.empty((3, width), np.float32)
    for i in range(height):
        row, lit = i + first_row, False
        for m in range(centres.shape[0]):
            r, y, lower = _phase(row + 0.5 - centres[m, 1] - first, parts)
            if r < 0 or r >= rows or r + 1 >= sheets.shape[3]:
                continue
            if not lit:
                total[:, :] = np.float32(0.0)
                lit = True
            c, x, right = _phase(0.5 - centres[m, 0] - left, parts)
            # of the next phase, which may be the first one of the next pixel
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
                one, two = sheets[y, x, k, r, c : c + width], sheets[y, beside, k, r, d : d + width]
                three, four = sheets[below, x, k, q, c : c + width], sheets[below, beside, k, q, d : d + width]
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
    """Divide a place into whole pixels, whole parts of one, and the rest of a part."""
    whole = math.floor(at)
    fine = (at - whole) * parts
    part = min(math.floor(fine), parts - 1.0)
    return int(whole), int(part), fine - part
