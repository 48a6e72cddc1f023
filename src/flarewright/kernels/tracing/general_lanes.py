"""Tracing through rows of any shape and position, in lanes that the compiler vectorises.

The counterpart of `kernels.tracing.sequential`, which traces conics. All lanes pass a row together, step by step: into
the row's frame, to the surface (a conic in closed form, any other sag by Newton's method until every lane has
converged), through it, and back to the lens' frame.
"""

from math import sqrt

import numpy as np

from ..jit.decorators import inlined, inner
from .intersect import (
    ASPHERE,
    AXES,
    CENTRED,
    CONIC_Y,
    CURVATURE_Y,
    DEGREE,
    KIND,
    NEWTON_STEPS,
    ODD,
    ODD_COUNT,
    ORIGIN,
    POLYNOMIAL,
    SAG,
    SCALE,
    SETTLED,
    SIDE,
    TANGENT,
    TERMS,
    TORUS,
    biconic_form,
    biconic_sag,
    height_of_image,
    intersect_conic,
    quadric_of,
    step_to_quadric,
    torus_sag,
)
from .refract import ALIVE, LANES, REFLECT, REL, STOP, STOP_X, WEIGHT, X, Y, bend_at, ray_from_near

# rows of `work`, all in the frame of the surface: place and direction, step, height and slopes at the hit, ...
PX, PY, PZ, UX, UY, UZ, T, SAGS, GX, GY, GZ, ROOT, FOUND = range(13)
# ... and scratch for polynomials
ONE, TWO, THREE, FOUR, FIVE, AT_X, AT_Y, ROOM = range(13, 21)
# height and slopes of the figure error where it was last evaluated, and that place
FIGURE, FIGURE_X, FIGURE_Y, FIGURE_AT_X, FIGURE_AT_Y = range(21, 26)
WORK = 26
# distance over which a figure error is linear, mm: its slopes change by less than 1e-7
LINEAR_MM = 3e-5


@inner
def trace_shapes(steps, lens, light, px, py, out, squares):
    """Trace rays as `kernels.tracing.sequential.trace_nodes` does, through rows of any shape.

    Parameters
    ----------
    steps, light, px, py
        As in `trace_nodes`.
    lens : ShapedLens
        At one wavelength, in the frame of the rays.
    out : ndarray, shape (N, 5 + 2 C)
        As in `trace_nodes`. A rim is decentred and tilted with its surface. For a ray that ended, the largest
        r / semi-diameter is that up to its end, and later crossings of the stop are 0.
    squares : ndarray, shape (N, S)
        As in `kernels.tracing.sequential.trace_lanes`, without rows instead of None: this code takes seconds to
        compile, and would be compiled again for an array.
    """
    rows, actions = steps
    shapes, z_vertex, inv_semi, n_gap, reflectance, sensor_z = lens
    tilt, nearness = light
    samples = reflectance.shape[1]
    x, y, z = np.empty(LANES), np.empty(LANES), np.empty(LANES)
    dx, dy, dz = np.empty(LANES), np.empty(LANES), np.empty(LANES)
    weight, rel2, alive, passed = np.empty(LANES), np.empty(LANES), np.empty(LANES), np.empty(LANES)
    cos_low = np.empty(LANES)
    work = np.empty((WORK, LANES))
    for start in range(0, px.shape[0], LANES):
        count = min(LANES, px.shape[0] - start)
        for m in range(LANES):
            k = start + min(m, count - 1)
            x[m], y[m], z[m] = px[k], py[k], 0.0
            dx[m], dy[m], dz[m] = 0.0, np.sin(tilt), np.cos(tilt)
            weight[m], rel2[m], alive[m], passed[m] = 1.0, 0.0, 1.0, 0.0
        if nearness > 0.0:
            for m in range(LANES):
                dx[m], dy[m], dz[m], weight[m] = ray_from_near(tilt, nearness, x[m], y[m])
        heading = 1.0
        crossing = 0
        for step in range(rows.shape[0]):
            row = rows[step]
            vertex = z_vertex[row]
            if actions[step] == STOP:
                for m in range(LANES):
                    t = (vertex - z[m]) / dz[m]
                    x[m] += t * dx[m]
                    y[m] += t * dy[m]
                    z[m] = vertex
                for m in range(count):
                    out[start + m, STOP_X + 2 * crossing] = x[m] if alive[m] > 0.0 else 0.0
                    out[start + m, STOP_X + 2 * crossing + 1] = y[m] if alive[m] > 0.0 else 0.0
                if squares.shape[0] > 0:
                    squares[start : start + count, step] = 0.0
                crossing += 1
                continue
            mirror = 1.0 if actions[step] == REFLECT else 0.0
            n_in, n_out = (n_gap[row], n_gap[row + 1]) if heading > 0.0 else (n_gap[row + 1], n_gap[row])
            low_in = n_in <= n_out
            _enter(shapes, row, vertex, x, y, z, dx, dy, dz, work)
            if shapes[row, KIND] == SAG:
                _meet_sag(shapes, row, heading, alive, work)
            else:
                _meet_conic(shapes, row, heading, work)
            _cross(shapes, row, heading, n_in / n_out, mirror, inv_semi[row], low_in, alive, rel2, passed, cos_low,
                   x, y, z, dx, dy, dz, work)  # fmt: skip
            living = 0.0
            for m in range(LANES):
                living += alive[m]
            if living == 0.0:
                break
            if squares.shape[0] > 0:
                for m in range(count):
                    squares[start + m, step] = 0.0 if n_in == n_out else max(1.0 - cos_low[m] * cos_low[m], 0.0)
            table = reflectance[row]
            for m in range(LANES):
                if alive[m] > 0.0:
                    place = min(cos_low[m], 1.0) * (samples - 1)
                    cell = min(np.int64(place), samples - 2)
                    r = table[cell] + (place - cell) * (table[cell + 1] - table[cell])
                    weight[m] *= r if mirror > 0.0 else 1.0 - r
            if mirror > 0.0:
                heading = -heading
        for m in range(count):
            k = start + m
            for c in range(STOP_X + 2 * crossing, out.shape[1]):
                out[k, c] = 0.0
            t = (sensor_z - z[m]) / dz[m]
            out[k, X], out[k, Y] = x[m] + t * dx[m] if alive[m] > 0.0 else passed[m], y[m] + t * dy[m]
            out[k, WEIGHT], out[k, REL], out[k, ALIVE] = weight[m], sqrt(rel2[m]), alive[m]


@inlined
def _enter(shapes, row, vertex, x, y, z, dx, dy, dz, work):
    """Transform rays to the frame of a row."""
    if shapes[row, KIND] == CENTRED:
        for m in range(LANES):
            work[PX, m], work[PY, m], work[PZ, m] = x[m], y[m], z[m] - vertex
            work[UX, m], work[UY, m], work[UZ, m] = dx[m], dy[m], dz[m]
        return
    ox, oy, oz = shapes[row, ORIGIN], shapes[row, ORIGIN + 1], vertex + shapes[row, ORIGIN + 2]
    for axis in range(3):
        a, b, c = shapes[row, AXES + 3 * axis], shapes[row, AXES + 3 * axis + 1], shapes[row, AXES + 3 * axis + 2]
        place, way = work[PX + axis], work[UX + axis]
        for m in range(LANES):
            place[m] = a * (x[m] - ox) + b * (y[m] - oy) + c * (z[m] - oz)
            way[m] = a * dx[m] + b * dy[m] + c * dz[m]


@inlined
def _meet_conic(shapes, row, heading, work):
    """Step to a conic of revolution; fill step, gradient, root and whether there is a hit."""
    curvature, conic = shapes[row, CURVATURE_Y], shapes[row, CONIC_Y]
    for m in range(LANES):
        px, py, pz, ux, uy, uz = work[PX, m], work[PY, m], work[PZ, m], work[UX, m], work[UY, m], work[UZ, m]
        t, root, discriminant = intersect_conic(curvature, conic, px, py, pz, ux, uy, uz, heading)
        work[T, m], work[ROOT, m] = t, root
        work[FOUND, m] = 1.0 if discriminant >= 0.0 else 0.0
        work[GX, m], work[GY, m] = curvature * (px + t * ux), curvature * (py + t * uy)
        work[GZ, m] = curvature * (1.0 + conic) * (pz + t * uz) - 1.0


@inlined
def _meet_sag(shapes, row, heading, alive, work):
    """Step to a sag as `kernels.tracing.intersect.intersect_sag` does, for all lanes until those alive converge."""
    quadric = quadric_of(shapes, row)
    for m in range(LANES):
        px, py, pz, ux, uy, uz = work[PX, m], work[PY, m], work[PZ, m], work[UX, m], work[UY, m], work[UZ, m]
        work[T, m] = step_to_quadric(quadric, px, py, pz, ux, uy, uz, heading)
    for m in range(LANES):
        work[FIGURE_AT_X, m] = np.inf
    for _ in range(NEWTON_STEPS):
        _sags(shapes, row, alive, work)
        open_lanes = 0.0
        for m in range(LANES):
            error = work[SAGS, m] - work[PZ, m] - work[T, m] * work[UZ, m]
            settled = abs(error) < SETTLED
            slope = work[GX, m] * work[UX, m] + work[GY, m] * work[UY, m] - work[UZ, m]
            # a converged lane takes no further step, so that its gradient belongs to its hit
            work[T, m] -= 0.0 if settled else error / slope
            work[FOUND, m] = 1.0 if settled and work[ROOM, m] > 0.0 else 0.0
            open_lanes += 0.0 if settled else alive[m]
        if open_lanes == 0.0:
            break
    for m in range(LANES):
        root = -heading * (work[GX, m] * work[UX, m] + work[GY, m] * work[UY, m] - work[UZ, m])
        work[GZ, m] = -1.0
        work[ROOT, m] = max(root, 0.0)
        work[FOUND, m] = work[FOUND, m] if root > 0.0 else 0.0


@inlined
def _sags(shapes, row, alive, work):
    """Evaluate `kernels.tracing.intersect.sag_of_shape` at the hits of all lanes: height, slopes, room."""
    torus = shapes[row, TORUS] > 0.0
    if torus:
        for m in range(LANES):
            x, y = work[PX, m] + work[T, m] * work[UX, m], work[PY, m] + work[T, m] * work[UY, m]
            work[AT_X, m], work[AT_Y, m] = x, y
            work[SAGS, m], work[GX, m], work[GY, m], work[ROOM, m] = torus_sag(shapes, row, x, y)
    else:
        form = biconic_form(shapes, row)
        for m in range(LANES):
            x, y = work[PX, m] + work[T, m] * work[UX, m], work[PY, m] + work[T, m] * work[UY, m]
            work[AT_X, m], work[AT_Y, m] = x, y
            work[SAGS, m], work[GX, m], work[GY, m], work[ROOM, m] = biconic_sag(form, x, y)
    terms = 0
    for k in range(TERMS):
        if shapes[row, ASPHERE + k] != 0.0:
            terms = k + 1
    if terms > 0 and not torus:
        _aspheres(shapes, row, ASPHERE, terms, False, work)
    if shapes[row, ODD_COUNT] > 0.0:
        _aspheres(shapes, row, ODD, int(shapes[row, ODD_COUNT]), True, work)
    if shapes[row, DEGREE] >= 0.0 or shapes[row, SIDE] > 0.0:
        _figures(shapes, row, alive, work)


@inlined
def _figures(shapes, row, alive, work):
    """Add the figure errors of all lanes; for small steps extrapolate them linearly from the last evaluation."""
    moved = 0.0
    for m in range(LANES):
        away = max(abs(work[AT_X, m] - work[FIGURE_AT_X, m]), abs(work[AT_Y, m] - work[FIGURE_AT_Y, m]))
        moved = max(moved, away if alive[m] > 0.0 else 0.0)
    if not moved <= LINEAR_MM:
        for m in range(LANES):
            work[FIGURE_AT_X, m], work[FIGURE_AT_Y, m] = work[AT_X, m], work[AT_Y, m]
            work[FIGURE, m], work[FIGURE_X, m], work[FIGURE_Y, m] = 0.0, 0.0, 0.0
        if shapes[row, DEGREE] >= 0.0:
            _polynomials(shapes, row, work)
        if shapes[row, SIDE] > 0.0:
            for m in range(LANES):
                if alive[m] > 0.0:
                    value, along_x, along_y = height_of_image(shapes, row, work[AT_X, m], work[AT_Y, m])
                    work[FIGURE, m] += value
                    work[FIGURE_X, m] += along_x
                    work[FIGURE_Y, m] += along_y
    for m in range(LANES):
        along_x, along_y = work[FIGURE_X, m], work[FIGURE_Y, m]
        across = along_x * (work[AT_X, m] - work[FIGURE_AT_X, m]) + along_y * (work[AT_Y, m] - work[FIGURE_AT_Y, m])
        work[SAGS, m] += work[FIGURE, m] + across
        work[GX, m] += along_x
        work[GY, m] += along_y


@inlined
def _aspheres(shapes, row, first, terms, odd, work):
    """Add the aspheres of all lanes (`kernels.tracing.intersect`); x and y are in AT_X and AT_Y."""
    tangent = shapes[row, TANGENT]
    for m in range(LANES):
        work[ONE, m], work[TWO, m] = 0.0, 0.0
        work[THREE, m] = min(work[AT_X, m] * work[AT_X, m] + work[AT_Y, m] * work[AT_Y, m], tangent)
    for k in range(first + terms - 1, first - 1, -1):
        term = shapes[row, k]
        for m in range(LANES):
            work[TWO, m] = work[TWO, m] * work[THREE, m] + work[ONE, m]
            work[ONE, m] = work[ONE, m] * work[THREE, m] + term
    for m in range(LANES):
        x, y, at = work[AT_X, m], work[AT_Y, m], work[THREE, m]
        part, power = (sqrt(at), 1.5) if odd else (at, 2.0)
        slope = part * (power * work[ONE, m] + at * work[TWO, m])
        work[SAGS, m] += part * at * work[ONE, m] + (x * x + y * y - at) * slope
        work[GX, m] += 2.0 * x * slope
        work[GY, m] += 2.0 * y * slope


@inlined
def _polynomials(shapes, row, work):
    """Add the polynomials of all lanes' figure errors (`kernels.tracing.intersect`); x and y are in AT_X and AT_Y."""
    scale, degree = shapes[row, SCALE], int(shapes[row, DEGREE])
    for m in range(LANES):
        work[ONE, m], work[TWO, m], work[THREE, m] = 0.0, 0.0, 0.0
    for i in range(degree, -1, -1):
        for m in range(LANES):
            work[FOUR, m], work[FIVE, m] = 0.0, 0.0
        for j in range(degree - i, -1, -1):
            term = shapes[row, POLYNOMIAL + 7 * i + j]
            for m in range(LANES):
                v = work[AT_Y, m] * scale
                work[FIVE, m] = work[FIVE, m] * v + work[FOUR, m]
                work[FOUR, m] = work[FOUR, m] * v + term
        for m in range(LANES):
            u = work[AT_X, m] * scale
            work[TWO, m] = work[TWO, m] * u + work[ONE, m]
            work[ONE, m] = work[ONE, m] * u + work[FOUR, m]
            work[THREE, m] = work[THREE, m] * u + work[FIVE, m]
    for m in range(LANES):
        work[FIGURE, m] += work[ONE, m]
        work[FIGURE_X, m] += work[TWO, m] * scale
        work[FIGURE_Y, m] += work[THREE, m] * scale


@inlined
def _cross(
    shapes, row, heading, eta, mirror, inv_semi, low_in, alive, rel2, passed, cos_low, x, y, z, dx, dy, dz, work,
):  # fmt: skip
    """Refract or reflect the rays at their hits and transform them to the lens' frame; update `alive`."""
    for m in range(LANES):
        t, ux, uy, uz = work[T, m], work[UX, m], work[UY, m], work[UZ, m]
        nx, ny, nz, cos_in, cos_out, inside = bend_at(
            work[GX, m], work[GY, m], work[GZ, m], ux, uy, uz, work[ROOT, m], heading, eta, mirror
        )
        at_x, at_y = work[PX, m] + t * ux, work[PY, m] + t * uy
        r2 = (at_x * at_x + at_y * at_y) * inv_semi * inv_semi
        # the surface at which a ray ends still counts, later ones do not
        rel2[m] = max(rel2[m], r2) if alive[m] > 0.0 else rel2[m]
        cos_low[m] = cos_in if low_in else cos_out
        # the step gives the hit in the lens' frame directly, without a rotation
        x[m] += t * dx[m]
        y[m] += t * dy[m]
        z[m] += t * dz[m]
        work[UX, m], work[UY, m], work[UZ, m] = nx, ny, nz
        work[FOUND, m] = work[FOUND, m] if mirror > 0.0 or inside >= 0.0 else 0.0
    turned = shapes[row, KIND] != CENTRED
    a = shapes[row, AXES : AXES + 9]
    forth = heading * (1.0 - 2.0 * mirror)
    for m in range(LANES):
        nx, ny, nz = work[UX, m], work[UY, m], work[UZ, m]
        dx[m] = a[0] * nx + a[3] * ny + a[6] * nz if turned else nx
        dy[m] = a[1] * nx + a[4] * ny + a[7] * nz if turned else ny
        dz[m] = a[2] * nx + a[5] * ny + a[8] * nz if turned else nz
        ok = alive[m] * work[FOUND, m]
        alive[m] = ok if dz[m] * forth > 0.0 else 0.0
        passed[m] += alive[m]
