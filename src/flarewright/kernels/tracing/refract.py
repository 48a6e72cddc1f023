"""Refraction and reflection of a ray at a surface, and the constants shared by all tracing kernels."""

from math import sqrt

import numpy as np

from ..jit.decorators import inlined

REFRACT = 0
REFLECT = 1
STOP = 2
# actions of steps that trace several paths together: KEEP saves the rays; LAND traces them to the sensor and restores
# the saved rays
KEEP = 3
LAND = 4

LANES = 64

# columns of a traced node
X, Y, WEIGHT, REL, ALIVE = 0, 1, 2, 3, 4
STOP_X = 5  # followed by stop y, and by x and y of a second and third crossing


@inlined
def ray_from_near(tilt, nearness, px, py):
    """Start a ray of a light at a finite distance.

    Parameters
    ----------
    tilt : float
        The ray through the first vertex runs along (0, sin tilt, cos tilt).
    nearness : float
        1 / distance from the light to the first vertex, 1/mm.
    px, py : float
        Place of the ray in the plane of the first vertex, mm.

    Returns
    -------
    dx, dy, dz : float
        Unit direction.
    irradiance : float
        Irradiance in the plane of the first vertex at the start, over that at the vertex.

    Notes
    -----
    The light is at -(0, sin tilt, cos tilt) / nearness, so a ray has the direction u = (0, sin tilt, cos tilt) +
    nearness (px, py, 0), and |u| is its length over that of the ray through the vertex. Irradiance is proportional to
    the cosine over the squared distance, and the cosine to 1 / distance: |u|^-3.
    """
    ux = nearness * px
    uy = np.sin(tilt) + nearness * py
    uz = np.cos(tilt)
    inverse = 1.0 / sqrt(ux * ux + uy * uy + uz * uz)
    return inverse * ux, inverse * uy, inverse * uz, inverse * inverse * inverse


@inlined
def bend_at(gx, gy, gz, dx, dy, dz, root, heading, eta, mirror):
    """Refract or reflect a ray at a hit with a known surface gradient.

    Parameters
    ----------
    gx, gy, gz : float
        Gradient of sag(x, y) - z, or a positive multiple of it.
    dx, dy, dz : float
        Unit direction.
    root : float
        -gradient . direction * heading.
    heading : float
        +1 or -1, the direction of the leg along z.
    eta : float
        Index before over index behind.
    mirror : float
        1 reflects, 0 refracts.

    Returns
    -------
    nx, ny, nz : float
        New unit direction.
    cos_in, cos_out : float
        Cosines before and behind the surface, both >= 0.
    inside : float
        cos_out squared; negative beyond the critical angle.

    Notes
    -----
    d' = eta d + (eta c - sqrt k) N and d' = d + 2 c N with c = -N.d, k = 1 - eta^2 (1 - c^2) (docs/physics.md). The
    normal against the ray is heading * gradient / norm, also beyond a sphere's equator.
    """
    inv_norm = 1.0 / sqrt(gx * gx + gy * gy + gz * gz)
    cos_in = root * inv_norm
    nx, ny, nz, cos_out, inside = bend_about(
        gx, gy, gz, dx, dy, dz, cos_in, cos_in * cos_in, heading * inv_norm, eta, mirror
    )
    return nx, ny, nz, cos_in, cos_out, inside


@inlined
def bend_about(gx, gy, gz, dx, dy, dz, cos_in, square, unit, eta, mirror):
    """Refract or reflect a ray at a hit with a known gradient and angle of incidence.

    Parameters
    ----------
    gx, gy, gz, dx, dy, dz, eta, mirror
        As in `bend_at`.
    cos_in, square : float
        Cosine before the surface, and its square; on a sphere both are known independently.
    unit : float
        Factor that makes the gradient a unit vector against the ray.

    Returns
    -------
    nx, ny, nz, cos_out, inside
        As `bend_at`.
    """
    inside = 1.0 - eta * eta * (1.0 - square)
    cos_out = sqrt(max(inside, 0.0))
    along = (2.0 * cos_in if mirror > 0.0 else eta * cos_in - cos_out) * unit
    scale = 1.0 if mirror > 0.0 else eta
    return scale * dx + along * gx, scale * dy + along * gy, scale * dz + along * gz, cos_out, inside


@inlined
def bend(curvature, conic, x, y, z, dx, dy, dz, root, heading, eta, mirror):
    """Refract or reflect a ray at a hit on a conic.

    Parameters
    ----------
    curvature, conic : float
    x, y, z : float
        The hit, mm, relative to the vertex.
    dx, dy, dz : float
        Unit direction.
    root : float
        From `intersect_conic`.
    heading, eta, mirror
        As in `bend_at`.

    Returns
    -------
    nx, ny, nz, cos_in, cos_out, inside
        As `bend_at`.
    """
    gx = curvature * x
    gy = curvature * y
    gz = curvature * (1.0 + conic) * z - 1.0
    return bend_at(gx, gy, gz, dx, dy, dz, root, heading, eta, mirror)
