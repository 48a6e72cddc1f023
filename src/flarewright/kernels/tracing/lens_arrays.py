"""A lens as arrays, one argument of the kernels: all rows centred conics, or rows of any shape."""

from __future__ import annotations

from typing import NamedTuple

from ...typing import Floats
from ..jit.decorators import inner


class ConicLens(NamedTuple):
    """A lens whose rows are centred conics.

    Attributes
    ----------
    curvature, conic : ndarray, shape (K,)
        Curvature, 1/mm, and conic constant of each row.
    z_vertex, inv_semi : ndarray, shape (K,)
        Vertex, mm from the first, and 1 / semi-diameter, 1/mm, 0 for the stop.
    n_gap : ndarray, shape (K + 1,) or (W, K + 1)
        Index before row 0, behind row 0, behind row 1, ..., at one or at W wavelengths.
    reflectance : ndarray, shape (K, M) or (W, K, M)
        R of each row against the cosine on its lower-index side, uniform over [0, 1].
    sensor_z : float
        Sensor plane, mm from the first vertex.
    """

    curvature: Floats
    conic: Floats
    z_vertex: Floats
    inv_semi: Floats
    n_gap: Floats
    reflectance: Floats
    sensor_z: float


class ShapedLens(NamedTuple):
    """A lens whose rows have any shape and position.

    Attributes
    ----------
    shapes : ndarray, shape (K, P)
        The shape table (`kernels.tracing.intersect`), in the frame of the rays.
    z_vertex, inv_semi, n_gap, reflectance, sensor_z
        As in `ConicLens`.
    """

    shapes: Floats
    z_vertex: Floats
    inv_semi: Floats
    n_gap: Floats
    reflectance: Floats
    sensor_z: float


LensArrays = ConicLens | ShapedLens

# the compiler knows the number of fields of a kernel's argument: of `if len(lens) == SHAPED` it compiles one branch
SHAPED = 6


@inner
def at_wavelength(lens, w):
    """Return a lens of several wavelengths at one of them."""
    if len(lens) == SHAPED:
        return ShapedLens(lens.shapes, lens.z_vertex, lens.inv_semi, lens.n_gap[w], lens.reflectance[w], lens.sensor_z)
    return ConicLens(
        lens.curvature, lens.conic, lens.z_vertex, lens.inv_semi, lens.n_gap[w], lens.reflectance[w], lens.sensor_z
    )
