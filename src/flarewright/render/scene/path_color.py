"""Colours of a path between the traced wavelengths, where coatings vary."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache, partial
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from ...kernels.tracing.ray_interpolation import visible_areas
from ...kernels.tracing.representative_rays import choose_representatives, choose_seen, seen_rays
from ...model import Lens
from ...optics.colour.spectrum import hats
from ...optics.lens.paths import LightPath, direct_path
from ...optics.rays.bundle import Bundle
from ...optics.rays.path_reflectance import CURVE_NM, PathSpectrum, path_spectra, spectra_of_rays
from ...optics.rays.steepness import curve_hats
from ...typing import Floats, Mask
from .shot import Shot, seen_light

# number of rays of a bundle that represent its angles of incidence, at all wavelengths together, and where one half of
# them gives colours that differ by more than a part of the largest channel from the other half's
RAYS, MORE_RAYS, SAMPLE_ERROR = 64, 256, 0.02
# part of the light below which a wavelength has no rays
LEAST_SHARE = 0.02
# number of triangles of the grid among which they are chosen
TRIANGLES = 4096

# x of the meridional frame changes its sign in the mirror image of a bundle
_MIRRORED_AXES, _MIRRORED_PLACES = np.array([[[1.0], [1.0]], [[-1.0], [1.0]]]), np.array([[[1, 1, 1]], [[1, -1, 1]]])
# a mask of the traced rays that pass
RayFilter = Callable[[Floats], Mask]


def traced_spectrum(shot: Shot, path: LightPath, bundle: Bundle, to_pixels: Floats) -> PathSpectrum | None:
    """Compute what coatings pass along a ghost's rays, as a spectrum.

    Parameters
    ----------
    shot : Shot
    path : LightPath
    bundle : Bundle
        Traced at least at one wavelength.
    to_pixels : ndarray, shape (4,)
        Of the shot or of the ghost. Coatings depend on the angle, so the visible rays count if there are any.

    Returns
    -------
    PathSpectrum or None
        For `Shot.weights`; None if no row has a film, or no ray passes.
    """
    if shot.curves is None:
        return None
    # films that reflect almost nothing of a light at some angles need more rays
    for rays in (RAYS, MORE_RAYS):
        found = _sampled_spectrum(shot, path, bundle, to_pixels, rays)
        if found is None or found[1] <= SAMPLE_ERROR:
            break
    return None if found is None else found[0]


def _sampled_spectrum(
    shot: Shot, path: LightPath, bundle: Bundle, to_pixels: Floats, count: int
) -> tuple[PathSpectrum, float] | None:
    """Return a path's spectrum by some rays, and how much the colours of every other ray differ from the rest's."""
    assert shot.curves is not None
    found_nm, passed, carried = [], [], []
    for wave, rays in _representative_rays(shot, bundle, to_pixels, count):
        # rays are in the order of the pupil's area, so both halves of them cover it
        both = spectra_of_rays(shot.packed, path, shot.incidence.tilt, shot.curves, bundle.pupil[rays], wave)
        if both is None:
            continue
        found_nm.append(shot.packed.wavelengths_nm[wave])
        passed.append(both.passed)
        carried.append(both.carried.mean(axis=0))
    if not found_nm:
        return None
    # other rays of a ghost land in the picture at other wavelengths, at other angles
    found = tuple(found_nm)
    curves = np.einsum("wl,whl->hl", curve_hats(found), np.stack(passed))
    spectrum = PathSpectrum(
        curves.mean(axis=0), np.einsum("wl,wl->l", _split(tuple(shot.packed.wavelengths_nm), found), np.stack(carried))
    )
    # not `@`, whose library threads busy-wait next to ours
    difference, color = np.einsum("kl,lc->kc", np.stack([curves[0] - curves[1], spectrum.passed]), seen_light(shot))
    return spectrum, float(np.abs(difference).max() / max(np.abs(color).max(), np.finfo(np.float64).tiny))


@lru_cache(maxsize=64)
def _split(wavelengths_nm: tuple[float, ...], nodes_nm: tuple[float, ...]) -> Floats:
    return hats(np.array(wavelengths_nm), nodes_nm)


def _representative_rays(
    shot: Shot, bundle: Bundle, to_pixels: Floats, count: int
) -> list[tuple[int, NDArray[np.intp]]]:
    """Choose `count` rays or a few more of a ghost: visible ones, else passing ones, else any that reach the iris.

    Returns
    -------
    list of (int, ndarray of int)
        Rising indices of traced wavelengths, and nodes of the bundle whose rays pass at each: more where more light is.
    """
    waves = sorted(bundle.traced)
    light = np.abs(shot.weights(shot.packed.wavelengths_nm[waves])).sum(axis=1)
    shares = light / max(light.sum(), np.finfo(np.float64).tiny)
    counts = np.where(shares < LEAST_SHARE, 0, 2 * np.ceil(0.5 * count * shares)).astype(np.int64)
    in_picture, anywhere = (pixel_frame(shot, to_pixels), shot.size_px), (np.zeros((2, 3)), (np.inf, np.inf))
    blades, no_blades = shot.opening.blades, np.empty((0, 4))
    for (place, size_px), edges in ((in_picture, blades), (anywhere, blades), (anywhere, no_blades)):
        choose = _chooser(shot, bundle, place, size_px, edges)
        chosen = [(w, choose(w, n)) for w, n in zip(waves, counts.tolist(), strict=True) if n > 0]
        if found := [(w, rays) for w, rays in chosen if rays.size > 0]:
            return found
        # a sliver can pass at one end of the spectrum only, where the light is faint
        for w in (w for w, n in zip(waves, counts, strict=True) if n == 0):
            if (rays := choose(w, count)).size > 0:
                return [(w, rays)]
    return []


def _chooser(
    shot: Shot, bundle: Bundle, place: Floats, size_px: tuple[float, float], blades: Floats
) -> Callable[[int, int], NDArray[np.intp]]:
    """Return a function of wavelength and number that chooses nodes of a bundle whose rays `seen_rays` finds.

    They land in a picture of any size, also infinite, placed as `pixel_frame` returns it.
    """
    width, height = (float(side) for side in size_px)
    axes, places = _frames(shot, place, bundle.halves)
    every = _stride(bundle)

    def choose(wave: int, count: int) -> NDArray[np.intp]:
        nodes: NDArray[np.intp] = choose_seen(
            bundle.traced[wave], bundle.pupil, bundle.triangles, every, shot.opening.radius, blades, axes, places,
            width, height, count,
        )  # fmt: skip
        return nodes

    return choose


def _stride(bundle: Bundle) -> int:
    """Return every which triangle of a bundle's grid is used to choose rays."""
    return max(1, len(bundle.triangles) // TRIANGLES)


def spread_rays(
    bundle: Bundle, waves: Sequence[int], passes: Sequence[RayFilter], count: int
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Choose rays that represent a bundle's light.

    Parameters
    ----------
    bundle : Bundle
    waves : sequence of int
        Traced wavelengths at one of which each ray must pass; empty: choose among all rays.
    passes : sequence of callable
        For each half of the bundle, a mask of the traced rays that pass.
    count : int

    Returns
    -------
    nodes : ndarray of int
        Nodes of the bundle, spread evenly over the pupil's area: a node is chosen in proportion to the area of its
        triangles, because the grid is finer at edges and folds. Empty if no ray passes.
    halves : ndarray of int
        The half of the bundle in which each was chosen.
    """
    nodes = len(bundle.pupil)
    passing = np.full((len(passes), nodes), not waves)
    for w in waves:
        for half, one in enumerate(passes):
            passing[half] |= one(bundle.traced[w])
    chosen: NDArray[np.intp] = choose_representatives(bundle.pupil, bundle.triangles, _stride(bundle), passing, count)
    return chosen % nodes, chosen // nodes


def visible_rays(shot: Shot, to_pixels: Floats, halves: int) -> tuple[RayFilter, ...]:
    """Return functions that select traced rays which pass all edges and the iris and land in the picture.

    Parameters
    ----------
    shot : Shot
    to_pixels : ndarray, shape (4,)
        Of the shot or of a ghost.
    halves : int
        Of the bundle. Its mirror image passes other blades and lands elsewhere in the picture.

    Returns
    -------
    tuple of callable
        For the bundle and its mirror image: from the bundle's rays as in `optics.rays.bundle.trace_points`, shape
        (N, 5 + 2 C), to a mask of shape (N,).
    """
    opening = shot.opening
    width, height = (float(side) for side in shot.size_px)

    def seen(axes: Floats, where: Floats, rays: Floats) -> Mask:
        mask: Mask = seen_rays(rays, opening.radius, opening.blades, axes, where, width, height)
        return mask

    frames = _frames(shot, pixel_frame(shot, to_pixels), halves)
    return tuple(partial(seen, axes, where) for axes, where in zip(*frames, strict=True))


def _frames(shot: Shot, place: Floats, halves: int) -> tuple[Floats, Floats]:
    """Return axes and place of each half of a bundle, as kernels read them, shape (halves, 2, 2) and (halves, 2, 3)."""
    return shot.incidence.axes * _MIRRORED_AXES[:halves], place * _MIRRORED_PLACES[:halves]


def areas_between(shot: Shot, bundle: Bundle, wavelengths_nm: Floats, to_pixels: Floats) -> Floats:
    """Return the visible area of the pupil, mm^2; rays are interpolated between those of the grid, or extrapolated.

    Indices of glass are nearly linear in 1 / wavelength^2 (Cauchy), and so are rays: through three wavelengths they are
    polynomials in it.

    Parameters
    ----------
    shot : Shot
    bundle : Bundle
        Traced at a few wavelengths.
    wavelengths_nm : ndarray, shape (M,)
    to_pixels : ndarray, shape (4,)
        Of the shot or of a ghost.

    Returns
    -------
    ndarray, shape (M,)
        In both halves of the bundle.
    """
    held = sorted(bundle.traced)
    held_nm = shot.packed.wavelengths_nm[held]
    shares = lagrange(tuple(held_nm**-2.0), tuple(wavelengths_nm**-2.0))
    nearest = np.abs(held_nm - wavelengths_nm[:, None]).argmin(axis=1)
    axes, places = _frames(shot, pixel_frame(shot, to_pixels), bundle.halves)
    width, height = (float(side) for side in shot.size_px)
    areas: Floats = visible_areas(
        np.stack([bundle.traced[w] for w in held]), shares, nearest, bundle.pupil, bundle.triangles,
        shot.opening.radius, shot.opening.blades, axes, places, width, height,
    )  # fmt: skip
    return areas


@lru_cache(maxsize=64)
def lagrange(nodes: tuple[float, ...], places: tuple[float, ...]) -> Floats:
    """Return the weights of values at nodes for the polynomial through them at other places.

    Parameters
    ----------
    nodes : tuple of float, N of them
    places : tuple of float, M of them

    Returns
    -------
    ndarray, shape (M, N)
        Lagrange's formula (Abramowitz and Stegun 1964, 25.2.2).

    Examples
    --------
    >>> lagrange((0.0, 1.0), (0.25,))
    array([[0.75, 0.25]])
    """
    weights = np.ones((len(places), len(nodes)))
    for j, k in permutations(range(len(nodes)), 2):
        weights[:, j] *= (np.array(places) - nodes[k]) / (nodes[j] - nodes[k])
    return weights


def pixel_frame(shot: Shot, to_pixels: Floats) -> Floats:
    """Return the position of the meridional frame in the picture, as kernels read it.

    Parameters
    ----------
    shot : Shot
    to_pixels : ndarray, shape (4,)
        Of the shot or of a ghost.

    Returns
    -------
    ndarray, shape (2, 3)
        Column and row of the axis, and their derivatives along x and y, pixels per mm.
    """
    place = np.empty((2, 3))
    # the upright picture is the meridional frame, rotated and upside down
    place[:, 0], place[:, 1:] = to_pixels[:2], (-shot.incidence.axes * [to_pixels[2], -to_pixels[3]]).T
    return place


def direct_spectrum(shot: Shot, lens: Lens) -> PathSpectrum | None:
    """Compute what coatings pass of the light on the axis that no surface reflects."""
    if shot.curves is None:
        return None
    path = direct_path(lens)
    return path_spectra(shot.curves, [path], np.zeros((1, len(path.rows)))).of(0)


def direct_flux(shots: Sequence[Shot], lens: Lens, throughputs: Sequence[Floats], fine_nm: Floats) -> Floats:
    """Interpolate the flux of direct images between the traced wavelengths.

    Parameters
    ----------
    shots : sequence of Shot, N of them
    lens : Lens
    throughputs : sequence of ndarray, N of shape (W,)
        At the traced wavelengths.
    fine_nm : ndarray, shape (F,)

    Returns
    -------
    ndarray, shape (N, F)
    """
    flux = np.empty((len(shots), len(fine_nm)))
    # lights with the same spectrum share their bands
    spectra: dict[int, PathSpectrum | None] = {}
    for k, (shot, throughput) in enumerate(zip(shots, throughputs, strict=True)):
        traced_nm = shot.packed.wavelengths_nm
        if id(shot.curves) not in spectra:
            spectra[id(shot.curves)] = direct_spectrum(shot, lens)
        spectrum = spectra[id(shot.curves)]
        if spectrum is None:
            flux[k] = np.interp(fine_nm, traced_nm, throughput)
        else:
            passed = np.interp(fine_nm, CURVE_NM, spectrum.passed)
            flux[k] = np.interp(fine_nm, traced_nm, throughput / spectrum.carried) * passed
    return flux
