"""Normal equations of fits that may know next to nothing of some of their numbers."""

from __future__ import annotations

import numpy as np

from .numbers import Floats

# of a matrix with ones on its diagonal: what is added where the plain way does not end
_RIDGE = 1e-9


def inverse(matrix: Floats) -> Floats:
    """Return the pseudo-inverse of a normal matrix.

    Parameters
    ----------
    matrix : ndarray, shape (Q, Q)
        Symmetric, not negative.

    Returns
    -------
    ndarray, shape (Q, Q)
        Where eigenvalues do not converge, that of the matrix scaled to ones on its diagonal plus a little; zeros
        when a number is not finite.
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
        Symmetric, not negative.
    side : ndarray, shape (Q,)

    Returns
    -------
    ndarray, shape (Q,)
        Where the matrix is singular, of the scaled matrix plus a little; zeros when a number is not finite.
    """
    if not (np.isfinite(matrix).all() and np.isfinite(side).all()):
        return np.zeros_like(side)
    try:
        return np.asarray(np.linalg.solve(matrix, side), dtype=np.float64)
    except np.linalg.LinAlgError:
        scaled, scale = _scaled(matrix)
        return np.asarray(scale * np.linalg.solve(scaled, scale * side), dtype=np.float64)


def _scaled(matrix: Floats) -> tuple[Floats, Floats]:
    """Return a matrix with ones on its diagonal, plus a little, and the factors of its rows and columns."""
    diagonal = np.maximum(np.diag(matrix), 0.0)
    scale = 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    scaled = matrix * np.outer(scale, scale)
    return scaled + np.diag(np.where(diagonal > 0.0, _RIDGE, 1.0)), scale
