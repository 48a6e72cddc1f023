"""One step of least squares inside bounds: Levenberg-Marquardt with an active set, for costs that Python computes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from .variables import Variables

Floats = NDArray[np.float64]

# times that damping grows before a step is given up
TRIES = 12


def damped_step(
    known: Variables, x: Floats, old: Floats, J: Floats, residuals: Callable[[Floats], Floats], damping: float
) -> tuple[Floats, Floats, float] | None:
    """Take one step that makes the sum of squares less.

    Parameters
    ----------
    known : Variables
    x : ndarray, shape (1 + 3 K,)
        Inside the bounds; the free ones move.
    old : ndarray, shape (M,)
        Residuals there.
    J : ndarray, shape (M, F)
        Their derivatives by the free variables.
    residuals : callable
        From x.
    damping : float

    Returns
    -------
    tuple or None
        The new x, its residuals, and the damping for the next step; None when there is no such step.
    """
    free, J = known.free, J.copy()
    push, cost = J.T @ old, float(old @ old)
    held = ((x[free] <= known.low[free]) & (push > 0.0)) | ((x[free] >= known.high[free]) & (push < 0.0))
    J[:, held] = 0.0
    normal, push = J.T @ J, J.T @ old
    for _ in range(TRIES):
        scaled = normal + damping * np.diag(np.maximum(np.diag(normal), 1e-9 * normal.max() + 1e-300))
        step = np.clip(-np.linalg.solve(scaled, push), -known.longest, known.longest)
        tried = x.copy()
        tried[free] = np.clip(x[free] + step, known.low[free], known.high[free])
        new = residuals(tried)
        if float(new @ new) < cost:
            return tried, new, max(0.2 * damping, 1e-9)
        damping *= 6.0
    return None
