"""Colours of ghosts in draft quality: the weight of each traced wavelength in each channel.

Where a path's throughput is steep between the traced wavelengths, its flux is computed at more (`steep_ghosts`).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray

from ...kernels.paraxial.ghosts import RIM
from ...kernels.tracing.sequential import REFLECT, REFRACT
from ...optics.colour.spectrum import hats
from ...optics.lens.paths import LightPath
from ...optics.rays.path_reflectance import CURVE_NM, BandCurves, PathSpectrum, joined_steps, products_between
from ...optics.rays.steepness import curve_hats
from ...typing import Floats, Indices, Mask
from ..scene.shot import Shot, at_fine_wavelengths
from .matrix_flux import ENTRANCE_SIDES, matrix_fluxes
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

# squared sine above which transmittance and reflectance change fast with the angle; 1 is total reflection
CRITICAL = 0.8


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
            traced, curve = throughput[chosen], steep @ curve_hats(tuple(nm))
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
    _, actions, starts = joined_steps(tuple(paths))
    # few paths are near total reflection
    for p in np.flatnonzero(_largest(paths, REFRACT, squares) > CRITICAL).tolist():
        own = slice(starts[p], starts[p + 1])
        farthest = np.where(actions[own] == REFRACT, angles[:, own], 0.0).max(axis=1).argmin()
        squares[own] = angles[farthest, own]
    return squares


def _nearly_total(paths: Sequence[LightPath], angles: Floats) -> Mask:
    """Return which paths have a mirror near total reflection, where R is no parabola in the angle; (W, steps)."""
    near: Mask = _largest(paths, REFLECT, np.where(angles < 1.0, angles, 0.0).max(axis=0)) > CRITICAL
    return near


def _largest(paths: Sequence[LightPath], action: int, angles: Floats) -> Floats:
    """Return the largest of the angles, (steps,), at which each path is refracted or reflected, (P,)."""
    _, actions, starts = joined_steps(tuple(paths))
    return np.maximum.reduceat(np.where(actions == action, angles, 0.0), starts[:-1])
