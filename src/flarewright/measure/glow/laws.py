"""Radiance of the halo and star of a measured flare, at offsets from the light."""

from __future__ import annotations

import numpy as np

from ...kernels.ghost_model.glow import halo_light, star_light
from ...model.measurement.ghost_model import Halo, Star
from ...typing import Floats

# floor of a law's radiance; below twice the floor a law counts as dark
_DARK = 1e-30
_NONE = np.log(2.0 * _DARK)


def _law(knots: tuple[float, ...], radiance: tuple[tuple[float, float, float], ...]) -> tuple[Floats, Floats]:
    """Return the logarithms of the radii of a law, shape (K,), and of its radiance there, shape (K, 3)."""
    return np.log(np.array(knots)), np.log(np.maximum(np.array(radiance), _DARK))


def offsets(light_px: tuple[float, float], size_px: tuple[int, int], scale: float) -> tuple[Floats, Floats]:
    """Return the offsets of all pixels from the light, to the right and upwards, in pixels of the model."""
    x = (np.arange(size_px[0]) + 0.5 - light_px[0]) / scale
    y = (light_px[1] - np.arange(size_px[1]) - 0.5) / scale
    across, up = np.meshgrid(x, y)
    return across, up


def halo_radiance(halo: Halo, x: Floats, y: Floats) -> Floats:
    """Return the radiance of a halo at offsets from the light, shape (..., 3), at strength 1."""
    return _halo(halo, x, y, 1.0, np.zeros(3))


def _halo(halo: Halo, x: Floats, y: Floats, strength: float, even: Floats) -> Floats:
    out = np.empty((x.size, 3))
    halo_light(x.ravel(), y.ravel(), *_law(halo.radius_px, halo.radiance), _NONE, strength, even, out)
    return out.reshape(*x.shape, 3)


def star_radiance(star: Star, x: Floats, y: Floats) -> Floats:
    """Return the radiance of a star at offsets from the light, shape (..., 3), at strength 1.

    Every spike follows a Gaussian across and the law of the star along.
    """
    out, law = np.empty((x.size, 3)), _law(star.radius_px, star.radiance)
    star_light(x.ravel(), y.ravel(), star.spikes, np.radians(star.first_deg), star.width_px, *law, _NONE, out)
    return out.reshape(*x.shape, 3)


def strength_at(strength: tuple[tuple[float, float], ...], constellation_deg: float) -> float:
    """Return the strength of a halo or star at a constellation, by linear interpolation; 1 without a table."""
    if not strength:
        return 1.0
    angles, parts = zip(*strength, strict=True)
    return float(np.interp(constellation_deg, angles, parts))


def halo_at(halo: Halo, constellation_deg: float, x: Floats, y: Floats) -> Floats:
    """Return the radiance of a halo at a constellation and at offsets from the light, shape (..., 3)."""
    even = np.zeros(3)
    if halo.even:
        angles, levels = zip(*halo.even, strict=True)
        even = np.array([np.interp(constellation_deg, angles, [level[m] for level in levels]) for m in range(3)])
    return _halo(halo, x, y, strength_at(halo.strength, constellation_deg), even)


def star_at(star: Star, constellation_deg: float, x: Floats, y: Floats) -> Floats:
    """Return the radiance of a star at a constellation and at offsets from the light, shape (..., 3)."""
    return strength_at(star.strength, constellation_deg) * star_radiance(star, x, y)
