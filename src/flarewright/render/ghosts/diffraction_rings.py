"""Rings inside ghosts: diffraction patterns of the iris, drawn instead of the sharp iris.

For every crossing of the stop with a lit edge, a pattern replaces the iris in the ghost
(`optics.diffraction.collins`). The pattern is averaged over the band of each drawn wavelength; an area light
spreads it together with its ghost. Ghosts without visible rings are drawn by the plain pass, with identical pixels.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from ...kernels.diffraction.fresnel import open_softly
from ...kernels.diffraction.ringing import StopPatterns, draw_ringing
from ...kernels.raster.stop_pattern import EDGE, FIRST
from ...kernels.tracing.iris_edge import reached_edges
from ...model import Light
from ...model.project.light import Lines, Spectrum
from ...optics.colour.spectrum import band_contents
from ...optics.diffraction.collins import StopToSensor, frft_fresnel_number, stop_to_sensor
from ...optics.diffraction.fresnel import (
    SHADOW,
    Box,
    FresnelGrid,
    band_pattern,
    crop,
    fresnel_grid,
    fresnel_intensity,
    halved_pattern,
)
from ...optics.diffraction.table_blocks import common_block
from ...optics.lens.paths import LightPath
from ...optics.pupil.blade_form import BladeForm, blade_form
from ...optics.pupil.iris import resampled
from ...optics.rays.pack import PackedLens
from ...typing import Floats, Mask, Pixels
from ..image.cache import BufferPool, Kept
from .ring_tables import EdgeCrossing, Piece, edge_crossing, picture_piece, sharp_piece

if TYPE_CHECKING:
    from ...optics.rays.bundle import Bundle
    from ..image.canvas import Plane
    from ..scene.opening import Opening

Pattern = tuple[Pixels, Box]
Octaves = tuple[tuple[float, float], tuple[float, float]]

LEAST_FRESNEL_NUMBER = 1.0
"""Below it a ghost is smaller than its own diffraction, and rays do not predict where its light lands."""

LEAST_FRINGE_PX = 0.15
"""Edges whose scale sqrt(lambda L / 2) is smaller on the sensor show no rings: the first ring is 2/3 of it wide."""

WIDEST_RADII = 2.0
"""Shadows are computed up to this many radii beyond the opening."""

OCTAVES = 1.5
"""A grid serves Fresnel areas up to this many octaves apart: those of one ghost at all wavelengths."""

TEXEL_PX = 0.7
"""Finest texel of a pattern on the sensor, in pixels; the wave of white light may be sampled twice as fine. If an area
light spreads the pattern over more than a pixel, in parts of that spread."""

ALIKE = 0.01
"""Relative difference of the Fresnel areas in x and in y below which tables for their mean are used: it moves fringes
by 1/400 of their distance, less than the error of the tables."""

MOST_OBLONG = 2.5
"""Largest aspect ratio of pixels in the stop for which tables treat them as squares."""

LEAST_SAMPLES = 8
"""Least number of samples of a pattern per radius of the iris."""

BAND_SPREAD = 0.045
"""A band whose wavelengths have a larger standard deviation over mean is diffracted in several parts."""

WINDOW_PART = 0.7
"""A window larger than this part of the pattern is replaced by the whole pattern, which other ghosts can share."""

WINDOW_TEXELS = 3.0
"""Margin of a window around the visible part of the stop, in texels of the pattern."""

KEPT_BYTES = 60_000_000
KEPT_GRID_BYTES = 60_000_000
# entries; a picture has hundreds of ghosts with rings
KEPT_RINGS = 2048
# float32 values in pooled buffers; all ghosts of a picture need 10 to 20 million
BUFFERS = 12_000_000
# a crossing is lit where rays come as close to its edge as this part of the inscribed circle
LIT = 0.95


@dataclass(frozen=True)
class Ringing:
    """Diffraction at an iris, for all ghosts of a picture.

    Attributes
    ----------
    mode : {"collins", "frft"}
    opening : Opening
    radius : float
        Of the round opening, mm.
    f_number : float
    """

    mode: Literal["collins", "frft"]
    opening: Opening
    radius: float
    f_number: float
    _grids: Kept = field(default_factory=lambda: Kept(KEPT_GRID_BYTES), compare=False, repr=False)
    _patterns: Kept = field(default_factory=lambda: Kept(KEPT_BYTES), compare=False, repr=False)
    _rings: Kept = field(default_factory=lambda: Kept(KEPT_RINGS), compare=False, repr=False)
    _textures: Kept = field(default_factory=lambda: Kept(KEPT_RINGS), compare=False, repr=False)
    _averages: Kept = field(default_factory=lambda: Kept(KEPT_BYTES), compare=False, repr=False)
    _buffers: BufferPool = field(default_factory=lambda: BufferPool(BUFFERS), compare=False, repr=False)

    def of(
        self,
        packed: PackedLens,
        path: LightPath,
        light: Light,
        bundle: Bundle,
        pixels_per_mm: tuple[float, float],
        nearness: float = 0.0,
        blur_px: tuple[float, float] = (1.0, 1.0),
    ) -> Rings | None:
        """Return the rings of a ghost, or None if it shows none.

        Parameters
        ----------
        packed : PackedLens
        path : LightPath
        light : Light
        bundle : Bundle
            Traced up to the iris.
        pixels_per_mm : tuple of float
            Across and down on the sensor.
        nearness : float
            1 / distance of the light from the first vertex along the axis, 1/mm; 0 for a distant one.
        blur_px : tuple of float
            Least width over which fringes are averaged, across and down the picture, pixels (`ring_visibility.blurs`).

        Returns
        -------
        Rings or None
            None where the edge of the iris is not lit, where the fringes are far below a pixel, and where the Fresnel
            number is below `LEAST_FRESNEL_NUMBER`; the plain picture is correct there.
        """
        lit = tuple(_lit(list(bundle.traced.values()), path.stop_crossings, self.opening))
        # the key does not contain the light's position, so later pictures of a moving light reuse the rings
        key = (path, lit, light.spectrum, pixels_per_mm, nearness, blur_px, _optics(packed))
        return self._rings.made(
            key, lambda: _rings(self, packed, path, light.spectrum, lit, pixels_per_mm, nearness, blur_px)
        )  # fmt: skip

    def sample(self, x: Floats, y: Floats) -> tuple[NDArray[np.floating], NDArray[np.floating]]:
        """Return the opening's amplitude and transmittance (`fresnel_grid`) at x, shape (Nx,), y, shape (Ny, 1)."""
        opening, light = self.opening, np.empty((len(y), len(x)), dtype=np.float32)
        open_softly(opening.blades, x, y[:, 0], light)
        if opening.images is None:
            return light, light
        wave, power = (resampled(image, opening.half, x, y[:, 0]) for image in opening.images)
        return light * wave, light * power

    def grid(self, octaves: Octaves, shown: tuple[float, float], window: Box | None) -> FresnelGrid:
        """Return the grid for areas from 2 ** low to 2 ** high mm^2, in x and y; other arguments as `fresnel_grid`."""

        def laid() -> FresnelGrid:
            least, most = (tuple(2.0 ** pair[end] for pair in octaves) for end in (0, 1))
            return fresnel_grid(
                self.sample, self.opening.radius, self.radius, (least[0], least[1]), (most[0], most[1]), shown, window
            )

        return self._grids.made((octaves, shown, window), laid, lambda grid: grid.spectrum.nbytes)

    def pattern(self, item: _Crossing, window: Box | None, areas: Floats, shares: Floats | None) -> Pattern:
        """Return the opening's pattern for a window of the stop, or for all of its lit part.

        With `shares`, the pattern of white light with these Fresnel areas, shape (K, 2), and shares; without, that of
        one wavelength. Cached patterns are already halved in resolution, which can make them 16 times smaller.
        """
        grid = self.grid(item.octaves, item.shown, window)
        halvings = [
            int(np.clip(math.log2(side / step), 0, 6)) for side, step in zip(item.texel, grid.steps, strict=True)
        ]
        times = (halvings[0], halvings[1])
        key = (item.octaves, item.shown, window, times, areas.tobytes(), None if shares is None else shares.tobytes())

        def drawn() -> Pattern:
            part = item.whole if window is None else window
            if shares is None:
                whole = crop(grid, fresnel_intensity(grid, (float(areas[0, 0]), float(areas[0, 1]))), part)
            else:
                whole = band_pattern(grid, areas, shares, part)
            return halved_pattern(*whole, times)

        return self._patterns.made(key, drawn, lambda pattern: pattern[0].nbytes)

    @cached_property
    def form(self) -> BladeForm | None:
        """The shape of a corner of the blades; None for an iris mask."""
        return None if self.opening.mask is not None else blade_form(self.opening.blades)

    def laid(self, pieces: Sequence[Piece], *, lasting: bool) -> tuple[Pixels, Floats]:
        """Return joined patterns and their table for `kernels.diffraction.ringing`; cache the block if `lasting`."""
        values = [piece.values for piece in pieces]
        if len(values) == 1:
            patterns, starts = values[0], [0]
        elif (shared := common_block(values)) is not None:
            patterns, starts = shared
        elif lasting:
            patterns, starts = self._buffers.laid(values)
        else:
            patterns, starts = np.concatenate(values), [0, *np.cumsum([part.size for part in values])[:-1].tolist()]
        table = np.array([piece.row for piece in pieces])
        table[:, FIRST] += starts
        table[:, EDGE] += starts
        return patterns, table

    def textures(self, rings: Rings, drawn_nm: Floats, windows: tuple[Box | None, ...]) -> Textures:
        """Return the patterns of a ghost at the drawn wavelengths, for the given window of each crossing."""
        key = (rings, drawn_nm.tobytes(), windows)
        return self._textures.made(key, lambda: _textures(rings, drawn_nm, windows))

    def averaged(self, rings: Rings, crossing: int, window: Box | None, band: tuple[Floats, Floats]) -> Piece:
        """Return a crossing's pattern, or a window of it, averaged over a band: wavelengths in nm and their shares."""
        key = (rings, crossing, window, *(column.tobytes() for column in band))
        item = rings.crossings[crossing]
        assert isinstance(item, _Crossing)
        return self._averages.made(
            key, lambda: picture_piece(*rings.average(item, window, *band)), lambda piece: piece.values.nbytes
        )

    def sharp(self, step: float) -> Piece:
        """Return the opening itself as a pattern, with a border a few steps wide."""
        if self.form is not None:
            return sharp_piece(self.form, step)
        reach = self.opening.radius + 2.0 * step
        count = min(2 * math.ceil(reach / step), 2048)
        step = 2.0 * reach / count
        at = np.asarray((np.arange(count) - 0.5 * (count - 1)) * step, dtype=np.float64)
        _, light = self.sample(at, at[:, None])
        light[0], light[-1], light[:, 0], light[:, -1] = 0.0, 0.0, 0.0, 0.0
        return picture_piece(np.ascontiguousarray(light, dtype=np.float32), ((-reach, reach),) * 2)


class _Last:
    """The `Ringing` of the last picture, shared between threads."""

    def __init__(self) -> None:
        self.held: Ringing | None = None
        self.lock = threading.Lock()


_LAST = _Last()


def ringing_for(mode: Literal["collins", "frft"], opening: Opening, radius: float, f_number: float) -> Ringing:
    """Return the diffraction of an iris; reuse that of the last picture if the iris is the same.

    Patterns take a fifth of a picture's time. They depend on lens and iris, but hardly on the light's position, so the
    next picture of a moving light reuses most of them. Reuse does not change the patterns.

    Parameters
    ----------
    mode, opening, radius, f_number
        As in `Ringing`.
    """
    with _LAST.lock:
        last = _LAST.held
        known = last is not None and (last.mode, last.radius, last.f_number) == (mode, radius, f_number)
        if last is None or not known or not _same_opening(last.opening, opening):
            last = _LAST.held = Ringing(mode, opening, radius, f_number)
        return last


def _same_opening(one: Opening, other: Opening) -> bool:
    if (one.mask is None) != (other.mask is None):
        return False
    masks = one.mask is None or other.mask is None or np.array_equal(one.mask, other.mask)
    same = (one.radius, one.inner, one.half) == (other.radius, other.inner, other.half)
    return same and masks and np.array_equal(one.blades, other.blades)


@dataclass(frozen=True)
class _Crossing:
    """The pattern of one crossing of the stop, before the choice of a wavelength.

    Attributes
    ----------
    area : ndarray, shape (W, 2)
        lambda L at the traced wavelengths, mm^2.
    octaves : tuple of (float, float)
        Range of Fresnel areas in powers of 2, in x and in y.
    shown : tuple of float
        Finest step that pixels can show in x and in y, mm in the stop; 0 for line spectra, whose fringes are all kept.
    whole : Box
        The lit part of the stop.
    texel : tuple of float
        Largest allowed step of a pattern in x and in y, mm in the stop.
    """

    area: Floats
    octaves: Octaves
    shown: tuple[float, float]
    whole: Box
    texel: tuple[float, float]

    @property
    def reach(self) -> float:
        """Largest distance of light from the centre of the stop, mm."""
        return float(np.max(self.whole))

    def window(self, seen: Box | None) -> Box | None:
        """Return a part of the stop that contains the visible part, or None for all of it.

        The window is rounded outwards to steps of at most a quarter of its size, so that neighbouring lights share it.
        """
        if seen is None:
            return None
        found = []
        for (low, high), texel, whole in zip(seen, self.texel, self.whole, strict=True):
            margin = WINDOW_TEXELS * texel
            step = 2.0 ** math.floor(math.log2(0.25 * (high - low + 2.0 * margin)))
            near = math.floor((low - margin) / step) * step, math.ceil((high + margin) / step) * step
            found.append((max(near[0], whole[0]), min(near[1], whole[1])))
        sides, all_sides = ([high - low for low, high in box] for box in (found, self.whole))
        if min(sides) <= 0.0 or math.prod(sides) > WINDOW_PART * math.prod(all_sides):
            return None
        return found[0], found[1]


# created once per key; compared by identity
@dataclass(frozen=True, eq=False)
class Rings:
    """The diffraction patterns of one path.

    Attributes
    ----------
    ringing : Ringing
    spectrum : Spectrum
        Of the light.
    wavelengths_nm : ndarray, shape (W,)
        The traced wavelengths.
    crossings : tuple of EdgeCrossing, _Crossing or Piece
        One per crossing of the stop; a piece where the edge is sharp.
    fringe_px : float
        Smallest sqrt(lambda L / 2) of a lit edge, in sensor pixels; 0 where an edge is sharp.
    squares_px2 : ndarray, shape (C, 2)
        Largest lambda L / 2 of each crossing with rings, on the sensor, across and down, pixels squared; with the sign
        of L.
    """

    ringing: Ringing
    spectrum: Spectrum
    wavelengths_nm: Floats
    crossings: tuple[EdgeCrossing | _Crossing | Piece, ...]
    fringe_px: float
    squares_px2: Floats

    @property
    def reach(self) -> float:
        """Radius within which light is searched in the stop, mm."""
        return max(item.reach for item in self.crossings if not isinstance(item, Piece))

    @property
    def ringed(self) -> Mask:
        """Mask of the crossings whose edge has rings, shape (C,)."""
        return np.array([not isinstance(item, Piece) for item in self.crossings])

    @property
    def edges(self) -> tuple[float, float]:
        """Radii between which a ray is near the edge of the iris, the larger one first, mm."""
        return _edges(self.ringing.opening)

    @property
    def white(self) -> bool:
        """Whether the spectrum averages out all but the nearest fringes, so that patterns are local."""
        return not isinstance(self.spectrum, Lines)

    @property
    def local(self) -> bool:
        """Whether the visible part of the stop limits the work."""
        return self.white and any(isinstance(item, _Crossing) for item in self.crossings)

    def textures(self, drawn_nm: Floats, seen: Sequence[Box | None]) -> Textures:
        """Prepare patterns for some wavelengths, of the visible part of each crossing where it is known and `local`."""
        windows = [
            item.window(box) if isinstance(item, _Crossing) else None
            for item, box in zip(self.crossings, seen, strict=True)
        ]
        return self.ringing.textures(self, drawn_nm, tuple(windows))

    def average(self, item: _Crossing, window: Box | None, waves: Floats, shares: Floats) -> Pattern:
        """Average a crossing's pattern over a band."""
        areas = np.column_stack(
            [np.interp(waves, self.wavelengths_nm, side / self.wavelengths_nm) * waves for side in item.area.T]
        )
        if self.white:
            # within a band the ratio of both areas hardly depends on the wavelength: use the meridian of wider fringes
            mean = shares @ areas
            leading = int(np.argmax(np.abs(mean) / np.square(item.texel)))
            areas = areas[:, leading, None] * (mean / mean[leading])
            parts = _narrow(areas[:, leading], shares)
            light = np.array([shares[part].sum() for part in parts])
            patterns = [
                self.ringing.pattern(item, window, areas[part], shares[part] / own)
                for part, own in zip(parts, light, strict=True)
            ]
        else:
            light = shares
            patterns = [self.ringing.pattern(item, window, areas[k : k + 1], None) for k in range(len(waves))]
        if len(patterns) == 1:
            return patterns[0]
        total = sum(values * np.float32(share) for (values, _), share in zip(patterns, light, strict=True))
        return np.asarray(total, dtype=np.float32), patterns[0][1]


@dataclass(frozen=True)
class Textures:
    """The diffraction patterns of one path at the drawn wavelengths.

    Attributes
    ----------
    rings : Rings
    bands : tuple of (ndarray, ndarray)
        The bands of the wavelengths whose patterns are transformed, wavelengths and shares: one per drawn wavelength,
        or per traced wavelength if these are fewer.
    edges : tuple of tuple of Piece
        For each crossing with edge tables, its pieces at the drawn wavelengths.
    windows : tuple of Box or None
        For each crossing, the part of the stop that its pattern covers; None for all of it.
    between : tuple of (int, float)
        For each drawn wavelength, the index of the preceding band, and the fraction of the distance to the next.

    Notes
    -----
    Wavelengths between the traced ones are drawn so that lateral colour shows no steps; their patterns are mixed from
    both neighbours. A band's light rises and falls linearly between the adjacent nodes, so mixing loses none of it.
    """

    rings: Rings
    bands: tuple[tuple[Floats, Floats], ...]
    edges: tuple[tuple[Piece, ...], ...]
    windows: tuple[Box | None, ...]
    between: tuple[tuple[int, float], ...]

    def draw(
        self, k: int, bundle: Bundle, data: Floats, densities: Floats, axes: Floats, to_pixels: Floats, gain: float,
        rgb: Floats, plane: Plane,
    ) -> None:  # fmt: skip
        """Draw a bundle at the k-th wavelength; other arguments as in `kernels.raster.bundle.draw_bundle`."""
        patterns, table, brighter = self._texture(k)
        form = self.rings.ringing.form
        corners = np.empty((0, 2)) if form is None else form.corners
        draw_ringing(
            data, bundle.pupil, bundle.triangles, densities, StopPatterns(patterns, table, corners), axes, to_pixels,
            gain * brighter, rgb, plane, bundle.halves,
        )  # fmt: skip

    def _texture(self, k: int) -> tuple[Pixels, Floats, float]:
        """Return patterns, table (as `kernels.diffraction.ringing` takes them) and gain at the k-th wavelength."""
        pieces: list[Piece] = []
        for c, (item, edges) in enumerate(zip(self.rings.crossings, self.edges, strict=True)):
            if isinstance(item, EdgeCrossing):
                pieces.append(edges[k])
            elif isinstance(item, _Crossing):
                pieces.append(self._mixed(c, *self.between[k]))
            else:
                pieces.append(item)
        laid = self.rings.ringing.laid(pieces, lasting=self.between[k][1] == 0.0)
        return (*laid, math.prod(piece.gain for piece in pieces))

    def _mixed(self, crossing: int, first: int, part: float) -> Piece:
        """Return a crossing's pattern at a wavelength, or interpolated between it and the next."""

        def at(k: int) -> Piece:
            return self.rings.ringing.averaged(self.rings, crossing, self.windows[crossing], self.bands[k])

        if part == 0.0:
            return at(first)
        here, there = at(first), at(first + 1)
        share = np.float32(part)
        return Piece((np.float32(1.0) - share) * here.values + share * there.values, here.row)


def _textures(rings: Rings, drawn_nm: Floats, windows: tuple[Box | None, ...]) -> Textures:
    bands = band_contents(rings.spectrum, drawn_nm)
    edges = [item.pieces(bands) if isinstance(item, EdgeCrossing) else [] for item in rings.crossings]
    between = [(k, 0.0) for k in range(len(drawn_nm))]
    if rings.local and len(drawn_nm) > len(rings.wavelengths_nm):
        bands = band_contents(rings.spectrum, rings.wavelengths_nm)
        at = np.interp(drawn_nm, rings.wavelengths_nm, np.arange(len(rings.wavelengths_nm)))
        between = [(int(place), float(place - int(place))) for place in at]
    return Textures(rings, bands, tuple(tuple(pieces) for pieces in edges), windows, tuple(between))


def _narrow(areas: Floats, shares: Floats) -> list[NDArray[np.intp]]:
    """Split a band into parts of equal light, each narrow enough for one transform."""
    mean = float(shares @ areas)
    spread = math.sqrt(float(shares @ (areas - mean) ** 2)) / abs(mean)
    count = max(1, math.ceil(spread / BAND_SPREAD))
    part = np.minimum((np.cumsum(shares) - 0.5 * shares) * count, count - 0.5).astype(np.intp)
    return [np.flatnonzero(part == k) for k in range(count) if (part == k).any()]


def _rings(
    ringing: Ringing,
    packed: PackedLens,
    path: LightPath,
    spectrum: Spectrum,
    lit: Sequence[bool],
    pixels_per_mm: tuple[float, float],
    nearness: float,
    blur_px: tuple[float, float],
) -> Rings | None:
    ways = stop_to_sensor(packed, path, nearness)
    found: list[EdgeCrossing | _Crossing | None] = [
        _crossing(ringing, packed.wavelengths_nm, way, spectrum, pixels_per_mm, blur_px) if shines else None
        for way, shines in zip(ways, lit, strict=True)
    ]
    if all(item is None for item in found):
        return None
    middle = len(packed.wavelengths_nm) // 2
    magnified = [np.abs(way.magnification[middle]) * pixels_per_mm for way in ways]
    crossings = [
        ringing.sharp(0.5 / max(float(m.max()), 1e-9)) if c is None else c
        for c, m in zip(found, magnified, strict=True)
    ]
    scales = [
        None if item is None else 0.5 * m**2 * np.reshape(item.area, (len(packed.wavelengths_nm), -1))
        for item, m in zip(found, magnified, strict=True)
    ]
    finest = min(
        0.0 if square is None else math.sqrt(float(np.abs(square).min()))
        for square, shines in zip(scales, lit, strict=True)
        if shines
    )
    widest = [square[np.abs(square).max(axis=1).argmax()] for square in scales if square is not None]
    return Rings(ringing, spectrum, packed.wavelengths_nm, tuple(crossings), finest, np.array(widest))


def _optics(packed: PackedLens) -> tuple[object, ...]:
    """Return all data of a lens that `stop_to_sensor` reads, as a key."""
    across = None if packed.curvature_x is None else packed.curvature_x.tobytes()
    arrays = packed.curvature, packed.z_vertex, packed.n_gap, packed.wavelengths_nm
    return (across, packed.sensor_z, *(array.tobytes() for array in arrays))


def _lit(traced: Sequence[Floats], crossings: int, opening: Opening) -> list[bool]:
    """Return for each crossing whether light that passes all other bounds reaches the edge of the iris."""
    lit = np.zeros(crossings, dtype=np.bool_)
    for data in traced:
        reached_edges(data, *_edges(opening), lit)
    return lit.tolist()


def _edges(opening: Opening) -> tuple[float, float]:
    """Return the radii between which a ray is near the edge of the iris, the larger one first, mm."""
    # a mask can have edges anywhere
    return opening.radius * (1.0 + 1e-9), 0.0 if opening.mask is not None else LIT * opening.inner


def _crossing(
    ringing: Ringing, wavelengths_nm: Floats, way: StopToSensor, spectrum: Spectrum, pixels_per_mm: tuple[float, float],
    blur_px: tuple[float, float],
) -> EdgeCrossing | _Crossing | None:  # fmt: skip
    """Describe a crossing's pattern; None where it is not visible."""
    middle = len(wavelengths_nm) // 2
    if ringing.mode == "frft":
        area = ringing.radius**2 / frft_fresnel_number(wavelengths_nm, ringing.f_number)[:, None] * np.ones(2)
    else:
        area = 1e-6 * wavelengths_nm[:, None] * way.length
    magnified = np.abs(way.magnification[middle]) * pixels_per_mm
    if not np.isfinite(area).all() or not np.abs(area).max() <= ringing.radius**2 / LEAST_FRESNEL_NUMBER:
        return None
    fringe = np.sqrt(0.5 * np.abs(area))
    # opposite signs at two wavelengths: at a wavelength between them the sensor sees a sharp image of the iris
    crosses = bool((np.sign(area) != np.sign(area[0])).any())
    if crosses or not (fringe.min(axis=0) * magnified).max() >= LEAST_FRINGE_PX:
        return None
    alike = np.allclose(area[:, 0], area[:, 1], rtol=ALIKE) and magnified.max() <= MOST_OBLONG * magnified.min()
    if ringing.form is not None and not isinstance(spectrum, Lines) and alike:
        mean, pixel_mm = area.mean(axis=1), 1.0 / math.sqrt(float(magnified.prod()))
        at_edges = edge_crossing(ringing.form, wavelengths_nm, mean, pixel_mm)
        if at_edges is not None:
            return at_edges
    # line spectra are not averaged and show finer rings: twice the samples
    finer = 2.0 if isinstance(spectrum, Lines) else 0.0
    # half octaves, so that similar ghosts share patterns; light outside the traced wavelengths counts to the end bands
    low = [math.floor(2.0 * math.log2(0.92 * side)) / 2.0 for side in np.abs(area).min(axis=0)]
    most = [math.log2(1.12 * side) for side in np.abs(area).max(axis=0)]
    high = [max(start + OCTAVES, math.ceil(2.0 * end) / 2.0) for start, end in zip(low, most, strict=True)]
    octaves = ((low[0] - finer, high[0]), (low[1] - finer, high[1]))
    # the finest steps that pixels, and the light's extent, can show
    enough = TEXEL_PX * np.array(blur_px) / np.maximum(magnified, 1e-9)
    # rounded to eighths of an octave
    seen = np.minimum(0.5 * enough, ringing.radius / LEAST_SAMPLES)
    shown = [0.0 if finer else 2.0 ** (0.125 * math.floor(8.0 * math.log2(side))) for side in seen.tolist()]
    widest = WIDEST_RADII * ringing.radius
    half = [ringing.opening.radius + min(SHADOW * math.sqrt(0.5 * 2.0**top), widest) for top in high]
    whole = ((-half[0], half[0]), (-half[1], half[1]))
    return _Crossing(area, octaves, (shown[0], shown[1]), whole, (float(enough[0]), float(enough[1])))
