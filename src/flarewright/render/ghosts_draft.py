"""Ghosts, draft quality: paraxial matrices (Lee and Eisemann 2013; Van Acoleyen 2025, chapter 4).

The same paths, wavelengths, iris and units as final quality, in milliseconds: every ghost is the image of the entrance
cut by the iris, evenly lit, its colour from one ray. A toroid has a matrix for each meridian, so its ghosts are ovals;
decentre, tilt, aspheric terms and figure errors are of higher order and left to final quality.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..kernels.matrix import RIM, draw_matrix_ghosts, matrix_squares, path_matrices, weigh_matrix_ghosts
from ..kernels.raster import sum_rows
from ..kernels.spread_marks import spread_marks
from ..optics.coating_curves import PathSpectrum, joined_steps, path_spectra
from ..optics.color import luminance_weights
from ..optics.paths import LightPath
from .art import Frame, PathArt
from .between import FINE_NM
from .canvas import DETAIL_CONTRAST, DETAILS, Plane, merge
from .grade import coarseness, finish
from .shot import Shot
from .spread import shape_kernel, spread_within
from .steep import bent_weights, steep_paths

Floats = NDArray[np.float64]

# of the largest, what sums of differences may be wrong by
ROUNDING = 1e-12
# what carries less than this part of the light is totally reflected somewhere
TOTAL = 1e-13
# farther than any ghost is from the picture, pixels
EVERYWHERE = 10**7
# every so manieth of the many wavelengths is looked at where few suffice
FINE_STEP = 3
# straight edges of the entrance there: what is asked is how fluxes compare
SIDES = 12


def draw_draft(
    shot: Shot, paths: Sequence[LightPath], differences: Floats, colors: Floats | None = None, first_row: int = 0
) -> None:
    """Mark the paraxial ghosts of some paths.

    Parameters
    ----------
    shot : Shot
    paths : sequence of LightPath
    differences : ndarray, shape (H, W, 3), float64
        Added to; `kernels.raster.sum_rows` turns it into flux per pixel.
    colors : ndarray, shape (P, W, 3), optional
        From `draft_colors`, or changed by hand; None: looked up.
    first_row : int
        Of the picture, which `differences` may hold a band of.
    """
    if not paths:
        return
    packed, opening = shot.packed, shot.opening
    steps, view, axes = _steps(shot, paths)
    # each other layout in memory would be another kernel to compile
    colors = np.ascontiguousarray(draft_colors(shot, paths) if colors is None else colors)
    draw_matrix_ghosts(
        *steps, packed.n_gap, packed.reflectance, packed.sensor_z, *view, opening.edges, opening.radius,
        opening.levels, axes, shot.to_pixels - [0.0, first_row, 0.0, 0.0], shot.gain, colors, differences,
    )  # fmt: skip


def draft_colors(shot: Shot, paths: Sequence[LightPath]) -> Floats:
    """Return what each traced wavelength of each path adds to each channel.

    Parameters
    ----------
    shot : Shot
    paths : sequence of LightPath
        Of two reflections each.

    Returns
    -------
    ndarray, shape (P, W, 3)
    """
    packed = shot.packed
    if not paths:
        return np.zeros((0, len(packed.wavelengths_nm), 3))
    spectra, squares = _spectra(shot, paths)
    plain = shot.weights(packed.wavelengths_nm, spectra)
    colors = np.repeat(plain[None], len(paths), axis=0) if spectra is None else plain
    if shot.between is None:
        return colors
    flux = _fluxes(shot, paths, packed.n_gap, packed.reflectance)
    for steep, every in zip(steep_paths(shot, flux, spectra), (FINE_STEP, 1), strict=True):
        if steep.size == 0:
            continue
        fine, bands = shot.between.finer
        few = [paths[int(k)] for k in steep]
        found = _fluxes(shot, few, fine.n_gap[::every], fine.reflectance[::every])
        own, carried = None, None
        if spectra is not None and bands is not None:
            starts = joined_steps(tuple(paths))[2]
            angles = np.concatenate([squares[starts[k] : starts[k + 1]] for k in steep])
            own = PathSpectrum(spectra.passed[steep], spectra.carried[steep])
            carried = path_spectra(bands, few, angles[None]).carried[:, ::every]
        colors[steep] = bent_weights(shot, flux[steep], own, FINE_NM[::every], found, carried)
    return colors


def _spectra(shot: Shot, paths: Sequence[LightPath]) -> tuple[PathSpectrum | None, Floats]:
    """Compute what coatings let pass along paths, and at which angles: of the rays that they have their colours from.

    The angles are joined as `path_spectra` takes them.
    """
    if shot.curves is None:
        return None, np.empty(0)
    middle = len(shot.packed.n_gap) // 2
    squares = _squares(shot, paths, middle)
    spectra = path_spectra(shot.curves, paths, squares[None])
    # a ray may be totally reflected at one wavelength, and not at another
    starts = joined_steps(tuple(paths))[2]
    for w in sorted(range(len(shot.packed.n_gap)), key=lambda w: abs(w - middle))[1:]:
        dark = np.flatnonzero(spectra.carried.max(axis=1) < TOTAL)
        if dark.size == 0:
            break
        few = [paths[int(k)] for k in dark]
        other = _squares(shot, few, w)
        squares[np.concatenate([np.arange(starts[k], starts[k + 1]) for k in dark])] = other
        found = path_spectra(shot.curves, few, other[None])
        spectra.passed[dark], spectra.carried[dark] = found.passed, found.carried
    return spectra, squares


def _squares(shot: Shot, paths: Sequence[LightPath], w: int) -> Floats:
    """Compute the angles of one ray of each path at a traced wavelength."""
    steps, view, _ = _steps(shot, paths)
    squares = np.empty(len(steps[0]))
    matrix_squares(*steps, shot.packed.n_gap[w], shot.packed.sensor_z, *view, shot.opening.radius, squares)
    return squares


def _fluxes(shot: Shot, paths: Sequence[LightPath], n_gap: Floats, reflectance: Floats) -> Floats:
    """Compute what each ghost brings into the picture at some wavelengths, per unit irradiance, shape (P, M).

    `n_gap` and `reflectance` are as in `PackedLens`, at these. Of an area light, which brings in what lands beside the
    picture, all that it brings anywhere.
    """
    packed, opening = shot.packed, shot.opening
    steps, view, axes = _steps(shot, paths)
    to_pixels, (width, height) = shot.to_pixels, shot.size_px
    if shot.border is not None:
        to_pixels = to_pixels + np.array([EVERYWHERE, EVERYWHERE, 0.0, 0.0])
        width, height = 2 * EVERYWHERE, 2 * EVERYWHERE
    found, seen = np.empty((len(paths), len(n_gap))), np.empty((len(paths), 2))
    for m in range(len(n_gap)):
        weigh_matrix_ghosts(
            *steps, n_gap[m], reflectance[m], packed.sensor_z, *view, opening.edges, opening.radius, axes,
            to_pixels, 1.0, float(width), float(height), SIDES, seen,
        )  # fmt: skip
        found[:, m] = seen[:, 0]
    return found


def _steps(shot: Shot, paths: Sequence[LightPath]) -> tuple[tuple[Any, ...], tuple[float, float, float, float], Floats]:
    """List what kernels take of paths; of the light's way in: entrance, slope, slope across and nearness; the axes."""
    packed = shot.packed
    slope, axes = float(np.tan(shot.incidence.tilt)), shot.incidence.axes
    slope_x, nearness = 0.0, packed.nearness / shot.incidence.tilt_cosine
    if packed.curvature_x is not None:
        # its two meridians are the lens' own, whatever the light's
        slope_x, slope = float(axes[1, 0]) * slope, float(axes[1, 1]) * slope
        axes = np.eye(2)
    steps = (*_in_a_row(tuple(paths)), packed.curvature, packed.curvature_x, packed.z_vertex)
    return steps, (float(packed.semi[packed.first_surface]), slope, slope_x, nearness), axes


# a moving hand asks for the same ones again and again
@lru_cache(maxsize=64)
def _in_a_row(paths: tuple[LightPath, ...]) -> tuple[NDArray[np.int64], ...]:
    """Join the rows and the actions of paths; tell where each begins, and how often it crosses the stop."""
    return *joined_steps(paths), np.array([path.stop_crossings for path in paths])


def seen_small(shot: Shot, times: int) -> Shot:
    """Return a shot at a resolution so many times smaller."""
    size = (-(-shot.size_px[0] // times), -(-shot.size_px[1] // times))
    return replace(shot, to_pixels=shot.to_pixels / times, size_px=size)


def weigh_drafts(shot: Shot, paths: Sequence[LightPath], colors: Floats) -> Floats:
    """Tell how bright the ghosts of `draw_draft` are, the middle wavelength standing for all.

    Parameters
    ----------
    shot : Shot
    paths : sequence of LightPath
    colors : ndarray, shape (len(paths), W, 3)
        As there.

    Returns
    -------
    ndarray, shape (len(paths), 2)
        Luminance of what falls into the picture, and of a pixel where the ghost is; 0 where it misses the picture.
    """
    packed, opening = shot.packed, shot.opening
    steps, view, axes = _steps(shot, paths)
    middle = len(packed.n_gap) // 2
    width, height = shot.size_px
    seen = np.empty((len(paths), 2))
    weigh_matrix_ghosts(
        *steps, packed.n_gap[middle], packed.reflectance[middle], packed.sensor_z, *view, opening.edges, opening.radius,
        axes, shot.to_pixels, shot.gain, float(width), float(height), RIM, seen,
    )  # fmt: skip
    light: Floats = colors.sum(axis=1) @ luminance_weights(shot.colorspace)
    return seen * light[:, None]


def draft_details(shots: Sequence[Shot], paths: Sequence[LightPath], colors: Sequence[Floats]) -> NDArray[np.int64]:
    """Tell how often the resolution may be halved for each ghost among many.

    Parameters
    ----------
    shots : sequence of Shot
    paths : sequence of LightPath
    colors : sequence of ndarray, shape (len(paths), W, 3)
        For each shot, as `draw_draft` takes them.

    Returns
    -------
    ndarray, shape (len(shots), len(paths))

    Notes
    -----
    As in final quality (docs/adr/0003), but each path's irradiance is that of one light of middling field angle at the
    middle wavelength, times each light's intensity.
    """
    middle = sorted(range(len(shots)), key=lambda k: shots[k].incidence.tilt)[len(shots) // 2]
    shot = shots[middle]
    seen = weigh_drafts(shot, paths, colors[middle])
    width, height = shot.size_px
    # against the light that was weighed; where that is dark, nothing is known of any
    power = np.array([each.light.intensity for each in shots]) / (shot.light.intensity or 1.0)
    level = power.sum() * seen[:, 0].sum() / (width * height)
    contrast = np.full((len(shots), len(paths)), np.inf)
    # what is dark at the middle wavelength says nothing
    known = seen[:, 1] > 0.0
    if level > 0.0:
        contrast[:, known] = power[:, None] * seen[known, 1] / level
    details: NDArray[np.int64] = np.sum([contrast < limit for limit in DETAIL_CONTRAST], axis=0)
    return details


def draw_draft_coarsely(
    shot: Shot, paths: Sequence[LightPath], details: NDArray[np.int64], sheets: list[Floats | None], colors: Floats
) -> None:
    """Mark paraxial ghosts, each at a resolution of its own.

    Parameters
    ----------
    shot : Shot
    paths : sequence of LightPath
    details : ndarray, shape (len(paths),)
        How often each one's resolution is halved.
    sheets : list of ndarray or None
        One a resolution, as `draw_draft` takes; made where there is none, and added to.
    colors : ndarray, shape (len(paths), W, 3)
        As in `draw_draft`.
    """
    for detail in range(DETAILS):
        chosen = np.flatnonzero(details == detail)
        if chosen.size:
            small = seen_small(shot, 2**detail)
            held = sheets[detail]
            if held is None:
                held = sheets[detail] = np.zeros((small.size_px[1], small.size_px[0], 3))
            draw_draft(small, [paths[int(k)] for k in chosen], held, colors[chosen])


def draw_draft_by_hand(shot: Shot, path: LightPath, art: PathArt, differences: Floats) -> None:
    """Mark one path with a gain, an offset or a scale; one with a ramp or a blur needs `draft_alone`.

    Parameters
    ----------
    shot : Shot
    path : LightPath
    art : PathArt
    differences : ndarray, shape (H, W, 3), float64
        As in `draw_draft`.
    """
    moved = replace(shot, to_pixels=art.place(shot.to_pixels, _frame(shot, path) if art.framed else None))
    draw_draft(moved, [path], differences, draft_colors(moved, [path]) * art.rgb)


def draft_alone(
    ghosts: Sequence[tuple[Shot, LightPath]], art: Sequence[PathArt], source: Floats | None = None, halved: int = 0
) -> Floats:
    """Draw ghosts on a plane of their own, spread, ramped and blurred.

    Parameters
    ----------
    ghosts : sequence of (Shot, LightPath)
        One with a ramp, or any number without that share a blur and a source: both are linear.
    art : sequence of PathArt
        One a ghost.
    source : ndarray, shape (N, 5), or None
        What the extent of an area light spreads them over (`optics.border`): columns and rows.
    halved : int
        How often the resolution may be halved because they are spread.

    Returns
    -------
    ndarray, shape (H, W, 3)
        Flux per pixel.
    """
    shot, first = ghosts[0][0], art[0]
    detail = max(halved, coarseness(first, shot.to_pixels) if first.blur > 0.0 else 0)
    own = shot.to_pixels / 2.0**detail
    width, height = (-(-side // 2**detail) for side in shot.size_px)
    mx, my = first.margin(own)
    kernel = None if source is None else shape_kernel(source, 0.5**detail)
    if kernel is not None:
        mx, my = mx + kernel.shape[1] // 2, my + kernel.shape[0] // 2
    sheet = np.zeros((height + 2 * my, width + 2 * mx, 3))
    frames = [_frame(shot, path) if each.framed else None for (shot, path), each in zip(ghosts, art, strict=True)]
    places = [each.place(shot.to_pixels, frame) / 2.0**detail for each, frame in zip(art, frames, strict=True)]
    for (lit, path), each, placed in zip(ghosts, art, places, strict=True):
        moved = replace(lit, to_pixels=placed + np.array([mx, my, 0.0, 0.0]))
        draw_draft(moved, [path], sheet, draft_colors(replace(lit, to_pixels=placed * 2.0**detail), [path]) * each.rgb)
    sum_rows(sheet, sheet)
    if kernel is not None:
        sheet = spread_within(sheet, kernel)
    planes: list[Plane | None] = [None] * DETAILS
    planes[detail] = finish(sheet, first, frames[0], places[0], own)
    return np.asarray(merge(planes, shot.size_px), dtype=np.float64)


def mark_spread(
    ghosts: Sequence[tuple[Shot, LightPath]], art: Sequence[PathArt], source: Floats, halved: int,
    sheets: list[Floats | None], scratch: Floats | None = None,
) -> Floats:  # fmt: skip
    """Mark paraxial ghosts of an area light that share a spread, and nothing else is done to.

    Parameters
    ----------
    ghosts, art, source, halved
        As in `draft_alone`; none with a ramp or a blur.
    sheets : list of ndarray or None
        One a resolution; made where there is none, and added to: `kernels.raster.sum_rows` twice turns them into flux
        per pixel.
    scratch : ndarray of float64, optional
        Zeros from the call before, to be used again where they suffice.

    Returns
    -------
    ndarray of float64
        Scratch for the next call.
    """
    shot = ghosts[0][0]
    width, height = (-(-side // 2**halved) for side in shot.size_px)
    kernel = shape_kernel(source, 0.5**halved)
    my, mx = (side // 2 for side in kernel.shape)
    sides = height + 2 * my, width + 2 * mx, 3
    if scratch is None or scratch.size < np.prod(sides):
        scratch = np.zeros(sides).ravel()
    marks = scratch[: np.prod(sides)].reshape(sides)
    for (lit, path), each in zip(ghosts, art, strict=True):
        placed = each.place(shot.to_pixels, _frame(lit, path) if each.framed else None)
        moved = replace(lit, to_pixels=placed / 2.0**halved + np.array([mx, my, 0.0, 0.0]))
        draw_draft(moved, [path], marks, draft_colors(replace(lit, to_pixels=placed), [path]) * each.rgb)
    held = sheets[halved]
    if held is None:
        held = sheets[halved] = np.zeros((height, width, 3))
    steps = np.diff(kernel, axis=1, prepend=0.0, append=0.0)
    steps[np.abs(steps) < ROUNDING * kernel.max()] = 0.0
    rows, columns = np.nonzero(steps)
    spread_marks(marks, rows, columns, steps[rows, columns], np.array([my, mx]), held)
    return scratch


def spread_light(sheet: Floats) -> Floats:
    """Turn a sheet that `mark_spread` marked into flux per pixel, in place."""
    sum_rows(sheet, sheet)
    sum_rows(sheet, sheet)
    # what the sums' rounding leaves is no light
    sheet[np.abs(sheet) < ROUNDING * np.abs(sheet).max()] = 0.0
    return sheet


def draft_centre(shot: Shot, path: LightPath) -> Floats:
    """Compute where a ghost's middle lands by matrices, upright, mm, shape (2,)."""
    return np.array(_frame(shot, path).centre)


def _frame(shot: Shot, path: LightPath) -> Frame:
    """Compute a ghost's centre and size at the middle wavelength by matrices; of an oval its larger size."""
    packed, axes = shot.packed, shot.incidence.axes
    slope = float(np.tan(shot.incidence.tilt))
    if packed.curvature_x is None:
        place, size = _meridian(shot, path, packed.curvature, slope)
        centre = -place * axes[1]
        return Frame((float(centre[0]), float(centre[1])), size)
    x, across = _meridian(shot, path, packed.curvature_x, float(axes[1, 0]) * slope)
    y, along = _meridian(shot, path, packed.curvature, float(axes[1, 1]) * slope)
    return Frame((-x, -y), max(across, along))


def _meridian(shot: Shot, path: LightPath, curvature: Floats, slope: float) -> tuple[float, float]:
    """Return where a ghost's middle lands in one plane through the axis, and its radius there."""
    packed = shot.packed
    to_stop = np.empty((path.stop_crossings, 2, 2))
    middle = len(packed.wavelengths_nm) // 2
    a, b, _, _ = path_matrices(
        path.rows, path.actions, curvature, packed.z_vertex, packed.n_gap[middle], packed.sensor_z, to_stop
    )
    # the rays of a near light spread: their slope grows with their height
    nearness = packed.nearness / shot.incidence.tilt_cosine
    a += nearness * b
    to_stop[:, :, 0] += nearness * to_stop[:, :, 1]
    # the entrance, or the iris as seen from the front, whichever is smaller
    centre, radius = 0.0, float(packed.semi[packed.first_surface])
    for ma, mb in to_stop[:, 0]:
        if shot.opening.radius < radius * abs(ma):
            centre, radius = -mb * slope / ma, shot.opening.radius / abs(ma)
    return float(a * centre + b * slope), float(abs(a) * radius)
