"""The iris as the kernels read it: blades, mask, dirt."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ...model import Iris
from ...optics.diffraction.fraunhofer import Soil
from ...optics.pupil.dirt import generate_dirt, rasterise
from ...optics.pupil.iris import blade_edges, iris_outline, transmission
from ...optics.pupil.mask_levels import MaskLevels, halved, mask_levels
from ...typing import Floats, Pixels
from .resolve import ResolvedProject

# mask of the dirt in ghosts: pixels per side, and half its width in radii
SOIL_SIDE, SOIL_SPAN = 1024, 1.65
# number of straight edges that approximate a rounded iris in draft quality
DRAFT_EDGES = 48
# largest number of samples per side of a rotated mask
MOST_ROTATED = 4096


@dataclass(frozen=True)
class Opening:
    """The iris as the kernels read it.

    Attributes
    ----------
    blades : ndarray, shape (B, 4)
        Curved edges (`optics.pupil.iris.blade_edges`); the border of a mask image.
    edges : ndarray, shape (E, 4)
        The same opening with straight edges.
    radius, inner : float
        Radii of the circles around and within the opening, mm. For a mask, `inner` is half the radius of the iris,
        because the mask can be dark anywhere.
    mask : ndarray, shape (A, B), or None
        Transmittance image, if the iris has one.
    half : float
        The mask spans [-half, half], mm.
    """

    blades: Floats
    edges: Floats
    radius: float
    inner: float
    mask: Floats | None
    half: float

    @cached_property
    def levels(self) -> MaskLevels | None:
        """The mask as the drawing kernels read it."""
        return None if self.mask is None else mask_levels(self.mask, self.half)

    @cached_property
    def images(self) -> tuple[Pixels, Pixels] | None:
        """The mask's amplitude and transmittance, for the samples of diffraction."""
        if self.mask is None:
            return None
        light = self.mask.astype(np.float32)
        return np.sqrt(light), light

    @property
    def mean_transmittance(self) -> float:
        """Mean of the mask over the square around the round opening; 1 without a mask."""
        # a rotated mask spans more than that square
        return 1.0 if self.mask is None else float(self.mask.mean()) * 2.0 * (self.half / self.radius) ** 2


def make_opening(settled: ResolvedProject, mask: Floats | None) -> Opening:
    """Convert an iris, or a mask, to what the kernels read.

    Parameters
    ----------
    settled : ResolvedProject
    mask : ndarray, shape (A, B), or None
        Transmittance in [0, 1], row 0 up.
    """
    semi = settled.order.stop_semi_diameter
    if mask is not None:
        # four blades cut along the border of the mask
        turn = np.radians(settled.iris.rotation_deg) + 0.5 * np.pi * np.arange(4)
        square = np.stack([np.cos(turn), np.sin(turn), np.full(4, semi), np.zeros(4)], axis=1)
        image, half = _rotated(np.asarray(mask, dtype=np.float64), settled.iris.rotation_deg)
        return Opening(square, square, float(np.sqrt(2.0) * semi), 0.5 * semi, image, half * semi)
    iris = settled.iris
    curved = iris.blades == 0 or iris.rounding > 0.0
    edges = blade_edges(iris, semi)
    border = iris_outline(iris, semi, DRAFT_EDGES if curved else iris.blades)
    if curved:
        # chords enclose less area than the arc; enlarge them to compensate
        step = 2.0 * np.pi / DRAFT_EDGES
        border = border * float(np.sqrt(step / np.sin(step)))
    return Opening(
        blades=edges,
        edges=_straight(border),
        radius=float(np.hypot(border[:, 0], border[:, 1]).max()),
        inner=float(edges[:, 2].min()),
        mask=None,
        half=1.0,
    )


def _rotated(mask: Floats, rotation_deg: float) -> tuple[Floats, float]:
    """Rotate a mask as `optics.pupil.iris.transmission` does; return it and its new half width in radii."""
    if rotation_deg % 90.0 == 0.0:
        return np.ascontiguousarray(np.rot90(mask, round(rotation_deg / 90.0))), 1.0
    # resample to the square around the rotated mask, at the mask's resolution or a half of it: pixels finer than
    # half the samples of a ring pattern show in no picture, and take a gigabyte
    half = float(np.sqrt(2.0))
    if half * max(mask.shape) > MOST_ROTATED:
        mask = halved(mask)
    count = int(np.ceil(half * max(mask.shape)))
    at = ((np.arange(count) + 0.5) * 2.0 / count - 1.0) * half
    seen = transmission(Iris(rotation_deg=rotation_deg), 1.0, at, at[:, None], mask=mask)
    return np.ascontiguousarray(seen[::-1]), half


def soiled_opening(opening: Opening, semi: float, soil: Soil) -> Opening:
    """Add dirt to an opening, for ghosts.

    Parameters
    ----------
    opening : Opening
        From `make_opening`; its edges stay unchanged.
    semi : float
        Semi-diameter of the round opening, mm.
    soil : Soil

    Returns
    -------
    Opening
        With a mask of the light that passes the dirt, times the iris image if there is one.
    """
    spacing = 2.0 * SOIL_SPAN / SOIL_SIDE
    at = np.asarray((np.arange(SOIL_SIDE) + 0.5) * spacing - SOIL_SPAN, dtype=np.float64)
    _, light = rasterise(generate_dirt(soil.dirt, semi), at)
    for image, half in ((soil.image, 1.0), (opening.mask, opening.half / semi)):
        if image is not None:
            seen = transmission(Iris(), half, at, at[:, None], mask=image)
            if image is soil.image:
                seen[np.maximum(np.abs(at), np.abs(at)[:, None]) >= 1.0] = 1.0
            light = light * seen
    return replace(opening, mask=np.ascontiguousarray(light[::-1]), half=SOIL_SPAN * semi)


def _straight(border: Floats) -> Floats:
    """Convert a closed counter-clockwise polyline to straight edges (normal, offset, curvature 0)."""
    along = np.roll(border, -1, axis=0) - border
    length = np.hypot(along[:, 0], along[:, 1])
    along, start = along[length > 1e-12] / length[length > 1e-12, None], border[length > 1e-12]
    normal = np.stack([along[:, 1], -along[:, 0]], axis=1)
    offset = (normal * start).sum(axis=1)
    return np.column_stack([normal, offset, np.zeros(len(offset))])
