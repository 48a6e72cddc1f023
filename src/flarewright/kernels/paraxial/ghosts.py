"""Paraxial ghosts: ray transfer matrices along a path, and ghosts drawn from them."""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

import numpy as np

from ...typing import Floats, Indices
from ..jit.decorators import borrowing, compiled, inner
from ..raster.iris_mask import fill_through_mask, mask_texture
from ..raster.polygons import fill_polygon
from ..tracing.clip import MAX_VERTICES, PP, PQ, PREL, PSTOP, PW, PX, PY, cut_to_rectangle, polygon_area
from ..tracing.sequential import REFLECT, STOP
from .arguments import MeridianLens
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
            ratio = n_gap[row] / n_gap[row + 1] if heading > 0.0 else n_gap[row + 1] / n_gap[row]
            bend = (ratio - 1.0) * power
            c, d = bend * a + ratio * c, bend * b + ratio * d
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
        ratio = n_gap[row] / n_gap[row + 1] if heading > 0.0 else n_gap[row + 1] / n_gap[row]
        slope = u + power * y
        square = slope * slope
        if curvature_x is not None:
            across = ux + curvature_x[row] * heading * x
            square += across * across
        # sin^2 = tan^2 / (1 + tan^2), on the side of the lower index by Snell's law
        higher = max(ratio, 1.0)
        squares[step] = min(square / (1.0 + square) * higher * higher, 1.0)
        if actions[step] == REFLECT:
            u += 2.0 * power * y
            if curvature_x is not None:
                ux += 2.0 * curvature_x[row] * heading * x
            heading = -heading
        else:
            u = (ratio - 1.0) * power * y + ratio * u
            if curvature_x is not None:
                ux = (ratio - 1.0) * curvature_x[row] * heading * x + ratio * ux


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
def _meridians(rows, actions, lens, curvature_x, nearness, crossings, to_stop, across):
    """Fill the matrices to the stop in the y and the x plane; return a and b of the whole path in each."""
    a, b, _, _ = path_matrices(rows, actions, lens.curvature, lens.z_vertex, lens.n_gap, lens.sensor_z, to_stop)
    # the rays of a near light diverge: their slope grows with their height
    a += nearness * b
    ax, bx = a, b
    if curvature_x is not None:
        ax, bx, _, _ = path_matrices(rows, actions, curvature_x, lens.z_vertex, lens.n_gap, lens.sensor_z, across)
        ax += nearness * bx
    for c in range(crossings):
        to_stop[c, 0, 0] += nearness * to_stop[c, 0, 1]
        if curvature_x is not None:
            across[c, 0, 0] += nearness * across[c, 0, 1]
    return a, b, ax, bx


@inner
def _fill_sines(rows, actions, lens, curvature_x, light, iris_radius, to_stop, across, squares):
    """Fill the angles of incidence of the ray that gives a ghost's colour (`paraxial_sines`)."""
    middle, reach = _iris_image(to_stop, light.slope, iris_radius, light.semi)
    if curvature_x is None:
        centre, beside = _middle_of_both(middle, reach, light.semi), 0.0
    else:
        # the image of the iris is an ellipse, cut by the line from the middle of the entrance to its own
        aside, width = _iris_image(across, light.slope_x, iris_radius, light.semi)
        off = sqrt(middle * middle + aside * aside)
        centre, beside = 0.0, 0.0
        if off > 0.0:
            up, along = middle / off, aside / off
            part = sqrt((up / reach) ** 2 + (along / width) ** 2)
            place = _middle_of_both(off, 1.0 / part if part > 0.0 else np.inf, light.semi)
            centre, beside = up * place, along * place
    paraxial_sines(
        rows, actions, lens.curvature, curvature_x, lens.z_vertex, lens.n_gap,
        centre, light.slope + light.nearness * centre, beside, light.slope_x + light.nearness * beside, squares,
    )  # fmt: skip


@compiled
def draw_matrix_ghosts(paths, lens, curvature_x, light, iris, mask, frame, rgb, plane):
    """Draw the ghosts of many paths at many wavelengths by matrices (Lee and Eisemann 2013; Van Acoleyen 2025, ch. 4).

    Parameters
    ----------
    paths : PathList
    lens : MeridianLens
        At W wavelengths.
    curvature_x : ndarray, shape (K,), or None
        Curvatures in the x plane if some row's differ; the frame is then that of the lens instead of the meridional
        one.
    light : EntranceLight
    iris : StopOutline
    mask
        As in `kernels.raster.bundle.draw_bundle`.
    frame : SensorFrame
    rgb : ndarray, shape (P, W, 3)
    plane : ndarray, shape (H, W, 3), float64
        Differences of flux along the rows, added to (`kernels.raster.polygons.sum_rows`).

    Notes
    -----
    A ghost is the image of the entrance cut by the iris: a polygon of constant irradiance. Its colour is that of one
    ray, through the middle of the part of the entrance whose light passes the iris.
    """
    height, width = plane.shape[0], plane.shape[1]
    values = np.empty(MAX_VERTICES)
    other = np.zeros((MAX_VERTICES, PSTOP + 6))
    work = _room_for_ghosts(paths, light, iris, curvature_x, RIM)
    if mask is not None:
        texture = mask_texture(mask, MOST_CROSSINGS, width)
        corner, stops = np.empty((3, 2)), np.empty((MOST_CROSSINGS, 3, 2))
    for p in range(paths.starts.size - 1):
        crossings = paths.crossings[p]
        for w in range(lens.n_gap.shape[0]):
            count, even = _place_ghost(
                paths, p, _lens_at(lens, w, w), curvature_x, light, iris, frame, work, work.squares
            )
            if count == 0:
                continue
            even *= frame.gain
            if mask is not None:
                _take_corners(work.polygon, count, crossings, corner, stops)
                fill_through_mask(
                    work.polygon, count, crossings, corner, stops, mask, texture, even, 0.0, 0.0, even, even, rgb[p, w],
                    plane, other, values,
                )  # fmt: skip
                continue
            count = cut_to_rectangle(work.polygon, count, other, values, float(width), float(height))
            if count >= 3:
                fill_polygon(work.polygon, count, even, 0.0, 0.0, even, even, rgb[p, w], plane)


@compiled
def measure_matrix_ghosts(
    paths, lens, near, curvature_x, light, iris, frame, width, height, sides, found, squares,
):  # fmt: skip
    """Compute irradiance, flux in the picture and bounds of the ghosts of `draw_matrix_ghosts`, and their rays' angles.

    Parameters
    ----------
    paths : PathList
    lens : MeridianLens
        With the indices of M wavelengths, and the reflectances of W, which need not be the same.
    near : ndarray, shape (M,), int64
        Which of the W reflectances the rays of each wavelength have.
    curvature_x, light, iris, frame
        As in `draw_matrix_ghosts`.
    width, height : float
        Pixels.
    sides : int
        Edges of the polygon for the round rim of the entrance; `draw_matrix_ghosts` uses `RIM`.
    found : ndarray, shape (P, M, 6)
        Filled with the flux inside the picture, the flux per pixel inside the ghost, and the bounds of the whole ghost,
        pixels: left, top, right, bottom; infinite and empty if it is dark.
    squares : ndarray, shape (M, steps)
        Filled with the squared sine on the lower-index side at each step of each path (`paraxial_sines`), of the rays
        from which the colours are taken.
    """
    values = np.empty(MAX_VERTICES)
    other = np.zeros((MAX_VERTICES, PSTOP + 6))
    work = _room_for_ghosts(paths, light, iris, curvature_x, sides)
    for m in range(near.size):
        own = _lens_at(lens, m, near[m])
        for p in range(paths.starts.size - 1):
            found[p, m, 0] = found[p, m, 1] = 0.0
            left, top, right, bottom = np.inf, np.inf, -np.inf, -np.inf
            count, even = _place_ghost(paths, p, own, curvature_x, light, iris, frame, work, squares[m])
            for k in range(count):
                x, y = work.polygon[k, PX], work.polygon[k, PY]
                left, top, right, bottom = min(left, x), min(top, y), max(right, x), max(bottom, y)
            found[p, m, 2], found[p, m, 3], found[p, m, 4], found[p, m, 5] = left, top, right, bottom
            if count > 0:
                count = cut_to_rectangle(work.polygon, count, other, values, width, height)
            if count >= 3:
                found[p, m, 0] = frame.gain * even * abs(polygon_area(work.polygon, count, PX, PY))
                found[p, m, 1] = frame.gain * even


class _Room(NamedTuple):
    """Working arrays for one ghost: its polygon and what leads to it.

    Attributes
    ----------
    polygon : ndarray, shape (MAX_VERTICES, PSTOP + 6)
    rim : ndarray, shape (sides, 2)
        From `_rim`.
    spots, ring : ndarray
        From `_outline`.
    squares : ndarray, shape (steps,)
        Squared sines at the steps of all paths.
    to_stop, across : ndarray, shape (MOST_CROSSINGS, 2, 2)
        Matrices to the crossings of the stop in the y and the x plane; one array if the planes do not differ.
    """

    polygon: Floats
    rim: Floats
    spots: Floats
    ring: Indices
    squares: Floats
    to_stop: Floats
    across: Floats


@inner
def _room_for_ghosts(paths, light, iris, curvature_x, sides):
    """Return the working arrays for the ghosts of some paths; `sides`: edges of the polygon of the entrance's rim."""
    to_stop = np.empty((MOST_CROSSINGS, 2, 2))
    across = to_stop if curvature_x is None else np.empty((MOST_CROSSINGS, 2, 2))
    spots, ring = _outline(sides, iris.edges)
    return _Room(
        np.zeros((MAX_VERTICES, PSTOP + 6)), _rim(light.semi, sides), spots, ring, np.empty(paths.rows.size), to_stop,
        across,
    )  # fmt: skip


@inner
def _lens_at(lens, m, w):
    """Return a lens of several wavelengths with the indices of the m-th and the reflectances of the w-th."""
    return MeridianLens(lens.curvature, lens.z_vertex, lens.n_gap[m], lens.reflectance[w], lens.sensor_z)


@inner
def _place_ghost(paths, p, lens, curvature_x, light, iris, frame, work, squares):
    """Fill a polygon with a ghost's outline in pixels; return its number of vertices and its flux per pixel.

    `squares`, shape (steps,), is filled at the path's steps with the angles of its ray, also of a ghost that is dark.
    """
    first, end = paths.starts[p], paths.starts[p + 1]
    rows, actions, crossings = paths.rows[first:end], paths.actions[first:end], paths.crossings[p]
    polygon, axes, to_pixels = work.polygon, frame.axes, frame.to_pixels
    whole = _meridians(rows, actions, lens, curvature_x, light.nearness, crossings, work.to_stop, work.across)
    own = squares[first:end]
    _fill_sines(rows, actions, lens, curvature_x, light, iris.radius, work.to_stop, work.across, own)
    close_ring(work.rim, work.spots, work.ring)
    head = _cut_by_iris(work, crossings, light, axes, iris.edges)
    if head < 0:
        return np.int64(0), 0.0
    count = _project_entrance(work, head, light, whole, crossings, axes)
    flux = paraxial_weight(rows, actions, lens.reflectance, own) * abs(polygon_area(polygon, count, PP, PQ))
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
def _iris_image(to_stop, slope, iris_radius, entrance):
    """Return middle and radius, mm, of the iris seen from the entrance in one plane; 0 and inf: it bounds nothing."""
    ma, mb = to_stop[0, 0, 0], to_stop[0, 0, 1]
    if abs(ma) * entrance <= 1e-12 * iris_radius:
        return 0.0, np.inf
    return -mb * slope / ma, iris_radius / abs(ma)


@inner
def _middle_of_both(middle, reach, entrance):
    """Return the middle of what passes both the entrance and an image of the iris, along the line of their middles.

    A choice between the middles of the iris and of the entrance would jump where both are equally large, and the ray
    could miss the light.
    """
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
def _cut_by_iris(work, crossings, light, axes, edges):
    """Cut the entrance by the images of the iris at each crossing; return a vertex of the rest, -1 if none is left."""
    spots, ring, to_stop, across = work.spots, work.ring, work.to_stop, work.across
    head, used = np.int64(0), work.rim.shape[0]
    for c in range(crossings):
        for e in range(edges.shape[0]):
            # the edge in the frame of the lens, and then in the entrance
            x = edges[e, 0] * axes[0, 0] + edges[e, 1] * axes[0, 1]
            y = edges[e, 0] * axes[1, 0] + edges[e, 1] * axes[1, 1]
            a, b = x * across[c, 0, 0], y * to_stop[c, 0, 0]
            high = edges[e, 2] - x * across[c, 0, 1] * light.slope_x - y * to_stop[c, 0, 1] * light.slope
            head, used = cut_ring(spots, ring, head, used, a, b, high, FLAT * light.semi * (abs(a) + abs(b)))
            if head < 0:
                return head
    return head


@borrowing
def _project_entrance(work, head, light, whole, crossings, axes):
    """Fill a polygon with an outline in the entrance and its images on the sensor and at each crossing of the stop.

    `whole` has a and b of the whole path in the y and the x plane (`_meridians`).
    """
    polygon, spots, ring, to_stop, across = work.polygon, work.spots, work.ring, work.to_stop, work.across
    slope, slope_x = light.slope, light.slope_x
    a, b, ax, bx = whole
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
