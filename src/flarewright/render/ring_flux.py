"""What a ghost with rings has to be multiplied by, so that it keeps its flux.

Diffraction moves light and takes none. A pattern by itself keeps it too, but where a path crosses the stop several
times the product of its patterns does not, as edges that lie on each other show; and a pattern that is asked at the
centres of pixels says little of ghosts of a few of them. So the ghost is drawn for itself, with rings and without,
wherever it lands, and the flux of both is compared.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..kernels.bundle import draw_bundle, node_densities
from ..kernels.lit_edge import widen_box
from ..kernels.raster import blank_plane
from ..optics.bundle import Bundle, trace_bundle
from ..optics.tears import mended
from .path_color import place_of

if TYPE_CHECKING:
    from .canvas import Plane
    from .ringing import Textures
    from .shot import Shot

Floats = NDArray[np.float64]

# pixels across beyond which a ghost is drawn smaller, for its flux alone
WIDEST_PX = 256.0
# ghosts no larger than this are compared at every wavelength that is drawn, others at the middle one
SMALL_PX = 48.0
# of a ghost that ends outside the picture, what lies within this part of its sides around it is compared, if that is
# this part of the ghost: elsewhere its grid is coarse
AROUND, SEEN = 0.1, 0.5
# pixels around a ghost
_MARGIN = 2

Box = tuple[float, float, float, float]


@dataclass(frozen=True)
class RingFlux:
    """How a ghost's flux is kept.

    Attributes
    ----------
    shot : Shot
    patterns : Textures
    place : ndarray, shape (4,)
        Column and row of the axis, pixels per mm.
    middle : float
        What the ghost is multiplied by at all wavelengths, unless it is small.
    small : tuple of (Box, ndarray, ndarray), or None
        Of a small ghost left, top, right and bottom, pixels; at the traced wavelengths, shape (W,), its flux without
        rings over what its rays carry, and what they carry.
    """

    shot: Shot
    patterns: Textures
    place: Floats
    middle: float = 1.0
    small: tuple[Box, Floats, Floats] | None = None

    def kept(self, k: int, at: float, whole: Bundle, data: Floats, densities: Floats) -> float:
        """Return what the ghost has to be multiplied by at the k-th drawn wavelength.

        Parameters
        ----------
        k : int
        at : float
            The same as traced wavelengths are counted.
        whole, data, densities
            The ghost as it is about to be drawn.
        """
        if self.small is None:
            return self.middle
        box, relative, carried = self.small
        waves = np.arange(carried.size)
        sharp = float(np.interp(at, waves, relative) * np.interp(at, waves, carried))
        return _over(sharp, _ringed(self.shot, self.patterns, self.place, box, k, whole, data, densities))


def ring_flux(
    shot: Shot, patterns: Textures, sharp: Bundle, ringed: Bundle, middle: int, place: Floats, size_px: tuple[int, int],
    carried: Floats | None = None,
) -> RingFlux:  # fmt: skip
    """Compare a ghost's flux without rings and with them.

    Parameters
    ----------
    shot : Shot
    patterns : Textures
    sharp, ringed : Bundle
        The grid of its light, and that which follows it into the shadow.
    middle : int
        Which of the drawn wavelengths is the middle one of those that are traced.
    place : ndarray, shape (4,)
        Column and row of the axis, pixels per mm.
    size_px : tuple of int
        Of the picture.
    carried : ndarray, shape (W,), optional
        What rays carry at the traced wavelengths (`optics.coating_curves.PathSpectrum`); None: alike at all.

    Returns
    -------
    RingFlux

    Notes
    -----
    `tests/render/test_ringing.py` compares sums of layers with and without rings.
    """
    count, tilt = len(shot.packed.wavelengths_nm), shot.incidence.tilt
    box = _compared(_box(shot, patterns, ringed, place), size_px)
    if box is None:
        return RingFlux(shot, patterns, place)

    def without(w: int) -> float:
        return _sharp(shot, place, box, *mended(sharp, trace_bundle(shot.packed, w, sharp, tilt)))

    if max(box[2] - box[0], box[3] - box[1]) <= SMALL_PX:
        # as `ghosts_final` interpolates the rays
        mean = np.ones(count) if carried is None or carried.min() <= 0.0 else carried
        return RingFlux(shot, patterns, place, small=(box, np.array([without(w) for w in range(count)]) / mean, mean))
    whole, data = mended(ringed, trace_bundle(shot.packed, count // 2, ringed, tilt))
    densities = node_densities(data, whole.pupil, whole.triangles)
    ringed_flux = _ringed(shot, patterns, place, box, middle, whole, data, densities)
    return RingFlux(shot, patterns, place, middle=_over(without(count // 2), ringed_flux))


def _over(sharp: float, ringed: float) -> float:
    return sharp / ringed if sharp > 0.0 and ringed > 0.0 else 1.0


def _box(shot: Shot, patterns: Textures, ringed: Bundle, place: Floats) -> Box | None:
    """Return left, top, right and bottom of a ghost, pixels of the picture; None where no ray passes."""
    at, box = place_of(shot, place), np.array([np.inf, -np.inf, np.inf, -np.inf])
    for data in ringed.traced.values():
        for mirror in (1.0, -1.0)[: ringed.halves]:
            widen_box(data, patterns.rings.reach, at, mirror, box)
    left, right, top, bottom = box.tolist()
    return (left, top, right, bottom) if right >= left else None


def _compared(box: Box | None, size_px: tuple[int, int]) -> Box | None:
    """Return the part of a ghost that is compared; None where that says nothing of the rest."""
    if box is None:
        return None
    width, height = size_px
    beside, below = AROUND * width, AROUND * height
    part = max(box[0], -beside), max(box[1], -below), min(box[2], width + beside), min(box[3], height + below)
    if part[2] <= part[0] or part[3] <= part[1]:
        return None
    whole = (box[2] - box[0]) * (box[3] - box[1])
    return part if (part[2] - part[0]) * (part[3] - part[1]) >= SEEN * whole else None


def _scratch(place: Floats, box: Box) -> tuple[Floats, int, int]:
    """Return where a ghost is drawn for its flux, and the width and height of that picture."""
    size = np.array([box[2] - box[0], box[3] - box[1]])
    smaller = min(1.0, WIDEST_PX / float(size.max()))
    # by whole pixels, so that what is asked at pixels' centres is asked there again
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
    """Add up a white picture: each of its colours says the same."""
    return float(plane[:, :, 0].reshape(len(plane), -1)[:, :width].sum(dtype=np.float64))
