"""Veiling glare of one path: light of a uniform surround at the centre of the sensor, by backward rays."""

from math import sqrt

import numpy as np

from ..jit.decorators import compiled, inner
from ..tracing.general_ray import cross_shape
from ..tracing.intersect import intersect_conic
from ..tracing.refract import REFLECT, STOP, bend

# items of `sums`: light from everywhere, light from beyond the patch, bounds x0, x1, y0, y1 of the rays that pass
ALL, BEYOND, BOUNDS = 0, 1, 2


@inner
def _meet(curvature, conic, row, vertex, x, y, z, dx, dy, dz, heading, eta, mirror):
    """Trace a ray to a surface and refract or reflect it; returns as `kernels.tracing.general_ray.cross_shape`."""
    if conic.ndim == 2:
        return cross_shape(conic, row, vertex, x, y, z, dx, dy, dz, heading, eta, mirror)
    c, kappa = curvature[row], conic[row]
    zl = z - vertex
    t, root, discriminant = intersect_conic(c, kappa, x, y, zl, dx, dy, dz, heading)
    hx, hy, hz = x + t * dx, y + t * dy, zl + t * dz
    nx, ny, nz, cos_in, cos_out, inside = bend(c, kappa, hx, hy, hz, dx, dy, dz, root, heading, eta, mirror)
    ok = discriminant >= 0.0 and (mirror > 0.0 or inside >= 0.0) and nz * heading * (1.0 - 2.0 * mirror) > 0.0
    return hx, hy, hz + vertex, nx, ny, nz, hx * hx + hy * hy, cos_in, cos_out, ok


@compiled
def light_from_surround(
    rows, actions, curvature, conic, z_vertex, inv_semi, n_gap, reflectance, sensor_z, stop_semi, plane_z, box, side,
    nearness, patch, sums,
):  # fmt: skip
    """Integrate a uniform surround of radiance 1 over the rays of one path to the centre of the sensor.

    Parameters
    ----------
    rows, actions : ndarray, shape (S,), int64
        The path from front to sensor (`optics.lens.paths`).
    curvature, conic, z_vertex, inv_semi, n_gap, reflectance, sensor_z
        As in `kernels.tracing.sequential.trace_nodes`.
    stop_semi : float
        Semi-diameter of the round stop.
    plane_z : float
        z of the plane over which rays are spread, that of the last vertex, mm from the first.
    box : ndarray, shape (4,)
        x0, x1, y0, y1 in that plane.
    side : int
        Number of rays: side x side.
    nearness : float
        1 / distance of the plane in focus, 0 for infinity.
    patch : float
        Radius of the black patch in the middle of the plane in focus, over its distance.
    sums : ndarray, shape (6,)
        Filled: irradiance from everywhere, irradiance from beyond the patch, and the bounds of the places that pass
        light.

    Notes
    -----
    Radiance over the squared index changes along a ray only by the factors R and T, so the irradiance is the integral
    of their product over slopes, dw / (1 + w^2)^2.
    """
    samples = reflectance.shape[1]
    sums[ALL], sums[BEYOND] = 0.0, 0.0
    sums[BOUNDS], sums[BOUNDS + 1], sums[BOUNDS + 2], sums[BOUNDS + 3] = np.inf, -np.inf, np.inf, -np.inf
    across, along = (box[1] - box[0]) / side, (box[3] - box[2]) / side
    away = plane_z - sensor_z
    cell = across * along / (away * away)
    for ray in range(side * side):
        px, py = box[0] + (ray % side + 0.5) * across, box[2] + (ray // side + 0.5) * along
        wx, wy = px / away, py / away
        square = 1.0 + wx * wx + wy * wy
        scale = -1.0 / sqrt(square)
        x, y, z, dx, dy, dz = 0.0, 0.0, sensor_z, wx * scale, wy * scale, scale
        weight, heading = cell / (square * square), -1.0
        for step in range(rows.shape[0] - 1, -1, -1):
            row = rows[step]
            if actions[step] == STOP:
                t = (z_vertex[row] - z) / dz
                x, y, z = x + t * dx, y + t * dy, z_vertex[row]
                if x * x + y * y > stop_semi * stop_semi:
                    weight = 0.0
                    break
                continue
            mirror = 1.0 if actions[step] == REFLECT else 0.0
            n_in = n_gap[row] if heading > 0.0 else n_gap[row + 1]
            n_out = n_gap[row + 1] if heading > 0.0 else n_gap[row]
            x, y, z, dx, dy, dz, radius2, cos_in, cos_out, ok = _meet(
                curvature, conic, row, z_vertex[row], x, y, z, dx, dy, dz, heading, n_in / n_out, mirror
            )
            if not ok or radius2 * inv_semi[row] * inv_semi[row] > 1.0:
                weight = 0.0
                break
            place = min(cos_in if n_in <= n_out else cos_out, 1.0) * (samples - 1)
            k = min(np.int64(place), samples - 2)
            r = reflectance[row, k] + (place - k) * (reflectance[row, k + 1] - reflectance[row, k])
            weight *= r if mirror > 0.0 else 1.0 - r
            if mirror > 0.0:
                heading = -heading
        if weight <= 0.0:
            continue
        sums[ALL] += weight
        sums[BOUNDS], sums[BOUNDS + 1] = min(sums[BOUNDS], px), max(sums[BOUNDS + 1], px)
        sums[BOUNDS + 2], sums[BOUNDS + 3] = min(sums[BOUNDS + 2], py), max(sums[BOUNDS + 3], py)
        # where the ray hits the plane in focus, over that plane's distance
        back = -1.0 - nearness * z
        ax, ay = nearness * x + back * dx / dz, nearness * y + back * dy / dz
        if ax * ax + ay * ay > patch * patch:
            sums[BEYOND] += weight
