"""Colours of a path between the traced wavelengths, where coatings vary."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from ...kernels.tracing.representative_rays import choose_representatives, seen_rays
from ...model import Lens
from ...optics.lens.paths import LightPath, direct_path
from ...optics.rays.bundle import Bundle
from ...optics.rays.path_reflectance import CURVE_NM, PathSpectrum, path_spectra, step_squares
from ...typing import Floats, Mask
from .shot import Shot

# number of rays of a bundle that represent its angles of incidence
RAYS = 48
# number of triangles of the grid among which they are chosen
TRIANGLES = 512

__all__ = ["direct_flux", "direct_spectrum", "pixel_frame", "spread_rays", "traced_spectrum", "visible_rays"]


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
    rays = bundle.pupil[_representative_rays(shot, bundle, to_pixels)]
    squares = step_squares(shot.packed, path, shot.incidence.tilt, rays)
    if len(squares) == 0:
        return None
    return path_spectra(shot.curves, [path], squares).of(0)


def _representative_rays(shot: Shot, bundle: Bundle, to_pixels: Floats) -> NDArray[np.intp]:
    """Choose rays that represent a ghost's light: visible ones, else passing ones, else any that reach the iris."""
    held = sorted(bundle.traced)
    middle = held[len(held) // 2]
    anywhere = np.zeros((2, 3)), (np.inf, np.inf)
    looks = (
        visible_rays(shot, to_pixels),
        _visible(shot, *anywhere),
        _visible(shot, *anywhere, blades=np.empty((0, 4))),
    )
    for seen in looks:
        # a sliver can pass at one end of the spectrum only
        for w in sorted(held, key=lambda w: abs(w - middle)):
            chosen = spread_rays(bundle, (w,), seen, RAYS)
            if chosen.size > 0:
                return chosen
    return np.empty(0, dtype=np.intp)


def spread_rays(bundle: Bundle, waves: Sequence[int], passes: Callable[[Floats], Mask], count: int) -> NDArray[np.intp]:
    """Choose rays that represent a bundle's light.

    Parameters
    ----------
    bundle : Bundle
    waves : sequence of int
        Traced wavelengths at which each ray must pass; empty: choose among all rays.
    passes : callable
        Returns a mask of the traced rays that pass.
    count : int

    Returns
    -------
    ndarray of int
        Nodes of the bundle, spread evenly over the pupil's area: a node is chosen in proportion to the area of its
        triangles, because the grid is finer at edges and folds. Empty if no ray passes.
    """
    passing = np.ones(len(bundle.pupil), dtype=np.bool_)
    for w in waves:
        passing &= passes(bundle.traced[w])
    step = max(1, len(bundle.triangles) // TRIANGLES)
    chosen: NDArray[np.intp] = choose_representatives(bundle.pupil, bundle.triangles, passing, step, count)
    return chosen


def visible_rays(shot: Shot, to_pixels: Floats) -> Callable[[Floats], Mask]:
    """Return a function that selects traced rays which pass all edges and the iris and land in the picture.

    Parameters
    ----------
    shot : Shot
    to_pixels : ndarray, shape (4,)
        Of the shot or of a ghost.

    Returns
    -------
    callable
        From rays as in `optics.rays.bundle.trace_points`, shape (N, 5 + 2 C), to a mask of shape (N,).
    """
    return _visible(shot, pixel_frame(shot, to_pixels), shot.size_px)


def _visible(
    shot: Shot, place: Floats, size_px: tuple[float, float], blades: Floats | None = None
) -> Callable[[Floats], Mask]:
    """As `visible_rays`, for a picture of any size, also infinite, with positions as in `seen_rays`, and blades."""
    opening, axes, width, height = shot.opening, shot.incidence.axes, float(size_px[0]), float(size_px[1])
    blades = opening.blades if blades is None else blades

    def seen(rays: Floats) -> Mask:
        mask: Mask = seen_rays(rays, opening.radius, blades, axes, place, width, height)
        return mask

    return seen


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
