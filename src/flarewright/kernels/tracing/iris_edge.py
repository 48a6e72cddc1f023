"""The iris edge seen by a ray bundle: which crossings reach it, the visible part of the stop, its relative light."""

import numpy as np

from ..jit.decorators import borrowing, compiled
from .representative_rays import crosses, lands_at, passes
from .sequential import ALIVE, REL, STOP_X, X, Y


@borrowing
def _comes_near(rays, k, crossing, inner):
    """Return whether a ray crosses the stop at a radius of at least `inner`."""
    u, v = rays[k, STOP_X + 2 * crossing], rays[k, STOP_X + 2 * crossing + 1]
    return u * u + v * v >= inner * inner


@borrowing
def _bounds_in_picture(rays, triangles, t, place, mirror):
    """Return the bounds of a triangle in the picture: left, right, top, bottom."""
    left, right, top, bottom = np.inf, -np.inf, np.inf, -np.inf
    for m in range(3):
        x, y = mirror * rays[triangles[t, m], X], rays[triangles[t, m], Y]
        column, row = lands_at(place, x, y)
        left, right, top, bottom = min(left, column), max(right, column), min(top, row), max(bottom, row)
    return left, right, top, bottom


@borrowing
def _alive(rays, triangles, t):
    """Return whether all three rays of a triangle reach the sensor."""
    return min(rays[triangles[t, 0], ALIVE], rays[triangles[t, 1], ALIVE], rays[triangles[t, 2], ALIVE]) > 0.0


@compiled
def reached_edges(rays, iris_radius, inner, reached):
    """Mark the stop crossings at which passing light comes near the iris edge.

    Parameters
    ----------
    rays : ndarray, shape (N, 5 + 2 C)
        As `kernels.tracing.sequential.trace_lanes` fills them.
    iris_radius, inner : float
        Radius of the circumscribed circle of the iris, and radius from which a ray is near the edge, mm.
    reached : ndarray, shape (C,), bool
        Set to True for such crossings; other items are unchanged.
    """
    for k in range(rays.shape[0]):
        if passes(rays, k, iris_radius):
            for c in range(reached.size):
                reached[c] = reached[c] or _comes_near(rays, k, c, inner)


@compiled
def bounded_by_iris(rays, triangles, iris_radius):
    """Return whether only the iris bounds a bundle: no rim cuts it, and its map does not fold.

    Parameters
    ----------
    rays : ndarray, shape (N, 5 + 2 C)
    triangles : ndarray, shape (T, 3), int64
    iris_radius : float
        Radius of the circumscribed circle of the iris, mm.

    Returns
    -------
    bool
    """
    within = np.empty(rays.shape[0], dtype=np.bool_)
    for k in range(rays.shape[0]):
        within[k] = rays[k, ALIVE] > 0.0 and crosses(rays, k, iris_radius)
        if within[k] and rays[k, REL] > 1.0:
            return False
    low, high = np.inf, -np.inf
    for t in range(triangles.shape[0]):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        if within[a] and within[b] and within[c]:
            x, y = rays[a, X], rays[a, Y]
            area = (rays[b, X] - x) * (rays[c, Y] - y) - (rays[b, Y] - y) * (rays[c, X] - x)
            low, high = min(low, area), max(high, area)
    return not (low < 0.0 and high > 0.0)


@compiled
def widen_box(rays, reach, place, mirror, box):
    """Extend a box in the picture to contain the passing rays.

    Parameters
    ----------
    rays : ndarray, shape (N, 5 + 2 C)
    reach : float
        Largest radius in the stop with light, mm.
    place : ndarray, shape (2, 3)
        As in `kernels.tracing.representative_rays.seen_rays`.
    mirror : float
        -1 for the bundle's mirror image, else 1.
    box : ndarray, shape (4,)
        Left, right, top and bottom, pixels.
    """
    for k in range(rays.shape[0]):
        if passes(rays, k, reach):
            x, y = mirror * rays[k, X], rays[k, Y]
            column, row = lands_at(place, x, y)
            box[0], box[1] = min(box[0], column), max(box[1], column)
            box[2], box[3] = min(box[2], row), max(box[3], row)


@compiled
def widen_stops(rays, triangles, places, size, mirror, axes, boxes):
    """Extend boxes in the stop to contain the crossings of all triangles that touch the picture.

    Parameters
    ----------
    rays : ndarray, shape (N, 5 + 2 C)
    triangles : ndarray, shape (T, 3), int64
    places : ndarray, shape (P, 2, 3)
        Placements of the bundle in pictures, each as in `kernels.tracing.representative_rays.seen_rays`.
    size : ndarray, shape (2,)
        Width and height of the picture.
    mirror : float
        -1 for the bundle's mirror image, else 1.
    axes : ndarray, shape (2, 2)
        Axes of the meridional frame, as rows.
    boxes : ndarray, shape (C, 4)
        For each crossing the least and largest x and the least and largest y, mm.
    """
    for t in range(triangles.shape[0]):
        if not _alive(rays, triangles, t):
            continue
        seen = False
        for p in range(places.shape[0]):
            left, right, top, bottom = _bounds_in_picture(rays, triangles, t, places[p], mirror)
            seen = seen or (right >= 0.0 and left <= size[0] and bottom >= 0.0 and top <= size[1])
        if not seen:
            continue
        for m in range(3):
            k = triangles[t, m]
            for c in range(boxes.shape[0]):
                u, v = mirror * rays[k, STOP_X + 2 * c], rays[k, STOP_X + 2 * c + 1]
                across, up = u * axes[0, 0] + v * axes[1, 0], u * axes[0, 1] + v * axes[1, 1]
                boxes[c, 0], boxes[c, 1] = min(boxes[c, 0], across), max(boxes[c, 1], across)
                boxes[c, 2], boxes[c, 3] = min(boxes[c, 2], up), max(boxes[c, 3], up)


@compiled
def largest_part(rays, triangles, own, ringed, iris_radius, inner, place, corners_px, mirror, least):
    """Return the largest share of a ghost's ringed edge in the light of the picture.

    Parameters
    ----------
    rays : ndarray, shape (N, 5 + 2 C)
    triangles : ndarray, shape (T, 3), int64
    own : ndarray, shape (N,)
        The ghost's irradiance at its nodes.
    ringed : ndarray, shape (C,), bool
        Whether the edge has rings, for each stop crossing.
    iris_radius, inner : float
        As in `reached_edges`.
    place : ndarray, shape (2, 3)
        As in `kernels.tracing.representative_rays.seen_rays`.
    corners_px : ndarray, shape (2, 2)
        Column and row of the picture's first and last corner.
    mirror : float
        -1 for the bundle's mirror image, else 1.
    least : ndarray, shape (H, W)
        Least light around each tile of the picture, which is divided into H x W equal tiles.

    Returns
    -------
    float
        Largest share; 1 where a triangle is brighter than the known light around it, 0 if no triangle is visible.
    """
    lit = np.empty(rays.shape[0], dtype=np.bool_)
    for k in range(rays.shape[0]):
        lit[k] = False
        if passes(rays, k, iris_radius):
            for c in range(ringed.size):
                lit[k] = lit[k] or (ringed[c] and _comes_near(rays, k, c, inner))
    height, width = least.shape
    across, down = width / (corners_px[1, 0] - corners_px[0, 0]), height / (corners_px[1, 1] - corners_px[0, 1])
    largest = 0.0
    for t in range(triangles.shape[0]):
        if not (lit[triangles[t, 0]] or lit[triangles[t, 1]] or lit[triangles[t, 2]]) or not _alive(rays, triangles, t):
            continue
        left, right, top, bottom = _bounds_in_picture(rays, triangles, t, place, mirror)
        if right < corners_px[0, 0] or left > corners_px[1, 0] or bottom < corners_px[0, 1] or top > corners_px[1, 1]:
            continue
        bright, there = 0.0, np.inf
        for m in range(3):
            k = triangles[t, m]
            bright = max(bright, own[k])
            x, y = mirror * rays[k, X], rays[k, Y]
            c, r = lands_at(place, x, y)
            c, r = (c - corners_px[0, 0]) * across, (r - corners_px[0, 1]) * down
            # outside the picture use the nearest tile
            column, row = np.int64(min(max(c, 0.0), width - 1.0)), np.int64(min(max(r, 0.0), height - 1.0))
            there = min(there, least[row, column])
        largest = max(largest, bright / max(there, bright, 1e-300))
    return largest
