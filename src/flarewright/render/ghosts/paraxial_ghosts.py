"""Ghosts in draft quality: paraxial matrices (Lee and Eisemann 2013; Van Acoleyen 2025, chapter 4).

Drafts use the paths, wavelengths, iris and units of final quality, but take milliseconds: every ghost is the uniformly
lit image of the entrance, cut by the iris, with the colour of one ray. A toroid has one matrix per meridian, so its
ghosts are ovals. Decentre, tilt, aspheric terms and figure errors are of higher order and ignored.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray

from ...kernels.paraxial.arguments import EntranceLight, MeridianLens, PathList, SensorFrame, StopOutline
from ...kernels.paraxial.ghosts import RIM, draw_matrix_ghosts, measure_matrix_ghosts
from ...kernels.raster.edge_blur import spread_marks
from ...kernels.raster.polygons import sum_rows
from ...kernels.tracing.sequential import REFLECT, REFRACT
from ...optics.colour.rgb import luminance_weights
from ...optics.colour.spectrum import hats
from ...optics.lens.paths import LightPath
from ...optics.rays.path_reflectance import CURVE_NM, BandCurves, PathSpectrum, joined_steps, products_between
from ...typing import Floats, Indices, Mask
from ..image.canvas import DETAIL_CONTRAST, DETAILS, Plane, merge
from ..scene.art_rules import PathArt
from ..scene.paraxial_place import ghost_frame
from ..scene.shot import Shot, at_fine_wavelengths
from .art_filters import coarseness, filtered_ghost
from .extent_blur import shape_kernel, spread_within
from .steep_ghosts import (
    ABRUPT_PART,
    DARK_PART,
    FAINT_PART,
    bent_weights,
    ends,
    light_up_to_its_end,
    over,
    steep_gaps,
    steep_paths,
    within_gaps,
)

# rounding error of sums of differences, relative to the largest value
ROUNDING = 1e-12
# squared sine above which transmittance and reflectance change fast with the angle; 1 is total reflection
CRITICAL = 0.8
# an offset larger than the distance of any ghost from the picture, pixels
FAR_PX = 10**7
# straight edges of the round entrance for comparing fluxes
ENTRANCE_SIDES = 16


def draw_draft(
    shot: Shot, paths: Sequence[LightPath], differences: Floats, colors: Floats | None = None, first_row: int = 0
) -> None:
    """Mark the paraxial ghosts of paths in a picture of differences.

    Parameters
    ----------
    shot : Shot
    paths : sequence of LightPath
    differences : ndarray, shape (H, W, 3), float64
        Added to; `kernels.raster.polygons.sum_rows` turns it into flux per pixel.
    colors : ndarray, shape (P, W, 3), optional
        From `draft_colors`, possibly changed by art rules, with or without `Between.fine_nm`; None: computed.
    first_row : int
        First row of the picture that `differences` holds, if it is a band.
    """
    if not paths:
        return
    packed, opening = shot.packed, shot.opening
    bent, light, axes = _arguments(shot)
    colors = draft_colors(shot, paths) if colors is None else colors
    colors, more = colors[:, : len(packed.n_gap)], colors[:, len(packed.n_gap) :]
    hidden = np.flatnonzero(more.any(axis=(1, 2)))
    if hidden.size > 0:
        lit = np.flatnonzero(more.any(axis=(0, 2)))
        waves, fine = slice(lit[0], lit[-1] + 1), at_fine_wavelengths(shot)
        few = replace(fine.packed, n_gap=fine.packed.n_gap[waves], reflectance=fine.packed.reflectance[waves])
        own = [paths[int(k)] for k in hidden]
        draw_draft(replace(fine, packed=few), own, differences, more[hidden, waves], first_row)
    # each other memory layout would compile another kernel
    colors = np.ascontiguousarray(colors)
    frame = SensorFrame(axes, shot.to_pixels - [0.0, first_row, 0.0, 0.0], shot.gain)
    draw_matrix_ghosts(
        _joined_paths(tuple(paths)), bent, packed.curvature_x, light, _outline(shot), opening.levels, frame, colors,
        differences,
    )  # fmt: skip


def draft_colors(shot: Shot, paths: Sequence[LightPath]) -> Floats:
    """Return the weight of each traced wavelength of each path in each channel.

    Parameters
    ----------
    shot : Shot
    paths : sequence of LightPath
        Of two reflections each.

    Returns
    -------
    ndarray, shape (P, W, 3)
        If a path is dark at all traced wavelengths and not beyond them, the weights at `Between.fine_nm` follow:
        (P, W + M, 3).
    """
    packed = shot.packed
    if not paths:
        return np.zeros((0, len(packed.wavelengths_nm), 3))
    flux, angles = matrix_fluxes(shot, paths, packed.n_gap, packed.reflectance)
    if shot.between is None:
        return _plain_weights(shot, paths, _spectra(shot, paths, angles)[0])
    between = shot.between
    fine_nm, (fine, bands), near = between.fine_nm, between.finer, between.beyond(packed.wavelengths_nm)
    beyond, more = matrix_fluxes(shot, paths, fine.n_gap[near], fine.reflectance, near)
    angles = np.concatenate([angles, more])
    spectra, squares = _spectra(shot, paths, angles, fine_nm[near], _transmitted(paths, angles))
    colors = _plain_weights(shot, paths, spectra)
    throughput = flux if spectra is None else over(flux, spectra.carried)
    carried = _carried(bands, paths, squares, more, near)
    known_nm, known = _merged((packed.wavelengths_nm, throughput), (fine_nm[near], over(beyond, carried)))
    little, much_steep = steep_paths(shot, known_nm, known, spectra, _nearly_total(paths, angles))
    if between.lines_nm is not None:
        little, much_steep = little[:0], np.union1d(little, much_steep)
    for chosen, much in ((little, False), (much_steep, True)):
        if chosen.size == 0:
            continue
        few = [paths[int(k)] for k in chosen]
        steps = _steps_of(paths, chosen)
        waves = np.arange(len(fine_nm)) if much else between.steep
        # how much of a sliver lands in the picture depends on the polygon: take the one that is drawn
        sides = RIM if much else ENTRANCE_SIDES
        steep, more = matrix_fluxes(shot, few, fine.n_gap[waves], fine.reflectance, waves, sides)
        steep = over(steep, _carried(bands, few, squares[steps], more, waves))
        if much:
            nodes_nm = fine_nm[np.concatenate([near, waves])]
            own = _spectra(shot, few, np.concatenate([angles[:, steps], more]), nodes_nm, squares[steps])[0]
            drawn = matrix_fluxes(shot, few, packed.n_gap, packed.reflectance, sides=RIM)[0]
            traced = drawn if own is None else over(drawn, own.carried)
            curve = _curve(shot, few, squares[steps], steep, own)
        else:
            own = None if spectra is None else PathSpectrum(spectra.passed[chosen], spectra.carried[chosen])
            nm, steep = _merged((known_nm, known[chosen]), (fine_nm[waves], steep))
            traced, curve = throughput[chosen], steep @ hats(CURVE_NM, nm)
        colors[chosen] = bent_weights(shot, traced, own, curve)
    # flux under total reflection is rounding error
    light = beyond.max(axis=1)
    hidden = np.flatnonzero((flux.max(axis=1) < DARK_PART * light) & (light > DARK_PART * FAINT_PART * flux.max()))
    return colors if hidden.size == 0 else _with_hidden(shot, paths, colors, flux, hidden)


def _plain_weights(shot: Shot, paths: Sequence[LightPath], spectra: PathSpectrum | None) -> Floats:
    """Return the weights of `draft_colors` of paths whose throughput is linear between the traced wavelengths."""
    plain = shot.weights(shot.packed.wavelengths_nm, spectra)
    return np.repeat(plain[None], len(paths), axis=0) if spectra is None else plain


def _with_hidden(
    shot: Shot, paths: Sequence[LightPath], colors: Floats, flux: Floats, hidden: NDArray[np.intp]
) -> Floats:
    """Add weights at fine wavelengths for paths that are dark at all traced ones, unless they are faint there too."""
    fine = at_fine_wavelengths(shot)
    fine_nm = fine.packed.wavelengths_nm
    waves = np.arange(len(fine_nm))
    own = [paths[int(k)] for k in hidden]
    flux_there, angles = matrix_fluxes(fine, own, fine.packed.n_gap, fine.packed.reflectance, sides=RIM)
    light, beyond = (
        np.abs((of[:, :, None] * in_channels).sum(axis=1)).max(axis=1)
        for of, in_channels in ((flux, colors), (flux_there, fine.weights(fine_nm)))
    )
    seen = np.flatnonzero(beyond > FAINT_PART * light.max())
    if seen.size == 0:
        return colors
    few, angles = [own[int(k)] for k in seen], angles[:, _steps_of(own, seen)]
    spectra, squares = _spectra(fine, few, angles)
    throughput = over(flux_there[seen], _carried(fine.curves, few, squares, angles, waves))
    more, colors = np.zeros((len(paths), len(fine_nm), 3)), colors.copy()
    more[hidden[seen]] = bent_weights(fine, throughput, spectra, _curve(shot, few, squares, throughput, spectra))
    colors[hidden[seen]] = 0.0
    return np.concatenate([colors, more], axis=1)


def _steps_of(paths: Sequence[LightPath], chosen: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return the steps of some paths among those of all concatenated ones."""
    starts = joined_steps(tuple(paths))[2]
    return np.concatenate([np.arange(starts[k], starts[k + 1]) for k in chosen])


def _merged(one: tuple[Floats, Floats], other: tuple[Floats, Floats]) -> tuple[Floats, Floats]:
    """Join values at some wavelengths, (N,) and (P, N), with those at others, rising."""
    nm, order = np.unique(np.concatenate([one[0], other[0]]), return_index=True)
    return nm, np.concatenate([one[1], other[1]], axis=1)[:, order]


def _carried(
    bands: BandCurves | None, paths: Sequence[LightPath], squares: Floats, angles: Floats, near: Indices
) -> Floats:
    """Return what rays carry that have the mean reflectances of some wavelengths, shape (P, M).

    Parameters
    ----------
    bands : BandCurves or None
        None: without films.
    paths : sequence of LightPath
    squares : ndarray, shape (steps,)
        From `_spectra`.
    angles : ndarray, shape (M, steps)
        From `matrix_fluxes`.
    near : ndarray of int, shape (M,)
        Wavelengths of `bands`.
    """
    if bands is None:
        return np.ones((len(paths), len(near)))
    # `take` keeps the memory order that the kernel needs
    return products_between(np.take(bands.means, near, axis=2), paths, squares, angles, np.eye(len(near)))


def _curve(
    shot: Shot, paths: Sequence[LightPath], squares: Floats, throughput: Floats, spectra: PathSpectrum | None
) -> Floats:
    """Return the throughput of paths at `CURVE_NM`; where it is steep or ends, it is computed there.

    Parameters
    ----------
    shot : Shot
    paths : sequence of LightPath
    squares : ndarray, shape (steps,)
        From `_spectra`.
    throughput : ndarray, shape (P, M)
        At `Between.fine_nm`.
    spectra : PathSpectrum or None
        Of the paths.

    Returns
    -------
    ndarray, shape (P, L)
    """
    assert shot.between is not None
    between, (fine, bands) = shot.between, shot.between.finer
    n_gap, nearest, curve = between.curve_indices, between.nearest, throughput @ between.spread
    # between lines is no light
    if between.lines_nm is not None:
        return curve

    steep = steep_gaps(shot, between.fine_nm, throughput, spectra)
    for k in np.flatnonzero(steep.any(axis=1)).tolist():
        own, steps = [paths[k]], squares[_steps_of(paths, np.array([k]))]
        more = within_gaps(between.fine_nm, steep[k])
        flux, angles = matrix_fluxes(shot, own, n_gap[more], fine.reflectance, nearest[more], RIM)
        curve[k, more] = over(flux, _carried(bands, own, steps, angles, nearest[more]))[0]
        # a curve's wavelengths lie too far apart to resolve an end
        at_curve = curve[[k]]
        for gaps, bright, dark in zip(ends(at_curve, ABRUPT_PART), (1, 0), (0, 1), strict=True):
            for m in np.flatnonzero(gaps[0]).tolist():
                low, high = m + bright, m + dark
                at = partial(_flux_between, shot, own, n_gap[low], n_gap[high], nearest[[low]])
                # relative to the bright bound, because rays carry nearly the same within a gap
                bright_flux = at(0.0)
                if not bright_flux > 0.0:
                    continue
                scale = at_curve[0, low] / bright_flux
                lit, unlit = (scale * part for part in light_up_to_its_end(bright_flux, at))
                # by linear interpolation each bound has half of its value
                curve[k, low] += lit - 0.5 * at_curve[0, low]
                curve[k, high] += unlit
    return curve


def _flux_between(shot: Shot, path: list[LightPath], low: Floats, high: Floats, near: Indices, part: float) -> float:
    """Compute the flux of one path where indices lie between two sets, with the mean reflectances of one wavelength."""
    assert shot.between is not None
    reflectance = shot.between.finer[0].reflectance
    return float(matrix_fluxes(shot, path, (low + part * (high - low))[None], reflectance, near, RIM)[0][0, 0])


def _spectra(
    shot: Shot, paths: Sequence[LightPath], angles: Floats, more_nm: Floats | None = None, squares: Floats | None = None
) -> tuple[PathSpectrum | None, Floats]:
    """Compute what coatings pass along one ray of each path.

    Parameters
    ----------
    shot : Shot
    paths : sequence of LightPath
    angles : ndarray, shape (W + N, steps)
        From `matrix_fluxes`, at the traced wavelengths and at others.
    more_nm : ndarray, shape (N,), optional
        These other wavelengths.
    squares : ndarray, shape (steps,), optional
        Result of an earlier call, for these paths; None: chosen.

    Returns
    -------
    spectra : PathSpectrum or None
        None without films.
    squares : ndarray, shape (steps,)
        Angles at which the light is transmitted: those of the middle wavelength, unless its ray is totally reflected.
    """
    traced_nm = shot.packed.wavelengths_nm
    if squares is None:
        squares = _transmitted(paths, angles[: len(traced_nm)])
    if shot.curves is None:
        return None, squares
    nodes_nm, order = np.unique(np.concatenate([traced_nm, [] if more_nm is None else more_nm]), return_index=True)
    shares = _shares(tuple(nodes_nm), tuple(traced_nm))
    through = products_between(shot.curves.reflectance, paths, squares, _with_middles(angles[order]), shares)
    return PathSpectrum(through[:, : len(CURVE_NM)], through[:, len(CURVE_NM) :]), squares


@lru_cache(maxsize=64)
def _shares(nodes_nm: tuple[float, ...], traced_nm: tuple[float, ...]) -> Floats:
    """Return the parts that nodes and the middles between them have in the columns of `BandCurves.reflectance`.

    Angles are almost linear in 1 / wavelength^2 between nodes, as indices are. What a film reflects near its zero is a
    parabola in the angle, so the shares are those of Lagrange's polynomials: a line is several per cent too bright.
    """
    line = hats(-(np.concatenate([CURVE_NM, traced_nm]) ** -2.0), -(np.array(nodes_nm) ** -2.0))
    shares = np.empty((2 * len(line) - 1, line.shape[1]))
    shares[::2] = line * (2.0 * line - 1.0)
    shares[1::2] = 4.0 * line[:-1] * line[1:]
    return shares


def _with_middles(angles: Floats) -> Floats:
    """Insert the means of neighbours between angles, (N, steps): (2 N - 1, steps)."""
    all_of = np.empty((2 * len(angles) - 1, angles.shape[1]))
    all_of[::2] = angles
    all_of[1::2] = 0.5 * (angles[:-1] + angles[1:])
    return all_of


def _transmitted(paths: Sequence[LightPath], angles: Floats) -> Floats:
    """Return the angles, (steps,), of the middle wavelength, or of the one whose ray is farthest from total reflection.

    `angles` has shape (W, steps).
    What passes at a fixed angle ends where total reflection begins at it, so this angle must be far from it. That rays
    of other colours are closer to it is a part of their throughput.
    """
    squares: Floats = angles[len(angles) // 2].copy()
    most, starts = _largest(paths, REFRACT, angles), joined_steps(tuple(paths))[2]
    least = most.argmin(axis=0)
    for p in np.flatnonzero(most[len(angles) // 2] > CRITICAL).tolist():
        squares[starts[p] : starts[p + 1]] = angles[least[p], starts[p] : starts[p + 1]]
    return squares


def _nearly_total(paths: Sequence[LightPath], angles: Floats) -> Mask:
    """Return which paths have a mirror near total reflection, where R is no parabola in the angle; (W, steps)."""
    below = np.where(angles < 1.0, angles, 0.0)
    near: Mask = _largest(paths, REFLECT, below).max(axis=0) > CRITICAL
    return near


def _largest(paths: Sequence[LightPath], action: int, angles: Floats) -> Floats:
    """Return the largest of the angles, (W, steps), at which each path is refracted or reflected, (W, P)."""
    _, actions, starts = joined_steps(tuple(paths))
    return np.maximum.reduceat(np.where(actions == action, angles, 0.0), starts[:-1], axis=1)


def matrix_fluxes(
    shot: Shot, paths: Sequence[LightPath], n_gap: Floats, reflectance: Floats, near: Indices | None = None,
    sides: int = ENTRANCE_SIDES,
) -> tuple[Floats, Floats]:  # fmt: skip
    """Compute the flux of each ghost in the picture at some wavelengths, and the angles of one ray.

    Parameters
    ----------
    shot : Shot
    paths : sequence of LightPath
    n_gap : ndarray, shape (M, K + 1)
    reflectance : ndarray, shape (W, K, S)
    near : ndarray of int, shape (M,), optional
        Which of the W belong to each of the M; None: they are the same.
    sides : int
        Edges of the round entrance.

    Returns
    -------
    flux : ndarray, shape (P, M)
        Per unit irradiance. For an area light it counts everywhere, because its spread brings light from beside the
        picture into it.
    angles : ndarray, shape (M, steps)
        Squared sines on the side of the lower index.
    """
    bent, light, axes = _arguments(shot)
    joined, iris = _joined_paths(tuple(paths)), _outline(shot)
    to_pixels, (width, height) = shot.to_pixels, shot.size_px
    if shot.border is not None:
        to_pixels = to_pixels + np.array([FAR_PX, FAR_PX, 0.0, 0.0])
        width, height = 2 * FAR_PX, 2 * FAR_PX
    own = bent._replace(n_gap=n_gap, reflectance=reflectance)
    found, angles = np.empty((len(paths), len(n_gap), 2)), np.empty((len(n_gap), len(joined.rows)))
    measure_matrix_ghosts(
        joined, own, np.arange(len(n_gap)) if near is None else near, shot.packed.curvature_x, light, iris,
        SensorFrame(axes, to_pixels, 1.0), float(width), float(height), sides, found, angles,
    )  # fmt: skip
    return found[:, :, 0], angles


def _arguments(shot: Shot) -> tuple[MeridianLens, EntranceLight, Floats]:
    """Return a shot's lens at all wavelengths and its incoming light as the kernels take them, and the axes."""
    packed = shot.packed
    slope, axes = float(np.tan(shot.incidence.tilt)), shot.incidence.axes
    slope_x, nearness = 0.0, packed.nearness / shot.incidence.tilt_cosine
    if packed.curvature_x is not None:
        # the two meridians are those of the lens, not of the light
        slope_x, slope = float(axes[1, 0]) * slope, float(axes[1, 1]) * slope
        axes = np.eye(2)
    lens = MeridianLens(packed.curvature, packed.z_vertex, packed.n_gap, packed.reflectance, packed.sensor_z)
    return lens, EntranceLight(float(packed.semi[packed.first_surface]), slope, slope_x, nearness), axes


def _outline(shot: Shot) -> StopOutline:
    """Return the opening of a shot's iris as the kernels take it."""
    return StopOutline(shot.opening.edges, shot.opening.radius)


# drags repeat the same paths
@lru_cache(maxsize=64)
def _joined_paths(paths: tuple[LightPath, ...]) -> PathList:
    """Join the steps of paths."""
    return PathList(*joined_steps(paths), np.array([path.stop_crossings for path in paths]))


def downsampled(shot: Shot, times: int) -> Shot:
    """Return a shot whose resolution is `times` times smaller."""
    size = (-(-shot.size_px[0] // times), -(-shot.size_px[1] // times))
    return replace(shot, to_pixels=shot.to_pixels / times, size_px=size)


def weigh_drafts(shot: Shot, paths: Sequence[LightPath], colors: Floats) -> Floats:
    """Return the brightness of the ghosts of `draw_draft`, computed at the middle wavelength.

    Parameters
    ----------
    shot : Shot
    paths : sequence of LightPath
    colors : ndarray, shape (len(paths), W, 3)
        As in `draw_draft`.

    Returns
    -------
    ndarray, shape (len(paths), 2)
        Luminance of the light in the picture, and of one pixel of the ghost; 0 for a ghost that misses the picture.
    """
    bent, incoming, axes = _arguments(shot)
    middle = [len(bent.n_gap) // 2]
    joined, frame = _joined_paths(tuple(paths)), SensorFrame(axes, shot.to_pixels, shot.gain)
    width, height = shot.size_px
    seen, angles = np.empty((len(paths), 1, 2)), np.empty((1, len(joined.rows)))
    measure_matrix_ghosts(
        joined, bent._replace(n_gap=bent.n_gap[middle]), np.array(middle), shot.packed.curvature_x, incoming,
        _outline(shot), frame, float(width), float(height), RIM, seen, angles,
    )  # fmt: skip
    light: Floats = colors.sum(axis=1) @ luminance_weights(shot.colorspace)
    return seen[:, 0] * light[:, None]


def draft_details(shots: Sequence[Shot], paths: Sequence[LightPath], colors: Sequence[Floats]) -> Indices:
    """Return how often the resolution can be halved for each ghost among many.

    Parameters
    ----------
    shots : sequence of Shot
    paths : sequence of LightPath
    colors : sequence of ndarray, shape (len(paths), W, 3)
        One per shot, as `draw_draft` takes them.

    Returns
    -------
    ndarray, shape (len(shots), len(paths))

    Notes
    -----
    As in final quality (docs/adr/0003), except that each path's irradiance is computed once, for the light with the
    median field angle at the middle wavelength, and scaled by each light's intensity.
    """
    middle = sorted(range(len(shots)), key=lambda k: shots[k].incidence.tilt)[len(shots) // 2]
    shot = shots[middle]
    seen = weigh_drafts(shot, paths, colors[middle])
    width, height = shot.size_px
    # relative to the weighed light; if that is dark, every contrast stays infinite
    power = np.array([each.light.intensity for each in shots]) / (shot.light.intensity or 1.0)
    level = power.sum() * seen[:, 0].sum() / (width * height)
    contrast = np.full((len(shots), len(paths)), np.inf)
    # ghosts that are dark at the middle wavelength keep infinite contrast
    known = seen[:, 1] > 0.0
    if level > 0.0:
        contrast[:, known] = power[:, None] * seen[known, 1] / level
    details: Indices = np.sum([contrast < limit for limit in DETAIL_CONTRAST], axis=0)
    return details


def draw_draft_by_detail(
    shot: Shot, paths: Sequence[LightPath], details: Indices, pyramid: list[Floats | None], colors: Floats
) -> None:
    """Mark paraxial ghosts, each at its own resolution.

    Parameters
    ----------
    shot : Shot
    paths : sequence of LightPath
    details : ndarray, shape (len(paths),)
        How often the resolution of each ghost is halved.
    sheets : list of ndarray or None
        One per resolution, as `draw_draft` takes them; missing ones are created.
    colors : ndarray, shape (len(paths), W, 3)
        As in `draw_draft`.
    """
    for detail in range(DETAILS):
        chosen = np.flatnonzero(details == detail)
        if chosen.size:
            small = downsampled(shot, 2**detail)
            held = pyramid[detail]
            if held is None:
                held = pyramid[detail] = np.zeros((small.size_px[1], small.size_px[0], 3))
            draw_draft(small, [paths[int(k)] for k in chosen], held, colors[chosen])


def draw_overridden_draft(shot: Shot, path: LightPath, art: PathArt, differences: Floats) -> None:
    """Mark one path with a gain, an offset or a scale; ramps and blurs need `draft_alone`.

    Parameters
    ----------
    shot : Shot
    path : LightPath
    art : PathArt
    differences : ndarray, shape (H, W, 3), float64
        As in `draw_draft`.
    """
    moved = replace(shot, to_pixels=art.place(shot.to_pixels, ghost_frame(shot, path) if art.framed else None))
    draw_draft(moved, [path], differences, draft_colors(moved, [path]) * art.rgb)


def draft_alone(
    ghosts: Sequence[tuple[Shot, LightPath]], art: Sequence[PathArt], source: Floats | None = None, halved: int = 0
) -> Floats:
    """Draw ghosts on a separate plane, then spread, ramp and blur it.

    Parameters
    ----------
    ghosts : sequence of (Shot, LightPath)
        One ghost with a ramp, or any number without that share a blur and a source, since both are linear.
    art : sequence of PathArt
        One per ghost.
    source : ndarray, shape (N, 5), or None
        The shape over which an area light spreads them: columns and rows (`optics.pupil.polygon`).
    halved : int
        How often the resolution can be halved because they are spread.

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
    marks = np.zeros((height + 2 * my, width + 2 * mx, 3))
    frames = [ghost_frame(shot, path) if each.framed else None for (shot, path), each in zip(ghosts, art, strict=True)]
    places = [each.place(shot.to_pixels, frame) / 2.0**detail for each, frame in zip(art, frames, strict=True)]
    for (lit, path), each, placed in zip(ghosts, art, places, strict=True):
        moved = replace(lit, to_pixels=placed + np.array([mx, my, 0.0, 0.0]))
        draw_draft(moved, [path], marks, draft_colors(replace(lit, to_pixels=placed * 2.0**detail), [path]) * each.rgb)
    sum_rows(marks, marks)
    if kernel is not None:
        marks = spread_within(marks, kernel)
    planes: list[Plane | None] = [None] * DETAILS
    planes[detail] = filtered_ghost(marks, first, frames[0], places[0], own)
    return np.asarray(merge(planes, shot.size_px), dtype=np.float64)


def mark_spread(
    ghosts: Sequence[tuple[Shot, LightPath]], art: Sequence[PathArt], source: Floats, halved: int,
    pyramid: list[Floats | None], scratch: Floats | None = None,
) -> Floats:  # fmt: skip
    """Mark paraxial ghosts of an area light that share a spread and have no ramp or blur.

    Parameters
    ----------
    ghosts, art, source, halved
        As in `draft_alone`, without ramps and blurs.
    sheets : list of ndarray or None
        One per resolution; missing ones are created. Two calls of `kernels.raster.polygons.sum_rows` turn them into
        flux per pixel.
    scratch : ndarray of float64, optional
        Zeros returned by the previous call, reused if large enough.

    Returns
    -------
    ndarray of float64
        Scratch memory for the next call.
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
        placed = each.place(shot.to_pixels, ghost_frame(lit, path) if each.framed else None)
        moved = replace(lit, to_pixels=placed / 2.0**halved + np.array([mx, my, 0.0, 0.0]))
        draw_draft(moved, [path], marks, draft_colors(replace(lit, to_pixels=placed), [path]) * each.rgb)
    held = pyramid[halved]
    if held is None:
        held = pyramid[halved] = np.zeros((height, width, 3))
    steps = np.diff(kernel, axis=1, prepend=0.0, append=0.0)
    steps[np.abs(steps) < ROUNDING * kernel.max()] = 0.0
    rows, columns = np.nonzero(steps)
    spread_marks(marks, rows, columns, steps[rows, columns], np.array([my, mx]), held)
    return scratch


def spread_light(marks: Floats) -> Floats:
    """Turn a picture marked by `mark_spread` into flux per pixel, in place."""
    sum_rows(marks, marks)
    sum_rows(marks, marks)
    # remove rounding errors of the sums
    marks[np.abs(marks) < ROUNDING * np.abs(marks).max()] = 0.0
    return marks
