"""Monte Carlo single scattering: scatter refracted light at a surface into one random direction."""

from math import cos, log, pi, sin, sqrt

import numpy as np

from ..jit.decorators import inner
from ..raster.iris_mask import transmittance
from ..scattering.single_scatter import CORE, SHARE, scattered_density
from ..tracing.clip import blade_value
from ..tracing.general_ray import cross_shape
from ..tracing.intersect import intersect_conic
from ..tracing.lens_arrays import SHAPED
from ..tracing.refract import bend
from .philox import refill

# tallies of scattered light: landed in the picture, beside it, or ended in the lens
STRAY_IN_PICTURE, STRAY_BESIDE, STRAY_ENDED = 0, 1, 2
STRAYS = 3
# part of Chaumond's share that is scattered backward
BACKWARD = 0.2


@inner
def _forward(lens, row, x, y, z, dx, dy, dz, eta):
    """Trace a ray forward to a surface and refract it; returns as `kernels.tracing.general_ray.cross_shape`."""
    vertex = lens.z_vertex[row]
    if len(lens) == SHAPED:
        return cross_shape(lens.shapes, row, vertex, x, y, z, dx, dy, dz, 1.0, eta, 0.0)
    c, kappa = lens.curvature[row], lens.conic[row]
    zl = z - vertex
    t, root, discriminant = intersect_conic(c, kappa, x, y, zl, dx, dy, dz, 1.0)
    hx, hy, hz = x + t * dx, y + t * dy, zl + t * dz
    nx, ny, nz, cos_in, cos_out, inside = bend(c, kappa, hx, hy, hz, dx, dy, dz, root, 1.0, eta, 0.0)
    ok = discriminant >= 0.0 and inside >= 0.0 and nz > 0.0
    return hx, hy, hz + vertex, nx, ny, nz, hx * hx + hy * hy, cos_in, cos_out, ok


@inner
def scatter_once(lens, row, place, refracted, along, scatter, scratch, light, rgb, stop, frame):
    """Scatter refracted light once into a random direction and trace it to the sensor without further reflections.

    Parameters
    ----------
    lens : ConicLens or ShapedLens
        At one wavelength.
    row : int
        The surface.
    place, refracted : tuple of float
        Where the light hits it, and the direction of the refracted light.
    along : tuple of float
        Vector along the surface normal, of any length and sign.
    scatter : Scattering
        At one wavelength; its sums are added to.
    scratch : Scratch
    light : tuple of float
        Luminous flux of the refracted light, and its flux for the picture.
    rgb : ndarray, shape (3,)
    stop : StopArrays
    frame : PictureFrame

    Returns
    -------
    float
        Estimate of the part of the light that the surface scatters; v is sampled uniformly in log v.

    Notes
    -----
    Light that is reflected after scattering is dropped, as in the scatter pass.
    """
    (x, y, z), (tx, ty, tz), (gx, gy, gz), (bright, flux) = place, refracted, along, light
    table, amount, strays, plane = scatter.tables[row], scatter.amounts[row], scatter.strays, scatter.plane
    n_gap, reflectance, pool = lens.n_gap, lens.reflectance, scratch.pool
    back = BACKWARD * amount[SHARE]
    strays[STRAY_ENDED] += bright * back
    n_out = n_gap[row + 1]
    scale = 1.0 / sqrt(gx * gx + gy * gy + gz * gz)
    if gx * tx + gy * ty + gz * tz < 0.0:
        scale = -scale
    gx, gy, gz = gx * scale, gy * scale, gz * scale
    cos_spec = gx * tx + gy * ty + gz * tz
    # two tangents of the surface
    ax, ay, az = (0.0, gz, -gy) if abs(gx) < 0.5 else (gz, 0.0, -gx)
    scale = 1.0 / sqrt(ax * ax + ay * ay + az * az)
    ax, ay, az = ax * scale, ay * scale, az * scale
    bx, by, bz = gy * az - gz * ay, gz * ax - gx * az, gx * ay - gy * ax
    refill(scratch.stream, pool)
    low = 0.1 * CORE
    span = log(2.0 * n_out / low)
    v = low * np.exp(span * pool[0])
    va, vb = v * cos(2.0 * pi * pool[1]) / n_out, v * sin(2.0 * pi * pool[1]) / n_out
    dx = tx - cos_spec * gx + va * ax + vb * bx
    dy = ty - cos_spec * gy + va * ay + vb * by
    dz = tz - cos_spec * gz + va * az + vb * bz
    square = 1.0 - (dx * dx + dy * dy + dz * dz)
    if square <= 0.0:
        return back
    cos_s = sqrt(square)
    dx, dy, dz = dx + cos_s * gx, dy + cos_s * gy, dz + cos_s * gz
    between = dx * tx + dy * ty + dz * tz
    share = scattered_density(table, amount, n_gap[row], n_out, cos_spec, cos_s, v * v, between)
    share *= 2.0 * pi * v * v * span
    weight = share
    samples = reflectance.shape[1]
    arrives = dz > 0.0
    k = row + 1
    while arrives and k < lens.z_vertex.shape[0]:
        if k == stop.row:
            t = (lens.z_vertex[k] - z) / dz
            x, y, z = x + t * dx, y + t * dy, lens.z_vertex[k]
            for b in range(stop.blades.shape[0]):
                arrives = arrives and blade_value(stop.blades, b, x, y) <= 0.0
            weight *= transmittance(stop.mask, stop.half, x, y)
        else:
            n_in, n_behind = n_gap[k], n_gap[k + 1]
            x, y, z, dx, dy, dz, radius2, cos_in, cos_out, ok = _forward(lens, k, x, y, z, dx, dy, dz, n_in / n_behind)
            arrives = ok and radius2 * lens.inv_semi[k] * lens.inv_semi[k] <= 1.0
            if arrives:
                angle = min(cos_in if n_in <= n_behind else cos_out, 1.0) * (samples - 1)
                cell = min(np.int64(angle), samples - 2)
                weight *= 1.0 - (
                    reflectance[k, cell] + (angle - cell) * (reflectance[k, cell + 1] - reflectance[k, cell])
                )
        k += 1
    if not arrives:
        strays[STRAY_ENDED] += bright * share
        return back + share
    strays[STRAY_ENDED] += bright * (share - weight)
    to_pixels, size = frame
    t = (lens.sensor_z - z) / dz
    column, line = to_pixels[0] - to_pixels[2] * (x + t * dx), to_pixels[1] + to_pixels[3] * (y + t * dy)
    inside = 0.0 <= column < size[0] and 0.0 <= line < size[1]
    strays[STRAY_IN_PICTURE if inside else STRAY_BESIDE] += bright * weight
    if inside and plane.shape[1] > 0:
        for channel in range(3):
            plane[channel, int(line), int(column)] += flux * weight * rgb[channel]
    return back + share
