"""Plain Monte Carlo of single scatter in NumPy: spheres, bare glass, a round stop. Shares no code with the pass."""

from __future__ import annotations

import numpy as np

from flarewright.model import Lens, Stop
from flarewright.optics.lens.paraxial import gap_indices, vertex_positions

SMALLEST = 1e-6


def unit(v):
    return v / np.sqrt((v**2).sum(axis=-1, keepdims=True))


def hit(o, d, z, c):
    """Intersect a sphere of curvature c with its vertex at z; return point and normal (towards +z)."""
    p = o - np.array([0.0, 0.0, z])
    if c == 0.0:
        at = p - (p[:, 2] / d[:, 2])[:, None] * d
        return at + np.array([0.0, 0.0, z]), np.tile([0.0, 0.0, 1.0], (len(d), 1))
    centre = np.array([0.0, 0.0, 1.0 / c])
    q = p - centre
    b, e = (q * d).sum(axis=1), (q * q).sum(axis=1) - 1.0 / c**2
    at = p + (-b - np.sign(c) * np.sqrt(b * b - e))[:, None] * d
    return at + np.array([0.0, 0.0, z]), unit((centre - at) * np.sign(c))


def refract(d, normal, n_in, n_out):
    """Return the refracted direction and the transmittance of bare glass, mean of s and p."""
    ci = (d * normal).sum(axis=1)
    ct = np.sqrt(1.0 - (n_in / n_out) ** 2 * (1.0 - ci**2))
    out = n_in / n_out * d + (ct - n_in / n_out * ci)[:, None] * normal
    rs = (n_in * ci - n_out * ct) / (n_in * ci + n_out * ct)
    rp = (n_out * ci - n_in * ct) / (n_out * ci + n_in * ct)
    return out, 1.0 - 0.5 * (rs**2 + rp**2), ci, ct


def scatter(d, normal, n_out, density, rng):
    """Draw a direction, log-uniform in |v|; return it with its weight for `density(v, d, new, normal)`."""
    a = unit(np.cross(normal, np.where(np.abs(normal[:, :1]) < 0.5, [[1.0, 0, 0]], [[0, 1.0, 0]])))
    b = np.cross(normal, a)
    span = np.log(2.0 * n_out / SMALLEST)
    v = SMALLEST * np.exp(span * rng.random(len(d)))
    angle = 2.0 * np.pi * rng.random(len(d))
    along = d - (d * normal).sum(axis=1)[:, None] * normal
    shift = (v * np.cos(angle))[:, None] * a + (v * np.sin(angle))[:, None] * b
    along = along + shift / n_out
    square = 1.0 - (along**2).sum(axis=1)
    new = along + np.sqrt(np.maximum(square, 0.0))[:, None] * normal
    return new, np.where(square > 0.0, 2.0 * np.pi * v**2 * span * density(v, d, new, normal), 0.0)


def scattered_flux(
    lens: Lens, order, tilt: float, axes, wavelength_nm: float, density, count: int, seed: int, weigh=None
):
    """Trace light that scatters once.

    Parameters
    ----------
    lens : Lens
        With bare spheres.
    order : FirstOrder
    tilt, axes
        From `optics.rays.bundle.incidence`.
    wavelength_nm : float
    density : callable
        density(row, n_in, n_out)(v, refracted, scattered, normal): share per area of v.
    count : int
        Rays per surface.
    seed : int

    Returns
    -------
    x, y, flux : ndarray
        Positions in the upright picture and flux per irradiance on the plane of the first vertex, one entry per ray; 0
        for rays that do not arrive.
    made : ndarray, shape (K,)
        Flux that each surface scatters.
    """
    rng = np.random.default_rng(seed)
    n, z = gap_indices(lens, wavelength_nm), vertex_positions(lens)
    sensor = z[-1] + order.sensor_distance
    # large enough for all rays that can reach the first surface
    half = 1.3 * lens.rows[0].semi_diameter if not isinstance(lens.rows[0], Stop) else 1.3 * lens.rows[1].semi_diameter
    direction = np.array([np.sin(tilt) * axes[1, 0], np.sin(tilt) * axes[1, 1], np.cos(tilt)])
    places, made = [], np.zeros(len(lens.rows))

    def carry(o, d, w, rows, stop_at=None):
        for k in rows:
            row = lens.rows[k]
            if isinstance(row, Stop):
                o = o + ((z[k] - o[:, 2]) / d[:, 2])[:, None] * d
                w = np.where(np.hypot(o[:, 0], o[:, 1]) <= order.stop_semi_diameter, w, 0.0)
                continue
            o, normal = hit(o, d, z[k], row.curvature)
            w = np.where(np.hypot(o[:, 0], o[:, 1]) <= row.semi_diameter, w, 0.0)
            new, T, *_ = refract(d, normal, n[k], n[k + 1])
            w = np.where(np.isfinite(T), w * T, 0.0)
            d = np.where(np.isfinite(new), new, np.array([0.0, 0.0, 1.0]))
            o = np.where(np.isfinite(o), o, 0.0)
        return o, d, w, normal if rows and not isinstance(lens.rows[rows[-1]], Stop) else None

    with np.errstate(invalid="ignore", divide="ignore"):
        for k, row in enumerate(lens.rows):
            if isinstance(row, Stop):
                continue
            f = density(k, n[k], n[k + 1])
            if f is None:
                continue
            o = np.zeros((count, 3))
            o[:, :2] = half * (2.0 * rng.random((count, 2)) - 1.0)
            w = np.full(count, (2.0 * half) ** 2 / count)
            o, d, w, normal = carry(o, np.tile(direction, (count, 1)), w, list(range(k + 1)))
            d, share = scatter(d, normal, n[k + 1], f, rng)
            w = w * share
            made[k] = w.sum()
            o, d, w, _ = carry(o, d, w, list(range(k + 1, len(lens.rows))))
            o = o + ((sensor - o[:, 2]) / d[:, 2])[:, None] * d
            places.append(np.stack([-o[:, 0], -o[:, 1], np.where(np.isfinite(w), w, 0.0)]))
    x, y, flux = np.concatenate(places, axis=1)
    return x, y, flux, made
