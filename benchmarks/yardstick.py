"""The yardstick of all benchmarks: a plain scalar tracer, which uses no code of this project."""

from __future__ import annotations

from math import sqrt

import numba
import numpy as np

_CURVATURE = np.array([0.03, -0.01, 0.002, -0.012, 0.035, 0.0, 0.031, -0.019])
_INDEX = np.array([1.0, 1.65, 1.6, 1.0, 1.64, 1.0, 1.58, 1.69, 1.0])
_GAP = np.full(8, 4.0)
_HEIGHTS = np.linspace(-5.0, 5.0, 200_000)

RAY_SURFACES = _HEIGHTS.size * _CURVATURE.size
"""Number of rays times surfaces of a call of `trace_plainly`."""


def trace_plainly() -> float:
    """Trace `RAY_SURFACES` on one core; returns a sum that depends on every ray."""
    return float(_scalar_trace(_CURVATURE, _GAP, _INDEX, _HEIGHTS))


@numba.njit(error_model="numpy")
def _scalar_trace(curvature, gap, index, heights):
    """Trace meridional rays one after the other, with refraction at spheres, in plain scalar code."""
    total = 0.0
    for y0 in heights:
        y, z, dy, dz = y0, 0.0, 0.0, 1.0
        for k in range(curvature.size):
            c = curvature[k]
            b = c * (y * dy + z * dz) - dz
            q = c * (y * y + z * z) - 2.0 * z
            root = sqrt(max(b * b - c * q, 0.0))
            t = q / (root - b)
            y, z = y + t * dy, z + t * dz
            eta = index[k] / index[k + 1]
            along = eta * root - sqrt(max(1.0 - eta * eta * (1.0 - root * root), 0.0))
            dy, dz = eta * dy + along * c * y, eta * dz + along * (c * z - 1.0)
            z -= gap[k]
        total += y
    return total
