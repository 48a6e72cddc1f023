"""Solve normal equations that may be singular or nearly so."""

from __future__ import annotations

import numpy as np

from ...typing import Floats

# added to the diagonal of a matrix scaled to unit diagonal, when the direct solution fails
_RIDGE = 1e-9


def inverse(matrix: Floats) -> Floats:
    """Return the pseudo-inverse of a normal matrix.

    Parameters
    ----------
    matrix : ndarray, shape (Q, Q)
        Symmetric, positive semidefinite.

    Returns
    -------
    ndarray, shape (Q, Q)
        If the eigenvalues do not converge, the inverse of the matrix with a small ridge; zeros if a number is not
        finite.
    """
    if not np.isfinite(matrix).all():
        return np.zeros_like(matrix)
    try:
        return np.asarray(np.linalg.pinv(matrix, hermitian=True), dtype=np.float64)
    except np.linalg.LinAlgError:
        scaled, scale = _scaled(matrix)
        found = np.linalg.solve(scaled, np.eye(scale.size)) * np.outer(scale, scale)
        return np.asarray(0.5 * (found + found.T), dtype=np.float64)


def solution(matrix: Floats, side: Floats) -> Floats:
    """Solve normal equations.

    Parameters
    ----------
    matrix : ndarray, shape (Q, Q)
        Symmetric, positive semidefinite.
    side : ndarray, shape (Q,)

    Returns
    -------
    ndarray, shape (Q,)
        If the matrix is singular, the solution with a small ridge; zeros if a number is not finite.
    """
    if not (np.isfinite(matrix).all() and np.isfinite(side).all()):
        return np.zeros_like(side)
    try:
        return np.asarray(np.linalg.solve(matrix, side), dtype=np.float64)
    except np.linalg.LinAlgError:
        scaled, scale = _scaled(matrix)
        return np.asarray(scale * np.linalg.solve(scaled, scale * side), dtype=np.float64)


def _scaled(matrix: Floats) -> tuple[Floats, Floats]:
    """Return a matrix scaled to unit diagonal with a small ridge, and the factors of its rows and columns."""
    diagonal = np.maximum(np.diag(matrix), 0.0)
    scale = 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    scaled = matrix * np.outer(scale, scale)
    return scaled + np.diag(np.where(diagonal > 0.0, _RIDGE, 1.0)), scale
