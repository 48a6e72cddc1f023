"""Fresnel patterns of an opening, by transforms of it: for openings that tables of edges and corners do not serve.

The opening is sampled finely and widely enough for some Fresnel areas lambda L and transformed once; each pattern is
its spectrum, turned and transformed back. White light leaves a few fringes along an edge, so a part of a pattern knows
only of what is near it (`REACH`): where the rest is not seen, only a window of the opening is sampled.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ..kernels.fresnel import sum_turns, turn_frequencies
from .fft_size import fast_size

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Kind = TypeVar("Kind", np.float32, np.float64)
Waves = NDArray[np.complex64]
Ranges = tuple[tuple[int, int], tuple[int, int]]
Box = tuple[tuple[float, float], tuple[float, float]]
"""From where to where a part of the stop reaches in x and in y, mm."""

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

REACH = FADE[1] + 0.5
"""How far from a border a pattern of white light knows of it, in sqrt(lambda L / 2)."""

FINEST_PART = 0.875
"""Fringes begin to end at this part of a grid's finest frequency; `SAMPLES_A_FRINGE` hold all of `FADE` below it."""

CUT = 4.0
"""An opening that goes on beyond what is sampled of it ends softly over this length, in sqrt(lambda L / 2)."""

TURN_STEPS = 128
"""The square of it is in how many steps the turn of frequencies is told up to the end of `FADE`, 77 radians."""

ALIKE = 0.4
"""Colours of a band whose turns differ by less than this at the end of `FADE`, radians, are joined, which changes their
wave by 0.7 % there, where nothing is left, and by a fourth of that where the fade begins."""

# f^2 lambda L at the end of the fade, and steps to it
_END = 0.5 * FADE[1] ** 2
_TO_STEP = (TURN_STEPS**2 - 1) / _END

__all__ = [
    "FADE",
    "REACH",
    "SHADOW",
    "Box",
    "FresnelGrid",
    "band_intensity",
    "band_pattern",
    "crop",
    "ending",
    "fresnel_grid",
    "fresnel_intensity",
    "halved",
]


@dataclass(frozen=True)
class FresnelGrid:
    """An opening, sampled finely and widely enough for some Fresnel areas, and its transform.

    Attributes
    ----------
    at : tuple of ndarray
        Places of the samples in x and in y, mm.
    spectrum : ndarray, shape (Ny, Nx // 2 + 1), complex64
        Transform of the amplitude.
    light : float
        Sum of the transmittance.
    whole : bool
        No part of the opening is left out.
    """

    at: tuple[Floats, Floats]
    spectrum: NDArray[np.complex64]
    light: float
    whole: bool = True

    @property
    def step(self) -> float:
        """Distance of the samples, mm."""
        return float(self.at[0][1] - self.at[0][0])

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of a pattern."""
        return len(self.at[1]), len(self.at[0])

    def frequencies(self) -> tuple[Floats, Floats]:
        """Return those of the spectrum, across and, as a column, down, 1/mm."""
        across, down = np.fft.rfftfreq(len(self.at[0]), self.step), np.fft.fftfreq(len(self.at[1]), self.step)
        return np.asarray(across, dtype=np.float64), np.asarray(down, dtype=np.float64)[:, None]


@dataclass(frozen=True)
class _Side:
    """What is sampled of an opening in one direction, mm.

    Attributes
    ----------
    shown : tuple of float
        Where patterns are looked at.
    lit : tuple of float
        From where to where the opening is open.
    soft : float
        Over this length it ends where it is cut.
    cut : tuple of bool
        Whether it goes on at either end.
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
        """Width beyond which light that comes around the grid's end is not seen, less the way that it travels."""
        return max(self.lit[1] - self.shown[0], self.shown[1] - self.lit[0])

    @property
    def middle(self) -> float:
        return 0.5 * (min(self.lit[0], self.shown[0]) + max(self.lit[1], self.shown[1]))

    def softened(self, at: Floats) -> Floats:
        """Return the part of the amplitude that is left at some places."""
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
    opening: Callable[[Floats, Floats], tuple[Floats, Floats]],
    reach: float,
    radius: float,
    least: tuple[float, float],
    most: tuple[float, float],
    shown: float = 0.0,
    window: Box | None = None,
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
    window : Box, optional
        The part of the stop that patterns of white light are looked at in; all of it when left out.

    Returns
    -------
    FresnelGrid

    Notes
    -----
    The frequency f travels lambda L f sideways. The grid is so wide that its highest frequency, 1 / (2 step), does not
    come around into the pattern, which reaches `SHADOW` fringes beyond the opening. What goes on beyond a window is
    sampled as far as the window knows of it, and ends softly after that: a slow fall throws no light aside.
    """
    spans = (None, None) if window is None else window
    sides = [_side(reach, math.sqrt(large / 2.0), span) for large, span in zip(most, spans, strict=True)]
    finest = min(math.sqrt(min(least) / 2.0) / SAMPLES_A_FRINGE, radius / SAMPLES_A_RADIUS)
    # count * step = open part + most / (2 step), with no more samples than there may be
    coarsest = [
        (side.width + math.sqrt(side.width**2 + 2.0 * large * MOST_SAMPLES)) / (2.0 * MOST_SAMPLES)
        for side, large in zip(sides, most, strict=True)
    ]
    step = max(finest, shown, *coarsest, *(side.open_width / MOST_SAMPLES for side in sides))
    counts = [
        fast_size(math.ceil(max(side.width + 0.5 * large / step, side.open_width) / step), even=True)
        for side, large in zip(sides, most, strict=True)
    ]
    x, y = (
        np.asarray(side.middle + (np.arange(count) - 0.5 * (count - 1)) * step, dtype=np.float64)
        for side, count in zip(sides, counts, strict=True)
    )
    amplitude, light = opening(x, y[:, None])
    whole = not any(any(side.cut) for side in sides)
    if not whole:
        left = sides[1].softened(y)[:, None] * sides[0].softened(x)
        amplitude, light = amplitude * left, light * left**2
    spectrum = np.fft.rfft2(amplitude.astype(np.float32))
    # a border's light has the frequencies across it, and the triangle took sinc^2 of them; in the corners, beyond what
    # the grid resolves, there is nothing to give back
    per_sample = np.minimum(np.hypot(np.fft.rfftfreq(counts[0]), np.fft.fftfreq(counts[1])[:, None]), 0.5)
    spectrum = (spectrum / np.sinc(per_sample) ** 2).astype(np.complex64)
    return FresnelGrid((x, y), spectrum, float(light.sum()), whole)


def ending(at: NDArray[Kind], first: float, last: float) -> NDArray[Kind]:
    """Fall smoothly from 1 up to the first place to 0 from the last."""
    fade = np.clip((last - at) / (last - first), 0.0, 1.0)
    found: NDArray[Kind] = fade * fade * (3.0 - 2.0 * fade)
    return found


def fresnel_intensity(grid: FresnelGrid, area: tuple[float, float]) -> Singles:
    """Diffract an opening by light of one wavelength: all its fringes.

    Parameters
    ----------
    grid : FresnelGrid
        Made for this Fresnel area, of the whole opening.
    area : tuple of float
        lambda L in x and in y, mm^2; of either sign.

    Returns
    -------
    ndarray, shape (Ny, Nx), float32
        |U|^2, 1 in the middle of a wide opening. Its sum does not depend on the area (Parseval).

    Notes
    -----
    U is T with each frequency f turned by -pi lambda L f^2 (Goodman, Introduction to Fourier Optics, section 4.2).
    """
    across, down = (
        np.exp(-1j * math.pi * a * f**2).astype(np.complex64) for a, f in zip(area, grid.frequencies(), strict=True)
    )
    turn = down * across
    return _light(grid, grid.spectrum * turn.real, grid.spectrum * turn.imag)


def band_intensity(grid: FresnelGrid, areas: Sequence[tuple[float, float]] | Floats, shares: Floats) -> Singles:
    """Diffract an opening by a band of white light: the few fringes along its edges that are left.

    Parameters
    ----------
    grid : FresnelGrid
        Made for these Fresnel areas.
    areas : array_like, shape (K, 2)
        lambda L in x and in y, mm^2, of the band's wavelengths: of one sign in x, of one in y, and in one proportion.
    shares : ndarray, shape (K,)
        Their parts of the light, which sum to 1.

    Returns
    -------
    ndarray, shape (Ny, Nx), float32
        1 in the middle of a wide opening.

    Notes
    -----
    Far fringes are ripples of the wave that passed the opening, and so its mean over the band holds the mean of
    their light: one transform serves a band. What it does not hold is the light of waves whose mean over the band is 0,
    far from the edge and faint: some per cent of the light in the shadow. Against the sum of its colours' intensities
    a band a sixth of its wavelength wide errs by 1e-3 rms along the border and by 0.02 at worst, deep in corners.
    Fringes end between `FADE`, and where the grid can hold no more of them.
    """
    real, imaginary, _ = _wave(grid, areas, shares)
    return _light(grid, real, imaginary)


def band_pattern(
    grid: FresnelGrid, areas: Sequence[tuple[float, float]] | Floats, shares: Floats, window: Box
) -> tuple[Singles, Box]:
    """Diffract an opening by a band of white light and keep a part of it: `crop` of `band_intensity`.

    What is not kept is not transformed back.

    Parameters
    ----------
    grid, areas, shares
        As in `band_intensity`.
    window
        As in `crop`.

    Returns
    -------
    ndarray, shape (Ky, Kx), float32, and Box
        What `crop` returns.
    """
    real, imaginary, light = _wave(grid, areas, shares)
    (left, right), (bottom, top) = ranges = _ranges(grid, window)
    # the light of all of it by Parseval: most is not there to be summed
    kept = np.ascontiguousarray(_light(grid, real, imaginary, (bottom, top))[:, left:right])
    return kept, _given_back(grid, kept, light, ranges)


def _wave(
    grid: FresnelGrid, areas: Sequence[tuple[float, float]] | Floats, shares: Floats
) -> tuple[Waves, Waves, float]:
    """Return a band's mean wave, its frequencies times the turn's real and imaginary parts, and the sum of its light.

    The opening is real and the turn even, so both parts are spectra of something real; they end where all are 0.
    """
    pairs = np.asarray(areas, dtype=np.float64)
    middle = shares @ pairs
    # each turn is that of the first in its row and that of its column in the first row, for all colours at once
    ratios, parts = _fewer(pairs[:, 0] / middle[0], shares)
    steps = np.arange(TURN_STEPS) / _TO_STEP
    rates = -1j * math.pi * ratios[:, None]
    table = np.empty(TURN_STEPS**2, dtype=np.complex64)
    sum_turns(parts[:, None] * np.exp(rates * (TURN_STEPS * steps)), np.exp(rates * steps), table)
    # a frequency is told by f^2 times the mean area, up to the end of the fade
    across, down = (f.ravel() ** 2 for f in grid.frequencies())
    area_x, area_y = np.abs(middle).tolist()
    count = int(np.searchsorted(area_x * across, _END))
    # a grid that pixels or samples limit ends before that: softly, or edges would ring of its own
    finest = 0.5 / grid.step
    ends = (FINEST_PART * finest, finest)
    if finest**2 * min(area_x, area_y) >= _END / FINEST_PART**2:
        ends = (math.inf, math.inf)
    turned = np.empty((2, len(down), count), dtype=np.complex64)
    light = turn_frequencies(
        grid.spectrum, across[:count], down, area_x, area_y, math.copysign(1.0, middle[0] * middle[1]), ends, table,
        _fades(), _TO_STEP, turned,
    )  # fmt: skip
    return turned[0], turned[1], light / math.prod(grid.shape)


def _fewer(ratios: Floats, shares: Floats) -> tuple[Floats, Floats]:
    """Join colours whose turns hardly part before the end of the fade, each group at its mean."""
    width = ALIKE / (math.pi * _END)
    group = ((ratios - ratios.min()) / width).astype(np.intp)
    parts: Floats = np.bincount(group, shares).astype(np.float64)
    held = parts > 0.0
    return np.bincount(group, shares * ratios)[held] / parts[held], parts[held]


@lru_cache(maxsize=1)
def _fades() -> Singles:
    """Return what is left of fringes at the steps of `_TO_STEP`."""
    return ending(np.sqrt(2.0 * np.arange(TURN_STEPS**2) / _TO_STEP), *FADE).astype(np.float32)


def _light(grid: FresnelGrid, real: Waves, imaginary: Waves, rows: tuple[int, int] | None = None) -> Singles:
    """Return the light of a wave, its rows from the first to before the last; as `_wave` has its parts."""
    parts = [
        np.fft.irfft(np.fft.ifft(part, axis=0)[slice(*rows) if rows else slice(None)], grid.shape[1])
        for part in (real, imaginary)
    ]
    return np.asarray(parts[0] * parts[0] + parts[1] * parts[1], dtype=np.float32)


def crop(grid: FresnelGrid, pattern: Singles, window: Box) -> tuple[Singles, Box]:
    """Keep a part of a pattern, with all the light of the opening.

    Parameters
    ----------
    grid : FresnelGrid
    pattern : ndarray, shape (Ny, Nx)
    window : Box
        The part to keep.

    Returns
    -------
    pattern : ndarray, shape (Ky, Kx), float32
        0 along its border.
    box : Box
        What was kept.
    """
    (left, right), (bottom, top) = ranges = _ranges(grid, window)
    kept = pattern[bottom:top, left:right].copy()
    return kept, _given_back(grid, kept, float(pattern.sum(dtype=np.float64)), ranges)


def _ranges(grid: FresnelGrid, window: Box) -> Ranges:
    """Return the first sample of a window and the one after its last, in x and in y."""
    found = []
    for (low, high), at in zip(window, grid.at, strict=True):
        first, last = (round((end - at[0]) / grid.step + 0.5) for end in (low, high))
        found.append((max(first, 0), min(last, len(at))))
    return found[0], found[1]


def _given_back(grid: FresnelGrid, kept: Singles, light: float, ranges: Ranges) -> Box:
    """Give the kept part of a pattern, in place, all its light and a dark border; return where it lies."""
    # what lost fringes took is given back; of a whole opening also what lies beyond, and what its border loses
    total = float(kept[1:-1, 1:-1].sum(dtype=np.float64)) if grid.whole else light
    kept *= np.float32(grid.light / max(total, 1e-30))
    kept[0], kept[-1], kept[:, 0], kept[:, -1] = 0.0, 0.0, 0.0, 0.0
    box = [
        (float(at[a]) - 0.5 * grid.step, float(at[b - 1]) + 0.5 * grid.step)
        for at, (a, b) in zip(grid.at, ranges, strict=True)
    ]
    return box[0], box[1]


def halved(pattern: Singles, box: Box, times: tuple[int, int]) -> tuple[Singles, Box]:
    """Halve a pattern's resolution by means over neighbours.

    Parameters
    ----------
    pattern : ndarray, shape (Ky, Kx)
        0 along its border.
    box : Box
        Where it lies.
    times : tuple of int
        How often, in x and in y.

    Returns
    -------
    pattern : ndarray, float32
        0 along its border.
    box : Box
        A little larger than it was.
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
