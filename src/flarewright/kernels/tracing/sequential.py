"""Sequential ray tracing of one path, or of paths with a common start, at one wavelength, in vectorised lanes."""

from math import sqrt

import numpy as np

from ..jit.decorators import borrowing, compiled, inner
from .general_lanes import trace_shapes
from .general_ray import hit_shapes
from .intersect import FLATTEST, intersect_conic, intersect_sphere
from .lens_arrays import SHAPED
from .refract import (  # fmt: skip
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
)

__all__ = [
    "ALIVE", "KEEP", "LAND", "LANES", "REFLECT", "REFRACT", "REL", "STOP", "STOP_X", "WEIGHT", "X", "Y", "bend",
    "trace_hits", "trace_lanes", "trace_nodes",
]  # fmt: skip


# the number of lanes is rounded up to a multiple of this, whole vectors to the compiler
VECTOR = 8


@borrowing
def _copy(source, target):
    """Copy all lanes."""
    for k in range(source.shape[0]):
        for m in range(LANES):
            target[k, m] = source[k, m]


@inner
def trace_lanes(steps, lens, light, px, py, out, squares=None):
    """Trace rays of one light along one path to the sensor plane.

    Parameters
    ----------
    steps : PathSteps
        Of one path, or of P paths with the same first steps.
    lens : ConicLens or ShapedLens
        At one wavelength. The code for shapes is compiled only for a `ShapedLens`.
    light : IncidentLight
    px, py : ndarray, shape (N,)
        Places of the rays in the plane of the first vertex, mm.
    out : ndarray, shape (P N, 5 + 2 C)
        Filled, path by path, with x, y on the sensor, weight (product of R and T), largest r / semi-diameter, alive (1
        or 0), and x, y at each of the C stop crossings, 0 if a path has fewer. For a ray that ended, the first column
        is the number of surfaces it passed; all others except "alive" are undefined.
    squares : ndarray, shape (N, S), or None
        With P = 1, filled with the squared sine of incidence on the side of the lower index at every step: 1 under
        total reflection, 0 at the stop and where the index does not change. Undefined for a ray that ended.

    Notes
    -----
    Hullin 2011, section 4.1. A ray ends when it misses a surface, is totally reflected where it should refract, or
    turns against the direction of its leg. A mirror beyond the critical angle has R = 1. The initial weight of a near
    light's ray is the irradiance at its start over that at the first vertex (`kernels.tracing.refract.ray_from_near`).
    """
    if len(lens) == SHAPED:
        if squares is None:
            trace_shapes(steps, lens, light, px, py, out, np.empty((0, 0)))
        else:
            trace_shapes(steps, lens, light, px, py, out, squares)
        return
    rows, actions = steps
    curvature, conic, z_vertex, inv_semi, n_gap, reflectance, sensor_z = lens
    tilt, nearness = light
    n_rays = px.shape[0]
    samples = reflectance.shape[1]
    last_place, last_cell = float(samples - 1), np.int32(samples - 2)
    rays = np.empty((10, LANES))
    x, y, z, dx, dy, dz = rays[0], rays[1], rays[2], rays[3], rays[4], rays[5]
    weight, rel2, alive, passed = rays[6], rays[7], rays[8], rays[9]
    cos_low = np.empty(LANES)
    where = np.empty(LANES, dtype=np.int32)
    # the rays saved by KEEP, at the end of the steps shared with the next path
    kept = np.empty((10, LANES))
    kept_heading, kept_crossing, kept_living = 1.0, 0, 0.0
    for start in range(0, n_rays, LANES):
        count = min(LANES, n_rays - start)
        # use only as many vectors as needed: a halved cell of the grid has few rays
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
        # first row of this path's rays in `out`
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
                if squares is not None:
                    squares[begin : begin + count, step] = 0.0
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
            if squares is not None:
                for m in range(count):
                    squares[begin + m, step] = 0.0 if n_in == n_out else max(1.0 - cos_low[m] * cos_low[m], 0.0)
            table = reflectance[row]
            # a separate loop for the indices: the look-ups below would prevent its vectorisation
            for m in range(lanes):
                place = min(cos_low[m] if alive[m] > 0.0 else 0.0, 1.0) * last_place
                cell = min(np.int32(place), last_cell)
                where[m] = cell
                cos_low[m] = place - cell
            for m in range(lanes):
                # unsigned indices skip Numba's check for negative ones
                at = np.uint64(where[m])
                low = table[at]
                r = low + cos_low[m] * (table[at + np.uint64(1)] - low)
                weight[m] *= r if mirror > 0.0 else 1.0 - r
            if mirror > 0.0:
                heading = -heading


@compiled
def trace_nodes(steps, lens, light, px, py, out):
    """Trace rays as `trace_lanes` does; for calls from Python only, kernels call `trace_lanes`."""
    trace_lanes(steps, lens, light, px, py, out)


@compiled
def trace_hits(rows, actions, curvature, conic, z_vertex, n_gap, sensor_z, tilt, nearness, px, py, hits):
    """Trace rays as `trace_lanes` does and record every hit, for drawings and for the sizes of surfaces.

    Parameters
    ----------
    rows ... n_gap
        As in `trace_lanes`.
    sensor_z, tilt, nearness : float
    px, py : ndarray, shape (N,)
    hits : ndarray, shape (N, S + 2, 3)
        Filled with the start, the hit at every step, and the point on the sensor; NaN after the end of a ray.
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
