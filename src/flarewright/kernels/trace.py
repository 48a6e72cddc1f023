"""Sequential ray tracing of one path at one wavelength, in lanes that the compiler vectorises."""

from math import sqrt

import numpy as np

from ._jit import borrowing, compiled, inner
from .bend import (
    ALIVE,
    KEEP,
    LAND,
    LANES,
    REFLECT,
    REFRACT,
    REL,
    STOP,
    STOP_X,
    WEIGHT,
    X,
    Y,
    bend,
    bend_about,
    ray_from_near,
)  # fmt: skip
from .intersect import FLATTEST, intersect_conic, intersect_sphere
from .shape_lanes import trace_shapes
from .shapes import hit_shapes

__all__ = [
    "ALIVE", "KEEP", "LAND", "LANES", "REFLECT", "REFRACT", "REL", "STOP", "STOP_X", "WEIGHT", "X", "Y", "bend",
    "hit_rays", "trace_hits", "trace_lanes", "trace_nodes",
]  # fmt: skip


# lanes are taken in multiples of this, whole vectors to the compiler
VECTOR = 8


@borrowing
def _copy(source, target):
    """Copy all lanes."""
    for k in range(source.shape[0]):
        for m in range(LANES):
            target[k, m] = source[k, m]


@inner
def trace_lanes(
    rows, actions, curvature, conic, z_vertex, inv_semi, n_gap, reflectance, sensor_z, tilt, nearness, px, py, out,
):  # fmt: skip
    """Trace rays of one light along one path to the sensor plane.

    Parameters
    ----------
    rows, actions : ndarray, shape (S,), int64
        Row met at each step and what happens there (REFRACT, REFLECT, STOP). Centred conics alone also know KEEP and
        LAND, by which P paths that begin alike share that beginning (`optics.paths.together`).
    curvature, conic, z_vertex, inv_semi : ndarray, shape (K,)
        Geometry of the rows; `inv_semi` is 1 / semi-diameter, 0 for the stop. Where not every row is a centred conic,
        `conic` is the shape table instead, shape (K, P) (`kernels.intersect`); only then is its code compiled.
    n_gap : ndarray, shape (K + 1,)
        Index before row 0, behind row 0, behind row 1, ...
    reflectance : ndarray, shape (K, M)
        R of each row against the cosine on its lower-index side, uniform over [0, 1].
    sensor_z : float
        Sensor plane, mm from the first vertex.
    tilt : float
        The ray through the first vertex runs along (0, sin tilt, cos tilt) in the meridional frame.
    nearness : float
        1 / distance from the light to the first vertex, 1/mm; 0 for a distant light, whose rays are parallel.
    px, py : ndarray, shape (N,)
        Where the rays cross the plane of the first vertex, mm.
    out : ndarray, shape (P N, 5 + 2 C)
        Filled, path by path, with x, y on the sensor, weight (product of R and T), the largest r / semi-diameter met,
        alive (1 or 0), and x, y at each of the C crossings of the stop, 0 where a path has fewer. Of a ray that ended,
        the first is the number of surfaces it passed; all else but "alive" means nothing.

    Notes
    -----
    Hullin 2011, section 4.1. A ray ends when it misses, is totally reflected where it should refract, or turns the
    wrong way along its leg. A mirror beyond the critical angle has R = 1. The weight of a near light's ray begins with
    the irradiance at its start over that at the first vertex (`kernels.bend.ray_from_near`).
    """
    if conic.ndim == 2:
        trace_shapes(
            rows, actions, conic, z_vertex, inv_semi, n_gap, reflectance, sensor_z, tilt, nearness, px, py, out
        )
        return
    n_rays = px.shape[0]
    samples = reflectance.shape[1]
    last_place, last_cell = float(samples - 1), np.int32(samples - 2)
    rays = np.empty((10, LANES))
    x, y, z, dx, dy, dz = rays[0], rays[1], rays[2], rays[3], rays[4], rays[5]
    weight, rel2, alive, passed = rays[6], rays[7], rays[8], rays[9]
    cos_low = np.empty(LANES)
    where = np.empty(LANES, dtype=np.int32)
    # the rays where a path leaves what it shares with the next
    kept = np.empty((10, LANES))
    kept_heading, kept_crossing, kept_living = 1.0, 0, 0.0
    for start in range(0, n_rays, LANES):
        count = min(LANES, n_rays - start)
        # the few rays of a cell that is halved do not take the time of a full set
        lanes = (count + VECTOR - 1) // VECTOR * VECTOR
        for m in range(lanes):
            k = start + min(m, count - 1)
            x[m] = px[k]
            y[m] = py[k]
            z[m] = 0.0
            dx[m] = 0.0
            dy[m] = np.sin(tilt)
            dz[m] = np.cos(tilt)
            weight[m] = 1.0
            rel2[m] = 0.0
            alive[m] = 1.0
            passed[m] = 0.0
        if nearness > 0.0:
            for m in range(lanes):
                dx[m], dy[m], dz[m], weight[m] = ray_from_near(tilt, nearness, x[m], y[m])
        heading = 1.0
        crossing = 0
        living = 1.0
        # where this path's rays begin in `out`
        begin = start
        for step in range(rows.shape[0] + 1):
            action = actions[step] if step < rows.shape[0] else LAND
            if action == KEEP:
                _copy(rays, kept)
                kept_heading, kept_crossing, kept_living = heading, crossing, living
                continue
            if action == LAND:
                for k in range(begin, begin + count):
                    for m in range(STOP_X + 2 * crossing, out.shape[1]):
                        out[k, m] = 0.0
                for m in range(count):
                    t = (sensor_z - z[m]) / dz[m]
                    out[begin + m, X] = x[m] + t * dx[m] if alive[m] > 0.0 else passed[m]
                    out[begin + m, Y] = y[m] + t * dy[m]
                    out[begin + m, WEIGHT] = weight[m]
                    out[begin + m, REL] = sqrt(rel2[m])
                    out[begin + m, ALIVE] = alive[m]
                if step == rows.shape[0]:
                    break
                _copy(kept, rays)
                heading, crossing, living = kept_heading, kept_crossing, kept_living
                for k in range(begin, begin + count):
                    for m in range(STOP_X, STOP_X + 2 * crossing):
                        out[k + n_rays, m] = out[k, m]
                begin += n_rays
                continue
            if living == 0.0:
                continue
            row = rows[step]
            vertex = z_vertex[row]
            if action == STOP:
                for m in range(lanes):
                    t = (vertex - z[m]) / dz[m]
                    x[m] += t * dx[m]
                    y[m] += t * dy[m]
                    z[m] = vertex
                for m in range(count):
                    out[begin + m, STOP_X + 2 * crossing] = x[m]
                    out[begin + m, STOP_X + 2 * crossing + 1] = y[m]
                crossing += 1
                continue
            c = curvature[row]
            kappa = conic[row]
            inv2 = inv_semi[row] * inv_semi[row]
            if heading > 0.0:
                n_in = n_gap[row]
                n_out = n_gap[row + 1]
            else:
                n_in = n_gap[row + 1]
                n_out = n_gap[row]
            eta = n_in / n_out
            mirror = 1.0 if action == REFLECT else 0.0
            low_in = 1.0 if n_in <= n_out else 0.0
            forth = heading * (1.0 - 2.0 * mirror)
            if kappa == 0.0 and abs(c) > FLATTEST:
                radius = 1.0 / c
                for m in range(lanes):
                    zl = z[m] - vertex
                    t, root, discriminant = intersect_sphere(c, radius, x[m], y[m], zl, dx[m], dy[m], dz[m], heading)
                    hx = x[m] + t * dx[m]
                    hy = y[m] + t * dy[m]
                    hz = zl + t * dz[m]
                    square = max(discriminant, 0.0)
                    nx, ny, nz, cos_out, inside = bend_about(
                        c * hx, c * hy, c * hz - 1.0, dx[m], dy[m], dz[m], root, square, heading, eta, mirror
                    )
                    ok = alive[m]
                    ok = ok if discriminant >= 0.0 else 0.0
                    ok = ok if (mirror > 0.0 or inside >= 0.0) else 0.0
                    ok = ok if nz * forth > 0.0 else 0.0
                    r2 = (hx * hx + hy * hy) * inv2
                    alive[m] = ok
                    passed[m] += ok
                    rel2[m] = max(rel2[m], r2)
                    cos_low[m] = root if low_in > 0.0 else cos_out
                    x[m] = hx
                    y[m] = hy
                    z[m] = hz + vertex
                    dx[m] = nx
                    dy[m] = ny
                    dz[m] = nz
            else:
                for m in range(lanes):
                    zl = z[m] - vertex
                    t, root, discriminant = intersect_conic(c, kappa, x[m], y[m], zl, dx[m], dy[m], dz[m], heading)
                    hx = x[m] + t * dx[m]
                    hy = y[m] + t * dy[m]
                    hz = zl + t * dz[m]
                    nx, ny, nz, cos_in, cos_out, inside = bend(
                        c, kappa, hx, hy, hz, dx[m], dy[m], dz[m], root, heading, eta, mirror
                    )
                    ok = alive[m]
                    ok = ok if discriminant >= 0.0 else 0.0
                    ok = ok if (mirror > 0.0 or inside >= 0.0) else 0.0
                    ok = ok if nz * forth > 0.0 else 0.0
                    r2 = (hx * hx + hy * hy) * inv2
                    alive[m] = ok
                    passed[m] += ok
                    rel2[m] = max(rel2[m], r2)
                    cos_low[m] = cos_in if low_in > 0.0 else cos_out
                    x[m] = hx
                    y[m] = hy
                    z[m] = hz + vertex
                    dx[m] = nx
                    dy[m] = ny
                    dz[m] = nz
            living = 0.0
            for m in range(lanes):
                living += alive[m]
            if living == 0.0:
                continue
            table = reflectance[row]
            # where to look is found for several rays at once; the rest would keep the compiler from it
            for m in range(lanes):
                place = min(cos_low[m] if alive[m] > 0.0 else 0.0, 1.0) * last_place
                cell = min(np.int32(place), last_cell)
                where[m] = cell
                cos_low[m] = place - cell
            for m in range(lanes):
                # an unsigned place needs no check for counting from the end
                at = np.uint64(where[m])
                low = table[at]
                r = low + cos_low[m] * (table[at + np.uint64(1)] - low)
                weight[m] *= r if mirror > 0.0 else 1.0 - r
            if mirror > 0.0:
                heading = -heading


@compiled
def trace_nodes(
    rows, actions, curvature, conic, z_vertex, inv_semi, n_gap, reflectance, sensor_z, tilt, nearness, px, py, out,
):  # fmt: skip
    """Trace rays as `trace_lanes` does, for Python; kernels call that."""
    trace_lanes(
        rows, actions, curvature, conic, z_vertex, inv_semi, n_gap, reflectance, sensor_z, tilt, nearness, px, py, out
    )


@inner
def hit_rays(rows, actions, curvature, conic, z_vertex, n_gap, sensor_z, tilt, nearness, px, py, hits):
    """Trace rays like `trace_lanes` and keep every hit: for drawings and for the size of surfaces.

    Parameters
    ----------
    rows ... n_gap
        As in `trace_lanes`.
    sensor_z, tilt, nearness : float
    px, py : ndarray, shape (N,)
    hits : ndarray, shape (N, S + 2, 3)
        Filled with the start, the hit at every step, and the point on the sensor; NaN from where a ray ends.
    """
    if conic.ndim == 2:
        hit_shapes(rows, actions, conic, z_vertex, n_gap, sensor_z, tilt, nearness, px, py, hits)
        return
    for k in range(px.shape[0]):
        x, y, z = px[k], py[k], 0.0
        dx, dy, dz, _ = ray_from_near(tilt, nearness, x, y)
        hits[k] = np.nan
        hits[k, 0, 0], hits[k, 0, 1], hits[k, 0, 2] = x, y, z
        heading = 1.0
        alive = True
        for step in range(rows.shape[0]):
            row = rows[step]
            vertex = z_vertex[row]
            if actions[step] == STOP:
                t = (vertex - z) / dz
                x, y, z = x + t * dx, y + t * dy, vertex
            else:
                mirror = 1.0 if actions[step] == REFLECT else 0.0
                n_in, n_out = (n_gap[row], n_gap[row + 1]) if heading > 0.0 else (n_gap[row + 1], n_gap[row])
                t, root, discriminant = intersect_conic(
                    curvature[row], conic[row], x, y, z - vertex, dx, dy, dz, heading
                )
                if discriminant < 0.0:
                    alive = False
                    break
                x, y, z = x + t * dx, y + t * dy, z + t * dz
                dx, dy, dz, _, _, inside = bend(
                    curvature[row], conic[row], x, y, z - vertex, dx, dy, dz, root, heading, n_in / n_out, mirror
                )
                if mirror > 0.0:
                    heading = -heading
                if dz * heading <= 0.0 or (mirror == 0.0 and inside < 0.0):
                    alive = False
            hits[k, step + 1, 0], hits[k, step + 1, 1], hits[k, step + 1, 2] = x, y, z
            if not alive:
                break
        if alive:
            t = (sensor_z - z) / dz
            last = rows.shape[0] + 1
            hits[k, last, 0], hits[k, last, 1], hits[k, last, 2] = x + t * dx, y + t * dy, sensor_z


@compiled
def trace_hits(rows, actions, curvature, conic, z_vertex, n_gap, sensor_z, tilt, nearness, px, py, hits):
    """Trace rays as `hit_rays` does, for Python; kernels call that."""
    hit_rays(rows, actions, curvature, conic, z_vertex, n_gap, sensor_z, tilt, nearness, px, py, hits)
