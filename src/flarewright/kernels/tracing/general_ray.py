"""One ray through rows of any shape and position: aspheres, cylinders, toroids, decentre, tilt, figure errors.

Used for drawings and random rays; bundles are traced in lanes (`kernels.tracing.general_lanes`). Compiled only for
lenses with such rows: the compiler selects the code by the dimension of `conic`.
"""

import numpy as np

from ..jit.decorators import inner
from .intersect import AXES, CENTRED, CONIC_Y, CURVATURE_Y, KIND, ORIGIN, SAG, intersect_conic, intersect_sag
from .refract import REFLECT, STOP, bend_at, ray_from_near


@inner
def cross_shape(shapes, row, vertex, x, y, z, dx, dy, dz, heading, eta, mirror):
    """Trace a ray to a row of the shape table and refract or reflect it.

    Parameters
    ----------
    shapes : ndarray, shape (K, P)
        The shape table (`kernels.tracing.intersect`), in the frame of the ray.
    row : int
    vertex : float
        z of the row's vertex on the axis, mm.
    x, y, z, dx, dy, dz : float
        Start, mm, and unit direction in the lens' frame.
    heading, eta, mirror
        As in `kernels.tracing.refract.bend_at`.

    Returns
    -------
    x, y, z, dx, dy, dz : float
        The hit and the new direction in the lens' frame.
    radius2 : float
        Squared distance of the hit from the surface's axis, mm^2.
    cos_in, cos_out : float
    ok : bool
        False where the ray misses, is totally reflected where it should refract, or turns the wrong way along its leg.
    """
    if shapes[row, KIND] == CENTRED:
        px, py, pz, ux, uy, uz = x, y, z - vertex, dx, dy, dz
    else:
        ox, oy, oz = x - shapes[row, ORIGIN], y - shapes[row, ORIGIN + 1], z - vertex - shapes[row, ORIGIN + 2]
        px, py, pz = _turn(shapes, row, ox, oy, oz)
        ux, uy, uz = _turn(shapes, row, dx, dy, dz)
    if shapes[row, KIND] == SAG:
        t, gx, gy, ok = intersect_sag(shapes, row, px, py, pz, ux, uy, uz, heading)
        gz = -1.0
        root = -heading * (gx * ux + gy * uy - uz)
        ok = ok and root > 0.0
        px, py, pz = px + t * ux, py + t * uy, pz + t * uz
    else:
        c, kappa = shapes[row, CURVATURE_Y], shapes[row, CONIC_Y]
        t, root, discriminant = intersect_conic(c, kappa, px, py, pz, ux, uy, uz, heading)
        ok = discriminant >= 0.0
        px, py, pz = px + t * ux, py + t * uy, pz + t * uz
        gx, gy, gz = c * px, c * py, c * (1.0 + kappa) * pz - 1.0
    nx, ny, nz, cos_in, cos_out, inside = bend_at(gx, gy, gz, ux, uy, uz, max(root, 0.0), heading, eta, mirror)
    if shapes[row, KIND] != CENTRED:
        nx, ny, nz = _turn_back(shapes, row, nx, ny, nz)
    ok = ok and (mirror > 0.0 or inside >= 0.0) and nz * heading * (1.0 - 2.0 * mirror) > 0.0
    # the step gives the hit in the lens' frame directly, without a rotation
    return x + t * dx, y + t * dy, z + t * dz, nx, ny, nz, px * px + py * py, cos_in, cos_out, ok


@inner
def _turn(shapes, row, x, y, z):
    """Return a vector of the lens' frame in the frame of a row."""
    return (
        shapes[row, AXES] * x + shapes[row, AXES + 1] * y + shapes[row, AXES + 2] * z,
        shapes[row, AXES + 3] * x + shapes[row, AXES + 4] * y + shapes[row, AXES + 5] * z,
        shapes[row, AXES + 6] * x + shapes[row, AXES + 7] * y + shapes[row, AXES + 8] * z,
    )


@inner
def _turn_back(shapes, row, x, y, z):
    """Return a vector of a row's frame in the lens' frame, the inverse of `_turn`."""
    return (
        shapes[row, AXES] * x + shapes[row, AXES + 3] * y + shapes[row, AXES + 6] * z,
        shapes[row, AXES + 1] * x + shapes[row, AXES + 4] * y + shapes[row, AXES + 7] * z,
        shapes[row, AXES + 2] * x + shapes[row, AXES + 5] * y + shapes[row, AXES + 8] * z,
    )


@inner
def hit_shapes(rows, actions, shapes, z_vertex, n_gap, sensor_z, tilt, nearness, px, py, hits):
    """Trace rays through rows of any shape and record every hit, as `kernels.tracing.sequential.trace_hits` does.

    Parameters
    ----------
    rows ... hits
        As in `trace_hits`, `shapes` as in `cross_shape`.
    """
    for k in range(px.shape[0]):
        x, y, z = px[k], py[k], 0.0
        dx, dy, dz, _ = ray_from_near(tilt, nearness, x, y)
        for step in range(hits.shape[1]):
            hits[k, step, 0], hits[k, step, 1], hits[k, step, 2] = np.nan, np.nan, np.nan
        hits[k, 0, 0], hits[k, 0, 1], hits[k, 0, 2] = x, y, z
        heading = 1.0
        ok = True
        for step in range(rows.shape[0]):
            row = rows[step]
            vertex = z_vertex[row]
            if actions[step] == STOP:
                t = (vertex - z) / dz
                x, y, z = x + t * dx, y + t * dy, vertex
            else:
                mirror = 1.0 if actions[step] == REFLECT else 0.0
                n_in, n_out = (n_gap[row], n_gap[row + 1]) if heading > 0.0 else (n_gap[row + 1], n_gap[row])
                x, y, z, dx, dy, dz, _, _, _, ok = cross_shape(
                    shapes, row, vertex, x, y, z, dx, dy, dz, heading, n_in / n_out, mirror
                )
                if mirror > 0.0:
                    heading = -heading
            if not ok:
                break
            hits[k, step + 1, 0], hits[k, step + 1, 1], hits[k, step + 1, 2] = x, y, z
        if ok:
            t = (sensor_z - z) / dz
            last = rows.shape[0] + 1
            hits[k, last, 0], hits[k, last, 1], hits[k, last, 2] = x + t * dx, y + t * dy, sensor_z
