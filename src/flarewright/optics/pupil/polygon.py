"""Borders of plane shapes as weighted edges: area, centroid, solid angle and inside test.

The weight of an edge is how much brighter the shape is on its left than on its right. All weights of a plain polygon
are 1. The same form describes grey shapes, holes and separate pieces, because all integrals over a shape are sums
over its edges (Green's theorem).
"""

from __future__ import annotations

import numpy as np

from ...typing import Floats

# columns of an edge: start, end, and weight
START, END, WEIGHT = slice(0, 2), slice(2, 4), 4


def closed(corners: Floats) -> Floats:
    """Return the border of a polygon.

    Parameters
    ----------
    corners : ndarray, shape (N, 2)
        Counter-clockwise when the second coordinate points up; may be concave.

    Returns
    -------
    ndarray, shape (N, 5)
        Each edge's start, end and weight, which is 1.
    """
    return np.column_stack([corners, np.roll(corners, -1, axis=0), np.ones(len(corners))])


def points(border: Floats) -> Floats:
    """Return both ends of every edge, shape (2 N, 2)."""
    return border[:, :WEIGHT].reshape(-1, 2)


def mapped(border: Floats, matrix: Floats, offset: Floats | float = 0.0) -> Floats:
    """Apply an affine map to a border.

    Parameters
    ----------
    border : ndarray, shape (N, 5)
    matrix : ndarray, shape (2, 2)
        Works on columns (x, y).
    offset : ndarray, shape (2,), or float
        Added after the matrix.

    Returns
    -------
    ndarray, shape (N, 5)
        A matrix that mirrors reverses the orientation; `backward` restores it.
    """
    ends = points(border) @ matrix.T + offset
    return np.column_stack([ends.reshape(-1, WEIGHT), border[:, WEIGHT]])


def backward(border: Floats) -> Floats:
    """Return a border with every edge reversed, shape (N, 5)."""
    return border[:, [2, 3, 0, 1, WEIGHT]]


def content(border: Floats) -> float:
    """Return the integral of brightness over area.

    Parameters
    ----------
    border : ndarray, shape (N, 5)

    Returns
    -------
    float
        The area of a plain polygon; negative when it runs clockwise.
    """
    return float(0.5 * (_cross(border) @ border[:, WEIGHT]))


def centroid(border: Floats) -> Floats:
    """Return the centroid of a shape's brightness, shape (2,)."""
    weight = _cross(border) * border[:, WEIGHT]
    return weight @ (border[:, START] + border[:, END]) / (6.0 * content(border))


def rim(border: Floats) -> float:
    """Return the sum of edge lengths times weights."""
    along = border[:, END] - border[:, START]
    return float(np.hypot(along[:, 0], along[:, 1]) @ np.abs(border[:, WEIGHT]))


def solid_angle(border: Floats) -> float:
    """Return the integral of brightness over the solid angle of a shape in field angles.

    Parameters
    ----------
    border : ndarray, shape (N, 5)
        In slopes (tan X, tan Y) from the axis.

    Returns
    -------
    float
        Steradians of a plain polygon.

    Notes
    -----
    Each edge and the axis form a triangle; its solid angle is after A. van Oosterom and J. Strackee, IEEE Trans.
    Biomed. Eng. 30, 125 (1983), with one corner at (0, 0, 1).
    """
    a, b = (np.sqrt(1.0 + (border[:, end] ** 2).sum(axis=1)) for end in (START, END))
    across = 1.0 + (border[:, START] * border[:, END]).sum(axis=1)
    return float(2.0 * np.arctan2(_cross(border), a * b + a + b + across) @ border[:, WEIGHT])


def shape_brightness(border: Floats, places: Floats) -> Floats:
    """Return the brightness of a shape at some points.

    Parameters
    ----------
    border : ndarray, shape (N, 5)
    places : ndarray, shape (M, 2)

    Returns
    -------
    ndarray, shape (M,)
        1 inside a plain polygon and 0 outside, up to rounding.
    """
    x0, y0, x1, y1, weight = border.T
    x, y = places[:, 0, None], places[:, 1, None]
    between = (y0 > y) != (y1 > y)
    with np.errstate(divide="ignore", invalid="ignore"):
        beyond = x < x0 + (y - y0) / (y1 - y0) * (x1 - x0)
    found: Floats = (between & beyond) @ (weight * np.sign(y1 - y0))
    return found


def _cross(border: Floats) -> Floats:
    (x0, y0), (x1, y1) = border[:, START].T, border[:, END].T
    product: Floats = x0 * y1 - x1 * y0
    return product
