"""Rings inside ghosts: what the iris' diffraction makes of a path, drawn in the iris' place.

For every crossing of the stop whose edge is lit, a pattern takes the iris' place in the ghost (`optics.ringing`). It is
averaged over the light that each drawn wavelength stands for; an area light spreads it with its ghost. Ghosts whose
rings nobody could see are left to the plain pass, pixel for pixel.
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

from ..kernels.lit_edge import reached_edges
from ..kernels.pattern import EDGE, FIRST
from ..kernels.ringing import draw_ringing
from ..model import Light
from ..model.light import Lines, Spectrum
from ..optics.blade_form import BladeForm, blade_form
from ..optics.fresnel import (
    SHADOW,
    Box,
    FresnelGrid,
    band_pattern,
    crop,
    fresnel_grid,
    fresnel_intensity,
    halved,
)
from ..optics.iris import coverage, resampled, softened
from ..optics.pack import PackedLens
from ..optics.paths import LightPath
from ..optics.ringing import StopToSensor, frft_fresnel_number, stop_to_sensor
from ..optics.spectrum import band_contents
from .edge_rings import EdgeCrossing, Piece, edge_crossing, picture_piece, sharp_piece
from .kept import Kept, Shelf

if TYPE_CHECKING:
    from ..optics.bundle import Bundle
    from .canvas import Plane
    from .opening import Opening

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Pattern = tuple[Singles, Box]
Octaves = tuple[tuple[float, float], tuple[float, float]]

LEAST_FRESNEL_NUMBER = 1.0
"""Below it a ghost is smaller than its own diffraction, and its rays no longer tell where the light goes."""

LEAST_FRINGE_PX = 0.15
"""Edges whose scale sqrt(lambda L / 2) is less than this on the sensor show no rings: the first is two thirds of it."""

WIDEST_RADII = 2.0
"""A shadow is not followed farther than this from the opening."""

OCTAVES = 1.5
"""A grid serves Fresnel areas up to this many octaves apart: those of one ghost at all colours."""

TEXEL_PX = 0.7
"""Patterns are no finer than this on the sensor, in pixels, and the wave of white light no finer than half of it."""

BAND_SPREAD = 0.045
"""A band whose wavelengths have a larger standard deviation, over their mean, is diffracted in parts."""

WINDOW_PART = 0.7
"""A window as large as this part of the pattern is not worth having: a whole one serves other ghosts and lights too."""

WINDOW_TEXELS = 3.0
"""A window reaches this many of a pattern's texels farther than what is seen through it."""

KEPT_BYTES = 60_000_000
KEPT_GRID_BYTES = 60_000_000
# ghosts, of which hundreds have rings
KEPT_RINGS = 2048
# numbers, of which all ghosts of a picture need 10 to 20 million
SHELF = 12_000_000
# a crossing is lit where rays come as near to its edge as this part of the circle within it
LIT = 0.95


@dataclass(frozen=True)
class Ringing:
    """How an iris diffracts, for all ghosts of a picture.

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
    _shelf: Shelf = field(default_factory=lambda: Shelf(SHELF), compare=False, repr=False)

    def of(
        self,
        packed: PackedLens,
        path: LightPath,
        light: Light,
        bundle: Bundle,
        pixels_per_mm: tuple[float, float],
        nearness: float = 0.0,
    ) -> Rings | None:
        """Decide whether a ghost shows rings.

        Parameters
        ----------
        packed : PackedLens
        path : LightPath
        light : Light
        bundle : Bundle
            Traced as far as the iris.
        pixels_per_mm : tuple of float
            Across and down on the sensor.
        nearness : float
            1 / distance of the light from the first vertex along the axis, 1/mm; 0 for a distant one.

        Returns
        -------
        Rings or None
            None where the edge of the iris is not lit, where its fringes are far below a pixel, and where the Fresnel
            number is below `LEAST_FRESNEL_NUMBER`: the plain picture is right then.
        """
        lit = tuple(_lit(list(bundle.traced.values()), path.stop_crossings, self.opening))
        # where the light stands is not asked: of a lens that stays every picture finds them
        key = (path, lit, light.spectrum, pixels_per_mm, nearness, _optics(packed))
        return self._rings.made(
            key, lambda: _rings(self, packed, path, light.spectrum, lit, pixels_per_mm, nearness)
        )  # fmt: skip

    def sample(self, x: Floats, y: Floats) -> tuple[Floats, Floats]:
        """Sample the opening at x, shape (Nx,), and y, shape (Ny, 1): amplitude and transmittance (`fresnel_grid`)."""
        opening = self.opening
        light = softened(coverage(opening.blades, x, y, 2.0 * float(x[1] - x[0])))
        if opening.mask is None:
            return light, light
        wave, power = resampled(np.stack([np.sqrt(opening.mask), opening.mask]), opening.half, x, y[:, 0])
        return light * wave, light * power

    def grid(self, octaves: Octaves, shown: float, window: Box | None) -> FresnelGrid:
        """Return the grid of areas from 2 ** low to 2 ** high mm^2, in x and in y; the rest as `fresnel_grid`."""

        def laid() -> FresnelGrid:
            least, most = (tuple(2.0 ** pair[end] for pair in octaves) for end in (0, 1))
            return fresnel_grid(
                self.sample, self.opening.radius, self.radius, (least[0], least[1]), (most[0], most[1]), shown, window
            )

        return self._grids.made((octaves, shown, window), laid, lambda grid: grid.spectrum.nbytes)

    def pattern(self, item: _Crossing, window: Box | None, areas: Floats, shares: Floats | None) -> Pattern:
        """Return the opening's pattern, of a window of the stop or of all that is lit.

        Of white light of these Fresnel areas, shape (K, 2), and shares, or of one wavelength where there are no shares.
        What is kept has its resolution halved already, which may leave a sixteenth of it.
        """
        grid = self.grid(item.octaves, item.shown, window)
        halvings = [int(np.clip(math.log2(side / grid.step), 0, 6)) for side in item.texel]
        times = (halvings[0], halvings[1])
        key = (item.octaves, item.shown, window, times, areas.tobytes(), None if shares is None else shares.tobytes())

        def drawn() -> Pattern:
            part = item.whole if window is None else window
            if shares is None:
                whole = crop(grid, fresnel_intensity(grid, (float(areas[0, 0]), float(areas[0, 1]))), part)
            else:
                whole = band_pattern(grid, areas, shares, part)
            return halved(*whole, times)

        return self._patterns.made(key, drawn, lambda pattern: pattern[0].nbytes)

    @cached_property
    def form(self) -> BladeForm | None:
        """The blades by one of their corners; None for an image."""
        return None if self.opening.mask is not None else blade_form(self.opening.blades)

    def laid(self, pieces: Sequence[Piece]) -> tuple[Singles, Floats]:
        """Return patterns and their table, as `kernels.ringing` takes them."""
        patterns, starts = self._shelf.laid([piece.values for piece in pieces])
        table = np.array([piece.row for piece in pieces])
        table[:, FIRST] += starts
        table[:, EDGE] += starts
        return patterns, table

    def textures(self, rings: Rings, drawn_nm: Floats, windows: tuple[Box | None, ...]) -> Textures:
        """Return what takes the iris' place in a ghost at some wavelengths, of a part of each of its crossings."""
        key = (rings, drawn_nm.tobytes(), windows)
        return self._textures.made(key, lambda: _textures(rings, drawn_nm, windows))

    def averaged(self, rings: Rings, crossing: int, window: Box | None, band: tuple[Floats, Floats]) -> Piece:
        """Return a crossing's pattern, or a part of it, averaged over a band: wavelengths in nm and their shares."""
        key = (rings, crossing, window, *(column.tobytes() for column in band))
        item = rings.crossings[crossing]
        assert isinstance(item, _Crossing)
        return self._averages.made(
            key, lambda: picture_piece(*rings.average(item, window, *band)), lambda piece: piece.values.nbytes
        )

    def sharp(self, step: float) -> Piece:
        """Return the opening itself as a pattern, its border a few steps wide."""
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
    """The ringing of the last picture; threads may share it."""

    def __init__(self) -> None:
        self.held: Ringing | None = None
        self.lock = threading.Lock()


_LAST = _Last()


def ringing_for(mode: Literal["collins", "frft"], opening: Opening, radius: float, f_number: float) -> Ringing:
    """Return how an iris diffracts: that of the last picture where its iris was the same.

    Patterns depend on lens and iris, hardly on where the light stands, and take a fifth of a picture's time: the next
    picture of a light that moves finds most of them. What they are does not depend on where they come from.

    Parameters
    ----------
    mode, opening, radius, f_number
        As of `Ringing`.

    Returns
    -------
    Ringing
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
    """The pattern of one crossing of the stop, up to its wavelength.

    Attributes
    ----------
    area : ndarray, shape (W, 2)
        lambda L at the traced wavelengths, mm^2.
    octaves : tuple of (float, float)
        From which to which power of 2 Fresnel areas may lie, in x and in y.
    shown : float
        The finest step that pixels show, mm in the stop; 0 for lines, whose fringes are all kept.
    whole : Box
        The part of the stop that is lit.
    texel : tuple of float
        The coarsest step that a pattern may have, in x and in y, mm in the stop.
    """

    area: Floats
    octaves: Octaves
    shown: float
    whole: Box
    texel: tuple[float, float]

    @property
    def reach(self) -> float:
        """How far out in the stop there is light, mm."""
        return float(np.max(self.whole))

    def window(self, seen: Box | None) -> Box | None:
        """Return the part of the stop whose pattern holds what is seen; None: all of it.

        Rounded outwards to steps of a fourth of itself or less, so that lights side by side share it.
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


# each is made once for its key, and is a key itself
@dataclass(frozen=True, eq=False)
class Rings:
    """What takes the iris' place in one path.

    Attributes
    ----------
    ringing : Ringing
    spectrum : Spectrum
        The light's.
    wavelengths_nm : ndarray, shape (W,)
        As traced.
    crossings : tuple of EdgeCrossing, _Crossing or Piece
        One a crossing of the stop; a piece where the edge is sharp.
    fringe_px : float
        The finest sqrt(lambda L / 2) of an edge that is lit, on the sensor in pixels; 0 where one is sharp.
    widest_px : float
        The widest of an edge that has rings.
    """

    ringing: Ringing
    spectrum: Spectrum
    wavelengths_nm: Floats
    crossings: tuple[EdgeCrossing | _Crossing | Piece, ...]
    fringe_px: float
    widest_px: float

    @property
    def reach(self) -> float:
        """How far out in the stop light is looked for, mm."""
        return max(item.reach for item in self.crossings if not isinstance(item, Piece))

    @property
    def ringed(self) -> NDArray[np.bool_]:
        """At which crossings the edge has rings, shape (C,)."""
        return np.array([not isinstance(item, Piece) for item in self.crossings])

    @property
    def edges(self) -> tuple[float, float]:
        """Between which radii a ray is near the edge of the iris, the larger one first, mm."""
        return _edges(self.ringing.opening)

    @property
    def white(self) -> bool:
        """Whether few fringes are left, so that a pattern knows only of what is near it."""
        return not isinstance(self.spectrum, Lines)

    @property
    def local(self) -> bool:
        """Whether it helps to know which part of the stop is seen."""
        return self.white and any(isinstance(item, _Crossing) for item in self.crossings)

    def textures(self, drawn_nm: Floats, seen: Sequence[Box | None]) -> Textures:
        """Prepare for drawing at some wavelengths; of each crossing the part that is seen, where known and `local`."""
        windows = [
            item.window(box) if isinstance(item, _Crossing) else None
            for item, box in zip(self.crossings, seen, strict=True)
        ]
        return self.ringing.textures(self, drawn_nm, tuple(windows))

    def average(self, item: _Crossing, window: Box | None, waves: Floats, shares: Floats) -> Pattern:
        """Average a crossing's pattern over the light of a band."""
        areas = np.column_stack(
            [np.interp(waves, self.wavelengths_nm, side / self.wavelengths_nm) * waves for side in item.area.T]
        )
        if self.white:
            # the proportion of both hardly depends on the wavelength
            middle = len(self.wavelengths_nm) // 2
            areas[:, 1] = areas[:, 0] * (item.area[middle, 1] / item.area[middle, 0])
            parts = _narrow(areas[:, 0], shares)
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
    """What takes the iris' place at the wavelengths that are drawn.

    Attributes
    ----------
    rings : Rings
    bands : tuple of (ndarray, ndarray)
        What light each drawn wavelength stands for.
    edges : tuple of tuple of Piece
        For each crossing of the stop its pieces at these wavelengths, where it has edges and corners.
    windows : tuple of Box or None
        For each the part of the stop that a picture of it holds; None for all of it.
    """

    rings: Rings
    bands: tuple[tuple[Floats, Floats], ...]
    edges: tuple[tuple[Piece, ...], ...]
    windows: tuple[Box | None, ...]

    def draw(
        self, k: int, bundle: Bundle, data: Floats, densities: Floats, axes: Floats, to_pixels: Floats, gain: float,
        rgb: Floats, plane: Plane,
    ) -> None:  # fmt: skip
        """Draw a bundle at the k-th wavelength; the rest is as `kernels.bundle.draw_bundle` takes it."""
        patterns, table, brighter = self._texture(k)
        form = self.rings.ringing.form
        corners = np.empty((0, 2)) if form is None else form.corners
        draw_ringing(
            data, bundle.pupil, bundle.triangles, densities, len(table), patterns, table, corners, axes, to_pixels,
            gain * brighter, rgb, plane, bundle.halves,
        )  # fmt: skip

    def _texture(self, k: int) -> tuple[Singles, Floats, float]:
        """Return the k-th patterns and their table, as `kernels.ringing` takes them, and a gain."""
        pieces: list[Piece] = []
        for c, (item, edges) in enumerate(zip(self.rings.crossings, self.edges, strict=True)):
            if isinstance(item, EdgeCrossing):
                pieces.append(edges[k])
            elif isinstance(item, _Crossing):
                pieces.append(self.rings.ringing.averaged(self.rings, c, self.windows[c], self.bands[k]))
            else:
                pieces.append(item)
        return (*self.rings.ringing.laid(pieces), math.prod(piece.gain for piece in pieces))


def _textures(rings: Rings, drawn_nm: Floats, windows: tuple[Box | None, ...]) -> Textures:
    bands = band_contents(rings.spectrum, drawn_nm)
    edges = [item.pieces(bands) if isinstance(item, EdgeCrossing) else [] for item in rings.crossings]
    return Textures(rings, bands, tuple(tuple(pieces) for pieces in edges), windows)


def _narrow(areas: Floats, shares: Floats) -> list[NDArray[np.intp]]:
    """Divide a band into parts of like light, each so narrow that one transform serves it."""
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
) -> Rings | None:
    ways = stop_to_sensor(packed, path, nearness)
    found: list[EdgeCrossing | _Crossing | None] = [
        _crossing(ringing, packed.wavelengths_nm, way, spectrum, pixels_per_mm) if shines else None
        for way, shines in zip(ways, lit, strict=True)
    ]
    if all(item is None for item in found):
        return None
    middle = len(packed.wavelengths_nm) // 2
    magnified = [float(np.max(np.abs(way.magnification[middle]) * pixels_per_mm)) for way in ways]
    crossings = [ringing.sharp(0.5 / max(m, 1e-9)) if c is None else c for c, m in zip(found, magnified, strict=True)]
    fringes = [
        0.0 if item is None else m * math.sqrt(0.5 * float(np.abs(item.area).min()))
        for item, m, shines in zip(found, magnified, lit, strict=True)
        if shines
    ]
    widest = max(
        m * math.sqrt(0.5 * float(np.abs(item.area).max())) for item, m in zip(found, magnified, strict=True) if item
    )
    return Rings(ringing, spectrum, packed.wavelengths_nm, tuple(crossings), min(fringes), widest)


def _optics(packed: PackedLens) -> tuple[object, ...]:
    """Return all of a lens that `stop_to_sensor` reads, as a key."""
    across = None if packed.curvature_x is None else packed.curvature_x.tobytes()
    arrays = packed.curvature, packed.z_vertex, packed.n_gap, packed.wavelengths_nm
    return (across, packed.sensor_z, *(array.tobytes() for array in arrays))


def _lit(traced: Sequence[Floats], crossings: int, opening: Opening) -> list[bool]:
    """Tell for each crossing whether light that passes everything else comes to the edge of the iris."""
    lit = np.zeros(crossings, dtype=np.bool_)
    for data in traced:
        reached_edges(data, *_edges(opening), lit)
    return lit.tolist()


def _edges(opening: Opening) -> tuple[float, float]:
    """Return between which radii a ray is near the edge of the iris, the larger one first, mm."""
    # an image may have edges anywhere
    return opening.radius * (1.0 + 1e-9), 0.0 if opening.mask is not None else LIT * opening.inner


def _crossing(
    ringing: Ringing, wavelengths_nm: Floats, way: StopToSensor, spectrum: Spectrum, pixels_per_mm: tuple[float, float]
) -> EdgeCrossing | _Crossing | None:
    """Describe a crossing's pattern; None when there is nothing to see of it."""
    middle = len(wavelengths_nm) // 2
    if ringing.mode == "frft":
        area = ringing.radius**2 / frft_fresnel_number(wavelengths_nm, ringing.f_number)[:, None] * np.ones(2)
    else:
        area = 1e-6 * wavelengths_nm[:, None] * way.length
    magnified = np.abs(way.magnification[middle]) * pixels_per_mm
    if not np.isfinite(area).all() or not np.abs(area).max() <= ringing.radius**2 / LEAST_FRESNEL_NUMBER:
        return None
    fringe = np.sqrt(0.5 * np.abs(area))
    # opposite signs at two wavelengths: somewhere between, the sensor sees the iris itself
    crosses = bool((np.sign(area) != np.sign(area[0])).any())
    if crosses or not (fringe.min(axis=0) * magnified).max() >= LEAST_FRINGE_PX:
        return None
    if ringing.form is not None and not isinstance(spectrum, Lines) and np.allclose(area[:, 0], area[:, 1], rtol=1e-6):
        at_edges = edge_crossing(ringing.form, wavelengths_nm, area[:, 0], 1.0 / float(magnified.max()))
        if at_edges is not None:
            return at_edges
    # the rings of a line are not averaged, so finer ones are seen: twice the samples
    finer = 2.0 if isinstance(spectrum, Lines) else 0.0
    # half octaves, so that ghosts alike share their patterns; light beyond the traced wavelengths belongs to the ends
    low = [math.floor(2.0 * math.log2(0.92 * side)) / 2.0 for side in np.abs(area).min(axis=0)]
    most = [math.log2(1.12 * side) for side in np.abs(area).max(axis=0)]
    high = [max(start + OCTAVES, math.ceil(2.0 * end) / 2.0) for start, end in zip(low, most, strict=True)]
    octaves = ((low[0] - finer, high[0]), (low[1] - finer, high[1]))
    # no finer than pixels show
    enough = TEXEL_PX / np.maximum(magnified, 1e-9)
    # half octaves of this too
    shown = 0.0 if finer else 2.0 ** (0.5 * math.floor(2.0 * math.log2(0.5 * float(enough.min()))))
    widest = WIDEST_RADII * ringing.radius
    half = [ringing.opening.radius + min(SHADOW * math.sqrt(0.5 * 2.0**top), widest) for top in high]
    whole = ((-half[0], half[0]), (-half[1], half[1]))
    return _Crossing(area, octaves, shown, whole, (float(enough[0]), float(enough[1])))
