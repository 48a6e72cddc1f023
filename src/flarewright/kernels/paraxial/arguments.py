"""Named tuples that the kernels of paraxial ghosts take."""

from __future__ import annotations

from typing import NamedTuple

from ...typing import Floats, Indices


class PathList(NamedTuple):
    """Many light paths.

    Attributes
    ----------
    rows, actions : ndarray, shape (S,), int64
        The steps of all paths, one after another.
    starts : ndarray, shape (P + 1,), int64
        Index of the first step of each path.
    crossings : ndarray, shape (P,), int64
        Number of stop crossings of each path.
    """

    rows: Indices
    actions: Indices
    starts: Indices
    crossings: Indices


class MeridianLens(NamedTuple):
    """A lens in the y plane, at one or at W wavelengths.

    Curvatures in the x plane, where they differ, are another argument: for None the compiler omits that plane's code.

    Attributes
    ----------
    curvature, z_vertex : ndarray, shape (K,)
        1/mm, and mm from the first vertex.
    n_gap : ndarray, shape (K + 1,) or (W, K + 1)
    reflectance : ndarray, shape (K, M) or (W, K, M)
        As in `kernels.tracing.lens_arrays.ConicLens`.
    sensor_z : float
    """

    curvature: Floats
    z_vertex: Floats
    n_gap: Floats
    reflectance: Floats
    sensor_z: float


class EntranceLight(NamedTuple):
    """The light of one source that fills the entrance.

    Attributes
    ----------
    semi : float
        Semi-diameter of the first surface, mm.
    slope, slope_x : float
        Slopes of the rays in the y and the x plane; `slope_x` is 0 in the meridional frame.
    nearness : float
        1 / distance along the axis from the light to the first vertex, 1/mm; 0 for a distant light.
    """

    semi: float
    slope: float
    slope_x: float
    nearness: float


class StopOutline(NamedTuple):
    """The opening of the iris.

    Attributes
    ----------
    edges : ndarray, shape (B, 4)
        The iris as straight blades.
    radius : float
        mm.
    """

    edges: Floats
    radius: float


class SensorFrame(NamedTuple):
    """From places on the sensor, in the frame of the rays, to pixels.

    Attributes
    ----------
    axes, to_pixels, gain
        As in `kernels.raster.bundle.draw_bundle`.
    """

    axes: Floats
    to_pixels: Floats
    gain: float
