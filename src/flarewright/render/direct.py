"""The direct image of a light: where it falls and how much light it holds, per wavelength."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..kernels.bundle import measure_bundle
from ..model import Lens
from ..optics.bundle import find_region, trace_grid, trace_points
from ..optics.paths import direct_path
from .shot import Shot

Floats = NDArray[np.float64]

# pixels per mm that the grid of the direct path resolves; its flux needs no more
_SCALE = 20.0


@dataclass(frozen=True)
class DirectImage:
    """The direct image of one light.

    Attributes
    ----------
    throughput_mm2 : ndarray, shape (W,)
        Flux on the sensor plane per unit irradiance on a plane facing the light, per traced wavelength.
    position_mm : tuple of float
        Centroid at the middle wavelength in the upright picture.
    transmittance : float
        Mean product of T over the accepted pupil, at the middle wavelength.
    """

    throughput_mm2: Floats
    position_mm: tuple[float, float]
    transmittance: float


def direct_image(lens: Lens, shot: Shot) -> DirectImage:
    """Trace the direct path of a light.

    Parameters
    ----------
    lens : Lens
    shot : Shot

    Returns
    -------
    DirectImage
        Dark (zeros at the ideal place) when the lens passes nothing at that angle.
    """
    path, tilt, axes = direct_path(lens), shot.incidence.tilt, shot.incidence.axes
    packed, opening = shot.packed, shot.opening
    count = len(packed.wavelengths_nm)
    middle = (count - 1) // 2
    box, _ = find_region(packed, middle, path, tilt, opening.radius)
    if box is None:
        ideal = -packed.first_order.efl * np.tan(tilt) * axes[1]
        return DirectImage(np.zeros(count), (float(ideal[0]), float(ideal[1])), 0.0)
    bundle = trace_grid(packed, path, tilt, opening.radius, box, tolerance=0.25, scale=_SCALE)
    flux = np.zeros(count)
    place, mean = (0.0, 0.0), 0.0
    for w in range(count):
        data = trace_points(packed, w, path, tilt, bundle.pupil)
        sums = measure_bundle(data, bundle.pupil, bundle.triangles, 1, opening.blades, axes)
        flux[w] = sums[0] * shot.incidence.cosine * opening.mean_transmittance
        if w == middle and sums[0] > 0.0:
            place, mean = (float(sums[1] / sums[0]), float(sums[2] / sums[0])), float(sums[0] / sums[4])
    return DirectImage(flux, place, mean)
