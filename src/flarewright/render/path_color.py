"""The colours of a path between the traced wavelengths, where coatings bend them."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from ..kernels.standing import seen_rays, standing_rays
from ..model import Lens
from ..optics.bundle import Bundle
from ..optics.coating_curves import CURVE_NM, PathSpectrum, path_spectra, step_squares
from ..optics.paths import LightPath, direct_path
from .shot import Shot

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

# so many rays of a bundle stand for the angles at which all of it meets the surfaces
RAYS = 48
# and these are looked for among so many triangles of its grid
TRIANGLES = 512

__all__ = ["direct_flux", "direct_spectrum", "place_of", "seen_of", "spread_rays", "traced_spectrum"]


def traced_spectrum(shot: Shot, path: LightPath, bundle: Bundle, to_pixels: Floats) -> PathSpectrum | None:
    """Compute what coatings let pass along a ghost's rays, over the wavelengths.

    Parameters
    ----------
    shot : Shot
    path : LightPath
    bundle : Bundle
        Traced at one wavelength at least.
    to_pixels : ndarray, shape (4,)
        The shot's, or the ghost's own: coatings reflect by the angle, so what is seen of it counts, if anything is.

    Returns
    -------
    PathSpectrum or None
        For `Shot.weights`; None where no row has a film, or no ray passes.
    """
    if shot.curves is None:
        return None
    squares = step_squares(shot.packed, path, shot.incidence.tilt, bundle.pupil[_light_of(shot, bundle, to_pixels)])
    if len(squares) == 0:
        return None
    return path_spectra(shot.curves, [path], squares).of(0)


def _light_of(shot: Shot, bundle: Bundle, to_pixels: Floats) -> NDArray[np.intp]:
    """Choose rays that stand for a ghost's light: what is seen, else what passes, else what may pass."""
    held = sorted(bundle.traced)
    middle = held[len(held) // 2]
    anywhere = np.zeros((2, 3)), (np.inf, np.inf)
    looks = (seen_of(shot, to_pixels), _seen(shot, *anywhere), _seen(shot, *anywhere, blades=np.empty((0, 4))))
    for seen in looks:
        # a sliver of light may pass at one end of the spectrum alone
        for w in sorted(held, key=lambda w: abs(w - middle)):
            chosen = spread_rays(bundle, (w,), seen, RAYS)
            if chosen.size > 0:
                return chosen
    return np.empty(0, dtype=np.intp)


def spread_rays(
    bundle: Bundle, waves: Sequence[int], passes: Callable[[Floats], Bools], count: int
) -> NDArray[np.intp]:
    """Choose rays of a bundle that stand for its light.

    Parameters
    ----------
    bundle : Bundle
    waves : sequence of int
        Traced wavelengths at which each of them must pass; of all rays if there are none.
    passes : callable
        Tells which traced rays do.
    count : int

    Returns
    -------
    ndarray of int
        Nodes of the bundle, spread evenly over the pupil's area: a node comes as often as its triangles are large, for
        the grid is fine at rims and folds. Empty where none passes.
    """
    passing = np.ones(len(bundle.pupil), dtype=np.bool_)
    for w in waves:
        passing &= passes(bundle.traced[w])
    step = max(1, len(bundle.triangles) // TRIANGLES)
    chosen: NDArray[np.intp] = standing_rays(bundle.pupil, bundle.triangles, passing, step, count)
    return chosen


def seen_of(shot: Shot, to_pixels: Floats) -> Callable[[Floats], Bools]:
    """Tell which traced rays meet no rim, cross the stop within the iris, and land in the picture.

    Parameters
    ----------
    shot : Shot
    to_pixels : ndarray, shape (4,)
        The shot's, or a ghost's own.

    Returns
    -------
    callable
        From rays as in `optics.bundle.trace_points`, shape (N, 5 + 2 C), to a mask of shape (N,).
    """
    return _seen(shot, place_of(shot, to_pixels), shot.size_px)


def _seen(
    shot: Shot, place: Floats, size_px: tuple[float, float], blades: Floats | None = None
) -> Callable[[Floats], Bools]:
    """Do the same for a picture of any size, infinite too, places as in `kernels.standing.seen_rays`, other blades."""
    opening, axes, width, height = shot.opening, shot.incidence.axes, float(size_px[0]), float(size_px[1])
    blades = opening.blades if blades is None else blades

    def seen(rays: Floats) -> Bools:
        mask: Bools = seen_rays(rays, opening.radius, blades, axes, place, width, height)
        return mask

    return seen


def place_of(shot: Shot, to_pixels: Floats) -> Floats:
    """Tell where the meridional frame lies in the picture, as kernels read it.

    Parameters
    ----------
    shot : Shot
    to_pixels : ndarray, shape (4,)
        The shot's, or a ghost's own.

    Returns
    -------
    ndarray, shape (2, 3)
        Column and row of the axis, and how they grow with x and with y, pixels per mm.
    """
    place = np.empty((2, 3))
    # the upright picture is the meridional frame's, turned and upside down
    place[:, 0], place[:, 1:] = to_pixels[:2], (-shot.incidence.axes * [to_pixels[2], -to_pixels[3]]).T
    return place


def direct_spectrum(shot: Shot, lens: Lens) -> PathSpectrum | None:
    """Compute what coatings let pass of the light that no surface reflects, on the axis.

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
    """Interpolate the flux of direct lights between the traced wavelengths.

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
    # lights of one spectrum share their bands
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
