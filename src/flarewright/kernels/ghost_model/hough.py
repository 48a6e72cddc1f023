"""Hough search for ghosts in all constellations: rims whose centre moves along the light's line with the field."""

from math import cos, floor, pi, sin, sqrt

import numpy as np

from ..jit.decorators import compiled, inner
from .pupil_polygon import apothem


@compiled
def rim_outline_points(blades, turn, spots):
    """Fill evenly spaced points of a rim of area pi and the normals there, with y down.

    Parameters
    ----------
    blades : int
        Number of sides; 0 for a circle.
    turn : float
        Direction of a side's normal, radians counterclockwise from the right.
    spots : ndarray, shape (P, 4), float64
        Filled: x, y, and the normal's x and y.
    """
    for k in range(spots.shape[0]):
        at = (k + 0.5) / spots.shape[0]
        away, along, angle = 1.0, 0.0, 2.0 * pi * at
        if blades > 0:
            side = floor(at * blades)
            angle = turn + 2.0 * pi * side / blades
            away = apothem(blades)
            along = (2.0 * (at * blades - side) - 1.0) * away * sin(pi / blades) / cos(pi / blades)
        c, s = cos(angle), sin(angle)
        spots[k, 0], spots[k, 1] = away * c - along * s, -(away * s + along * c)
        spots[k, 2], spots[k, 3] = c, -s


@inner
def _rim_slope(slopes, cx, cy, radius, spots, every, inside):
    """Return the mean inward slope on a rim and the measured part of the rim.

    With `inside` the whole rim lies in the picture and no point is checked.
    """
    height, width = slopes.shape[0], slopes.shape[1]
    total, seen, count = 0.0, 0, 0
    for k in range(0, spots.shape[0], every):
        count += 1
        x, y = int(floor(cx + radius * spots[k, 0])), int(floor(cy + radius * spots[k, 1]))
        if inside or (0 <= x < width and 0 <= y < height):
            value = slopes[y, x, 0] * spots[k, 2] + slopes[y, x, 1] * spots[k, 3]
            if value == value:
                total -= value
                seen += 1
    if seen * 3 < count or seen < 6:
        return 0.0, 0.0
    return total / seen, seen / count


@inner
def _vote(slopes, sigma, frame, speeds, sizes, rims, reaches, floor_level, sign, votes):
    """Fill the vote of one view for every rim, 0 where the rim is not visible; `slopes` has shape (H, W, 2)."""
    height, width = slopes.shape[0], slopes.shape[1]
    for s in range(speeds.size):
        away = sigma * speeds[s] * frame[4]
        cx, cy = frame[0] + frame[2] * away, frame[1] - frame[3] * away
        for r in range(sizes.size):
            radius = sizes[r] * frame[4]
            every = 2 if radius < 8.0 else 1
            for b in range(rims.shape[0]):
                reach = radius * reaches[b]
                votes[s, r, b] = 0.0
                if cx + reach < 0.0 or cy + reach < 0.0 or cx - reach > width or cy - reach > height:
                    continue
                inside = (
                    cx - reach > 1.0 and cy - reach > 1.0 and cx + reach < width - 1.0 and cy + reach < height - 1.0
                )
                slope, part = _rim_slope(slopes, cx, cy, radius, rims[b], every, inside)
                if part > 0.0:
                    votes[s, r, b] = (sign * slope - floor_level) * part


@inner
def _place(rims, turning, frame, placed):
    """Fill the rims as they appear in a view: rotate those that turn with the direction of the light."""
    c, s = (frame[2], frame[3]) if turning else (1.0, 0.0)
    for b in range(rims.shape[0]):
        for k in range(rims.shape[1]):
            for m in range(0, 4, 2):
                along, down = rims[b, k, m], rims[b, k, m + 1]
                placed[b, k, m], placed[b, k, m + 1] = c * along + s * down, c * down - s * along


@compiled
def search(slopes_x, slopes_y, sigmas, frames, speeds, sizes, rims, turning, floor_level, sign, scores, runs):
    """Score rims by the mean inward gradient along their border, summed over the best run of views.

    Parameters
    ----------
    slopes_x, slopes_y : ndarray, shape (V, H, W), float32
        Gradient from `salient_slopes`, of length 1 at most; NaN where nothing was measured.
    sigmas : ndarray, shape (V,)
    frames : ndarray, shape (V, 5)
        Axis x and y, cosine and sine of the light's direction, picture pixels per model pixel.
    speeds : ndarray, shape (S,)
        Place of the centre over the field, model pixels.
    sizes : ndarray, shape (R,)
        Radii, model pixels.
    rims : ndarray, shape (K, P, 4)
        Kinds of rims, each as filled by `rim_outline_points`.
    turning : bool
        Whether the rims turn with the direction of the light; `rims` are then those of a light right of the axis.
    floor_level : float
        Mean slope below which the vote of a view is negative.
    sign : float
        1 for bright discs; -1 for dark discs, as a control: no ghost is dark.
    scores : ndarray, shape (S, R)
        Filled: the best score over the kinds.
    runs : ndarray, shape (S, R, 3), int64
        Filled: first and last view of the best run, and the kind.
    """
    views = sigmas.size
    reaches = np.zeros(rims.shape[0])
    for b in range(rims.shape[0]):
        for k in range(rims.shape[1]):
            reaches[b] = max(reaches[b], sqrt(rims[b, k, 0] ** 2 + rims[b, k, 1] ** 2))
    # view by view: the slopes of one view fit in the cache, those of all views do not
    votes = np.empty((views, speeds.size, sizes.size, rims.shape[0]))
    placed = np.empty(rims.shape)
    slopes = np.empty((slopes_x.shape[1], slopes_x.shape[2], 2), np.float32)
    for v in range(views):
        for y in range(slopes.shape[0]):
            for x in range(slopes.shape[1]):
                slopes[y, x, 0], slopes[y, x, 1] = slopes_x[v, y, x], slopes_y[v, y, x]
        _place(rims, turning, frames[v], placed)
        _vote(slopes, sigmas[v], frames[v], speeds, sizes, placed, reaches, floor_level, sign, votes[v])
    for s in range(speeds.size):
        for r in range(sizes.size):
            scores[s, r] = 0.0
            for b in range(rims.shape[0]):
                run, start = 0.0, 0
                for v in range(views):
                    run += votes[v, s, r, b]
                    if run <= 0.0:
                        run, start = 0.0, v + 1
                    elif run > scores[s, r]:
                        scores[s, r] = run
                        runs[s, r, 0], runs[s, r, 1], runs[s, r, 2] = start, v, b


@inner
def _smooth(picture, along, out):
    """Convolve a picture with the binomial kernel 1 4 6 4 1 along rows (`along`) or columns."""
    height, width = picture.shape
    for r in range(height):
        for c in range(width):
            total = 0.0
            for k in range(-2, 3):
                weight = 6.0 if k == 0 else (4.0 if abs(k) == 1 else 1.0)
                if along:
                    total += weight * picture[r, min(max(c + k, 0), width - 1)]
                else:
                    total += weight * picture[min(max(r + k, 0), height - 1), c]
            out[r, c] = total / 16.0


@compiled
def salient_slopes(picture, variance, salient, slopes_x, slopes_y):
    """Fill the gradient of a smoothed picture, scaled to a length below 1.

    The length is |g| / sqrt(|g|^2 + (salient * noise)^2), with the standard deviation `noise` of the gradient.

    Parameters
    ----------
    picture : ndarray, shape (H, W), float64
    variance : ndarray, shape (H, W), float64
        Variance of the pixels; infinite or NaN where nothing was measured.
    salient : float
        Gradient, in standard deviations of its noise, that gets the length sqrt(1/2).
    slopes_x, slopes_y : ndarray, shape (H, W), float32
        Filled; NaN at the border and where nothing was measured.
    """
    height, width = picture.shape
    once, smooth = np.empty((height, width)), np.empty((height, width))
    _smooth(picture, True, once)
    _smooth(once, False, smooth)
    # variance of half the difference of two neighbours after smoothing, for a pixel variance of 1
    left = (70.0 / 256.0) * 0.5 * (70.0 - 28.0) / 256.0
    for r in range(height):
        for c in range(width):
            noise = variance[r, c] * left
            if not (0 < r < height - 1 and 0 < c < width - 1 and noise < 1e300):
                slopes_x[r, c], slopes_y[r, c] = np.nan, np.nan
                continue
            gx, gy = 0.5 * (smooth[r, c + 1] - smooth[r, c - 1]), 0.5 * (smooth[r + 1, c] - smooth[r - 1, c])
            length = sqrt(gx * gx + gy * gy + salient * salient * noise)
            slopes_x[r, c], slopes_y[r, c] = gx / length, gy / length
