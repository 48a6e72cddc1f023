"""The direct image of a light: where it falls and how much light it holds, per wavelength."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..kernels.bundle import draw_bundle, measure_bundle, node_densities
from ..kernels.raster import blank_plane, to_pixels
from ..model import Layer, Lens, Lines
from ..optics.bundle import Bundle, find_region, trace_bundle, trace_grid
from ..optics.paths import direct_path
from .prepare import Settled
from .shot import Shot
from .starburst import NEAR_SPLIT, starburst_layer

Floats = NDArray[np.float64]

# pixels per mm that the grid of the direct path resolves; its flux needs no more
_SCALE = 20.0
# Hullin 2011, section 3.3: fine enough to blur the rings of single wavelengths into each other
DIFFRACTION_STEP_NM = 5.0


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
    region = find_region(packed, path, tilt, opening.radius)
    if region is None:
        ideal = -packed.first_order.efl * np.tan(tilt) * axes[1]
        return DirectImage(np.zeros(count), (float(ideal[0]), float(ideal[1])), 0.0)
    bundle = trace_grid(packed, path, tilt, (opening.radius, opening.inner), region, tolerance=0.25, scale=_SCALE)
    flux = np.zeros(count)
    place, mean = (0.0, 0.0), 0.0
    for w in range(count):
        data = trace_bundle(packed, w, bundle, tilt)
        sums = measure_bundle(data, bundle.pupil, bundle.triangles, 1, opening.blades, axes, bundle.halves)
        flux[w] = sums[0] * shot.incidence.cosine
        if opening.mask is not None and sums[0] > 0.0:
            flux[w] = _through_mask(shot, bundle, data, sums)
        if w == middle and sums[0] > 0.0:
            place, mean = (float(sums[1] / sums[0]), float(sums[2] / sums[0])), float(sums[0] / sums[4])
    return DirectImage(flux, place, mean)


def _through_mask(shot: Shot, bundle: Bundle, data: Floats, sums: Floats) -> float:
    """Flux of the direct image through a mask: drawn large enough to look the mask up, and added up."""
    side = 128
    zoom = 0.4 * side / max(sums[5], 0.5 * (sums[7] - sums[6]), 1e-9)
    centre = -0.5 * (sums[6] + sums[7]) * shot.incidence.axes[1]
    plane = blank_plane(side, side)
    view = np.array([side / 2 - centre[0] * zoom, side / 2 + centre[1] * zoom, zoom, zoom])
    opening, densities = shot.opening, node_densities(data, bundle.pupil, bundle.triangles)
    draw_bundle(
        data, bundle.pupil, bundle.triangles, densities, bundle.path.stop_crossings, opening.blades, opening.mask,
        opening.half, shot.incidence.axes, view, shot.incidence.cosine, np.array([1.0, 0.0, 0.0]), plane,
        bundle.halves,
    )  # fmt: skip
    return float(to_pixels(plane, side)[:, :, 0].sum(dtype=np.float64))


def starburst_of(settled: Settled, shots: Sequence[Shot], images: Sequence[DirectImage], mask: Floats | None) -> Layer:
    """Draw the direct image of every light, spread by diffraction at the iris.

    Parameters
    ----------
    settled : Settled
    shots, images : sequence
        One a light.
    mask : ndarray, shape (A, B), or None
        The iris as an image.

    Returns
    -------
    Layer
        Named "starburst"; its light is the direct images' flux, in the unit of the ghosts.
    """
    width, height = shots[0].size_px
    total = np.zeros((height, width, 3), dtype=np.float32)
    for shot, image in zip(shots, images, strict=True):
        fine_nm = _diffracted_wavelengths(shot)
        flux = np.interp(fine_nm, shot.packed.wavelengths_nm, image.throughput_mm2) * shot.light.intensity
        if not flux.any():
            continue
        column = shot.to_pixels[0] + image.position_mm[0] * shot.to_pixels[2]
        row = shot.to_pixels[1] - image.position_mm[1] * shot.to_pixels[3]
        total += starburst_layer(
            settled.iris,
            settled.order.f_number,
            (1.0 / float(shot.to_pixels[2]), 1.0 / float(shot.to_pixels[3])),
            shot.size_px,
            (float(column), float(row)),
            fine_nm,
            shot.weights(fine_nm) * flux[:, None],
            mask=mask,
            split=NEAR_SPLIT if settled.project.quality.mode == "final" else 1,
        )
    return Layer("starburst", total, (0, 0, width, height))


def _diffracted_wavelengths(shot: Shot) -> Floats:
    """Return steps of 5 nm over the visible range, or the lines of a spectrum of lines."""
    if isinstance(shot.light.spectrum, Lines):
        return np.array(sorted({nm for nm, _ in shot.light.spectrum.lines}))
    return np.arange(380.0, 781.0, DIFFRACTION_STEP_NM)
