"""Convert linear light to 8-bit display codes in one pass over the pixels."""

import numpy as np

from ..jit.decorators import borrowing, compiled
from .perceived_hue import keep_hue

# filmic view: colours farther from grey than this part of the brightest channel are moved inwards
KNEE = 0.9
# filmic view: light is unchanged up to this value and rolls off towards white beyond it
SHOULDER = 0.5
# filmic view: a colour this many times brighter than white loses half of its saturation
HALF_WHITE = 8.0


@borrowing
def shown_color(red, green, blue, filmic):
    """Map a colour into the range of a display.

    Parameters
    ----------
    red, green, blue : float32
        Linear Rec.709 after exposure, of any size; negative outside the gamut.
    filmic : bool
        Whether bright light rolls off towards white; otherwise only what is brighter than white changes.

    Returns
    -------
    tuple of float32
        In [0, 1].

    Notes
    -----
    The largest distance of a channel from grey, d = (max - min) / max, exceeds 1 where a channel is negative. All three
    distances are scaled by the same factor, so the colour moves along the line to the grey of its largest channel: the
    dominant wavelength and the order of the channels stay. Without `filmic`, d is clipped at 1, which leaves colours in
    gamut unchanged, and a colour brighter than white is white but for the part 1 / max; `filmic` uses the smooth knee
    of the ACES reference gamut compression, k + (1 - k) x / (1 + x^p)^(1/p) with x = (d - k) / (1 - k) and p = 1.2
    (Academy S-2020-001), whose limit is 1. The largest channel rolls off by s + (1 - s) u / (1 + u), u = (v - s) / (1 -
    s), the others in proportion. What is mixed with white keeps its hue as it is seen (`perceived_hue.keep_hue`).
    """
    zero, one = np.float32(0.0), np.float32(1.0)
    red, green, blue = _bounded(red), _bounded(green), _bounded(blue)
    high = max(red, green, blue)
    if not high > zero:
        return zero, zero, zero
    far = (high - min(red, green, blue)) / high
    kept = kept_distance(far) if filmic else one / max(far, one)
    if kept < one:
        red, green, blue = high - (high - red) * kept, high - (high - green) * kept, high - (high - blue) * kept
    if not filmic:
        if high > one:
            # clipping each channel would make a bright blue magenta
            part = one / high
            white = one - part
            return keep_hue(
                red, green, blue, white + red * part * part, white + green * part * part, white + blue * part * part
            )
        return min(max(red, zero), one), min(max(green, zero), one), min(max(blue, zero), one)
    tone, bend = high, np.float32(SHOULDER)
    if high > bend:
        beyond = (high - bend) / (one - bend)
        tone = bend + (one - bend) * beyond / (one + beyond)
    over = max(high - one, zero)
    colored = np.float32(HALF_WHITE) / (np.float32(HALF_WHITE) + over)
    scale = tone / high * colored
    grey = tone * (one - colored)
    if over > zero:
        return keep_hue(red, green, blue, grey + red * scale, grey + green * scale, grey + blue * scale)
    red, green, blue = red * scale, green * scale, blue * scale
    return min(max(red, zero), one), min(max(green, zero), one), min(max(blue, zero), one)


@borrowing
def kept_distance(far):
    """Return the factor by which the knee of `shown_color` scales a distance from grey, (max - min) / max."""
    one, knee = np.float32(1.0), np.float32(KNEE)
    if far <= knee:
        return one
    beyond = min((far - knee) / (one - knee), np.float32(1e6))
    return (knee + (one - knee) * beyond / (one + beyond ** np.float32(1.2)) ** np.float32(1.0 / 1.2)) / far


@compiled
def compress_gamut(pixels):
    """Move colours with negative channels into the gamut, in place, as `shown_color` does in the filmic view.

    Parameters
    ----------
    pixels : ndarray, shape (H, W, 3), float32
        Linear. Afterwards no channel is negative; the largest channel of each pixel is unchanged.
    """
    zero = np.float32(0.0)
    for i in range(pixels.shape[0]):
        for j in range(pixels.shape[1]):
            red, green, blue = pixels[i, j, 0], pixels[i, j, 1], pixels[i, j, 2]
            high = max(red, green, blue)
            if not high > zero:
                pixels[i, j, 0], pixels[i, j, 1], pixels[i, j, 2] = zero, zero, zero
                continue
            kept = kept_distance((high - min(red, green, blue)) / high)
            # colours well inside the gamut stay bit-identical
            if kept < np.float32(1.0):
                pixels[i, j, 0] = max(high - (high - red) * kept, zero)
                pixels[i, j, 1] = max(high - (high - green) * kept, zero)
                pixels[i, j, 2] = max(high - (high - blue) * kept, zero)


@borrowing
def _bounded(light):
    """Return finite light: clamp infinities, replace NaN by 0."""
    limit = np.float32(1e30)
    return min(max(light, -limit), limit) if light == light else np.float32(0.0)


@borrowing
def code_of(light, codes, following):
    """Return the display code of a value in [0, 1]; the tables are those of `encode_sum`."""
    code = codes[np.int64(light * np.float32(codes.shape[0] - 1))]
    return np.uint8(code + (light >= following[code]))


@compiled
def encode(light, gain, filmic, codes, following, out):
    """Expose a picture and convert it to display codes.

    Parameters
    ----------
    light : ndarray, shape (H, W, 3), float32
        Linear Rec.709.
    gain : float32
    filmic, codes, following, out
        As in `encode_sum`.
    """
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            red, green, blue = shown_color(light[i, j, 0] * gain, light[i, j, 1] * gain, light[i, j, 2] * gain, filmic)
            out[i, j, 0] = code_of(red, codes, following)
            out[i, j, 1] = code_of(green, codes, following)
            out[i, j, 2] = code_of(blue, codes, following)


@compiled
def encode_clipped(light, codes, following, out):
    """Convert values to display codes, each clipped to 0 and 1.

    Parameters
    ----------
    light : ndarray, shape (N,), float32
    codes, following
        As in `encode_sum`.
    out : ndarray, shape (N,), uint8
        Filled.
    """
    zero, one = np.float32(0.0), np.float32(1.0)
    for k in range(out.size):
        out[k] = code_of(min(max(_bounded(light[k]), zero), one), codes, following)


@compiled
def encode_sum(ghosts, ghost_gain, rest, rest_gain, corner, filmic, codes, following, out):
    """Add two pictures and convert the sum to display codes.

    Parameters
    ----------
    ghosts : ndarray, shape (H, W, 3), float32
    ghost_gain, rest_gain : ndarray, shape (3,), float32
        Channel gains, exposure included.
    rest : ndarray, shape (H', W', 3), float32
        At least as large as `ghosts` plus the offset `corner`.
    corner : tuple of int
        Row and column of `rest` at the first pixel of `ghosts`.
    filmic : bool
        As in `shown_color`.
    codes : ndarray, shape (N + 1,), uint8
        Code at the lower end of each of N equal cells of [0, 1].
    following : ndarray, shape (256,), float32
        For each code, the least value of the next code; a cell holds at most two codes.
    out : ndarray, shape (H, W, 3), uint8
        Filled.
    """
    top, left = corner
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            red, green, blue = shown_color(
                ghosts[i, j, 0] * ghost_gain[0] + rest[top + i, left + j, 0] * rest_gain[0],
                ghosts[i, j, 1] * ghost_gain[1] + rest[top + i, left + j, 1] * rest_gain[1],
                ghosts[i, j, 2] * ghost_gain[2] + rest[top + i, left + j, 2] * rest_gain[2],
                filmic,
            )
            out[i, j, 0] = code_of(red, codes, following)
            out[i, j, 1] = code_of(green, codes, following)
            out[i, j, 2] = code_of(blue, codes, following)
