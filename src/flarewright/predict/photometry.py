"""From lamps to light at a camera, and from light on a sensor to exposure."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..optics.constellation import brightness_scale

Floats = NDArray[np.float64]

CLIPPING_LX_S = 78.0
"""Exposure at which a sensor of ISO 1 clips, lx s (ISO 12232, saturation-based speed: S = 78 / H_sat)."""

__all__ = ["CLIPPING_LX_S", "beam", "disc_illuminance", "exposure_level", "point_illuminance"]


def point_illuminance(intensity_cd: float, distance_m: Floats) -> Floats:
    """Compute the illuminance on a plane facing a small lamp: I / d^2, lx."""
    return np.asarray(intensity_cd / distance_m**2)


def disc_illuminance(luminance_cd_m2: float, diameter_m: float, distance_m: Floats) -> Floats:
    """Compute the illuminance on a plane that faces an evenly bright disc on its axis.

    Parameters
    ----------
    luminance_cd_m2, diameter_m : float
    distance_m : ndarray

    Returns
    -------
    ndarray
        lx.

    Notes
    -----
    E = pi L r^2 / (r^2 + d^2); far away L times the solid angle of equation 8.3, close to it pi L.
    """
    r = 0.5 * diameter_m
    return np.asarray(np.pi * luminance_cd_m2 * r**2 / (r**2 + distance_m**2))


def beam(off_axis_deg: Floats, beam_deg: float) -> Floats:
    """Return the part of its intensity that a lamp gives off its aim.

    Parameters
    ----------
    off_axis_deg : ndarray
    beam_deg : float
        Across the cone at whose edge half of it is left.

    Returns
    -------
    ndarray
        0 to 1: cos^n, with n so that it is one half at the edge; nothing backwards.
    """
    n = np.log(0.5) / np.log(np.cos(np.radians(0.5 * beam_deg)))
    forward = np.maximum(np.cos(np.radians(off_axis_deg)), 0.0)
    return np.asarray(forward**n)


def exposure_level(illuminance_lx: float, iso: float, exposure_s: float) -> float:
    """Return the signal on the sensor over the one at which it clips.

    Parameters
    ----------
    illuminance_lx : float
        On the sensor.
    iso, exposure_s : float

    Notes
    -----
    H = E t over 78 / ISO lx s (ISO 12232). Two cameras of one lens and opening compare by equation 8.3.
    """
    return illuminance_lx / CLIPPING_LX_S * brightness_scale({"iso": iso, "exposure_s": exposure_s})
