"""Starbursts of many lights that share one pattern.

Near each direct image, a finely drawn pattern is integrated over pixels through a summed-area table, for any position
of the centre within its pixel. Farther out come the wings. Those of round and of straight-bladed irises are sampled
finely on the spikes and coarsely between them (`kernels.diffraction.wings`); those of other irises are drawn once and
shifted to every light (`render.starburst.translated_wings`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...kernels.diffraction import wings as kernel
from ...kernels.raster.plane_memory import black_picture
from ...optics.diffraction.fraunhofer import BladeWings, FanWings, Pattern
from ...optics.diffraction.spike_profile import SpikeProfile, spike_profile
from ...typing import Floats, Indices, Pixels
from .bands import BAND, in_threads
from .pattern import NEAR_PIXELS, Painter, painter_of
from .translated_wings import add_moved_wings

# largest number of cells of the fine pattern per pixel, in final and draft quality, and along a side
PIXEL_CELLS, DRAFT_PIXEL_CELLS, SIDE_CELLS = 8, 4, 1280
# the same for the peak, and its half width in pixels
PEAK_CELLS, PEAK_PX = 64, 1
# pixels per coarse sample of the wings, along each axis
COARSE = 4
# transition to coarse samples: pixels from a spike's axis, and pixels beyond the fine square
SPIKE_PX, DISC_PX = (4.0, 24.0), 24.0
# relative error up to which a spike's profile is replaced by its asymptotic tail
TAIL_TOLERANCE = 0.01


@dataclass(frozen=True)
class Stars:
    """Direct images that differ only in position and brightness.

    Attributes
    ----------
    pattern : Pattern
    f_number : float
        Working f-number, scaled by the starburst's size.
    wavelengths_nm : ndarray, shape (M,)
    weights : ndarray, shape (M, 3)
        Flux of the reference light at each wavelength in each channel.
    centres_px : ndarray, shape (L, 2)
        Columns and rows.
    gains : ndarray, shape (L, 3)
        Flux of each light relative to the reference light.
    """

    pattern: Pattern
    f_number: float
    wavelengths_nm: Floats
    weights: Floats
    centres_px: Floats
    gains: Floats


def _is_plain(pattern: Pattern) -> bool:
    """Return whether a pattern comes from a clean iris that is round or has smooth, straight blades."""
    wings = pattern.wings
    plain = wings.half_fan == 0.0 if isinstance(wings, BladeWings) else len(wings.angular) == 1
    return plain and not pattern.veil and pattern.rough is None


def draw_stars(
    stars: Stars, pixel_mm: tuple[float, float], size_px: tuple[int, int], *, draft: bool, threads: int | None
) -> Pixels:
    """Draw the starbursts of many lights with one pattern.

    Parameters
    ----------
    stars : Stars
    pixel_mm : tuple of float
    size_px : tuple of int
    draft : bool
        Draw the centres coarser.
    threads : int or None
        None: all cores. The pixels do not depend on it.

    Returns
    -------
    ndarray of float32, shape (height, width, 3)
        As from `pattern.starburst_layer`.
    """
    width, height = size_px
    total = black_picture(width, height)
    painter = painter_of(stars.pattern, stars.f_number, pixel_mm, stars.wavelengths_nm, stars.weights)
    reach = max(NEAR_PIXELS + 1, math.ceil(painter.outer / min(pixel_mm)) + 1)
    windows = _windows(stars.centres_px, reach)
    if _is_plain(stars.pattern):
        _add_plain_wings(total, _star_set(painter, stars, pixel_mm, reach), windows, pixel_mm, threads)
    else:
        add_moved_wings(total, painter, stars.centres_px, stars.gains, windows, pixel_mm, draft=draft, threads=threads)
    _lay_centres(total, painter, stars, pixel_mm, reach, windows, draft)
    return total


def _add_plain_wings(
    total: Pixels, shared: kernel.StarSet, windows: Indices, pixel_mm: tuple[float, float], threads: int | None
) -> None:
    """Add the wings of a round or straight-bladed iris."""
    height, width = total.shape[:2]
    x = (np.arange(width) + 0.5) * pixel_mm[0]
    y = -(np.arange(height) + 0.5) * pixel_mm[1]
    coarse = _coarse(shared, pixel_mm, (width, height), threads)

    def band(first: int) -> None:
        rows = slice(first, min(first + BAND, height))
        kernel.add_sharp_wings(shared, windows, x, y[rows], first, total[rows])

    in_threads(band, range(0, height, BAND), threads)
    total += _upsampled(coarse, (width, height))


def _windows(centres_px: Floats, reach: int) -> Indices:
    """Return the pixel bounds of the fine pattern around each centre: columns, then rows."""
    middle = np.floor(np.clip(centres_px, -1e9, 1e9)).astype(np.int64)
    low, high = middle - reach, middle + reach + 1
    return np.stack([low[:, 0], high[:, 0], low[:, 1], high[:, 1]], axis=1)


def _star_set(painter: Painter, stars: Stars, pixel_mm: tuple[float, float], reach: int) -> kernel.StarSet:
    """Return the starbursts as both wing kernels take them."""
    wings, widest = painter.pattern.wings, max(pixel_mm)
    look = np.zeros(kernel.LOOK)
    look[[kernel.PIXEL_X, kernel.PIXEL_Y]] = pixel_mm
    look[[kernel.SPIKE_IN, kernel.SPIKE_OUT]] = np.array(SPIKE_PX) * widest
    # beyond the corners of the fine square
    look[kernel.DISC_IN] = math.sqrt(2.0) * (reach + 1.0) * widest
    look[kernel.DISC_OUT] = look[kernel.DISC_IN] + DISC_PX * widest
    normals, spikes, tail, fan = np.zeros((0, 2)), np.zeros((0, 2, 3)), np.zeros(3), np.zeros(3)
    if isinstance(wings, FanWings):
        fan = float(wings.angular.mean()) * 2.0 * painter.f_number * (painter.wave * 1e-6) @ painter.weights
    else:
        profile = spike_profile(wings, painter.wave, painter.weights, painter.f_number, pixel_mm)
        normals = np.stack([np.cos(wings.angle), np.sin(wings.angle)], axis=1)
        spikes, tail = _shortened(profile), profile.tail
        look[kernel.SCALE], look[kernel.STEP] = 0.5 / painter.f_number, profile.step
    centres = stars.centres_px * np.array(pixel_mm) * [1.0, -1.0]
    return kernel.StarSet(look, normals, spikes, tail, fan, centres, np.ascontiguousarray(stars.gains))


def _shortened(profile: SpikeProfile) -> Floats:
    """Truncate a profile where its tail is accurate enough."""
    v = np.arange(profile.density.shape[1]) * profile.step
    tail = profile.tail / np.maximum(v, profile.step)[:, None] ** 2
    off = np.abs(profile.density - tail).max(axis=2) > TAIL_TOLERANCE * np.abs(tail).max(axis=1)
    end = int(np.flatnonzero(off.any(axis=0)).max(initial=0)) + 3
    return np.ascontiguousarray(profile.density[:, :end])


def _coarse(
    shared: kernel.StarSet, pixel_mm: tuple[float, float], size_px: tuple[int, int], threads: int | None
) -> Floats:
    """Sample the smooth part of the wings, two samples beyond the picture on every side."""
    columns, rows = (-(-side // COARSE) + 4 for side in size_px)
    x = ((np.arange(columns) - 1.5) * COARSE) * pixel_mm[0]
    y = -((np.arange(rows) - 1.5) * COARSE) * pixel_mm[1]
    found = np.zeros((rows, columns, 3))

    def band(first: int) -> None:
        part = slice(first, min(first + BAND // COARSE, rows))
        kernel.add_coarse_wings(shared, x, y[part], found[part])

    in_threads(band, range(0, rows, BAND // COARSE), threads)
    return found


def _upsampled(coarse: NDArray[np.floating], size_px: tuple[int, int]) -> NDArray[np.floating]:
    """Interpolate coarse samples to all pixels by cubic polynomials through four neighbours."""
    coarse = coarse.astype(np.float32)
    for axis, side in ((0, size_px[1]), (1, size_px[0])):
        groups = -(-side // COARSE)
        fine = np.zeros((*coarse.shape[:axis], groups * COARSE, *coarse.shape[axis + 1 :]), dtype=np.float32)
        for phase in range(COARSE):
            # samples lie at the centres of groups of COARSE pixels; the first two lie before the picture
            at = (phase + 0.5) / COARSE - 0.5
            back = at < 0.0
            t = at + 1.0 if back else at
            weights = (
                -t * (t - 1.0) * (t - 2.0) / 6.0, (t * t - 1.0) * (t - 2.0) / 2.0, -t * (t + 1.0) * (t - 2.0) / 2.0,
                t * (t * t - 1.0) / 6.0,
            )  # fmt: skip
            first = 0 if back else 1
            part = [slice(None)] * 3
            part[axis] = slice(phase, None, COARSE)
            total = fine[tuple(part)]
            for k, weight in enumerate(weights):
                part[axis] = slice(first + k, first + k + groups)
                total += np.float32(weight) * coarse[tuple(part)]
        coarse = fine[:side] if axis == 0 else fine[:, :side]
    return coarse


def _lay_centres(
    total: Pixels, painter: Painter, stars: Stars, pixel_mm: tuple[float, float], reach: int,
    windows: Indices, draft: bool,
) -> None:  # fmt: skip
    """Add the fine pattern around every centre, and the still finer peak."""
    height, width = total.shape[:2]
    half = reach + 1
    cells = max(1, min(DRAFT_PIXEL_CELLS if draft else PIXEL_CELLS, SIDE_CELLS // (2 * half)))
    # cells of the peak: a sixth of its diffraction width, where that is less than a pixel
    width_px = painter.f_number * float(painter.wave.min()) * 1e-6 / max(pixel_mm)
    finest = max(cells, min(PEAK_CELLS, math.ceil(6.0 / width_px)))
    tables = [_summed(painter, pixel_mm, half, cells, PEAK_PX), _summed(painter, pixel_mm, PEAK_PX, finest, 0)]
    for (cx, cy), gain, (left, right, top, bottom) in zip(stars.centres_px, stars.gains, windows, strict=True):
        j0, j1, i0, i1 = max(left, 0), min(right, width), max(top, 0), min(bottom, height)
        if j0 >= j1 or i0 >= i1:
            continue
        for table, reached, parts in ((tables[0], half, cells), (tables[1], PEAK_PX, finest)):
            rows = _read(table, (np.arange(i0, i1 + 1) - cy + reached) * parts, 0)
            corners = _read(rows, (np.arange(j0, j1 + 1) - cx + reached) * parts, 1)
            total[i0:i1, j0:j1] += np.diff(np.diff(corners, axis=0), axis=1) * gain


def _summed(painter: Painter, pixel_mm: tuple[float, float], half: int, cells: int, without: int) -> Floats:
    """Sum the pattern over `half` pixels around its centre, with a hole of `without` pixels, as a summed-area table.

    Each cell is 1 / `cells` of a pixel and counts by its part of a pixel's area, so that the sum over a pixel is its
    irradiance.
    """
    side = 2 * half * cells
    fine = np.zeros((side, side, 3))
    edges = np.arange(side + 1) / cells - half
    painter.paint(edges * pixel_mm[0], -edges * pixel_mm[1], (pixel_mm[0] / cells, pixel_mm[1] / cells), fine)
    hole = slice((half - without) * cells, (half + without) * cells)
    fine[hole, hole] = 0.0
    table = np.zeros((side + 1, side + 1, 3))
    table[1:, 1:] = np.cumsum(np.cumsum(fine / cells**2, axis=0), axis=1)
    return table


def _read(table: Floats, at: Floats, axis: int) -> Floats:
    """Interpolate a table linearly along an axis, constant beyond its ends."""
    at = np.clip(at, 0.0, table.shape[axis] - 1.0)
    low = np.minimum(at.astype(np.intp), table.shape[axis] - 2)
    part = (at - low).reshape((-1, 1, 1) if axis == 0 else (1, -1, 1))
    found: Floats = np.take(table, low, axis) * (1.0 - part) + np.take(table, low + 1, axis) * part
    return found
