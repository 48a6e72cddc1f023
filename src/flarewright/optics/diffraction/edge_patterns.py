"""Fresnel patterns of an iris whose blades are long compared to its fringes: tables of edges and corners for all sizes.

White light leaves a few fringes along an edge (`ringing.FADE`), so the pattern depends only on the border within
`REACH` scales s = sqrt(lambda L / 2). Deep inside, the pattern is 1; along a blade it depends on the distance from the
border; at a corner, on two coordinates. In units of s both tables are the same for every ghost, colour and light,
which differ only in s. The effect of a blade's curvature is computed at a few values of s and is linear between them.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ...kernels.diffraction.corner_table import average_corner
from ...typing import Floats, Pixels
from ..pupil.blade_form import BladeForm, to_corner
from ..pupil.iris import coverage, softened
from .fft_size import fast_size
from .fresnel import FADE, REACH, ending
from .table_blocks import TableBlocks

CORNER_SAMPLES = 16
"""Samples per s of the table around a corner."""

PROFILE_SAMPLES = 32
"""Samples per s of the profile across an edge."""

EDGE_SAMPLES = 256
"""Samples per s of the profile as the kernel reads it, by nearest neighbour: error 3e-3 at worst, 5e-4 rms."""

COLOR_STEP = 0.01
"""Step of ln s for averages over a band of colours."""

SPREADS_AN_OCTAVE, PIXELS_AN_OCTAVE, SCALES_AN_OCTAVE = 8, 4, 4
"""Quantization of band spreads, pixel sizes and, for curved blades, s: steps per octave."""

NEARLY_STRAIGHT = 2e-3
"""s over the radius of curvature below which an octave of s shares tables: error 2e-3 at worst, 3e-4 rms."""

SMALL_SPREAD = 0.01
"""Below this spread half as many steps per octave have no larger error than all steps have above it."""

LEAST_SPREAD, LEAST_PIXEL = 3e-3, 0.1
"""Smaller values have no visible effect."""

KEPT_AVERAGES, KEPT_BANDS = 384, 96
"""Cache sizes in tables of a few hundred kB each: a zoom's ghosts use some 300 repeatedly."""

BLOCK = 34_000_000
"""Values in a block of memory of the averaged tables: about as many as the cache holds."""

# samples per s of the wave: the finest fringes in the table have a period of 2.25 samples
_WAVE_SAMPLES = 8
# straight blades are alike at every s: an arbitrary offset, in s
_STRAIGHT_OFFSET = 64.0

# a ghost's crossings have different tables, which the kernel reads from one array
_BLOCKS = TableBlocks(BLOCK)


@dataclass(frozen=True)
class EdgeTables:
    """The pattern of an iris in units of s.

    Attributes
    ----------
    profile : ndarray, shape (P,), float32
        Across an edge, at (k - P // 2) / PROFILE_SAMPLES from the border, outside is positive; 1 far inside, 0 far
        outside.
    corner : ndarray, shape (Y, X), float32
        Around a corner, at (k - first) / CORNER_SAMPLES along its direction and m / CORNER_SAMPLES across it. For
        curved blades, a sample has the same distances to the tangents there as to the arcs. Empty for a round opening.
    first : int
        Column of the corner.
    excess : tuple of float
        Light of the pattern minus that of the opening: per s of border, its first moment, and at half a corner.
    values : ndarray, shape (V,), float32
        Tables for the kernel, from `laid_out`: the corner's table row by row, then the profile with `EDGE_SAMPLES` per
        s, and zeros. The kernel interpolates edges like corners and multiplies these zeros by 0.
    """

    profile: Pixels
    corner: Pixels
    first: int
    excess: tuple[float, float, float] = (0.0, 0.0, 0.0)
    values: Pixels = field(default_factory=lambda: np.zeros(0, dtype=np.float32), repr=False)

    def laid_out(self) -> EdgeTables:
        """Return the same tables with `values`; the corner becomes a view of them: hundreds stay in the cache."""
        count = len(self.profile)
        fine = np.linspace(0.0, count - 1.0, self.edge_count)
        profile = np.interp(fine, np.arange(count), self.profile).astype(np.float32)
        beyond = np.zeros(self.corner.shape[1] + 2, dtype=np.float32)
        values = _BLOCKS.joined([self.corner, profile, beyond])
        return replace(self, corner=values[: self.corner.size].reshape(self.corner.shape), values=values)

    @property
    def edge_count(self) -> int:
        """Number of samples of the profile in `values`."""
        return (len(self.profile) - 1) * (EDGE_SAMPLES // PROFILE_SAMPLES) + 1


@dataclass(frozen=True)
class Corner:
    """The parameters of an iris' tables, independent of its size: lengths in radii of the circle within its blades.

    Attributes
    ----------
    gamma, blunt : float
        Angles between a corner's direction and the normals of its blades, in their middles and at the corner; 0 for a
        round opening.
    curvature : float
    scale : float
        s; 0 for straight blades, which are alike at every s.
    """

    gamma: float
    blunt: float
    curvature: float
    scale: float


def corner_of(form: BladeForm, scale: float) -> Corner:
    """Return the rounded table parameters of an iris and an s in mm, so that similar ones share tables."""
    if form.curvature == 0.0:
        return Corner(form.gamma, form.gamma, 0.0, 0.0)
    steps = 1 if form.curvature * scale < NEARLY_STRAIGHT else SCALES_AN_OCTAVE
    node = 2.0 ** (round(steps * math.log2(scale / form.offset)) / steps)
    return Corner(form.gamma, form.gamma - form.bend, form.curvature * form.offset, node)


def edge_tables(corner: Corner, margin: float = REACH) -> EdgeTables:
    """Compute the tables of an iris for one colour.

    Parameters
    ----------
    corner : Corner
    margin : float
        Distance from the border that the tables cover, in s; at least `REACH`.

    Notes
    -----
    The Fresnel integral as in `fresnel.fresnel_intensity`, with lambda L = 2 s^2, over squares so large that their
    borders do not affect the tables. Tables of curved blades are linear in s between powers of two: the effect of
    curvature is of the order of fringes over radii, and the error is of its square.
    """
    if (between := _between_nodes(corner, lambda node: edge_tables(node, margin))) is not None:
        return between
    offset, curvature = (
        (1.0 / corner.scale, corner.curvature * corner.scale) if corner.scale else (_STRAIGHT_OFFSET, 0.0)
    )
    return _tables(corner.gamma, corner.blunt, offset, curvature, margin)


def _between_nodes(corner: Corner, tables_of: Callable[[Corner], EdgeTables]) -> EdgeTables | None:
    """Interpolate tables, or averages of them, between the powers of two around a corner's s; None if it is at one."""
    if corner.scale == 0.0 or math.frexp(corner.scale)[0] == 0.5:
        return None
    start = 2.0 ** math.floor(math.log2(corner.scale))
    low, high = (tables_of(replace(corner, scale=scale)) for scale in (start, 2.0 * start))
    share = corner.scale / start - 1.0

    def mixed(one: Pixels, other: Pixels) -> Pixels:
        return np.float32(1.0 - share) * one + np.float32(share) * other

    border, moment, at_corner = ((1.0 - share) * a + share * b for a, b in zip(low.excess, high.excess, strict=True))
    return EdgeTables(
        mixed(low.profile, high.profile), mixed(low.corner, high.corner), low.first, (border, moment, at_corner)
    )


@lru_cache(maxsize=32)
def _tables(gamma: float, blunt: float, offset: float, curvature: float, margin: float) -> EdgeTables:
    """Compute the tables of blades with offset and curvature in units of s."""
    profile = _profile(offset, curvature, margin)
    if gamma == 0.0:
        return EdgeTables(profile, np.zeros((0, 0), dtype=np.float32), 0)
    # inside a sharp corner both edges stay near over a long distance
    inwards = math.ceil(margin / math.cos(max(blunt, 0.0)) * CORNER_SAMPLES)
    sideways = math.ceil(margin * CORNER_SAMPLES)
    at = _places(max(inwards, sideways) / CORNER_SAMPLES)
    normals = np.array([[math.cos(gamma), side * math.sin(gamma)] for side in (1.0, -1.0)])
    spectrum = _spectrum(normals, (offset, curvature), at + to_corner(offset, curvature, gamma), at)
    finer = CORNER_SAMPLES // _WAVE_SAMPLES
    # the first sample stays in place, so one of the refined samples lies on the corner; the table is even about its
    # first row, and reads one row below it where its blades are curved
    middle = (len(at) - 1) * finer // 2
    wave = _upsampled(_upsampled(spectrum, finer, 0)[middle - 1 :], finer, 1)
    if curvature == 0.0:
        kept = wave[1 : sideways + 2, middle - inwards : middle + sideways + 1]
        return EdgeTables(profile, np.asarray(kept.real**2 + kept.imag**2, dtype=np.float32), inwards)
    along, across = np.arange(-inwards, sideways + 1) / CORNER_SAMPLES, np.arange(sideways + 1) / CORNER_SAMPLES
    x, y = _straightened(along, across[:, None], gamma, blunt, offset, curvature)
    bent = _interpolated(wave.real**2 + wave.imag**2, y * CORNER_SAMPLES + 1.0, x * CORNER_SAMPLES + middle)
    return EdgeTables(profile, np.asarray(bent, dtype=np.float32), inwards)


def _interpolated(values: Floats, row: Floats, column: Floats) -> Floats:
    """Interpolate a table by Lagrange's cubics at points in its interior."""
    r, c = row.astype(np.intp), column.astype(np.intp)
    down, across = (_cubic(place - low) for place, low in ((row, r), (column, c)))
    found = np.zeros(r.shape)
    for m, share in enumerate(down):
        for n, part in enumerate(across):
            found += share * part * values[r + m - 1, c + n - 1]
    return found


def _cubic(t: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Return the weights of Lagrange's cubic through four neighbours at t between the second and the third."""
    a, b, c, d = t + 1.0, t, t - 1.0, t - 2.0
    return -b * c * d / 6.0, a * c * d / 2.0, -a * b * d / 2.0, a * b * c / 6.0


def _straightened(
    along: Floats, across: Floats, gamma: float, blunt: float, offset: float, curvature: float
) -> tuple[Floats, Floats]:
    """Return points near a corner of arcs: their distances to the arcs are those of the given points to the tangents.

    In these coordinates the borders of all curvatures coincide. Points are relative to the corner; each is an
    intersection of two circles of equal radii.
    """
    radius, back = 1.0 / curvature, offset - 1.0 / curvature
    near, other = (radius + along * math.cos(blunt) + side * across * math.sin(blunt) for side in (1.0, -1.0))
    aside = back * math.sin(gamma)
    y = (near**2 - other**2) / (-4.0 * aside)
    x = back * math.cos(gamma) + np.sqrt(np.maximum(near**2 - (y - aside) ** 2, 0.0))
    return np.asarray(x - to_corner(offset, curvature, gamma)), np.asarray(y)


def _profile(offset: float, curvature: float, margin: float) -> Pixels:
    """Return the pattern across the middle of a blade."""
    at = _places(margin)
    spectrum = _spectrum(np.array([[1.0, 0.0]]), (offset, curvature), at + offset, at)
    # the row at height 0 lies half a sample from the nearest rows
    down = np.exp(1j * math.pi * np.fft.fftfreq(len(at)) * (len(at) - 1))
    finer = PROFILE_SAMPLES // _WAVE_SAMPLES
    row = _upsampled((spectrum * down[:, None]).mean(axis=0), finer, 0)
    middle, reach = (len(at) - 1) * finer // 2, math.ceil(margin * PROFILE_SAMPLES)
    kept = row[middle - reach : middle + reach + 1]
    return np.asarray(kept.real**2 + kept.imag**2, dtype=np.float32)


def _places(half: float) -> Floats:
    """Return the sample positions of a square for a table of this half side, symmetric about 0, in s."""
    count = fast_size(2 * math.ceil((half + REACH + 0.5) * _WAVE_SAMPLES), even=True)
    return np.asarray((np.arange(count) - 0.5 * (count - 1)) / _WAVE_SAMPLES)


def _spectrum(normals: Floats, blade: tuple[float, float], x: Floats, y: Floats) -> NDArray[np.complex128]:
    """Return the transform of the wave behind blades of these normals, one offset and one curvature, at x, y in s."""
    edges = np.column_stack([normals, np.tile(blade, (len(normals), 1))])
    amplitude = softened(coverage(edges, x, y[:, None], 2.0 / _WAVE_SAMPLES))
    f = np.fft.fftfreq(len(x), 1.0 / _WAVE_SAMPLES)
    squared = f**2 + f[:, None] ** 2
    # undo the triangle filter of the border, two samples wide: sinc^2 of the frequencies across it
    soft = np.sinc(np.minimum(np.sqrt(squared) / _WAVE_SAMPLES, 0.5)) ** 2
    turn = np.exp(-2j * math.pi * squared) * (ending(2.0 * np.sqrt(squared), *FADE) / soft)
    return np.asarray(np.fft.fft2(amplitude) * turn)


def _upsampled(spectrum: NDArray[np.complex128], finer: int, axis: int) -> NDArray[np.complex128]:
    """Transform an axis back to `finer` times as many samples; exact, because the frequencies are band-limited."""
    count = spectrum.shape[axis]
    shape = list(spectrum.shape)
    shape[axis] = finer * count
    wide = np.zeros(shape, dtype=spectrum.dtype)
    source, target = np.moveaxis(spectrum, axis, 0), np.moveaxis(wide, axis, 0)
    target[: count // 2], target[-(count // 2) :] = source[: count // 2], source[count // 2 :]
    return np.asarray(finer * np.fft.ifft(wide, axis=axis))


# not cached: a lasting table would keep its block of memory
def sharp_tables() -> EdgeTables:
    """Return tables of the geometric opening, with a border one sample of the corner's table wide; for any s."""
    across = np.arange(-PROFILE_SAMPLES, PROFILE_SAMPLES + 1) / PROFILE_SAMPLES
    profile = np.clip(0.5 - across * CORNER_SAMPLES, 0.0, 1.0)
    return EdgeTables(profile.astype(np.float32), np.zeros((0, 0), dtype=np.float32), 0).laid_out()


def averaged(form: BladeForm, scale: float, spread: float, pixel: float = 0.0) -> EdgeTables:
    """Return the tables averaged over a band of colours and over a pixel.

    Parameters
    ----------
    form : BladeForm
    scale : float
        s, mm: the root of its mean square in the band.
    spread : float
        Standard deviation of ln s over the band.
    pixel : float
        Side of a pixel in the stop, in s.

    Returns
    -------
    EdgeTables
        Shared by similar arguments (`SPREADS_AN_OCTAVE` and the other steps). For a band, the spread alone determines
        how its fringes fade.
    """
    steps = SPREADS_AN_OCTAVE // 2 if spread < SMALL_SPREAD else SPREADS_AN_OCTAVE
    width = -math.inf if spread < LEAST_SPREAD else round(steps * math.log2(spread)) / steps
    step = -math.inf if pixel < LEAST_PIXEL else round(PIXELS_AN_OCTAVE * math.log2(pixel))
    side = 2.0 ** (step / PIXELS_AN_OCTAVE)
    margin = 0.5 * math.ceil(2.0 * (REACH + 0.5 + 0.5 * side))
    halves = _half_width(side * PROFILE_SAMPLES), _half_width(side * CORNER_SAMPLES)
    return _averaged(corner_of(form, scale), 2.0**width, margin, *halves)


@lru_cache(maxsize=KEPT_AVERAGES)
def _averaged(corner: Corner, spread: float, margin: float, half_profile: int, half_corner: int) -> EdgeTables:
    """Average tables over a band and a pixel, of 2 k + 1 samples of the profile and of the corner's table."""
    band = _band(corner, spread, margin)
    profile = _box_averaged(band.profile, half_profile)
    profile[0], profile[-1] = 1.0, 0.0
    around = _box_averaged_corner(band.corner, band.first, half_corner)
    return replace(band, profile=profile, corner=around).laid_out()


@lru_cache(maxsize=KEPT_BANDS)
def _band(corner: Corner, spread: float, margin: float) -> EdgeTables:
    """Average tables over a band with a symmetric weight in ln s."""
    # two averages serve an octave
    if (between := _between_nodes(corner, lambda node: _band(node, spread, margin))) is not None:
        return between
    base = edge_tables(corner, margin)
    if spread == 0.0:
        return replace(base, excess=_excess(corner, base))
    parts = math.ceil(math.sqrt(6.0) * spread / COLOR_STEP)
    at = np.arange(-parts, parts + 1) / (parts + 1.0)
    shares = (1.0 - np.abs(at)) / (1.0 - np.abs(at)).sum()
    ratios = np.exp(at * spread / math.sqrt(float(shares @ at**2)))
    ratios /= math.sqrt(float(shares @ ratios**2))
    # the profile is a row of such a table
    pair, across = np.empty((2, len(base.profile)), dtype=np.float32), np.tile(base.profile, (2, 1))
    average_corner(across, len(base.profile) // 2, 1.0 / ratios, shares, 0, pair)
    around = np.empty_like(base.corner)
    if around.size:
        average_corner(base.corner, base.first, 1.0 / ratios, shares, 0, around)
    tables = EdgeTables(pair[0].copy(), around, base.first)
    return replace(tables, excess=_excess(corner, tables))


def gain(form: BladeForm, scale: float, tables: EdgeTables) -> float:
    """Return the light of the opening over that of its pattern, to restore the light of omitted fringes.

    Parameters
    ----------
    form : BladeForm
    scale : float
        s, mm.
    tables : EdgeTables
        From `averaged`.
    """
    border, moment, corner = tables.excess
    half = form.half_length / scale * (border + form.curvature * scale * moment) + corner
    open_area = form.area / scale**2
    return open_area / (open_area + form.halves * half)


def _box_averaged(profile: Pixels, side: int) -> Pixels:
    """Average a profile over 2 `side` + 1 samples; its ends continue."""
    sums = np.cumsum(np.pad(profile, (side + 1, side), mode="edge"), dtype=np.float64)
    return np.asarray((sums[2 * side + 1 :] - sums[: len(profile)]) / (2 * side + 1), dtype=np.float32)


def _box_averaged_corner(corner: Pixels, first: int, side: int) -> Pixels:
    """Average a corner's table over squares of 2 `side` + 1 samples; it is even about its first row."""
    if side < 1 or not corner.size:
        return corner
    averaged = np.empty_like(corner)
    average_corner(corner, first, np.ones(1), np.ones(1), side, averaged)
    return averaged


def _half_width(width: float) -> int:
    """Return k of the odd number of samples, 2 k + 1, that is nearest to a width."""
    return max(0, round(0.5 * (width - 1.0)))


def _excess(corner: Corner, tables: EdgeTables) -> tuple[float, float, float]:
    """Return the light of a pattern minus that of the opening (`EdgeTables.excess`)."""
    count = len(tables.profile)
    u = (np.arange(count) - count // 2) / PROFILE_SAMPLES
    more = (tables.profile - np.where(u < 0.0, 1.0, np.where(u > 0.0, 0.0, 0.5))) / PROFILE_SAMPLES
    border, moment, around = float(more.sum()), float((more * u).sum()), 0.0
    if tables.corner.size:
        rows, columns = tables.corner.shape
        along, across = (np.arange(columns) - tables.first) / CORNER_SAMPLES, np.arange(rows) / CORNER_SAMPLES
        beyond = along * math.cos(corner.blunt) + across[:, None] * math.sin(corner.blunt)
        apart = tables.corner - np.interp(beyond, u, tables.profile)
        # the strips along two blades meet at the line between them
        around = math.tan(corner.blunt) * moment
        around += float(apart.sum() - 0.5 * apart[0].sum()) / CORNER_SAMPLES**2
    return border, moment, around
