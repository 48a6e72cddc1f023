"""The rays of the pre-pass, one argument of its kernels."""

from __future__ import annotations

from typing import NamedTuple

from ...typing import Floats


class Samples(NamedTuple):
    """Rays on a rectangular grid in the plane of the first vertex.

    Attributes
    ----------
    px, py : ndarray, shape (N,)
        Places, mm; y fastest.
    data : ndarray, shape (N, >= 5 + 2 C)
        The traced rays (`kernels.tracing.sequential.trace_lanes`).
    width : int
        Number of samples along y.
    hx, hy : float
        Distances of neighbours, mm.
    """

    px: Floats
    py: Floats
    data: Floats
    width: int
    hx: float
    hy: float
