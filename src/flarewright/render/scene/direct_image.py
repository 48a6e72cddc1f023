"""The direct image of a light: its position and its flux per wavelength."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import isclose

import numpy as np

from ...kernels.raster.bundle import draw_bundle, measure_bundle, node_densities
from ...kernels.raster.polygons import blank_plane, to_pixels
from ...kernels.tracing.sequential import ALIVE, REL, WEIGHT, X, Y
from ...model import Lens
from ...optics.lens.dispersion import D_LINE_NM
from ...optics.lens.paraxial import path_matrices
from ...optics.lens.paths import direct_path
from ...optics.rays.bundle import Bundle, Refinement, trace_bundle, trace_grid, trace_points
from ...optics.rays.pupil_region import find_region
from ...typing import Floats
from .shot import Shot

# pixels per mm for the grid of the direct path, enough for its flux
_SCALE = 20.0
# picture of the traced pupil: pixels per side, and half its width in pupil radii
PUPIL_SIDE = 1024
PUPIL_SPAN = 1.65


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

    Returns
    -------
    DirectImage
        Dark (zeros at the ideal position) if the lens passes no light at that angle.
    """
    packed = shot.packed
    count = len(packed.wavelengths_nm)
    middle = (count - 1) // 2
    ideal = -packed.first_order.efl * np.tan(shot.incidence.tilt) * shot.incidence.axes[1]
    place, mean = (float(ideal[0]), float(ideal[1])), 0.0
    bundle = _direct_bundle(lens, shot)
    if bundle is None:
        return DirectImage(np.zeros(count), place, mean)
    flux = np.zeros(count)
    for w in range(count):
        data, sums = _measured(shot, bundle, w)
        flux[w] = sums[0] * shot.incidence.cosine
        if shot.opening.mask is not None and sums[0] > 0.0:
            flux[w] = _through_mask(shot, bundle, data, sums)
        if w == middle and sums[0] > 0.0:
            place, mean = (float(sums[1] / sums[0]), float(sums[2] / sums[0])), float(sums[0] / sums[4])
    return DirectImage(flux, place, mean)


def direct_place(lens: Lens, shot: Shot) -> tuple[float, float] | None:
    """Return the position of a light's direct image: `DirectImage.position_mm`, without the flux per wavelength.

    Returns
    -------
    tuple of float or None
        Millimetres right and up of the axis in the upright picture; None if the lens passes no light at that angle.
    """
    # on another grid the centroid differs by a fraction of a pixel
    bundle = _direct_bundle(lens, shot)
    if bundle is None:
        return None
    _, sums = _measured(shot, bundle, (len(shot.packed.wavelengths_nm) - 1) // 2)
    return (float(sums[1] / sums[0]), float(sums[2] / sums[0])) if sums[0] > 0.0 else None


def _direct_bundle(lens: Lens, shot: Shot) -> Bundle | None:
    """Return the rays of the direct path; None if the lens passes no light at that angle."""
    path, tilt, opening = direct_path(lens), shot.incidence.tilt, shot.opening
    region = find_region(shot.packed, path, tilt, opening.radius)
    if region is None:
        return None
    return trace_grid(shot.packed, path, tilt, (opening.radius, opening.inner), region, Refinement(_SCALE))


def _measured(shot: Shot, bundle: Bundle, w: int) -> tuple[Floats, Floats]:
    """Return the traced rays of a bundle at a wavelength, and the sums of `measure_bundle` over their light."""
    data = trace_bundle(shot.packed, w, bundle, shot.incidence.tilt)
    axes, blades = shot.incidence.axes, shot.opening.blades
    return data, measure_bundle(data, bundle.pupil, bundle.triangles, 1, blades, axes, bundle.halves)


def _through_mask(shot: Shot, bundle: Bundle, data: Floats, sums: Floats) -> float:
    """Return the flux of the direct image through a mask, by drawing it large enough to sample the mask."""
    side = 128
    zoom = 0.4 * side / max(sums[5], 0.5 * (sums[7] - sums[6]), 1e-9)
    centre = -0.5 * (sums[6] + sums[7]) * shot.incidence.axes[1]
    plane = blank_plane(side, side)
    view = np.array([side / 2 - centre[0] * zoom, side / 2 + centre[1] * zoom, zoom, zoom])
    opening, densities = shot.opening, node_densities(data, bundle.pupil, bundle.triangles)
    draw_bundle(
        data, bundle.pupil, bundle.triangles, densities, bundle.path.stop_crossings, opening.blades, opening.levels,
        shot.incidence.axes, view, shot.incidence.cosine, np.array([1.0, 0.0, 0.0]), plane,
        bundle.halves,
    )  # fmt: skip
    return float(to_pixels(plane, side)[:, :, 0].sum(dtype=np.float64))


def pattern_stretch(lens: Lens, shot: Shot) -> float:
    """Return the width of the diffraction pattern of a round iris over its height, from matrices.

    Returns
    -------
    float
        1 where both meridians have the same cone of light behind the lens, as with cylinders in front of the stop only.

    Notes
    -----
    The cone's f-number in a meridian is B of the way from the stop to the sensor over the stop's diameter
    (`Shot.working_f_number` in the y-z plane).
    """
    packed = shot.packed
    if packed.curvature_x is None:
        return 1.0
    reach = []
    for across in (True, False):
        ((stop, *_), *_), total = path_matrices(lens, direct_path(lens), D_LINE_NM, packed.sensor_z, across=across)
        reach.append(abs(float(total[0, 1] * stop[0] - total[0, 0] * stop[1])))
    wide, high = reach
    return 1.0 if isclose(wide, high, rel_tol=1e-9) or min(reach) == 0.0 else wide / high


def defocus_mm(lens: Lens, shot: Shot) -> float:
    """Return the width of a point's defocused direct image on the sensor, from matrices.

    Returns
    -------
    float
        Diameter of the disc, mm; the larger one if the two meridians focus at different planes. 0 in focus.
    """
    packed = shot.packed
    nearness = packed.nearness / shot.incidence.tilt_cosine
    widths = []
    for across in (False,) if packed.curvature_x is None else (False, True):
        ((stop, *_), *_), total = path_matrices(lens, direct_path(lens), D_LINE_NM, packed.sensor_z, across=across)
        # heights in the stop and on the sensor of the ray with height 1 at the first vertex
        in_stop, on_sensor = (float(row[0] + nearness * row[1]) for row in (stop, total[0]))
        widths.append(2.0 * packed.first_order.stop_semi_diameter * abs(on_sensor / in_stop))
    return max(widths)


def widest_defocus_mm(lens: Lens, shots: Sequence[Shot]) -> float:
    """Return the largest `defocus_mm` of some lights; distant lights share one value."""
    apart = {shot.packed.nearness / shot.incidence.tilt_cosine: shot for shot in shots}
    return max(defocus_mm(lens, shot) for shot in apart.values())


def traced_spot(lens: Lens, shot: Shot, offset: tuple[float, float] = (0.0, 0.0)) -> Floats | None:
    """Draw the direct image of a point from rays, without diffraction.

    Parameters
    ----------
    lens : Lens
    shot : Shot
    offset : tuple of float
        Shift in columns and rows.

    Returns
    -------
    ndarray, shape (2 a + 1, 2 b + 1), or None
        Part of the flux per pixel of the picture, at the middle wavelength. Its centroid lies `offset` from the centre
        of the middle pixel. None if no light passes.
    """
    path, packed, opening = direct_path(lens), shot.packed, shot.opening
    region = find_region(packed, path, shot.incidence.tilt, opening.radius)
    if region is None:
        return None
    scale = float(shot.to_pixels[2:].max())
    tilt, axes, crossings = shot.incidence.tilt, shot.incidence.axes, path.stop_crossings
    bundle = trace_grid(packed, path, tilt, (opening.radius, opening.inner), region, Refinement(scale))
    data = trace_bundle(packed, (len(packed.wavelengths_nm) - 1) // 2, bundle, tilt)
    sums = measure_bundle(data, bundle.pupil, bundle.triangles, crossings, opening.blades, axes, bundle.halves)
    if sums[0] <= 0.0:
        return None
    x, y = sums[1] / sums[0], sums[2] / sums[0]
    # largest distance of a ray from the centroid, limited to two pictures
    across, along = -(axes @ np.array([x, y]))
    far = float(np.hypot(sums[5] + abs(across), max(sums[7] - along, along - sums[6])))
    sides = zip(shot.to_pixels[2:], shot.size_px, strict=True)
    reach = [int(min(np.ceil(far * zoom) + 2, 2 * side)) for zoom, side in sides]
    plane = blank_plane(2 * reach[0] + 1, 2 * reach[1] + 1)
    view = np.array([0.0, 0.0, *shot.to_pixels[2:]])
    view[0] = reach[0] + 0.5 + offset[0] - x * view[2]
    view[1] = reach[1] + 0.5 + offset[1] + y * view[3]
    draw_bundle(
        data, bundle.pupil, bundle.triangles, node_densities(data, bundle.pupil, bundle.triangles), crossings,
        opening.blades, opening.levels, axes, view, 1.0, np.array([1.0, 0.0, 0.0]), plane, bundle.halves,
    )  # fmt: skip
    drawn = to_pixels(plane, 2 * reach[0] + 1)[:, :, 0].astype(np.float64)
    total = float(drawn.sum())
    if any(r == 2 * side for r, side in zip(reach, shot.size_px, strict=True)):
        # some of the light lies outside
        whole = float(sums[0]) if opening.mask is None else _through_mask(shot, bundle, data, sums)
        total = whole if opening.mask is None else whole / shot.incidence.cosine
    return _trimmed(drawn) / total if total > 0.0 else None


def _trimmed(kernel: Floats) -> Floats:
    """Remove dark borders, equally on both sides."""
    (high, wide), cut = kernel.shape, []
    for lit, side in ((kernel.any(axis=1), high), (kernel.any(axis=0), wide)):
        at = np.flatnonzero(lit)
        cut.append(0 if at.size == 0 else min(int(at[0]), side - 1 - int(at[-1])))
    return kernel[cut[0] : high - cut[0], cut[1] : wide - cut[1]]


def traced_pupil(lens: Lens, shot: Shot, f_number: float) -> Floats | None:
    """Draw the pupil of the direct path as seen from the image: the cat's eye.

    Returns
    -------
    ndarray, shape (PUPIL_SIDE, PUPIL_SIDE), or None
        Transmittance, about 1 in the centre, row 0 up, over [-PUPIL_SPAN, PUPIL_SPAN] squared in pupil radii; None if
        no light passes.

    Notes
    -----
    A point at distance d from the image gets the phase k d.(L, M) from a ray with direction cosines (L, M), so the
    pattern is the transform of the light over 2 N (L, M), relative to the mean ray. Near the axis that is the iris; off
    the axis the edges of elements clip it and the image plane sees it foreshortened. The wavefront is taken as perfect:
    aberrations are ignored.
    """
    path, tilt, opening, packed = direct_path(lens), shot.incidence.tilt, shot.opening, shot.packed
    region = find_region(packed, path, tilt, opening.radius)
    if region is None:
        return None
    bundle = trace_grid(packed, path, tilt, (opening.radius, opening.inner), region, Refinement(_SCALE))
    w = (len(packed.wavelengths_nm) - 1) // 2
    data = trace_bundle(packed, w, bundle, tilt).copy()
    axes, crossings = shot.incidence.axes, path.stop_crossings
    sums = measure_bundle(data, bundle.pupil, bundle.triangles, crossings, opening.blades, axes, bundle.halves)
    if sums[0] <= 0.0:
        return None
    # tracing to a second plane gives the slopes
    behind = trace_points(replace(packed, sensor_z=packed.sensor_z + 1.0), w, path, tilt, bundle.pupil)
    slope = behind[:, X : Y + 1] - data[:, X : Y + 1]
    cosines = slope / np.sqrt(1.0 + (slope**2).sum(axis=1, keepdims=True))
    weight = data[:, WEIGHT] * data[:, ALIVE] * (data[:, REL] <= 1.0)
    middle = (weight @ cosines) / weight.sum()
    if bundle.halves == 2:
        middle[0] = 0.0
    data[:, X : Y + 1] = 2.0 * f_number * (cosines - middle)
    plane = blank_plane(PUPIL_SIDE, PUPIL_SIDE)
    zoom = 0.5 * PUPIL_SIDE / PUPIL_SPAN
    view = np.array([PUPIL_SIDE / 2, PUPIL_SIDE / 2, zoom, zoom])
    densities = node_densities(data, bundle.pupil, bundle.triangles)
    draw_bundle(
        data, bundle.pupil, bundle.triangles, densities, crossings, opening.blades, opening.levels, axes, view, 1.0,
        np.array([1.0, 0.0, 0.0]), plane, bundle.halves,
    )  # fmt: skip
    lit = to_pixels(plane, PUPIL_SIDE)[:, :, 0].astype(np.float64)
    level = float(np.median(lit[lit > 0.3 * lit.max()])) if lit.max() > 0.0 else 0.0
    return lit / level if level > 0.0 else None
