"""Paraxial ghosts: ray transfer matrices along a path, and ghosts drawn from them."""

from math import sqrt

import numpy as np

from ..jit.decorators import borrowing, compiled, inner
from ..raster.iris_mask import fill_through_mask, mask_texture
from ..raster.polygons import fill_polygon
from ..tracing.clip import MAX_VERTICES, PP, PQ, PREL, PSTOP, PW, PX, PY, cut_to_rectangle, polygon_area
from ..tracing.sequential import REFLECT, STOP
from .iris_images import close_ring, cut_ring

# edges of the polygon that approximates the round rim of the entrance
RIM = 64
# largest number of stop crossings of a path of two reflections
MOST_CROSSINGS = 3
# side of the square drawn for a ghost focused to a point, pixels
SPOT = 0.05
# part of the entrance's radius within which vertices of an outline count as one
FLAT = 1e-9


@compiled
def path_matrices(rows, actions, curvature, z_vertex, n_gap, sensor_z, to_stop):
    """Multiply the ray transfer matrices along a path.

    Parameters
    ----------
    rows, actions : ndarray, shape (S,), int64
    curvature, z_vertex : ndarray, shape (K,)
    n_gap : ndarray, shape (K + 1,)
    sensor_z : float
    to_stop : ndarray, shape (C, 2, 2)
        Filled with Ma of each crossing of the stop.

    Returns
    -------
    a, b, c, d : float
        Matrix of the whole path, from the plane of the first vertex to the sensor.

    Notes
    -----
    Rays (y, u); refraction [[1, 0], [(n1 - n2) / (n2 Re), n1 / n2]], reflection [[1, 0], [2 / Re, 1]], Re = +R on
    forward and -R on backward legs (docs/physics.md; Lee and Eisemann 2013, the sign of the second mirror corrected).
    """
    a, b, c, d = 1.0, 0.0, 0.0, 1.0
    heading, here = 1.0, 0.0
    crossing = 0
    for step in range(rows.size):
        row = rows[step]
        gap = heading * (z_vertex[row] - here)
        a, b = a + gap * c, b + gap * d
        here = z_vertex[row]
        if actions[step] == STOP:
            to_stop[crossing, 0, 0], to_stop[crossing, 0, 1] = a, b
            to_stop[crossing, 1, 0], to_stop[crossing, 1, 1] = c, d
            crossing += 1
            continue
        power = curvature[row] * heading
        if actions[step] == REFLECT:
            c, d = c + 2.0 * power * a, d + 2.0 * power * b
            heading = -heading
        else:
            n1, n2 = (n_gap[row], n_gap[row + 1]) if heading > 0.0 else (n_gap[row + 1], n_gap[row])
            bend = (n1 - n2) / n2 * power
            c, d = bend * a + n1 / n2 * c, bend * b + n1 / n2 * d
    gap = sensor_z - here
    return a + gap * c, b + gap * d, c, d


@inner
def paraxial_sines(rows, actions, curvature, curvature_x, z_vertex, n_gap, y, u, x, ux, squares):
    """Trace one paraxial ray along a path and record its angles of incidence.

    Parameters
    ----------
    rows, actions, curvature, z_vertex, n_gap
        As in `path_matrices`.
    curvature_x : ndarray, shape (K,), or None
        Curvatures in the x plane if they differ; None: the ray stays in its plane, x and ux are not used.
    y, u : float
        Height in the plane of the first vertex and slope.
    x, ux : float
        The same in the x plane.
    squares : ndarray, shape (S,) or longer
        Filled with the squared sine on the lower-index side at every step: 1 under total reflection, 0 at the stop.
    """
    heading, here = 1.0, 0.0
    for step in range(rows.size):
        row = rows[step]
        squares[step] = 0.0
        y += heading * (z_vertex[row] - here) * u
        if curvature_x is not None:
            x += heading * (z_vertex[row] - here) * ux
        here = z_vertex[row]
        if actions[step] == STOP:
            continue
        power = curvature[row] * heading
        n1, n2 = (n_gap[row], n_gap[row + 1]) if heading > 0.0 else (n_gap[row + 1], n_gap[row])
        slope = u + power * y
        if curvature_x is not None:
            across = ux + curvature_x[row] * heading * x
            slope = sqrt(slope * slope + across * across)
        sine = slope / sqrt(1.0 + slope * slope) * (1.0 if n1 <= n2 else n1 / n2)
        squares[step] = min(sine * sine, 1.0)
        if actions[step] == REFLECT:
            u += 2.0 * power * y
            if curvature_x is not None:
                ux += 2.0 * curvature_x[row] * heading * x
            heading = -heading
        else:
            u = (n1 - n2) / n2 * power * y + n1 / n2 * u
            if curvature_x is not None:
                ux = (n1 - n2) / n2 * curvature_x[row] * heading * x + n1 / n2 * ux


@inner
def paraxial_weight(rows, actions, reflectance, squares):
    """Multiply R and T along one paraxial ray, at its angles of incidence.

    Parameters
    ----------
    rows, actions : ndarray, shape (S,), int64
    reflectance : ndarray, shape (K, M)
        As in `kernels.tracing.sequential.trace_nodes`.
    squares : ndarray, shape (S,) or longer
        From `paraxial_sines`.

    Returns
    -------
    float
    """
    weight = 1.0
    samples = reflectance.shape[1]
    for step in range(rows.size):
        if actions[step] == STOP:
            continue
        row = rows[step]
        place = sqrt(1.0 - squares[step]) * (samples - 1)
        cell = min(int(place), samples - 2)
        r = reflectance[row, cell] + (place - cell) * (reflectance[row, cell + 1] - reflectance[row, cell])
        weight *= r if actions[step] == REFLECT else 1.0 - r
    return weight


@inner
def _meridians(rows, actions, curvature, curvature_x, z_vertex, n_gap, sensor_z, nearness, crossings, to_stop, across):
    """Fill the matrices to the stop in the y and the x plane; return a and b of the whole path in each."""
    a, b, _, _ = path_matrices(rows, actions, curvature, z_vertex, n_gap, sensor_z, to_stop)
    # the rays of a near light diverge: their slope grows with their height
    a += nearness * b
    ax, bx = a, b
    if curvature_x is not None:
        ax, bx, _, _ = path_matrices(rows, actions, curvature_x, z_vertex, n_gap, sensor_z, across)
        ax += nearness * bx
    for c in range(crossings):
        to_stop[c, 0, 0] += nearness * to_stop[c, 0, 1]
        if curvature_x is not None:
            across[c, 0, 0] += nearness * across[c, 0, 1]
    return a, b, ax, bx


@compiled
def draw_matrix_ghosts(
    rows, actions, starts, crossings, curvature, curvature_x, z_vertex, n_gap, reflectance, sensor_z,
    entrance, slope, slope_x, nearness, edges, iris_radius, mask, axes, to_pixels, gain, rgb, plane,
):  # fmt: skip
    """Draw the ghosts of many paths at many wavelengths by matrices (Lee and Eisemann 2013; Van Acoleyen 2025, ch. 4).

    Parameters
    ----------
    rows, actions : ndarray, int64
        The steps of all paths, one after another.
    starts : ndarray, shape (P + 1,), int64
        Index of the first step of each path.
    crossings : ndarray, shape (P,), int64
        Number of stop crossings of each path.
    curvature, z_vertex : ndarray, shape (K,)
    curvature_x : ndarray, shape (K,), or None
        Curvatures in the x plane if some row's differ; the frame is then that of the lens instead of the meridional
        one.
    n_gap : ndarray, shape (W, K + 1)
    reflectance : ndarray, shape (W, K, M)
    sensor_z : float
    entrance : float
        Semi-diameter of the first surface, mm.
    slope : float
        Slope of the rays in the y plane.
    slope_x : float
        Slope in the x plane; 0 in the meridional frame.
    nearness : float
        1 / distance along the axis from the light to the first vertex, 1/mm; 0 for a distant light.
    edges : ndarray, shape (B, 4)
        The iris as straight blades.
    iris_radius : float
    mask, axes, to_pixels, gain
        As in `draw_bundle`.
    rgb : ndarray, shape (P, W, 3)
    plane : ndarray, shape (H, W, 3), float64
        Differences of flux along the rows, added to (`kernels.raster.polygons.sum_rows`).

    Notes
    -----
    A ghost is the image of the entrance cut by the iris: a polygon of constant irradiance. Its colour is that of one
    ray, through the middle of the part of the entrance whose light passes the iris.
    """
    height, width = plane.shape[0], plane.shape[1]
    polygon, other = np.zeros((MAX_VERTICES, PSTOP + 6)), np.zeros((MAX_VERTICES, PSTOP + 6))
    values = np.empty(MAX_VERTICES)
    squares = np.empty(rows.size)
    to_stop = np.empty((MOST_CROSSINGS, 2, 2))
    across = to_stop if curvature_x is None else np.empty((MOST_CROSSINGS, 2, 2))
    rim = _rim(entrance, RIM)
    spots, ring = _outline(RIM, edges)
    if mask is not None:
        texture = mask_texture(mask, MOST_CROSSINGS, width)
        corner, stops = np.empty((3, 2)), np.empty((MOST_CROSSINGS, 3, 2))
    for p in range(starts.size - 1):
        path_rows, path_actions = rows[starts[p] : starts[p + 1]], actions[starts[p] : starts[p + 1]]
        for w in range(n_gap.shape[0]):
            count, even = _place_ghost(
                path_rows, path_actions, crossings[p], curvature, curvature_x, z_vertex, n_gap[w], reflectance[w],
                sensor_z, entrance, slope, slope_x, nearness, edges, iris_radius, axes, to_pixels, rim, spots, ring,
                polygon, squares, to_stop, across,
            )  # fmt: skip
            if count == 0:
                continue
            even *= gain
            if mask is not None:
                _take_corners(polygon, count, crossings[p], corner, stops)
                fill_through_mask(
                    polygon, count, crossings[p], corner, stops, mask, texture, even, 0.0, 0.0, even, even, rgb[p, w],
                    plane, other, values,
                )  # fmt: skip
                continue
            count = cut_to_rectangle(polygon, count, other, values, float(width), float(height))
            if count >= 3:
                fill_polygon(polygon, count, even, 0.0, 0.0, even, even, rgb[p, w], plane)


@compiled
def measure_matrix_ghosts(
    rows, actions, starts, crossings, curvature, curvature_x, z_vertex, n_gap, reflectance, near, sensor_z,
    entrance, slope, slope_x, nearness, edges, iris_radius, axes, to_pixels, gain, width, height, sides, found, squares,
):  # fmt: skip
    """Compute the irradiance of the ghosts of `draw_matrix_ghosts`, their flux in the picture and their rays' angles.

    Parameters
    ----------
    rows ... z_vertex
        As in `draw_matrix_ghosts`.
    n_gap : ndarray, shape (M, K + 1)
        At M wavelengths, which need not be those of `reflectance`.
    reflectance : ndarray, shape (W, K, S)
    near : ndarray, shape (M,), int64
        Which of the W reflectances the rays of each wavelength have.
    sensor_z ... gain
        As in `draw_matrix_ghosts`.
    width, height : float
        Pixels.
    sides : int
        Edges of the polygon for the round rim of the entrance; `draw_matrix_ghosts` uses `RIM`.
    found : ndarray, shape (P, M, 2)
        Filled with the flux inside the picture and the flux per pixel inside the ghost.
    squares : ndarray, shape (M, steps)
        Filled with the squared sine on the lower-index side at each step of each path (`paraxial_sines`), of the rays
        from which the colours are taken.
    """
    polygon, other = np.zeros((MAX_VERTICES, PSTOP + 6)), np.zeros((MAX_VERTICES, PSTOP + 6))
    values = np.empty(MAX_VERTICES)
    to_stop = np.empty((MOST_CROSSINGS, 2, 2))
    across = to_stop if curvature_x is None else np.empty((MOST_CROSSINGS, 2, 2))
    rim = _rim(entrance, sides)
    spots, ring = _outline(sides, edges)
    for m in range(n_gap.shape[0]):
        for p in range(starts.size - 1):
            found[p, m, 0] = found[p, m, 1] = 0.0
            count, even = _place_ghost(
                rows[starts[p] : starts[p + 1]], actions[starts[p] : starts[p + 1]], crossings[p], curvature,
                curvature_x, z_vertex, n_gap[m], reflectance[near[m]], sensor_z, entrance, slope, slope_x, nearness,
                edges, iris_radius, axes, to_pixels, rim, spots, ring, polygon, squares[m, starts[p] : starts[p + 1]],
                to_stop, across,
            )  # fmt: skip
            if count > 0:
                count = cut_to_rectangle(polygon, count, other, values, width, height)
            if count >= 3:
                found[p, m, 0] = gain * even * abs(polygon_area(polygon, count, PX, PY))
                found[p, m, 1] = gain * even


@inner
def _place_ghost(
    rows, actions, crossings, curvature, curvature_x, z_vertex, n_gap, reflectance, sensor_z, entrance, slope, slope_x,
    nearness, edges, iris_radius, axes, to_pixels, rim, spots, ring, polygon, squares, to_stop, across,
):  # fmt: skip
    """Fill a polygon with a ghost's outline in pixels; return its number of vertices and its flux per pixel.

    `squares` is filled with the angles of its ray, also of a ghost that is dark.
    """
    a, b, ax, bx = _meridians(
        rows, actions, curvature, curvature_x, z_vertex, n_gap, sensor_z, nearness, crossings, to_stop, across
    )
    centre = _centre(to_stop, slope, iris_radius, entrance)
    beside = 0.0 if curvature_x is None else _centre(across, slope_x, iris_radius, entrance)
    paraxial_sines(
        rows, actions, curvature, curvature_x, z_vertex, n_gap,
        centre, slope + nearness * centre, beside, slope_x + nearness * beside, squares,
    )  # fmt: skip
    close_ring(rim, spots, ring)
    head = _cut_by_iris(spots, ring, rim.shape[0], crossings, to_stop, across, slope, slope_x, axes, edges, entrance)
    if head < 0:
        return np.int64(0), 0.0
    count = _project_entrance(
        polygon, spots, ring, head, slope, slope_x, a, b, ax, bx, to_stop, across, crossings, axes
    )
    flux = paraxial_weight(rows, actions, reflectance, squares) * abs(polygon_area(polygon, count, PP, PQ))
    for k in range(count):
        x, y = polygon[k, PX], polygon[k, PY]
        polygon[k, PX] = to_pixels[0] - to_pixels[2] * (x * axes[0, 0] + y * axes[1, 0])
        polygon[k, PY] = to_pixels[1] + to_pixels[3] * (x * axes[0, 1] + y * axes[1, 1])
    area = abs(polygon_area(polygon, count, PX, PY))
    if area < 1e-4:
        # the ghost is focused to a point: draw its light as a small square
        count = _square(polygon, polygon[0, PX], polygon[0, PY])
        area = SPOT * SPOT
    return count, flux / area


@inner
def _take_corners(polygon, count, crossings, corner, stops):
    """Fill `corner` with three well separated vertices, and `stops` with their places in the stop."""
    for m in range(3):
        k = m * count // 3
        corner[m, 0], corner[m, 1] = polygon[k, PX], polygon[k, PY]
        for c in range(crossings):
            stops[c, m, 0], stops[c, m, 1] = polygon[k, PSTOP + 2 * c], polygon[k, PSTOP + 2 * c + 1]


@inner
def _square(polygon, x, y):
    """Replace a polygon without area by a small square around a point; keep its places in the stop."""
    for k in range(4):
        for m in range(polygon.shape[1]):
            polygon[k, m] = polygon[0, m]
        polygon[k, PX] = x + SPOT * (0.5 if k in (1, 2) else -0.5)
        polygon[k, PY] = y + SPOT * (0.5 if k in (2, 3) else -0.5)
    return np.int64(4)


@inner
def _centre(to_stop, slope, iris_radius, entrance):
    """Return the height at the entrance of the ray that gives a ghost's colour: the middle of what passes both rims.

    A choice between the middles of the iris and of the entrance would jump where both are equally large, and the ray
    could miss the light.
    """
    ma, mb = to_stop[0, 0, 0], to_stop[0, 0, 1]
    if abs(ma) * entrance <= 1e-12 * iris_radius:
        return 0.0
    middle, reach = -mb * slope / ma, iris_radius / abs(ma)
    return 0.5 * (max(middle - reach, -entrance) + min(middle + reach, entrance))


@inner
def _rim(entrance, sides):
    """Return a polygon for the rim of the entrance, shape (sides, 2)."""
    # slightly larger radius, so that the polygon has the area of the circle
    radius = entrance * sqrt(2.0 * np.pi / (sides * np.sin(2.0 * np.pi / sides)))
    rim = np.empty((sides, 2))
    for k in range(sides):
        angle = 2.0 * np.pi * k / sides
        rim[k, 0], rim[k, 1] = radius * np.cos(angle), radius * np.sin(angle)
    return rim


@inner
def _outline(sides, edges):
    """Return arrays for the outline of a ghost in the entrance (`iris_images.close_ring`), with room for all cuts."""
    most = sides + 2 * MOST_CROSSINGS * edges.shape[0]
    return np.empty((most, 2)), np.empty((most, 2), dtype=np.int64)


@borrowing
def _cut_by_iris(spots, ring, used, crossings, to_stop, across, slope, slope_x, axes, edges, entrance):
    """Cut the entrance by the images of the iris at each crossing; return a vertex of the rest, -1 if none is left."""
    head = np.int64(0)
    for c in range(crossings):
        for e in range(edges.shape[0]):
            # the edge in the frame of the lens, and then in the entrance
            x = edges[e, 0] * axes[0, 0] + edges[e, 1] * axes[0, 1]
            y = edges[e, 0] * axes[1, 0] + edges[e, 1] * axes[1, 1]
            a, b = x * across[c, 0, 0], y * to_stop[c, 0, 0]
            high = edges[e, 2] - x * across[c, 0, 1] * slope_x - y * to_stop[c, 0, 1] * slope
            head, used = cut_ring(spots, ring, head, used, a, b, high, FLAT * entrance * (abs(a) + abs(b)))
            if head < 0:
                return head
    return head


@borrowing
def _project_entrance(polygon, spots, ring, head, slope, slope_x, a, b, ax, bx, to_stop, across, crossings, axes):
    """Fill a polygon with an outline in the entrance and its images on the sensor and at each crossing of the stop."""
    k, count = head, np.int64(0)
    while True:
        x, y = spots[k, 0], spots[k, 1]
        polygon[count, PX], polygon[count, PY] = ax * x + bx * slope_x, a * y + b * slope
        polygon[count, PREL], polygon[count, PW] = 0.0, 1.0
        polygon[count, PP], polygon[count, PQ] = x, y
        for c in range(crossings):
            u, v = across[c, 0, 0] * x + across[c, 0, 1] * slope_x, to_stop[c, 0, 0] * y + to_stop[c, 0, 1] * slope
            polygon[count, PSTOP + 2 * c] = u * axes[0, 0] + v * axes[1, 0]
            polygon[count, PSTOP + 2 * c + 1] = u * axes[0, 1] + v * axes[1, 1]
        k, count = ring[k, 0], count + 1
        if k == head:
            return count
