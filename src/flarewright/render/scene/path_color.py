"""Colours of a path between the traced wavelengths, where coatings vary."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ...kernels.tracing.representative_rays import choose_representatives, seen_rays
from ...model import Lens
from ...optics.colour.spectrum import hats
from ...optics.lens.paths import LightPath, direct_path
from ...optics.rays.bundle import Bundle
from ...optics.rays.path_reflectance import CURVE_NM, PathSpectrum, path_spectra, step_squares
from ...typing import Floats, Mask
from .shot import Shot, seen_light

# number of rays of a bundle that represent its angles of incidence, at all wavelengths together, and where one half of
# them gives colours that differ by more than a part of the largest channel from the other half's
RAYS, MORE_RAYS, SAMPLE_ERROR = 64, 256, 0.02
# part of the light below which a wavelength has no rays
LEAST_SHARE = 0.02
# number of triangles of the grid among which they are chosen
TRIANGLES = 4096

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
        squares = step_squares(shot.packed, path, shot.incidence.tilt, bundle.pupil[rays], wave)
        if len(squares) == 0:
            continue
        # rays are in the order of the pupil's area, so both halves of them cover it
        even = len(squares) // 2 * 2
        halves = [squares[:even:2], squares[1:even:2]] if even else [squares, squares]
        both = path_spectra(shot.curves, [path, path], np.concatenate(halves, axis=1))
        found_nm.append(shot.packed.wavelengths_nm[wave])
        passed.append(both.passed)
        carried.append(both.carried.mean(axis=0))
    if not found_nm:
        return None
    # other rays of a ghost land in the picture at other wavelengths, at other angles
    curves = np.einsum("wl,whl->hl", hats(CURVE_NM, found_nm), np.stack(passed))
    spectrum = PathSpectrum(
        curves.mean(axis=0), np.einsum("wl,wl->l", hats(shot.packed.wavelengths_nm, found_nm), np.stack(carried))
    )
    # not `@`, whose library threads busy-wait next to ours
    difference, color = np.einsum("kl,lc->kc", np.stack([curves[0] - curves[1], spectrum.passed]), seen_light(shot))
    return spectrum, float(np.abs(difference).max() / max(np.abs(color).max(), np.finfo(np.float64).tiny))


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
    anywhere = np.zeros((2, 3)), (np.inf, np.inf)
    looks = (
        visible_rays(shot, to_pixels, bundle.halves),
        _visible(shot, *anywhere, bundle.halves),
        _visible(shot, *anywhere, bundle.halves, blades=np.empty((0, 4))),
    )
    for seen in looks:
        chosen = [(w, spread_rays(bundle, (w,), seen, n)[0]) for w, n in zip(waves, counts, strict=True) if n > 0]
        if found := [(w, rays) for w, rays in chosen if rays.size > 0]:
            return found
        # a sliver can pass at one end of the spectrum only, where the light is faint
        for w in (w for w, n in zip(waves, counts, strict=True) if n == 0):
            rays, _ = spread_rays(bundle, (w,), seen, count)
            if rays.size > 0:
                return [(w, rays)]
    return []


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
    halves, nodes = len(passes), len(bundle.pupil)
    passing = np.full((halves, nodes), not waves)
    for w in waves:
        passing |= [one(bundle.traced[w]) for one in passes]
    few = bundle.triangles[:: max(1, len(bundle.triangles) // TRIANGLES)]
    # both halves of a triangle in a row, so that rays are as many places of the pupil as without halves
    triangles = np.stack([few + half * nodes for half in range(halves)], axis=1).reshape(-1, 3)
    chosen: NDArray[np.intp] = choose_representatives(
        np.concatenate([bundle.pupil] * halves), triangles, passing.ravel(), count
    )
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
    return _visible(shot, pixel_frame(shot, to_pixels), shot.size_px, halves)


def _visible(
    shot: Shot, place: Floats, size_px: tuple[float, float], halves: int, blades: Floats | None = None
) -> tuple[RayFilter, ...]:
    """As `visible_rays`, for a picture of any size, also infinite, with positions as in `seen_rays`, and blades."""
    opening, width, height = shot.opening, float(size_px[0]), float(size_px[1])
    blades = opening.blades if blades is None else blades

    def seen(mirror: float, rays: Floats) -> Mask:
        # x of the meridional frame changes its sign
        axes, where = shot.incidence.axes * [[mirror], [1.0]], place * [1.0, mirror, 1.0]
        mask: Mask = seen_rays(rays, opening.radius, blades, axes, where, width, height)
        return mask

    return tuple(partial(seen, mirror) for mirror in (1.0, -1.0)[:halves])


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
    """Compute what coatings pass of the light on the axis that no surface reflects.

    Parameters
    ----------
    shot : Shot
    lens : Lens

    Returns
    -------
    PathSpectrum or None
    """
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
