"""Fresnel patterns of an iris whose blades are long beside its fringes: edges and corners, computed once for all.

White light leaves a few fringes along an edge (`ringing.FADE`), so a place of the pattern knows of the border within
`REACH` scales s = sqrt(lambda L / 2) only. Deep inside the pattern is 1; along a blade it is a function of the distance
from the border; around a corner one of two coordinates. In units of s both are the same for every ghost, colour and
light: s alone depends on them. What a blade's curvature adds is taken at a few values of s and is straight between.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .blade_form import BladeForm, to_corner
from .fft_size import fast_size
from .fresnel import FADE, REACH, ending
from .iris import coverage, softened

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]

CORNER_SAMPLES = 16
"""Samples per s of the table around a corner."""

PROFILE_SAMPLES = 32
"""Samples per s of the table across an edge."""

EDGE_SAMPLES = 256
"""Samples per s of that table as the kernel reads it: the nearest of them errs by 3e-3 at worst, 5e-4 rms."""

COLOR_STEP = 0.01
"""Steps of ln s in which a band of colours is averaged."""

SPREADS_AN_OCTAVE, PIXELS_AN_OCTAVE, SCALES_AN_OCTAVE = 8, 4, 4
"""How finely the spreads of bands, the sizes of pixels and, of curved blades, s are told apart."""

LEAST_SPREAD, LEAST_PIXEL = 3e-3, 0.1
"""What is smaller averages nothing that is seen."""

KEPT_AVERAGES, KEPT_BANDS = 384, 96
"""Tables that are kept, a few hundred kB each: a zoom's ghosts ask for some 300, again and again."""

# the finest fringes of the wave that are left turn in two of its samples and a quarter
_WAVE_SAMPLES = 8
# of straight blades every s is alike: any offset will do, in s
_FAR = 64.0

__all__ = [
    "CORNER_SAMPLES",
    "EDGE_SAMPLES",
    "PROFILE_SAMPLES",
    "EdgeTables",
    "averaged",
    "edge_tables",
    "gain",
    "sharp_tables",
]


@dataclass(frozen=True)
class EdgeTables:
    """The pattern of an iris in units of s.

    Attributes
    ----------
    profile : ndarray, shape (P,), float32
        Across an edge, at (k - P // 2) / PROFILE_SAMPLES from the border, outside above 0; 1 far inside, 0 far outside.
    corner : ndarray, shape (Y, X), float32
        Around a corner, at (k - first) / CORNER_SAMPLES along its direction and m / CORNER_SAMPLES beside it, of places
        that lie so from the tangents there as they do from curved blades. Empty for a round opening.
    first : int
        Column of the corner itself.
    excess : tuple of float
        What the pattern holds more than the opening: per s of border, its first moment, and at half a corner.
    values : ndarray, shape (V,), float32
        As the kernel reads them, once they are `laid_out`: the corner's table row by row, after it the profile,
        `EDGE_SAMPLES` per s, and zeros, for an edge is looked up as a corner is, between neighbours that count for
        nothing but have to be there.
    """

    profile: Singles
    corner: Singles
    first: int
    excess: tuple[float, float, float] = (0.0, 0.0, 0.0)
    values: Singles = field(default_factory=lambda: np.zeros(0, dtype=np.float32), repr=False)

    def laid_out(self) -> EdgeTables:
        """Return the same tables with their `values`, of which the corner's is a part: hundreds of them are kept."""
        count = len(self.profile)
        fine = np.linspace(0.0, count - 1.0, self.edge_count)
        profile = np.interp(fine, np.arange(count), self.profile).astype(np.float32)
        beyond = np.zeros(self.corner.shape[1] + 2, dtype=np.float32)
        values = np.concatenate([self.corner.ravel(), profile, beyond])
        return replace(self, corner=values[: self.corner.size].reshape(self.corner.shape), values=values)

    @property
    def edge_count(self) -> int:
        """Samples of the profile in `values`."""
        return (len(self.profile) - 1) * (EDGE_SAMPLES // PROFILE_SAMPLES) + 1


@dataclass(frozen=True)
class Corner:
    """What the tables of an iris depend on, whatever its size: in radii of the circle within its blades.

    Attributes
    ----------
    gamma, blunt : float
        Angles between a corner's direction and the normals of its blades, in their middles and at the corner; 0 for a
        round opening.
    curvature : float
    scale : float
        s; 0 where the blades are straight, for which all are alike.
    """

    gamma: float
    blunt: float
    curvature: float
    scale: float


def corner_of(form: BladeForm, scale: float) -> Corner:
    """Round an iris and an s in mm to those whose tables it shares."""
    if form.curvature == 0.0:
        return Corner(form.gamma, form.gamma, 0.0, 0.0)
    node = 2.0 ** (round(SCALES_AN_OCTAVE * math.log2(scale / form.offset)) / SCALES_AN_OCTAVE)
    return Corner(form.gamma, form.gamma - form.bend, form.curvature * form.offset, node)


def edge_tables(corner: Corner, margin: float = REACH) -> EdgeTables:
    """Diffract an edge and a corner of an iris by one colour.

    Parameters
    ----------
    corner : Corner
    margin : float
        How far from the border the tables reach, in s; `REACH` at least.

    Returns
    -------
    EdgeTables

    Notes
    -----
    The Fresnel integral as in `fresnel.fresnel_intensity`, with lambda L = 2 s^2, over squares so wide that their
    borders do not come into what is kept. The tables of curved blades are straight in s between powers of two: what a
    curvature adds is of the order of fringes over radii, and this errs by the square of that.
    """
    if corner.scale == 0.0:
        return _tables(corner.gamma, corner.blunt, _FAR, 0.0, margin)
    octave = math.floor(math.log2(corner.scale))
    nodes = 2.0**octave, 2.0 ** (octave + 1)
    share = np.float32((corner.scale - nodes[0]) / (nodes[1] - nodes[0]))
    low, high = (_tables(corner.gamma, corner.blunt, 1.0 / node, corner.curvature * node, margin) for node in nodes)
    return EdgeTables(
        (1 - share) * low.profile + share * high.profile, (1 - share) * low.corner + share * high.corner, low.first
    )


@lru_cache(maxsize=32)
def _tables(gamma: float, blunt: float, offset: float, curvature: float, margin: float) -> EdgeTables:
    """Compute the tables of blades whose offset and curvature are in units of s."""
    profile = _profile(offset, curvature, margin)
    if gamma == 0.0:
        return EdgeTables(profile, np.zeros((0, 0), dtype=np.float32), 0)
    # inside a sharp corner both edges are near until far from it
    inwards = math.ceil(margin / math.cos(max(blunt, 0.0)) * CORNER_SAMPLES)
    sideways = math.ceil(margin * CORNER_SAMPLES)
    at = _places(max(inwards, sideways) / CORNER_SAMPLES)
    normals = np.array([[math.cos(gamma), side * math.sin(gamma)] for side in (1.0, -1.0)])
    spectrum = _spectrum(normals, (offset, curvature), at + to_corner(offset, curvature, gamma), at)
    finer = CORNER_SAMPLES // _WAVE_SAMPLES
    wave = _refined(_refined(spectrum, finer, 0), finer, 1)
    # the first sample stays where it is, so one of the finer ones lies on the corner
    middle = (len(at) - 1) * finer // 2
    if curvature == 0.0:
        kept = wave[middle : middle + sideways + 1, middle - inwards : middle + sideways + 1]
        return EdgeTables(profile, np.asarray(kept.real**2 + kept.imag**2, dtype=np.float32), inwards)
    along, across = np.arange(-inwards, sideways + 1) / CORNER_SAMPLES, np.arange(sideways + 1) / CORNER_SAMPLES
    x, y = _unbent(along, across[:, None], gamma, blunt, offset, curvature)
    bent = _between(wave.real**2 + wave.imag**2, y * CORNER_SAMPLES + middle, x * CORNER_SAMPLES + middle)
    return EdgeTables(profile, np.asarray(bent, dtype=np.float32), inwards)


def _between(values: Floats, row: Floats, column: Floats) -> Floats:
    """Interpolate a table by Lagrange's cubics, at places well within it."""
    r, c = row.astype(np.intp), column.astype(np.intp)
    down, across = (_cubic(place - low) for place, low in ((row, r), (column, c)))
    found = np.zeros(r.shape)
    for m, share in enumerate(down):
        for n, part in enumerate(across):
            found += share * part * values[r + m - 1, c + n - 1]
    return found


def _cubic(t: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Weights of Lagrange's cubic through four neighbours at t between the second and the third."""
    a, b, c, d = t + 1.0, t, t - 1.0, t - 2.0
    return -b * c * d / 6.0, a * c * d / 2.0, -a * b * d / 2.0, a * b * c / 6.0


def _unbent(
    along: Floats, across: Floats, gamma: float, blunt: float, offset: float, curvature: float
) -> tuple[Floats, Floats]:
    """Find the places around a corner of arcs that lie as far from both as these do from its tangents.

    In such coordinates the borders of all curvatures run alike. Places are seen from the corner; between two circles of
    equal radii they follow from the distances to both.
    """
    radius, back = 1.0 / curvature, offset - 1.0 / curvature
    near, other = (radius + along * math.cos(blunt) + side * across * math.sin(blunt) for side in (1.0, -1.0))
    aside = back * math.sin(gamma)
    y = (near**2 - other**2) / (-4.0 * aside)
    x = back * math.cos(gamma) + np.sqrt(np.maximum(near**2 - (y - aside) ** 2, 0.0))
    return np.asarray(x - to_corner(offset, curvature, gamma)), np.asarray(y)


def _profile(offset: float, curvature: float, margin: float) -> Singles:
    """Pattern across the middle of a blade."""
    at = _places(margin)
    spectrum = _spectrum(np.array([[1.0, 0.0]]), (offset, curvature), at + offset, at)
    # at height 0, half a sample from the nearest rows
    down = np.exp(1j * math.pi * np.fft.fftfreq(len(at)) * (len(at) - 1))
    finer = PROFILE_SAMPLES // _WAVE_SAMPLES
    row = _refined((spectrum * down[:, None]).mean(axis=0), finer, 0)
    middle, reach = (len(at) - 1) * finer // 2, math.ceil(margin * PROFILE_SAMPLES)
    kept = row[middle - reach : middle + reach + 1]
    return np.asarray(kept.real**2 + kept.imag**2, dtype=np.float32)


def _places(half: float) -> Floats:
    """Place samples over the square that a table of half this side needs, symmetric about 0, in s."""
    count = fast_size(2 * math.ceil((half + REACH + 0.5) * _WAVE_SAMPLES), even=True)
    return np.asarray((np.arange(count) - 0.5 * (count - 1)) / _WAVE_SAMPLES)


def _spectrum(normals: Floats, blade: tuple[float, float], x: Floats, y: Floats) -> NDArray[np.complex128]:
    """Transform of the wave behind blades of these normals, of one offset and curvature, at x and y in units of s."""
    edges = np.column_stack([normals, np.tile(blade, (len(normals), 1))])
    amplitude = softened(coverage(edges, x, y[:, None], 2.0 / _WAVE_SAMPLES))
    f = np.fft.fftfreq(len(x), 1.0 / _WAVE_SAMPLES)
    squared = f**2 + f[:, None] ** 2
    # the border was averaged over a triangle two samples wide, which took sinc^2 of the frequencies across it
    soft = np.sinc(np.minimum(np.sqrt(squared) / _WAVE_SAMPLES, 0.5)) ** 2
    turn = np.exp(-2j * math.pi * squared) * (ending(2.0 * np.sqrt(squared), *FADE) / soft)
    return np.asarray(np.fft.fft2(amplitude) * turn)


def _refined(spectrum: NDArray[np.complex128], finer: int, axis: int) -> NDArray[np.complex128]:
    """Transform an axis back to samples so many times finer: frequencies end below the grid's, so it is exact."""
    count = spectrum.shape[axis]
    shape = list(spectrum.shape)
    shape[axis] = finer * count
    wide = np.zeros(shape, dtype=spectrum.dtype)
    source, target = np.moveaxis(spectrum, axis, 0), np.moveaxis(wide, axis, 0)
    target[: count // 2], target[-(count // 2) :] = source[: count // 2], source[count // 2 :]
    return np.asarray(finer * np.fft.ifft(wide, axis=axis))


@lru_cache(maxsize=1)
def sharp_tables() -> EdgeTables:
    """Return the opening itself, its border a sample of a corner's table wide; its s may be of any length."""
    across = np.arange(-PROFILE_SAMPLES, PROFILE_SAMPLES + 1) / PROFILE_SAMPLES
    profile = np.clip(0.5 - across * CORNER_SAMPLES, 0.0, 1.0)
    return EdgeTables(profile.astype(np.float32), np.zeros((0, 0), dtype=np.float32), 0).laid_out()


def averaged(form: BladeForm, scale: float, spread: float, pixel: float = 0.0) -> EdgeTables:
    """Average the patterns of a band of colours, and each place over a pixel.

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
        Shared by all that are as alike as `SPREADS_AN_OCTAVE` and so on say: of a band the spread alone tells how its
        fringes fade.
    """
    width = -math.inf if spread < LEAST_SPREAD else round(SPREADS_AN_OCTAVE * math.log2(spread))
    side = -math.inf if pixel < LEAST_PIXEL else round(PIXELS_AN_OCTAVE * math.log2(pixel))
    return _averaged(corner_of(form, scale), 2.0 ** (width / SPREADS_AN_OCTAVE), 2.0 ** (side / PIXELS_AN_OCTAVE))


@lru_cache(maxsize=KEPT_AVERAGES)
def _averaged(corner: Corner, spread: float, pixel: float) -> EdgeTables:
    """Average a band over a pixel."""
    band = _band(corner, spread, 0.5 * math.ceil(2.0 * (REACH + 0.5 + 0.5 * pixel)))
    profile = _boxed(band.profile, 0, pixel * PROFILE_SAMPLES).astype(np.float32)
    profile[0], profile[-1] = 1.0, 0.0
    return replace(band, profile=profile, corner=_boxed_corner(band.corner, pixel * CORNER_SAMPLES)).laid_out()


@lru_cache(maxsize=KEPT_BANDS)
def _band(corner: Corner, spread: float, margin: float) -> EdgeTables:
    """Average a band whose light rises and falls evenly over ln s."""
    base = edge_tables(corner, margin)
    if spread == 0.0:
        return replace(base, excess=_excess(corner, base))
    parts = math.ceil(math.sqrt(6.0) * spread / COLOR_STEP)
    at = np.arange(-parts, parts + 1) / (parts + 1.0)
    shares = (1.0 - np.abs(at)) / (1.0 - np.abs(at)).sum()
    ratios = np.exp(at * spread / math.sqrt(float(shares @ at**2)))
    ratios /= math.sqrt(float(shares @ ratios**2))
    count = len(base.profile)
    across = np.arange(count) - count // 2
    profile, around = np.zeros(count), np.zeros_like(base.corner)
    for ratio, share in zip(ratios, shares, strict=True):
        profile += share * np.interp(across / ratio, across, base.profile)
        around += np.float32(share) * _scaled(base.corner, base.first, 1.0 / ratio)
    tables = EdgeTables(profile.astype(np.float32), around, base.first)
    return replace(tables, excess=_excess(corner, tables))


def _scaled(corner: Singles, first: int, ratio: float) -> Singles:
    """Look a corner's table up at places `ratio` times as far from it."""
    for axis, origin in ((0, 0), (1, first)):
        count = corner.shape[axis]
        if count == 0:
            return corner
        at = np.clip((np.arange(count) - origin) * ratio + origin, 0.0, count - 1.001)
        low = at.astype(np.intp)
        part = np.expand_dims((at - low).astype(np.float32), 1 - axis)
        corner = (1 - part) * corner.take(low, axis=axis) + part * corner.take(low + 1, axis=axis)
    return corner


def gain(form: BladeForm, scale: float, tables: EdgeTables) -> float:
    """Light of the opening over that of its pattern: the fringes that are left out took some.

    Parameters
    ----------
    form : BladeForm
    scale : float
        s, mm.
    tables : EdgeTables
        From `averaged`.

    Returns
    -------
    float
    """
    border, moment, corner = tables.excess
    half = form.half_length / scale * (border + form.curvature * scale * moment) + corner
    open_area = form.area / scale**2
    return open_area / (open_area + form.halves * half)


def _boxed_corner(corner: Singles, width: float) -> Singles:
    """Average a corner's table over squares; it is even about its first row."""
    if width < 2.0 or not corner.size:
        return corner
    whole = np.concatenate([corner[:0:-1], corner])
    return np.ascontiguousarray(_boxed(_boxed(whole, 0, width), 1, width)[len(corner) - 1 :], dtype=np.float32)


def _boxed(values: NDArray[Any], axis: int, width: float) -> Floats:
    """Average along an axis over an odd number of samples near `width`; the ends go on as they are."""
    side = round(0.5 * (width - 1.0))
    if side < 1:
        return np.asarray(values, dtype=np.float64)
    ends = [(0, 0)] * values.ndim
    ends[axis] = (side + 1, side)
    count, width = values.shape[axis], 2 * side + 1
    sums = np.moveaxis(np.cumsum(np.pad(values, ends, mode="edge"), axis=axis, dtype=np.float64), axis, 0)
    means: Floats = (sums[width : width + count] - sums[:count]) / width
    return np.moveaxis(means, 0, axis)


def _excess(corner: Corner, tables: EdgeTables) -> tuple[float, float, float]:
    """Compare the light of a pattern with that of the opening (`EdgeTables.excess`)."""
    count = len(tables.profile)
    u = (np.arange(count) - count // 2) / PROFILE_SAMPLES
    more = (tables.profile - np.where(u < 0.0, 1.0, np.where(u > 0.0, 0.0, 0.5))) / PROFILE_SAMPLES
    border, moment, around = float(more.sum()), float((more * u).sum()), 0.0
    if tables.corner.size:
        rows, columns = tables.corner.shape
        along, across = (np.arange(columns) - tables.first) / CORNER_SAMPLES, np.arange(rows) / CORNER_SAMPLES
        beyond = along * math.cos(corner.blunt) + across[:, None] * math.sin(corner.blunt)
        apart = tables.corner - np.interp(beyond, u, tables.profile)
        # strips along two blades end at the line between them
        around = math.tan(corner.blunt) * moment
        around += float(apart.sum() - 0.5 * apart[0].sum()) / CORNER_SAMPLES**2
    return border, moment, around
