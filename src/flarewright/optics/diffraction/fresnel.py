"""Fresnel patterns of an opening by FFT, for openings that the tables of `edge_patterns` do not cover.

The opening is sampled for a range of Fresnel areas lambda L and transformed once; each pattern is its spectrum with
phases applied, transformed back. White light leaves a few fringes along an edge, so a part of a pattern depends only on
the opening within `REACH`; when only a part is visible, a window of the opening is sampled.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ...kernels.diffraction.fresnel import BandAreas, FrequencyLimits, PhaseTables, sharpen, sum_turns, turn_frequencies
from ...typing import Floats, Pixels
from .fft_size import fast_size

Kind = TypeVar("Kind", np.float32, np.float64)
Waves = NDArray[np.complex64]
Ranges = tuple[tuple[int, int], tuple[int, int]]
Box = tuple[tuple[float, float], tuple[float, float]]
"""Extent of a part of the stop in x and in y, mm."""

SAMPLES_A_FRINGE = 8
"""Samples per sqrt(lambda L / 2), the scale of an edge's fringes; the first fringe is two thirds of it wide."""

SAMPLES_A_RADIUS = 32
"""Least number of samples per radius of the opening."""

MOST_SAMPLES = 2048
"""Largest number of samples per side of a grid."""

SHADOW = 6.0
"""Width of the shadow in a pattern, in sqrt(lambda L / 2): 1 / (2 pi^2 6^2) = 0.14 % of the open light remain there."""

FADE = (5.0, 7.0)
"""White light's fringes fade out between these distances from an edge, in sqrt(lambda L / 2): the 6th and the 12th."""

REACH = FADE[1] + 0.5
"""Largest distance of a border that affects a pattern of white light, in sqrt(lambda L / 2)."""

FINEST_PART = 0.875
"""Fraction of a grid's finest frequency at which fringes begin to fade; a grid of `SAMPLES_A_FRINGE` resolves all of
`FADE` below it."""

CUT = 4.0
"""Length of the soft end of an opening that extends beyond its samples, in sqrt(lambda L / 2)."""

TURN_STEPS = 128
"""Square root of the number of phase steps up to the end of `FADE`, 77 radians."""

ALIKE = 0.4
"""Colours of a band are merged when their phases at the end of `FADE` differ by less than this, radians. It changes the
wave by 0.7 % there, where it has faded out, and by a fourth of that where the fade begins."""

# f^2 lambda L at the end of the fade, and steps per unit of it
_END = 0.5 * FADE[1] ** 2
_TO_STEP = (TURN_STEPS**2 - 1) / _END


@dataclass(frozen=True)
class FresnelGrid:
    """A sampled opening and its transform, for a range of Fresnel areas.

    Attributes
    ----------
    at : tuple of ndarray
        Sample positions in x and in y, mm.
    spectrum : ndarray, shape (Ny, Nx // 2 + 1), complex64
        Transform of the amplitude.
    light : float
        Sum of the transmittance.
    whole : bool
        All that the opening lights is looked at, not a window of it.
    """

    at: tuple[Floats, Floats]
    spectrum: NDArray[np.complex64]
    light: float
    whole: bool = True

    @property
    def steps(self) -> tuple[float, float]:
        """Distance of the samples in x and in y, mm."""
        return float(self.at[0][1] - self.at[0][0]), float(self.at[1][1] - self.at[1][0])

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of a pattern."""
        return len(self.at[1]), len(self.at[0])

    def frequencies(self) -> tuple[Floats, Floats]:
        """Return those of the spectrum, across and, as a column, down, 1/mm."""
        across, down = np.fft.rfftfreq(len(self.at[0]), self.steps[0]), np.fft.fftfreq(len(self.at[1]), self.steps[1])
        return np.asarray(across, dtype=np.float64), np.asarray(down, dtype=np.float64)[:, None]


@dataclass(frozen=True)
class _Side:
    """Extent of the samples in one direction, mm.

    Attributes
    ----------
    shown : tuple of float
        Visible part of the patterns.
    lit : tuple of float
        Extent of the opening.
    soft : float
        Length of its soft ends where it is cut.
    cut : tuple of bool
        Whether the opening extends beyond either end.
    """

    shown: tuple[float, float]
    lit: tuple[float, float]
    soft: float
    cut: tuple[bool, bool]

    @property
    def open_width(self) -> float:
        return self.lit[1] - self.lit[0]

    @property
    def width(self) -> float:
        """Width at which light that wraps around the grid stays out of the visible part, without its travel."""
        return max(self.lit[1] - self.shown[0], self.shown[1] - self.lit[0])

    @property
    def middle(self) -> float:
        return 0.5 * (min(self.lit[0], self.shown[0]) + max(self.lit[1], self.shown[1]))

    def softened(self, at: Floats) -> Floats:
        """Return the factor of the amplitude at some positions."""
        found = np.ones_like(at)
        if self.cut[0]:
            found *= ending(-at, -self.lit[0] - self.soft, -self.lit[0])
        if self.cut[1]:
            found *= ending(at, self.lit[1] - self.soft, self.lit[1])
        return found


def _side(reach: float, scale: float, span: tuple[float, float] | None) -> _Side:
    if span is None:
        far = reach + SHADOW * scale
        return _Side((-far, far), (-reach, reach), 0.0, (False, False))
    more = (REACH + CUT) * scale
    lit = max(-reach, span[0] - more), min(reach, span[1] + more)
    return _Side(span, lit, CUT * scale, (lit[0] > -reach, lit[1] < reach))


def fresnel_grid(
    opening: Callable[[Floats, Floats], tuple[NDArray[np.floating], NDArray[np.floating]]],
    reach: float,
    radius: float,
    least: tuple[float, float],
    most: tuple[float, float],
    shown: tuple[float, float] = (0.0, 0.0),
    window: Box | None = None,
) -> FresnelGrid:
    """Sample an opening for Fresnel diffraction.

    Parameters
    ----------
    opening : callable
        Amplitude and transmittance of samples at (x, y), called with arrays of shapes (Nx,) and (Ny, 1); the amplitude
        averaged across borders over a triangle two samples wide, which is undone here.
    reach : float
        Half the side of a square that holds the opening, mm.
    radius : float
        The opening's radius, mm.
    least, most : tuple of float
        Least and largest |lambda L| in x and in y, mm^2.
    shown : tuple of float
        In x and in y samples need not lie closer than this, mm.
    window : Box, optional
        Visible part of the stop for patterns of white light; default: the whole stop.

    Notes
    -----
    The frequency f travels lambda L f sideways. The grid is so wide that its highest frequency, 1 / (2 step), does not
    come around into the pattern, which reaches `SHADOW` fringes beyond the opening. An opening that extends beyond a
    window is sampled up to `REACH` from the window and fades out softly there, because a slow fall diffracts no light.
    Across a border between both axes the frequency in x is that of a border across x at most, so each axis has its own
    step.
    """
    spans = (None, None) if window is None else window
    sides = [_side(reach, math.sqrt(large / 2.0), span) for large, span in zip(most, spans, strict=True)]
    finest = [min(math.sqrt(small / 2.0) / SAMPLES_A_FRINGE, radius / SAMPLES_A_RADIUS) for small in least]
    # count * step = open part + most / (2 step), with no more samples than there may be
    coarsest = [
        (side.width + math.sqrt(side.width**2 + 2.0 * large * MOST_SAMPLES)) / (2.0 * MOST_SAMPLES)
        for side, large in zip(sides, most, strict=True)
    ]
    steps = [
        max(*limits, side.open_width / MOST_SAMPLES)
        for *limits, side in zip(finest, shown, coarsest, sides, strict=True)
    ]
    counts = [
        fast_size(math.ceil(max(side.width + 0.5 * large / step, side.open_width) / step), even=True)
        for side, large, step in zip(sides, most, steps, strict=True)
    ]
    x, y = (
        np.asarray(side.middle + (np.arange(count) - 0.5 * (count - 1)) * step, dtype=np.float64)
        for side, count, step in zip(sides, counts, steps, strict=True)
    )
    amplitude, light = opening(x, y[:, None])
    if any(any(side.cut) for side in sides):
        left = sides[1].softened(y).astype(np.float32)[:, None] * sides[0].softened(x).astype(np.float32)
        amplitude, light = amplitude * left, light * left**2
    spectrum = np.fft.rfft2(np.asarray(amplitude, dtype=np.float32)).astype(np.complex64, copy=False)
    # a border's light has the frequencies across it, and the triangle took sinc^2 of them
    sharpen(np.fft.rfftfreq(counts[0]), np.fft.fftfreq(counts[1]), spectrum)
    return FresnelGrid((x, y), spectrum, float(light.sum(dtype=np.float64)), window is None)


def ending(at: NDArray[Kind], first: float, last: float) -> NDArray[Kind]:
    """Return a factor that falls smoothly from 1 at `first` to 0 at `last`."""
    fade = np.clip((last - at) / (last - first), 0.0, 1.0)
    found: NDArray[Kind] = fade * fade * (3.0 - 2.0 * fade)
    return found


def fresnel_intensity(grid: FresnelGrid, area: tuple[float, float]) -> Pixels:
    """Compute the pattern of one wavelength with all its fringes.

    Parameters
    ----------
    grid : FresnelGrid
        Made for this Fresnel area, with the whole opening.
    area : tuple of float
        lambda L in x and in y, mm^2; of either sign.

    Returns
    -------
    ndarray, shape (Ny, Nx), float32
        |U|^2, 1 in the middle of a wide opening. Its sum does not depend on the area (Parseval).

    Notes
    -----
    U is T with the phase -pi lambda L f^2 at each frequency f (Goodman, Introduction to Fourier Optics, section 4.2).
    """
    across, down = (
        np.exp(-1j * math.pi * a * f**2).astype(np.complex64) for a, f in zip(area, grid.frequencies(), strict=True)
    )
    turn = down * across
    return _light(grid, grid.spectrum * turn.real, grid.spectrum * turn.imag)


def band_pattern(
    grid: FresnelGrid, areas: Sequence[tuple[float, float]] | Floats, shares: Floats, window: Box
) -> tuple[Pixels, Box]:
    """Compute a part of the pattern of a band of white light, with the few fringes that remain along its edges.

    Only that part is transformed back.

    Parameters
    ----------
    grid : FresnelGrid
        Made for these Fresnel areas.
    areas : array_like, shape (K, 2)
        lambda L in x and in y, mm^2, of the band's wavelengths: of one sign in x, of one sign in y, and of one ratio.
    shares : ndarray, shape (K,)
        Their fractions of the light, which sum to 1.
    window
        As in `crop`.

    Returns
    -------
    ndarray, shape (Ky, Kx), float32, and Box
        As from `crop`; 1 in the middle of a wide opening.

    Notes
    -----
    Far fringes are small ripples on the transmitted wave, so the band's mean wave contains the mean of their light: one
    transform serves a band. It omits the light of waves whose mean over the band is 0, faint and far from the edge:
    some per cent of the light in the shadow. Compared with the sum over colours, a band a sixth of its wavelength wide
    has an error of 1e-3 rms along the border and 0.026 at worst, deep in corners. Fringes fade out between `FADE`, or
    earlier where the grid cannot resolve them.
    """
    real, imaginary, light = _wave(grid, areas, shares)
    (left, right), (bottom, top) = ranges = _ranges(grid, window)
    # Parseval gives the light of the whole pattern, most of which is not computed
    kept = np.ascontiguousarray(_light(grid, real, imaginary, (bottom, top))[:, left:right])
    return kept, _given_back(grid, kept, light, ranges)


def _wave(
    grid: FresnelGrid, areas: Sequence[tuple[float, float]] | Floats, shares: Floats
) -> tuple[Waves, Waves, float]:
    """Return a band's mean wave as its spectrum times the real and the imaginary part of the phase, and its light.

    The opening is real and the phase even, so both parts are spectra of real functions; they end where all are 0.
    """
    pairs = np.asarray(areas, dtype=np.float64)
    middle = shares @ pairs
    # each phase factor is the product of its row's and its column's, for all colours at once
    ratios, parts = _fewer(pairs[:, 0] / middle[0], shares)
    steps = np.arange(TURN_STEPS) / _TO_STEP
    rates = -1j * math.pi * ratios[:, None]
    table = np.empty(TURN_STEPS**2, dtype=np.complex64)
    sum_turns(parts[:, None] * np.exp(rates * (TURN_STEPS * steps)), np.exp(rates * steps), table)
    # index phases by f^2 times the mean area, up to the end of the fade
    across, down = (f.ravel() ** 2 for f in grid.frequencies())
    area_x, area_y = np.abs(middle).tolist()
    count = int(np.searchsorted(area_x * across, _END))
    # a grid that pixels or samples limit ends before that; it fades out softly, because a sharp end makes edges ring
    finest_x, finest_y = ((0.5 / step) ** 2 for step in grid.steps)
    ends = (FINEST_PART, 1.0)
    if min(finest_x * area_x, finest_y * area_y) >= _END / FINEST_PART**2:
        ends = (math.inf, math.inf)
    turned = np.empty((2, len(down), count), dtype=np.complex64)
    own = BandAreas(area_x, area_y, math.copysign(1.0, middle[0] * middle[1]))
    limits, tables = FrequencyLimits((finest_x, finest_y), ends), PhaseTables(table, _fades(), _TO_STEP)
    light = turn_frequencies(grid.spectrum, across[:count], down, own, limits, tables, turned)
    return turned[0], turned[1], light / math.prod(grid.shape)


def _fewer(ratios: Floats, shares: Floats) -> tuple[Floats, Floats]:
    """Merge colours whose phases differ little up to the end of the fade, each group at its mean."""
    width = ALIKE / (math.pi * _END)
    group = ((ratios - ratios.min()) / width).astype(np.intp)
    parts: Floats = np.bincount(group, shares).astype(np.float64)
    held = parts > 0.0
    return np.bincount(group, shares * ratios)[held] / parts[held], parts[held]


@lru_cache(maxsize=1)
def _fades() -> Pixels:
    """Return the remaining amplitude of fringes at the phase steps (`_TO_STEP`)."""
    return ending(np.sqrt(2.0 * np.arange(TURN_STEPS**2) / _TO_STEP), *FADE).astype(np.float32)


def _light(grid: FresnelGrid, real: Waves, imaginary: Waves, rows: tuple[int, int] | None = None) -> Pixels:
    """Return the irradiance of a wave in the given rows (first, end); parts as from `_wave`."""
    parts = [
        np.fft.irfft(np.fft.ifft(part, axis=0)[slice(*rows) if rows else slice(None)], grid.shape[1])
        for part in (real, imaginary)
    ]
    for part in parts:
        np.square(part, out=part)
    parts[0] += parts[1]
    return np.asarray(parts[0], dtype=np.float32)


def crop(grid: FresnelGrid, pattern: Pixels, window: Box) -> tuple[Pixels, Box]:
    """Cut a part out of a pattern and scale it to the light of the opening.

    Parameters
    ----------
    grid : FresnelGrid
    pattern : ndarray, shape (Ny, Nx)
    window : Box
        The part.

    Returns
    -------
    pattern : ndarray, shape (Ky, Kx), float32
        0 along its border.
    box : Box
        Its extent.
    """
    (left, right), (bottom, top) = ranges = _ranges(grid, window)
    kept = pattern[bottom:top, left:right].copy()
    return kept, _given_back(grid, kept, float(pattern.sum(dtype=np.float64)), ranges)


def _ranges(grid: FresnelGrid, window: Box) -> Ranges:
    """Return the first and end samples of a window, in x and in y."""
    found = []
    for (low, high), at, step in zip(window, grid.at, grid.steps, strict=True):
        first, last = (round((end - at[0]) / step + 0.5) for end in (low, high))
        found.append((max(first, 0), min(last, len(at))))
    return found[0], found[1]


def _given_back(grid: FresnelGrid, kept: Pixels, light: float, ranges: Ranges) -> Box:
    """Scale a part of a pattern, in place, to the light of the opening, set its border to 0; return its extent."""
    # restores the light of omitted fringes; for a whole opening also that beyond the pattern and that of its border
    total = float(kept[1:-1, 1:-1].sum(dtype=np.float64)) if grid.whole else light
    kept *= np.float32(grid.light / max(total, 1e-30))
    kept[0], kept[-1], kept[:, 0], kept[:, -1] = 0.0, 0.0, 0.0, 0.0
    box = [
        (float(at[a]) - 0.5 * step, float(at[b - 1]) + 0.5 * step)
        for at, (a, b), step in zip(grid.at, ranges, grid.steps, strict=True)
    ]
    return box[0], box[1]


def halved_pattern(pattern: Pixels, box: Box, times: tuple[int, int]) -> tuple[Pixels, Box]:
    """Halve a pattern's resolution by averages of neighbours.

    Parameters
    ----------
    pattern : ndarray, shape (Ky, Kx)
        0 along its border.
    box : Box
        Its extent.
    times : tuple of int
        Number of halvings in x and in y.

    Returns
    -------
    pattern : ndarray, float32
        0 along its border.
    box : Box
        A little larger than before.
    """
    blocks = (2 ** times[0], 2 ** times[1])
    if blocks == (1, 1):
        return pattern, box
    # room for a border of zeros and for whole blocks
    after = [blocks[k] + -pattern.shape[1 - k] % blocks[k] for k in (0, 1)]
    wide = np.pad(pattern, ((blocks[1], after[1]), (blocks[0], after[0])))
    steps = [(high - low) / count for (low, high), count in zip(box, pattern.shape[::-1], strict=True)]
    for _ in range(times[0]):
        wide = 0.5 * (wide[:, ::2] + wide[:, 1::2])
    for _ in range(times[1]):
        wide = 0.5 * (wide[::2] + wide[1::2])
    larger = [
        (low - block * step, high + more * step)
        for (low, high), block, more, step in zip(box, blocks, after, steps, strict=True)
    ]
    return wide, (larger[0], larger[1])
