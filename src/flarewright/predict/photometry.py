"""Photometry: illuminance at a camera by lamps, and exposure of a sensor."""

from __future__ import annotations

import numpy as np

from ..optics.lens.field_angles import brightness_scale
from ..typing import Floats

CLIPPING_LX_S = 78.0
"""Exposure at which a sensor of ISO 1 clips, lx s (ISO 12232, saturation-based speed: S = 78 / H_sat)."""


def point_illuminance(intensity_cd: float, distance_m: Floats) -> Floats:
    """Compute the illuminance on a plane facing a small lamp: I / d^2, lx."""
    return np.asarray(intensity_cd / distance_m**2)


def disc_illuminance(luminance_cd_m2: float, diameter_m: float, distance_m: Floats) -> Floats:
    """Compute the illuminance on a plane that faces a uniform disc on its axis.

    Parameters
    ----------
    luminance_cd_m2, diameter_m : float
    distance_m : ndarray

    Returns
    -------
    ndarray
        Illuminance, lx.

    Notes
    -----
    E = pi L r^2 / (r^2 + d^2); for large d this is L times the solid angle of equation 8.3, at the disc pi L.
    """
    r = 0.5 * diameter_m
    return np.asarray(np.pi * luminance_cd_m2 * r**2 / (r**2 + distance_m**2))


def beam(off_axis_deg: Floats, beam_deg: float) -> Floats:
    """Return the relative intensity of a lamp at an angle from its aim.

    Parameters
    ----------
    off_axis_deg : ndarray
    beam_deg : float
        Full angle of the cone at whose edge the intensity is one half.

    Returns
    -------
    ndarray
        0 to 1: cos^n, with n such that it is one half at the edge; 0 backwards.
    """
    n = np.log(0.5) / np.log(np.cos(np.radians(0.5 * beam_deg)))
    forward = np.maximum(np.cos(np.radians(off_axis_deg)), 0.0)
    return np.asarray(forward**n)


def exposure_level(illuminance_lx: float, iso: float, exposure_s: float) -> float:
    """Return the sensor signal over its clipping level.

    Parameters
    ----------
    illuminance_lx : float
        Illuminance on the sensor.
    iso, exposure_s : float

    Notes
    -----
    H = E t over 78 / ISO lx s (ISO 12232). Two cameras of one lens and opening compare by equation 8.3.
    """
    return illuminance_lx / CLIPPING_LX_S * brightness_scale({"iso": iso, "exposure_s": exposure_s})
