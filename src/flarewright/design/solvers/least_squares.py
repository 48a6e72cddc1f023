"""One least-squares step inside bounds: Levenberg-Marquardt with an active set, for costs computed in Python."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...typing import Floats, Indices

# number of times the damping grows before the step fails
TRIES = 12


def bounded_step(
    x: Floats,
    old: Floats,
    J: Floats,
    residuals: Callable[[Floats], Floats],
    damping: float,
    *,
    free: Indices,
    low: Floats,
    high: Floats,
    longest: Floats | float = np.inf,
) -> tuple[Floats, Floats, float] | None:
    """Take one step that reduces the sum of squares.

    Parameters
    ----------
    x : ndarray, shape (N,)
        Inside the bounds.
    old : ndarray, shape (M,)
        Residuals at x.
    J : ndarray, shape (M, F)
        Their derivatives by the free variables.
    residuals : callable
        Residuals as a function of x.
    damping : float
    free : ndarray of int, shape (F,)
        Indices of the variables that may move.
    low, high : ndarray, shape (N,)
    longest : float or ndarray, shape (F,)
        Longest step of each free variable.

    Returns
    -------
    tuple or None
        The new x, its residuals, and the damping for the next step; None if no step reduces the sum.
    """
    J, low, high = J.copy(), low[free], high[free]
    push, cost = J.T @ old, float(old @ old)
    held = ((x[free] <= low) & (push > 0.0)) | ((x[free] >= high) & (push < 0.0))
    J[:, held] = 0.0
    normal, push = J.T @ J, J.T @ old
    for _ in range(TRIES):
        scaled = normal + damping * np.diag(np.maximum(np.diag(normal), 1e-9 * normal.max() + 1e-300))
        step = np.clip(-np.linalg.solve(scaled, push), -longest, longest)
        tried = x.copy()
        tried[free] = np.clip(x[free] + step, low, high)
        new = residuals(tried)
        if float(new @ new) < cost:
            return tried, new, max(0.2 * damping, 1e-9)
        damping *= 6.0
    return None
