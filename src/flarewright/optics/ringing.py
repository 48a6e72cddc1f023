"""Fresnel diffraction of the iris on a ghost's way to the sensor: Collins' integral with the ghost's own matrix.

A wave that left a point of light meets the stop and goes on to the sensor through a system [[A, B], [C, D]]. With M the
sensor's height per height in the stop along geometric rays, Collins' integral gives at x = M xi the irradiance

    I(xi) = | 1 / (lambda L) * integral T(p) exp(i pi (p - xi)^2 / (lambda L)) d^2p |^2 / M^2,    L = B / M,

the Fresnel pattern of the opening T at the distance L, drawn where geometric rays through xi land. So a pattern in the
plane of the stop stands in for the opening, and everything else about a ghost stays with its rays. What tells the
pattern is lambda L, the Fresnel area; the Fresnel number is N_F = h^2 / (lambda L), h the opening's radius.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ..kernels import matrix
from .fft_size import fast_size
from .pack import PackedLens
from .paths import LightPath

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Kind = TypeVar("Kind", np.float32, np.float64)

# a few dozen steps: Python has them done before a compiled kernel would be loaded
_path_matrices = getattr(matrix.path_matrices, "py_func", matrix.path_matrices)

SAMPLES_A_FRINGE = 8
"""Samples per sqrt(lambda L / 2), the scale of an edge's fringes; the first is two thirds of it wide."""

SAMPLES_A_RADIUS = 32
"""And samples per radius of the opening at least."""

MOST_SAMPLES = 2048
"""Samples a side of the widest grid."""

SHADOW = 6.0
"""How far into the shadow a pattern goes, in sqrt(lambda L / 2): to 1 / (2 pi^2 6^2) = 0.14 % of the open light."""

FADE = (5.0, 7.0)
"""White light's fringes end between these distances from an edge, in sqrt(lambda L / 2): the sixth and the twelfth."""

FINEST_PART = 0.875
"""They begin to end at this part of the finest frequency of a grid; `SAMPLES_A_FRINGE` hold all of `FADE` below it."""

RIPPLES = (
    (0.1, 0.25, 0.5, 0.8, 1.0, 1.4, 2.0, 3.0, 4.0, 6.0, 8.0),
    (0.37, 0.362, 0.335, 0.28, 0.23, 0.14, 0.095, 0.061, 0.046, 0.03, 0.023),
)
"""Blurs, in sqrt(lambda L / 2), and how far the light along a knife edge then rises at most above that of rays."""

FRFT_SAMPLES = 512
"""Samples across the texture that Hullin's fractional Fourier transform sees; the paper does not say how many."""

FRFT_FILL = 0.8
"""The round opening's radius there, in halves of the texture."""

__all__ = [
    "FresnelGrid",
    "StopToSensor",
    "crop",
    "ending",
    "fresnel_grid",
    "fresnel_intensity",
    "frft_fresnel_number",
    "halved",
    "ripple_height",
    "stop_to_sensor",
]


@dataclass(frozen=True)
class StopToSensor:
    """How a path goes on from one of its crossings of the stop, per traced wavelength and in x and y.

    Attributes
    ----------
    length : ndarray, shape (W, 2)
        L = B / M, mm; infinite where the light comes to a focus on the sensor.
    magnification : ndarray, shape (W, 2)
        M, the sensor's height per height in the stop along the light's rays.
    """

    length: Floats
    magnification: Floats


def stop_to_sensor(packed: PackedLens, path: LightPath, nearness: float = 0.0) -> tuple[StopToSensor, ...]:
    """Describe a path from each of its crossings of the stop to the sensor.

    Parameters
    ----------
    packed : PackedLens
    path : LightPath
    nearness : float
        1 / distance of the light from the first vertex along the axis, 1/mm; 0 for a distant one.

    Returns
    -------
    tuple of StopToSensor
        One a crossing.

    Notes
    -----
    With Ma to the stop and S to the sensor, both from the first vertex, light of slope k per height has the height
    a = Ma00 + k Ma01 in the stop and s = S00 + k S01 on the sensor. B, reduced by the index in the stop so that
    lambda is that of vacuum, is S01 Ma00 - S00 Ma01, whatever the indices: M = s / a, L = B a / s.
    """
    sides = [packed.curvature] if packed.curvature_x is None else [packed.curvature_x, packed.curvature]
    count, crossings = len(packed.wavelengths_nm), path.stop_crossings
    found = np.empty((2, crossings, count, 2))
    to_stop = np.empty((crossings, 2, 2, count))
    for side, curvature in enumerate(sides):
        # indices as (K + 1, W): every step is done for all colours at once
        S00, S01, _, _ = _path_matrices(
            path.rows, path.actions, curvature, packed.z_vertex, packed.n_gap.T, packed.sensor_z, to_stop
        )
        a, s = to_stop[:, 0, 0] + nearness * to_stop[:, 0, 1], S00 + nearness * S01
        B = S01 * to_stop[:, 0, 0] - S00 * to_stop[:, 0, 1]
        with np.errstate(divide="ignore", invalid="ignore"):
            found[..., side:] = np.stack([B * a / s, s / a])[..., None]
    return tuple(StopToSensor(*found[:, c]) for c in range(crossings))


def frft_fresnel_number(wavelength_nm: Floats, f_number: float) -> Floats:
    """Fresnel number that Hullin's fractional Fourier transform comes to.

    Parameters
    ----------
    wavelength_nm : ndarray
    f_number : float

    Returns
    -------
    ndarray
        Of the round opening's radius; the same for every ghost.

    Notes
    -----
    Hullin et al. 2011, equation 5: order alpha = 0.15 (lambda / 400 nm) (N / 18). The transform by phi = pi alpha / 2
    has the kernel exp(i pi (u^2 cot phi - 2 u u' / sin phi + u'^2 cot phi)), a Fresnel diffraction of Fresnel number
    R^2 cot phi, scaled by cos phi; the scale is left to the rays. In the plane of Ozaktas' transform n samples lie
    1 / sqrt(n) apart, so a circle that fills r of the texture has R = r sqrt(n) / 2. The transform by 1 is the far
    field, beyond which the formula has no meaning: orders stop short of it, at N_F = 1.
    """
    alpha = 0.15 * (np.asarray(wavelength_nm, dtype=np.float64) / 400.0) * (f_number / 18.0)
    squared = 0.25 * FRFT_FILL**2 * FRFT_SAMPLES
    phi = 0.5 * math.pi * np.minimum(alpha, 1.0)
    return np.asarray(np.maximum(squared * np.cos(phi) / np.sin(phi), 1.0))


def ripple_height(blur: float) -> float:
    """Bound how far the light along an edge rises above that of rays, once it is blurred.

    Parameters
    ----------
    blur : float
        Width of a pixel, or of the disc or square that a light spreads each place over, in sqrt(lambda L / 2).

    Returns
    -------
    float
        In parts of the open light; 0.37 where nothing is blurred.

    Notes
    -----
    The analytic knife edge (Born and Wolf, section 8.7.3) less a step, averaged over boxes and discs; beyond the table
    it falls as 1 / blur, as that of boxes does. A test computes it anew.
    """
    blurs, heights = RIPPLES
    if blur > blurs[-1]:
        return heights[-1] * blurs[-1] / blur
    return float(np.interp(blur, blurs, heights))


@dataclass(frozen=True)
class FresnelGrid:
    """An opening, sampled finely and widely enough for some Fresnel areas, and its transform.

    Attributes
    ----------
    at : tuple of ndarray
        Places of the samples in x and in y, mm; symmetric about 0.
    spectrum : ndarray, shape (Ny, Nx // 2 + 1), complex64
        Transform of the amplitude.
    light : float
        Sum of the transmittance.
    """

    at: tuple[Floats, Floats]
    spectrum: NDArray[np.complex64]
    light: float

    @property
    def step(self) -> float:
        """Distance of the samples, mm."""
        return float(self.at[0][1] - self.at[0][0])


def fresnel_grid(
    opening: Callable[[Floats, Floats], tuple[Floats, Floats]],
    reach: float,
    radius: float,
    least: tuple[float, float],
    most: tuple[float, float],
    shown: float = 0.0,
) -> FresnelGrid:
    """Sample an opening for Fresnel diffraction.

    Parameters
    ----------
    opening : callable
        Amplitude and transmittance of samples at (x, y), called with arrays of shapes (Nx,) and (Ny, 1); the amplitude
        averaged over a triangle two samples wide, which is undone here.
    reach : float
        Half the side of a square that holds the opening, mm.
    radius : float
        The opening's radius, mm.
    least, most : tuple of float
        Least and largest |lambda L| in x and in y, mm^2.
    shown : float
        Samples need not lie closer than this, mm.

    Returns
    -------
    FresnelGrid

    Notes
    -----
    The frequency f travels lambda L f sideways. The grid is so wide that its highest frequency, 1 / (2 step), does not
    come around into the pattern, which reaches `SHADOW` fringes beyond the opening.
    """
    finest = min(math.sqrt(min(least) / 2.0) / SAMPLES_A_FRINGE, radius / SAMPLES_A_RADIUS)
    open_part = [2.0 * reach + SHADOW * math.sqrt(large / 2.0) for large in most]
    # count * step = open part + most / (2 step), with no more samples than there may be
    coarsest = [
        (width + math.sqrt(width**2 + 2.0 * large * MOST_SAMPLES)) / (2.0 * MOST_SAMPLES)
        for width, large in zip(open_part, most, strict=True)
    ]
    step = max(finest, shown, *coarsest)
    counts = [
        fast_size(math.ceil((width + 0.5 * large / step) / step), even=True)
        for width, large in zip(open_part, most, strict=True)
    ]
    x, y = (np.asarray((np.arange(count) - 0.5 * (count - 1)) * step, dtype=np.float64) for count in counts)
    amplitude, light = opening(x, y[:, None])
    spectrum = np.fft.rfft2(amplitude.astype(np.float32))
    # a border's light has the frequencies across it, and the triangle took sinc^2 of them; in the corners, beyond what
    # the grid resolves, there is nothing to give back
    per_sample = np.minimum(np.hypot(np.fft.rfftfreq(counts[0]), np.fft.fftfreq(counts[1])[:, None]), 0.5)
    spectrum = (spectrum / np.sinc(per_sample) ** 2).astype(np.complex64)
    return FresnelGrid((x, y), spectrum, float(light.sum()))


def ending(at: NDArray[Kind], first: float, last: float) -> NDArray[Kind]:
    """Fall smoothly from 1 up to the first place to 0 from the last."""
    fade = np.clip((last - at) / (last - first), 0.0, 1.0)
    found: NDArray[Kind] = fade * fade * (3.0 - 2.0 * fade)
    return found


def fresnel_intensity(grid: FresnelGrid, area: tuple[float, float], *, white: bool = False) -> Singles:
    """Diffract an opening.

    Parameters
    ----------
    grid : FresnelGrid
        Made for this Fresnel area.
    area : tuple of float
        lambda L in x and in y, mm^2; of either sign.
    white : bool
        Leave out the fine fringes that no band of colours leaves, those between `FADE`, and what the grid cannot hold.

    Returns
    -------
    ndarray, shape (Ny, Nx), float32
        |U|^2, 1 in the middle of a wide opening. Its sum does not depend on the area (Parseval), unless `white`.

    Notes
    -----
    U is T with each frequency f turned by -pi lambda L f^2 (Goodman, Introduction to Fourier Optics, section 4.2). T is
    real, so the transforms with the cosine and with the sine of the turn are the real and the imaginary part.
    """
    fx = np.fft.rfftfreq(len(grid.at[0]), grid.step)
    fy = np.fft.fftfreq(len(grid.at[1]), grid.step)
    turn = np.exp(-1j * math.pi * area[1] * fy**2)[:, None].astype(np.complex64)
    turn = turn * np.exp(-1j * math.pi * area[0] * fx**2).astype(np.complex64)
    if white:
        w = np.abs(2.0 * area[1]) * (fy**2)[:, None].astype(np.float32) + np.abs(2.0 * area[0]) * (fx**2).astype(
            np.float32
        )
        turn *= ending(np.sqrt(w, dtype=np.float32), *FADE)
        # a grid that pixels or samples limit ends before that: softly, or edges would ring of its own
        per_finest = 2.0 * grid.step * np.hypot(fx, fy[:, None]).astype(np.float32)
        turn *= ending(per_finest, FINEST_PART, 1.0)
    shape = (len(grid.at[1]), len(grid.at[0]))
    real = np.fft.irfft2(grid.spectrum * turn.real, shape)
    imaginary = np.fft.irfft2(grid.spectrum * turn.imag, shape)
    return np.asarray(real * real + imaginary * imaginary, dtype=np.float32)


def crop(grid: FresnelGrid, pattern: Singles, half: tuple[float, float]) -> tuple[Singles, tuple[float, float]]:
    """Keep the middle of a pattern, with all the light of the opening.

    Parameters
    ----------
    grid : FresnelGrid
    pattern : ndarray, shape (Ny, Nx)
    half : tuple of float
        Half the sides of the part to keep, mm.

    Returns
    -------
    pattern : ndarray, shape (Ky, Kx), float32
        0 along its border.
    half : tuple of float
        Half the sides of what was kept, mm.
    """
    each = [min(2 * math.ceil(wanted / grid.step), len(at)) for wanted, at in zip(half, grid.at, strict=True)]
    x, y = ((len(at) - count) // 2 for count, at in zip(each, grid.at, strict=True))
    kept = pattern[y : y + each[1], x : x + each[0]].copy()
    kept[0], kept[-1], kept[:, 0], kept[:, -1] = 0.0, 0.0, 0.0, 0.0
    # what lies beyond, and what the borders' samples lost, is given back
    kept *= np.float32(grid.light / max(float(kept.sum(dtype=np.float64)), 1e-30))
    return kept, (0.5 * each[0] * grid.step, 0.5 * each[1] * grid.step)


def halved(pattern: Singles, half: tuple[float, float], times: tuple[int, int]) -> tuple[Singles, tuple[float, float]]:
    """Halve a pattern's resolution by means over neighbours.

    Parameters
    ----------
    pattern : ndarray, shape (Ky, Kx)
        0 along its border.
    half : tuple of float
        Half its sides, mm.
    times : tuple of int
        How often, in x and in y.

    Returns
    -------
    pattern : ndarray, float32
        0 along its border.
    half : tuple of float
        Half its sides, a little more than they were.
    """
    blocks = (2 ** times[0], 2 ** times[1])
    if blocks == (1, 1):
        return pattern, half
    # room for a border of zeros and for whole blocks
    more = [blocks[k] + (-pattern.shape[1 - k] // 2) % blocks[k] for k in (0, 1)]
    step = (2.0 * half[0] / pattern.shape[1], 2.0 * half[1] / pattern.shape[0])
    wide = np.pad(pattern, ((more[1], more[1]), (more[0], more[0])))
    for _ in range(times[0]):
        wide = 0.5 * (wide[:, ::2] + wide[:, 1::2])
    for _ in range(times[1]):
        wide = 0.5 * (wide[::2] + wide[1::2])
    return wide, (half[0] + more[0] * step[0], half[1] + more[1] * step[1])
