"""Fresnel diffraction of the iris in a ghost: Collins' integral with the ghost's own ray transfer matrix.

A wave from a point of light meets the stop and reaches the sensor through a system [[A, B], [C, D]]. With M the
sensor's height per height in the stop along geometric rays, Collins' integral gives at x = M xi the irradiance

    I(xi) = | 1 / (lambda L) * integral T(p) exp(i pi (p - xi)^2 / (lambda L)) d^2p |^2 / M^2,    L = B / M,

This is the Fresnel pattern of the opening T at the distance L, drawn where geometric rays through xi land. So a pattern
in the plane of the stop replaces the opening; the rays describe everything else of the ghost. The pattern depends only
on lambda L, the Fresnel area; the Fresnel number is N_F = h^2 / (lambda L), h the opening's radius.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...kernels.paraxial.ghosts import path_matrices
from ...typing import Floats
from ..lens.paths import LightPath
from ..rays.pack import PackedLens

RIPPLES = (
    (0.1, 0.25, 0.5, 0.8, 1.0, 1.4, 2.0, 3.0, 4.0, 6.0, 8.0),
    (0.37, 0.362, 0.335, 0.28, 0.23, 0.14, 0.095, 0.061, 0.046, 0.03, 0.023),
)
"""Blur widths in sqrt(lambda L / 2), and a knife edge's largest excess of irradiance over the rays' after the blur."""

FRFT_SAMPLES = 512
"""Samples across the texture of Hullin's fractional Fourier transform; the paper does not state the number."""

FRFT_FILL = 0.8
"""Radius of the round opening there, in halves of the texture."""


@dataclass(frozen=True)
class StopToSensor:
    """The system from one stop crossing of a path to the sensor, per traced wavelength and in x and y.

    Attributes
    ----------
    length : ndarray, shape (W, 2)
        L = B / M, mm; infinite where the light is focused on the sensor.
    magnification : ndarray, shape (W, 2)
        M, the sensor's height per height in the stop along the light's rays.
    """

    length: Floats
    magnification: Floats


def stop_to_sensor(packed: PackedLens, path: LightPath, nearness: float = 0.0) -> tuple[StopToSensor, ...]:
    """Return the system from each stop crossing of a path to the sensor.

    Parameters
    ----------
    packed : PackedLens
    path : LightPath
    nearness : float
        1 / distance of the light from the first vertex along the axis, 1/mm; 0 for a light at infinity.

    Returns
    -------
    tuple of StopToSensor
        One per crossing.

    Notes
    -----
    With Ma to the stop and S to the sensor, both from the first vertex, light of slope k per height has the height
    a = Ma00 + k Ma01 in the stop and s = S00 + k S01 on the sensor. B, reduced by the index in the stop so that lambda
    is the vacuum wavelength, is S01 Ma00 - S00 Ma01 for any indices: M = s / a, L = B a / s.
    """
    sides = [packed.curvature] if packed.curvature_x is None else [packed.curvature_x, packed.curvature]
    count, crossings = len(packed.wavelengths_nm), path.stop_crossings
    found = np.empty((2, crossings, count, 2))
    to_stops, system = np.empty((count, crossings, 2, 2)), np.empty((count, 4))
    for side, curvature in enumerate(sides):
        for w in range(count):
            system[w] = path_matrices(
                path.rows, path.actions, curvature, packed.z_vertex, packed.n_gap[w], packed.sensor_z, to_stops[w]
            )
        to_stop, (S00, S01, _, _) = to_stops.transpose(1, 2, 3, 0), system.T
        a, s = to_stop[:, 0, 0] + nearness * to_stop[:, 0, 1], S00 + nearness * S01
        B = S01 * to_stop[:, 0, 0] - S00 * to_stop[:, 0, 1]
        with np.errstate(divide="ignore", invalid="ignore"):
            found[..., side:] = np.stack([B * a / s, s / a])[..., None]
    return tuple(StopToSensor(*found[:, c]) for c in range(crossings))


def frft_fresnel_number(wavelength_nm: Floats, f_number: float) -> Floats:
    """Return the Fresnel number that corresponds to Hullin's fractional Fourier transform.

    Parameters
    ----------
    wavelength_nm : ndarray
    f_number : float

    Returns
    -------
    ndarray
        For the round opening's radius; the same for every ghost.

    Notes
    -----
    Hullin et al. 2011, equation 5: order alpha = 0.15 (lambda / 400 nm) (N / 18). The transform by phi = pi alpha / 2
    has the kernel exp(i pi (u^2 cot phi - 2 u u' / sin phi + u'^2 cot phi)), a Fresnel diffraction of Fresnel number
    R^2 cot phi, scaled by cos phi; the rays give the scale. In the plane of Ozaktas' transform n samples lie
    1 / sqrt(n) apart, so a circle that fills r of the texture has R = r sqrt(n) / 2. The transform by 1 is the far
    field, beyond which the formula has no meaning: orders stop before it, at N_F = 1.
    """
    alpha = 0.15 * (np.asarray(wavelength_nm, dtype=np.float64) / 400.0) * (f_number / 18.0)
    squared = 0.25 * FRFT_FILL**2 * FRFT_SAMPLES
    phi = 0.5 * math.pi * np.minimum(alpha, 1.0)
    return np.asarray(np.maximum(squared * np.cos(phi) / np.sin(phi), 1.0))


def ripple_height(blur: float) -> float:
    """Return an upper bound of the ringing along an edge after a blur.

    Parameters
    ----------
    blur : float
        Width of a pixel, or of the blur disc or square of an extended light, in sqrt(lambda L / 2).

    Returns
    -------
    float
        Excess over the rays' irradiance, relative to the open light; 0.37 without blur.

    Notes
    -----
    The analytic knife edge (Born and Wolf, section 8.7.3) minus a step, averaged over boxes and discs; beyond the table
    it falls as 1 / blur, as for boxes. A test recomputes the table.
    """
    blurs, heights = RIPPLES
    if blur > blurs[-1]:
        return heights[-1] * blurs[-1] / blur
    return float(np.interp(blur, blurs, heights))
