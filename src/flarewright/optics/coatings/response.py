"""Reflectance of a coated glass surface over wavelength and angle, its means, and its colour."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ...colorimetry import VISIBLE_NM
from ...model import D65, Coating, Film
from ...typing import Floats
from ..colour.rgb import luminance_weights
from ..colour.spectrum import band_weights
from .thin_film import film_stack, stack_reflectance

BAND_NM = (420.0, 680.0)
"""Band of mean reflectances, as makers state them."""

WAVELENGTHS_NM = np.arange(VISIBLE_NM[0], VISIBLE_NM[1] + 1.0, 5.0)


@dataclass(frozen=True)
class CoatingResponse:
    """Reflectance of a coated surface, seen from the air.

    Attributes
    ----------
    films : tuple of Film
        From the air to the glass.
    wavelengths_nm : ndarray, shape (W,)
    angles_deg : ndarray, shape (A,)
        Of incidence, in air.
    reflectance : ndarray, shape (A, W)
        R of unpolarised light.
    mean_reflectance : ndarray, shape (A,)
        Unweighted mean over 420 to 680 nm.
    luminous_reflectance : ndarray, shape (A,)
        Reflectance of daylight D65, weighted by the eye's sensitivity.
    rgb : ndarray, shape (A, 3)
        Reflectance of daylight D65 in linear Rec.709; (1, 1, 1) is total reflection.
    """

    films: tuple[Film, ...]
    wavelengths_nm: Floats
    angles_deg: Floats
    reflectance: Floats
    mean_reflectance: Floats
    luminous_reflectance: Floats
    rgb: Floats


def coating_response(
    coating: Coating | None,
    n_d: float,
    n_glass: ArrayLike,
    angles_deg: ArrayLike,
    front: tuple[float, ArrayLike] = (1.0, 1.0),
) -> CoatingResponse:
    """Compute the reflectance of a coated surface between air and glass, or of a cemented one.

    Parameters
    ----------
    coating : Coating or None
    n_d : float
        Index of the glass at 587.56 nm, which sets the films.
    n_glass : array_like
        Index of the glass at `WAVELENGTHS_NM`, or one number for all.
    angles_deg : array_like, shape (A,)
        Angles of incidence in the medium in front, 0 to 90.
    front : (float, array_like), optional
        Index at 587.56 nm and at `WAVELENGTHS_NM` of the medium in front: air, or the glass it is cemented to.
    """
    indices, thicknesses_nm = film_stack(coating, front[0], n_d)
    wave, angles = WAVELENGTHS_NM, np.atleast_1d(np.asarray(angles_deg, dtype=np.float64))
    cosine = np.clip(np.cos(np.radians(angles)), 0.0, 1.0)[:, None]
    R = stack_reflectance(front[1], n_glass, indices, thicknesses_nm, wave, cosine)
    inside = (wave >= BAND_NM[0]) & (wave <= BAND_NM[1])
    rgb = R @ band_weights(D65(), wave, "rec709")
    return CoatingResponse(
        films=tuple(Film(index=n, thickness_nm=d) for n, d in zip(indices, thicknesses_nm, strict=True)),
        wavelengths_nm=wave,
        angles_deg=angles,
        reflectance=R,
        mean_reflectance=R[:, inside].mean(axis=1),
        luminous_reflectance=rgb @ luminance_weights("rec709"),
        rgb=rgb,
    )
