"""Vectors of three numbers and matrices of four rows, without a library."""

from collections.abc import Sequence
from math import sqrt

Vector = tuple[float, float, float]
Matrix = Sequence[Sequence[float]]


def column(matrix: Matrix, k: int) -> Vector:
    """Return the first three numbers of a column."""
    return matrix[0][k], matrix[1][k], matrix[2][k]


def plus(a: Vector, b: Vector) -> Vector:
    """Return a sum."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def minus(a: Vector, b: Vector) -> Vector:
    """Return a difference."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def times(a: Vector, factor: float) -> Vector:
    """Return a vector times a number."""
    return a[0] * factor, a[1] * factor, a[2] * factor


def dot(a: Vector, b: Vector) -> float:
    """Return the scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    """Return the vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def length(a: Vector) -> float:
    """Return the length."""
    return sqrt(dot(a, a))


def unit(a: Vector) -> Vector:
    """Return the direction, of unit length."""
    return times(a, 1.0 / max(length(a), 1e-300))


def two_across(axis: Vector) -> tuple[Vector, Vector]:
    """Return two directions across an axis of unit length."""
    other: Vector = (1.0, 0.0, 0.0) if abs(axis[0]) < 0.7 else (0.0, 1.0, 0.0)
    right = unit(cross(axis, other))
    return right, cross(right, axis)
