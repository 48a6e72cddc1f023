"""A shot as the kernels of random rays read it."""

from __future__ import annotations

import numpy as np

from ...kernels.montecarlo.arguments import PictureFrame
from ...kernels.raster.iris_mask import StopArrays
from ...kernels.tracing.lens_arrays import LensArrays, ShapedLens
from ...optics.rays.pack import PackedLens
from ..scene.shot import Shot


def shot_arrays(shot: Shot) -> tuple[LensArrays, StopArrays, PictureFrame]:
    """Return lens, stop and picture of a shot as kernel arguments; random rays of all lights run in the lens' frame.

    Returns
    -------
    lens : ConicLens or ShapedLens
        At the wavelengths of the shot.
    stop : StopArrays
    frame : PictureFrame
    """
    packed, opening = shot.packed, shot.opening
    stop_row = int(np.flatnonzero(packed.inv_semi == 0.0)[0])
    stop = StopArrays(stop_row, opening.blades, opening.mask, opening.half)
    return _lens_arrays(packed), stop, PictureFrame(shot.to_pixels, shot.size_px)


def _lens_arrays(packed: PackedLens) -> LensArrays:
    """As `PackedLens.arrays`, in the lens' frame instead of that of one light."""
    if packed.shapes is None:
        return packed.arrays(packed.n_gap, packed.reflectance)
    return ShapedLens(
        packed.shapes, packed.z_vertex, packed.inv_semi, packed.n_gap, packed.reflectance, packed.sensor_z
    )
