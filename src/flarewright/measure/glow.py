"""Star and halo of a measured flare: light around the light's image."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..model.ghost_model import Halo, Star

Floats = NDArray[np.float64]

_DARK = 1e-30


def _law(radius: Floats, knots: tuple[float, ...], radiance: tuple[tuple[float, float, float], ...]) -> Floats:
    """Interpolate logarithms of radiance over the logarithm of the radius; 0 beyond the last knot."""
    at, logs = np.log(np.maximum(radius, knots[0])), np.log(knots)
    values = np.log(np.maximum(np.array(radiance), _DARK))
    out = np.stack([np.exp(np.interp(at, logs, values[:, m])) for m in range(3)], axis=-1)
    out[out <= 2.0 * _DARK] = 0.0
    out[radius > knots[-1]] = 0.0
    return out


def offsets(light_px: tuple[float, float], size_px: tuple[int, int], scale: float) -> tuple[Floats, Floats]:
    """Return how far pixels lie right of and above the light, in pixels of the model."""
    x = (np.arange(size_px[0]) + 0.5 - light_px[0]) / scale
    y = (light_px[1] - np.arange(size_px[1]) - 0.5) / scale
    across, up = np.meshgrid(x, y)
    return across, up


def halo_radiance(halo: Halo, x: Floats, y: Floats) -> Floats:
    """Return the halo's radiance at offsets from the light, shape (..., 3)."""
    return _law(np.hypot(x, y), halo.radius_px, halo.radiance)


def star_radiance(star: Star, x: Floats, y: Floats) -> Floats:
    """Return the star's radiance at offsets from the light, shape (..., 3).

    Every spike falls off as a Gaussian across and by the star's law along.
    """
    radius, angle = np.hypot(x, y), np.arctan2(y, x)
    apart = 2.0 * np.pi / star.spikes
    off = (angle - np.radians(star.first_deg) + 0.5 * apart) % apart - 0.5 * apart
    # the nearest spike only: beside it, a spike's own circle is farther than the next one's
    ridge = np.exp(-0.5 * (radius * np.sin(off) / star.width_px) ** 2)
    return np.asarray(ridge[..., None] * _law(radius, star.radius_px, star.radiance))


def strength_at(strength: tuple[tuple[float, float], ...], constellation_deg: float) -> float:
    """Return how much of a halo or star there is at a constellation."""
    if not strength:
        return 1.0
    angles, parts = zip(*strength, strict=True)
    return float(np.interp(constellation_deg, angles, parts))


def halo_at(halo: Halo, constellation_deg: float, x: Floats, y: Floats) -> Floats:
    """Return the halo's radiance at a constellation and at offsets from the light, shape (..., 3)."""
    light = strength_at(halo.strength, constellation_deg) * halo_radiance(halo, x, y)
    if halo.even:
        angles, levels = zip(*halo.even, strict=True)
        light = light + [np.interp(constellation_deg, angles, [level[m] for level in levels]) for m in range(3)]
    return np.asarray(light)


def star_at(star: Star, constellation_deg: float, x: Floats, y: Floats) -> Floats:
    """Return the star's radiance at a constellation and at offsets from the light, shape (..., 3)."""
    return strength_at(star.strength, constellation_deg) * star_radiance(star, x, y)
