"""The factor that keeps the flux of a ghost when rings are added.

Diffraction redistributes light without loss. A single pattern conserves flux, but the product of the patterns of
several stop crossings does not, for example where their edges coincide; and sampling patterns at pixel centres is
inaccurate for ghosts a few pixels wide. So the ghost is drawn separately with and without rings, at its full extent,
and the two fluxes are compared.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...kernels.raster.bundle import draw_bundle, node_densities
from ...kernels.raster.polygons import blank_plane
from ...kernels.tracing.iris_edge import widen_box
from ...optics.rays.bundle import Bundle, trace_bundle
from ...optics.rays.torn_cells import cut_failed_triangles
from ...typing import Floats
from ..scene.path_color import pixel_frame

if TYPE_CHECKING:
    from ..image.canvas import Plane
    from ..scene.shot import Shot
    from .diffraction_rings import Textures


# wider ghosts are drawn at reduced size for the comparison
WIDEST_PX = 256.0
# ghosts up to this size are compared at every drawn wavelength, larger ones at the middle wavelength
SMALL_PX = 48.0
# of a ghost that ends outside the picture, the part within this margin (relative to the picture's sides) is compared,
# if it is at least LEAST_PART of the ghost: farther out the ghost's grid is coarse
MARGIN_PART, LEAST_PART = 0.1, 0.5
# margin around a ghost, pixels
_MARGIN = 2

Box = tuple[float, float, float, float]


@dataclass(frozen=True)
class RingFlux:
    """Data for the flux factor of a ghost with rings.

    Attributes
    ----------
    shot : Shot
    patterns : Textures
    place : ndarray, shape (4,)
        Column and row of the axis, pixels per mm.
    middle : float
        The factor at all wavelengths, unless the ghost is small.
    small : tuple of (Box, ndarray, ndarray), or None
        For a small ghost: left, top, right and bottom in pixels; and at the traced wavelengths, shape (W,), its flux
        without rings divided by the weight of its rays, and that weight.
    """

    shot: Shot
    patterns: Textures
    place: Floats
    middle: float = 1.0
    small: tuple[Box, Floats, Floats] | None = None

    def kept(self, k: int, at: float, whole: Bundle, data: Floats, densities: Floats) -> float:
        """Return the flux factor at the k-th drawn wavelength.

        Parameters
        ----------
        k : int
        at : float
            Position of the wavelength among the traced ones, fractional.
        whole, data, densities
            The ghost's bundle, rays and densities, as they are drawn next.
        """
        if self.small is None:
            return self.middle
        box, relative, carried = self.small
        waves = np.arange(carried.size)
        sharp = float(np.interp(at, waves, relative) * np.interp(at, waves, carried))
        return _ratio(sharp, _ringed(self.shot, self.patterns, self.place, box, k, whole, data, densities))


def ring_flux(
    shot: Shot, patterns: Textures, sharp: Bundle, ringed: Bundle, middle: int, place: Floats, size_px: tuple[int, int],
    carried: Floats | None = None,
) -> RingFlux:  # fmt: skip
    """Compare the flux of a ghost without and with rings.

    Parameters
    ----------
    shot : Shot
    patterns : Textures
    sharp, ringed : Bundle
        The grid of its geometrical light, and the grid that includes the shadow.
    middle : int
        Index of the middle traced wavelength among the drawn ones.
    place : ndarray, shape (4,)
        Column and row of the axis, pixels per mm.
    size_px : tuple of int
        Width and height of the picture.
    carried : ndarray, shape (W,), optional
        Mean weight of the rays at the traced wavelengths (`optics.rays.path_reflectance.PathSpectrum`); None: equal.

    Notes
    -----
    `tests/render/ghosts/test_diffraction_rings.py` compares sums of layers with and without rings.
    """
    count, tilt = len(shot.packed.wavelengths_nm), shot.incidence.tilt
    box = _compared(_box(shot, patterns, ringed, place), size_px)
    if box is None:
        return RingFlux(shot, patterns, place)

    def without(w: int) -> float:
        return _sharp(shot, place, box, *cut_failed_triangles(sharp, trace_bundle(shot.packed, w, sharp, tilt)))

    if max(box[2] - box[0], box[3] - box[1]) <= SMALL_PX:
        # interpolate as `traced_ghosts` interpolates the rays
        mean = np.ones(count) if carried is None or carried.min() <= 0.0 else carried
        return RingFlux(shot, patterns, place, small=(box, np.array([without(w) for w in range(count)]) / mean, mean))
    whole, data = cut_failed_triangles(ringed, trace_bundle(shot.packed, count // 2, ringed, tilt))
    densities = node_densities(data, whole.pupil, whole.triangles)
    ringed_flux = _ringed(shot, patterns, place, box, middle, whole, data, densities)
    return RingFlux(shot, patterns, place, middle=_ratio(without(count // 2), ringed_flux))


def _ratio(sharp: float, ringed: float) -> float:
    return sharp / ringed if sharp > 0.0 and ringed > 0.0 else 1.0


def _box(shot: Shot, patterns: Textures, ringed: Bundle, place: Floats) -> Box | None:
    """Return left, top, right and bottom of a ghost in pixels of the picture; None where no ray passes."""
    at, box = pixel_frame(shot, place), np.array([np.inf, -np.inf, np.inf, -np.inf])
    for data in ringed.traced.values():
        for mirror in (1.0, -1.0)[: ringed.halves]:
            widen_box(data, patterns.rings.reach, at, mirror, box)
    left, right, top, bottom = box.tolist()
    return (left, top, right, bottom) if right >= left else None


def _compared(box: Box | None, size_px: tuple[int, int]) -> Box | None:
    """Return the part of a ghost that is compared; None where it does not represent the whole ghost."""
    if box is None:
        return None
    width, height = size_px
    beside, below = MARGIN_PART * width, MARGIN_PART * height
    part = max(box[0], -beside), max(box[1], -below), min(box[2], width + beside), min(box[3], height + below)
    if part[2] <= part[0] or part[3] <= part[1]:
        return None
    whole = (box[2] - box[0]) * (box[3] - box[1])
    return part if (part[2] - part[0]) * (part[3] - part[1]) >= LEAST_PART * whole else None


def _scratch(place: Floats, box: Box) -> tuple[Floats, int, int]:
    """Return the position of a ghost in a scratch picture, and the width and height of that picture."""
    size = np.array([box[2] - box[0], box[3] - box[1]])
    smaller = min(1.0, WIDEST_PX / float(size.max()))
    # shift by whole pixels, so that patterns are sampled at the same points as in the picture
    corner = np.floor(box[:2]) - _MARGIN
    width, height = (int(side) for side in np.ceil(size * smaller) + 2 * _MARGIN + 1)
    return np.append((place[:2] - corner) * smaller, place[2:] * smaller), width, height


def _sharp(shot: Shot, place: Floats, box: Box, whole: Bundle, data: Floats) -> float:
    """Return the flux of a ghost without rings, in the unit of `_ringed`."""
    at, width, height = _scratch(place, box)
    plane, opening = blank_plane(width, height), shot.opening
    draw_bundle(
        data, whole.pupil, whole.triangles, node_densities(data, whole.pupil, whole.triangles),
        whole.path.stop_crossings, opening.blades, opening.levels, shot.incidence.axes, at, shot.gain, np.ones(3),
        plane, whole.halves,
    )  # fmt: skip
    return _light(plane, width)


def _ringed(
    shot: Shot, patterns: Textures, place: Floats, box: Box, k: int, whole: Bundle, data: Floats, densities: Floats
) -> float:
    """Return the flux of a ghost with rings."""
    at, width, height = _scratch(place, box)
    plane = blank_plane(width, height)
    patterns.draw(k, whole, data, densities, shot.incidence.axes, at, shot.gain, np.ones(3), plane)
    return _light(plane, width)


def _light(plane: Plane, width: int) -> float:
    """Return the sum of a white picture; its channels are equal."""
    return float(plane[:, :, 0].reshape(len(plane), -1)[:, :width].sum(dtype=np.float64))
