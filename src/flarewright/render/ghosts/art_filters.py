"""Colour ramps and blurs of art direction, applied to the plane of a separately drawn ghost."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...typing import Floats
from ..image.canvas import DETAILS, Plane, lit_window
from ..scene.art_rules import REACH, Frame, PathArt, Ramp

SMOOTH_PX = 8.0


def filtered_ghost(pixels: Plane, art: PathArt, frame: Frame | None, placed: Floats, to_pixels: Floats) -> Plane:
    """Apply ramp and blur to a separately drawn ghost, and remove the margin.

    Parameters
    ----------
    pixels : ndarray, shape (H + 2 my, W + 2 mx, 3)
        The ghost with the margin of `PathArt.margin` around the picture.
    art : PathArt
    frame : Frame or None
        The ghost's centre and radius; needed for ramps.
    placed : ndarray, shape (4,)
        `PathArt.place` of the picture without margin.
    to_pixels : ndarray, shape (4,)
        The picture's own.

    Returns
    -------
    ndarray, shape (H, W, 3)
        Flux per pixel.
    """
    mx, my = art.margin(to_pixels)
    x0, y0, x1, y1 = lit_window(pixels)
    if x1 > x0:
        light = np.moveaxis(pixels[y0:y1, x0:x1], 2, 0).astype(np.float64)
        if frame is not None and art.ramps:
            column, row = placed[0] + placed[2] * frame.centre[0] + mx, placed[1] - placed[3] * frame.centre[1] + my
            across, down = (max(frame.radius * float(scale), 1e-6) for scale in placed[2:])
            columns, rows = (np.arange(x0, x1) + 0.5 - column) / across, (np.arange(y0, y1) + 0.5 - row) / down
            light *= ramp_factors(art.ramps, np.hypot(rows[:, None], columns[None, :]))
        if art.blur > 0.0:
            light, (x0, y0) = _blurred(light, (x0, y0), art.blur * to_pixels[2:4], (pixels.shape[1], pixels.shape[0]))
        pixels = np.zeros_like(pixels)
        pixels[y0 : y0 + light.shape[1], x0 : x0 + light.shape[2]] = np.moveaxis(light, 0, 2)
    return pixels[my : pixels.shape[0] - my, mx : pixels.shape[1] - mx]


def coarseness(art: PathArt, to_pixels: Floats) -> int:
    """Return how often the plane of a blurred ghost can be halved without a visible difference.

    Parameters
    ----------
    art : PathArt
    to_pixels : ndarray, shape (4,)
        Of the full picture.

    Returns
    -------
    int
        The blur's standard deviation stays above `SMOOTH_PX` coarse pixels; interpolating a Gaussian that wide linearly
        errs by less than 0.2 % of its peak.
    """
    halvings = np.log2(max(art.blur * float(to_pixels[2:4].min()), 1e-9) / SMOOTH_PX)
    return int(np.clip(np.floor(halvings), 0, DETAILS - 1))


def ramp_factors(ramps: Sequence[Ramp], distance: Floats) -> Floats:
    """Return the factors of red, green and blue at distances from a ghost's centre.

    Parameters
    ----------
    ramps : sequence of Ramp
        Each (position, red, green, blue), rising; all are multiplied.
    distance : ndarray, shape (H, W)
        In radii of the ghost: 1 at the edge of a uniform disc.

    Returns
    -------
    ndarray, shape (3, H, W)
    """
    factors = np.ones((3, *distance.shape))
    for ramp in ramps:
        positions, *colours = np.transpose(ramp)
        for channel, values in enumerate(colours):
            factors[channel] *= np.interp(distance, positions, values)
    return factors


def gaussian(sigma_px: float) -> Floats:
    """Return the weights of a Gaussian over pixels, shape (2 n + 1,), sum 1.

    Parameters
    ----------
    sigma_px : float
        Standard deviation.

    Returns
    -------
    ndarray
        Truncated at four standard deviations plus three pixels.

    Notes
    -----
    The discrete analogue of the Gaussian, exp(-t) I_k(t) with t = sigma^2 (T. Lindeberg, "Scale-Space for Discrete
    Signals", IEEE PAMI 12, 234, 1990), from its transfer function exp(t (cos w - 1)). Unlike a sampled Gaussian it has
    the exact variance t for narrow blurs too, and the variances of two successive blurs add up.
    """
    n = int(np.ceil(REACH * sigma_px)) + 3
    length = 4 * (2 * n + 1)
    transfer = np.exp(sigma_px**2 * (np.cos(2.0 * np.pi * np.arange(length // 2 + 1) / length) - 1.0))
    weights = np.roll(np.fft.irfft(transfer, length), n)[: 2 * n + 1]
    return np.asarray(weights / weights.sum())


def _blurred(
    light: Floats, corner: tuple[int, int], sigma_px: Floats, size: tuple[int, int]
) -> tuple[Floats, tuple[int, int]]:
    """Blur along both axes; return the part within the plane and its corner."""
    x0, y0 = corner
    for axis, sigma in ((2, float(sigma_px[0])), (1, float(sigma_px[1]))):
        weights = gaussian(sigma)
        light = _convolved(light, weights, axis)
        if axis == 2:
            x0 -= len(weights) // 2
        else:
            y0 -= len(weights) // 2
    left, top = max(0, -x0), max(0, -y0)
    light = light[:, top : size[1] - y0, left : size[0] - x0]
    return light, (x0 + left, y0 + top)


def _convolved(light: Floats, weights: Floats, axis: int) -> Floats:
    """Convolve along an axis by FFT; the result is longer by the number of weights minus one."""
    length = light.shape[axis] + len(weights) - 1
    shape = [1, 1, 1]
    shape[axis] = -1
    spectrum = np.fft.rfft(light, length, axis=axis)
    spectrum *= np.fft.rfft(weights, length).reshape(shape)
    out = np.fft.irfft(spectrum, length, axis=axis)
    # remove rounding errors of the transform
    out[np.abs(out) < 1e-14 * np.abs(light).max()] = 0.0
    return np.asarray(out)
