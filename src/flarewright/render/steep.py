"""Ghosts whose throughput is steep between the traced wavelengths, and what is done about them.

Final quality traces them at more wavelengths. Drafts know the size of a ghost at any wavelength from its matrices, so
they set its colours right and draw as many outlines as before.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ..kernels.standing import passing_area
from ..model.camera import Colorspace
from ..model.light import Spectrum
from ..optics.bundle import Bundle, trace_bundle
from ..optics.coating_curves import CURVE_NM, PathSpectrum
from ..optics.spectrum import band_parts
from ..optics.steepness import bent_error, bent_ratios, lit_waves
from .path_color import seen_of
from .shot import Shot

Floats = NDArray[np.float64]

# of a ghost's largest channel, expected
STEEP, STEEP_DRAFT = 0.01, 0.006
# and from here on it is known too little at few wavelengths to set colours by
MUCH = 0.05
# as from here down, of the largest
ENDS = 1e-3
# below this difference of the throughput between the ends and the middle of the spectrum, of the largest, nothing is
LEAST_CHANGE = 0.1
# of the brightest ghost's largest channel: what is fainter is not looked at in drafts
FAINT = 7e-4

__all__ = ["bent_weights", "bundle_is_steep", "seen_light", "steep_paths"]


def bundle_is_steep(shot: Shot, bundle: Bundle, spectrum: PathSpectrum | None, to_pixels: Floats) -> bool:
    """Tell whether a ghost's colour is wrong because its throughput is steep between the traced wavelengths.

    Parameters
    ----------
    shot : Shot
    bundle : Bundle
    spectrum : PathSpectrum or None
        From `path_color.traced_spectrum`.
    to_pixels : ndarray, shape (4,)
        As there.

    Returns
    -------
    bool
        False where nothing is seen.
    """
    if shot.between is None:
        return False
    seen = seen_of(shot, to_pixels)

    def area(w: int) -> float:
        rays = trace_bundle(shot.packed, w, bundle, shot.incidence.tilt)
        return float(passing_area(bundle.pupil, bundle.triangles, seen(rays)))

    known = {w: area(w) for w in bundle.traced}
    if max(known.values()) - min(known.values()) <= LEAST_CHANGE * max(known.values()):
        return False
    traced_nm = shot.packed.wavelengths_nm
    throughput = np.array([known[w] if w in known else area(w) for w in range(len(traced_nm))])
    passed = np.ones(len(CURVE_NM)) if spectrum is None else spectrum.passed
    error, total = bent_error(passed, seen_light(shot), traced_nm, throughput)
    return bool(error > STEEP * total)


def steep_paths(shot: Shot, flux: Floats, spectra: PathSpectrum | None) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Choose the paths whose colours are wrong because their throughput is steep between the traced wavelengths.

    Parameters
    ----------
    shot : Shot
    flux : ndarray, shape (P, W)
        What is drawn of them at the traced wavelengths.
    spectra : PathSpectrum or None
        Of all paths.

    Returns
    -------
    a_little, much : ndarray of int
        None of them much fainter than the brightest.
    """
    passed = np.ones(len(CURVE_NM)) if spectra is None else spectra.passed
    throughput = flux if spectra is None else _over(flux, spectra.carried)
    error, total = bent_error(passed, seen_light(shot), shot.packed.wavelengths_nm, throughput)
    seen = total > FAINT * total.max(initial=0.0)
    # what is dark at one of them has an end somewhere
    ends = throughput.min(axis=1) < ENDS * throughput.max(axis=1)
    much = seen & (error > np.where(ends, STEEP_DRAFT, MUCH) * total)
    return np.flatnonzero(seen & ~much & (error > STEEP_DRAFT * total)), np.flatnonzero(much)


def bent_weights(
    shot: Shot, flux: Floats, spectra: PathSpectrum | None, fine_nm: Floats, fine: Floats, fine_carried: Floats | None
) -> Floats:
    """Return the RGB weights of the traced wavelengths for paths whose flux is known at many.

    Parameters
    ----------
    shot : Shot
    flux : ndarray, shape (P, W)
        What is drawn of them at the traced wavelengths.
    spectra : PathSpectrum or None
        Of the paths.
    fine_nm : ndarray, shape (M,)
        Rising.
    fine : ndarray, shape (P, M)
        What is drawn of them where these are traced.
    fine_carried : ndarray, shape (P, M), or None
        As `PathSpectrum.carried`, there.

    Returns
    -------
    ndarray, shape (P, W, 3)
        So that all that is drawn has a path's light in each channel.
    """
    traced_nm, light = shot.packed.wavelengths_nm, seen_light(shot)
    throughput = flux if spectra is None else _over(flux, spectra.carried)
    found = fine if fine_carried is None else _over(fine, fine_carried)
    lit = lit_waves(throughput, found)
    weights = np.zeros((*flux.shape, 3))
    for which in np.unique(lit[lit.any(axis=1)], axis=0):
        alike = np.flatnonzero((lit == which).all(axis=1))
        shares, passed = bent_ratios(which, traced_nm, throughput[alike], fine_nm, found[alike])
        if spectra is not None:
            passed = passed * spectra.passed[alike]
        parts = (shares[:, :, None] * light).transpose(1, 0, 2).reshape(len(light), -1)
        weights[alike] = np.einsum("pl,lk->pk", passed, parts).reshape(len(alike), -1, 3)
    return weights if spectra is None else _over(weights, spectra.carried[..., None])


def _over(values: Floats, carried: Floats) -> Floats:
    """Divide by what rays carry; nothing where they carry nothing."""
    return np.divide(values, carried, out=np.zeros_like(values), where=carried > 0.0)


def seen_light(shot: Shot) -> Floats:
    """Return what a shot's light adds to the channels, shape (L, 3), at `CURVE_NM`."""
    return _seen_light(shot.light.spectrum, shot.colorspace)


@lru_cache(maxsize=64)
def _seen_light(spectrum: Spectrum, colorspace: Colorspace) -> Floats:
    parts: Floats = band_parts(spectrum, CURVE_NM[len(CURVE_NM) // 2], colorspace, CURVE_NM)[:, 0]
    return parts
