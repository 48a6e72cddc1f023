"""What the rays of a bundle tell of the iris' edge: where it is lit, how bright it is there, what is seen of it."""

import numpy as np

from ._jit import borrowing, compiled
from .standing import crosses, landed, passes
from .trace import ALIVE, REL, STOP_X, X, Y


@borrowing
def _comes_near(rays, k, crossing, inner):
    """Tell whether a ray crosses the stop no nearer to its middle than this."""
    u, v = rays[k, STOP_X + 2 * crossing], rays[k, STOP_X + 2 * crossing + 1]
    return u * u + v * v >= inner * inner


@borrowing
def _land(rays, triangles, t, place, mirror):
    """Return the bounds of a triangle in the picture: left, right, top, bottom."""
    left, right, top, bottom = np.inf, -np.inf, np.inf, -np.inf
    for m in range(3):
        x, y = mirror * rays[triangles[t, m], X], rays[triangles[t, m], Y]
        column, row = landed(place, x, y)
        left, right, top, bottom = min(left, column), max(right, column), min(top, row), max(bottom, row)
    return left, right, top, bottom


@borrowing
def _lives(rays, triangles, t):
    """Tell whether no corner of a triangle is a ray that ended."""
    return min(rays[triangles[t, 0], ALIVE], rays[triangles[t, 1], ALIVE], rays[triangles[t, 2], ALIVE]) > 0.0


@compiled
def reached_edges(rays, iris_radius, inner, reached):
    """Mark the crossings of the stop to whose edge light comes that passes everything else.

    Parameters
    ----------
    rays : ndarray, shape (N, 5 + 2 C)
        As `kernels.trace.trace_lanes` fills them.
    iris_radius, inner : float
        Of the circle around the iris, and what counts as near its edge, mm.
    reached : ndarray, shape (C,), bool
        True is written where it is; the rest is left.
    """
    for k in range(rays.shape[0]):
        if passes(rays, k, iris_radius):
            for c in range(reached.size):
                reached[c] = reached[c] or _comes_near(rays, k, c, inner)


@compiled
def bounded_by_iris(rays, triangles, iris_radius):
    """Tell whether nothing but the iris bounds a bundle: no rim cuts it, and it does not fold.

    Parameters
    ----------
    rays : ndarray, shape (N, 5 + 2 C)
    triangles : ndarray, shape (T, 3), int64
    iris_radius : float
        Of the circle around the iris, mm.

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
    """Widen a box by where the rays land that pass.

    Parameters
    ----------
    rays : ndarray, shape (N, 5 + 2 C)
    reach : float
        How far out in the stop there is light, mm.
    place : ndarray, shape (2, 3)
        As in `kernels.standing.seen_rays`.
    mirror : float
        -1 for the bundle's mirror image, else 1.
    box : ndarray, shape (4,)
        Left, right, top and bottom, pixels.
    """
    for k in range(rays.shape[0]):
        if passes(rays, k, reach):
            x, y = mirror * rays[k, X], rays[k, Y]
            column, row = landed(place, x, y)
            box[0], box[1] = min(box[0], column), max(box[1], column)
            box[2], box[3] = min(box[2], row), max(box[3], row)


@compiled
def widen_stops(rays, triangles, places, size, mirror, axes, boxes):
    """Widen boxes in the stop by where the triangles that come into a picture cross it.

    Parameters
    ----------
    rays : ndarray, shape (N, 5 + 2 C)
    triangles : ndarray, shape (T, 3), int64
    places : ndarray, shape (P, 2, 3)
        Where the bundle is drawn, each as in `kernels.standing.seen_rays`.
    size : ndarray, shape (2,)
        Width and height of the picture.
    mirror : float
        -1 for the bundle's mirror image, else 1.
    axes : ndarray, shape (2, 2)
        Of the meridional frame, as rows.
    boxes : ndarray, shape (C, 4)
        Of each crossing the least and largest place across and up, mm.
    """
    for t in range(triangles.shape[0]):
        if not _lives(rays, triangles, t):
            continue
        seen = False
        for p in range(places.shape[0]):
            left, right, top, bottom = _land(rays, triangles, t, places[p], mirror)
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
    """Compare a ghost's light at its lit edge with all light there, where it is in the picture.

    Parameters
    ----------
    rays : ndarray, shape (N, 5 + 2 C)
    triangles : ndarray, shape (T, 3), int64
    own : ndarray, shape (N,)
        The ghost's irradiance at its nodes.
    ringed : ndarray, shape (C,), bool
        At which crossings of the stop the edge has rings.
    iris_radius, inner : float
        As in `reached_edges`.
    place : ndarray, shape (2, 3)
        As in `kernels.standing.seen_rays`.
    corners_px : ndarray, shape (2, 2)
        The picture's first and last corner, column and row.
    mirror : float
        -1 for the bundle's mirror image, else 1.
    least : ndarray, shape (H, W)
        The least light around each of so many even parts of the picture.

    Returns
    -------
    float
        The largest part, 1 where a triangle is brighter than all that is known of its surroundings; 0 where none is
        seen.
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
        if not (lit[triangles[t, 0]] or lit[triangles[t, 1]] or lit[triangles[t, 2]]) or not _lives(rays, triangles, t):
            continue
        left, right, top, bottom = _land(rays, triangles, t, place, mirror)
        if right < corners_px[0, 0] or left > corners_px[1, 0] or bottom < corners_px[0, 1] or top > corners_px[1, 1]:
            continue
        bright, there = 0.0, np.inf
        for m in range(3):
            k = triangles[t, m]
            bright = max(bright, own[k])
            x, y = mirror * rays[k, X], rays[k, Y]
            c, r = landed(place, x, y)
            c, r = (c - corners_px[0, 0]) * across, (r - corners_px[0, 1]) * down
            # what lies beside the picture takes the nearest
            column, row = np.int64(min(max(c, 0.0), width - 1.0)), np.int64(min(max(r, 0.0), height - 1.0))
            there = min(there, least[row, column])
        largest = max(largest, bright / max(there, bright, 1e-300))
    return largest
