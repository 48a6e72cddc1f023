"""The iris as the kernels read it: its blades, its image, the dirt on it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..model import Iris
from ..optics.diffraction import Soil
from ..optics.dirt import lay_elements, rasterise
from ..optics.iris import blade_edges, outline, transmission
from ..optics.mask_levels import MaskLevels, mask_levels
from .prepare import Settled

Floats = NDArray[np.float64]

# the picture of the dirt in ghosts: pixels a side, and half its width in radii
SOIL_SIDE, SOIL_SPAN = 1024, 1.65
# straight edges that stand for a rounded iris in draft quality
DRAFT_EDGES = 48


@dataclass(frozen=True)
class Opening:
    """The iris as the kernels read it.

    Attributes
    ----------
    blades : ndarray, shape (B, 4)
        Curved edges (`optics.iris.blade_edges`); the border of a mask image.
    edges : ndarray, shape (E, 4)
        The same opening by straight edges.
    radius, inner : float
        Circles around and within the opening, mm; half of it for a mask, whose inside is unknown.
    mask : ndarray, shape (A, B), or None
        Transmittance image, if the iris is one.
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
        """The mask as kernels that draw read it."""
        return None if self.mask is None else mask_levels(self.mask, self.half)

    @property
    def mean_transmittance(self) -> float:
        """Mean of the mask over the square around the round opening; 1 without a mask."""
        # a turned one spans more than that square
        return 1.0 if self.mask is None else float(self.mask.mean()) * 2.0 * (self.half / self.radius) ** 2


def make_opening(settled: Settled, mask: Floats | None) -> Opening:
    """Turn an iris, or a mask image, into what the kernels read.

    Parameters
    ----------
    settled : Settled
    mask : ndarray, shape (A, B), or None
        Transmittance in [0, 1], row 0 up.

    Returns
    -------
    Opening
    """
    semi = settled.order.stop_semi_diameter
    if mask is not None:
        # the mask ends at its own border, so the border cuts as four blades
        turn = np.radians(settled.iris.rotation_deg) + 0.5 * np.pi * np.arange(4)
        square = np.stack([np.cos(turn), np.sin(turn), np.full(4, semi), np.zeros(4)], axis=1)
        image, half = _turned(np.asarray(mask, dtype=np.float64), settled.iris.rotation_deg)
        return Opening(square, square, float(np.sqrt(2.0) * semi), 0.5 * semi, image, half * semi)
    iris = settled.iris
    curved = iris.blades == 0 or iris.rounding > 0.0
    edges = blade_edges(iris, semi)
    border = outline(iris, semi, DRAFT_EDGES if curved else iris.blades)
    if curved:
        # chords lose a little of the arc's area; give it back
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


def _turned(mask: Floats, rotation_deg: float) -> tuple[Floats, float]:
    """Turn a mask as `optics.iris.transmission` does; return it, and half of what it spans then, in radii."""
    if rotation_deg % 90.0 == 0.0:
        return np.ascontiguousarray(np.rot90(mask, round(rotation_deg / 90.0))), 1.0
    # the square around the turned one, as fine as the mask is
    half = float(np.sqrt(2.0))
    count = int(np.ceil(half * max(mask.shape)))
    at = ((np.arange(count) + 0.5) * 2.0 / count - 1.0) * half
    seen = transmission(Iris(rotation_deg=rotation_deg), 1.0, at, at[:, None], mask=mask)
    return np.ascontiguousarray(seen[::-1]), half


def soiled_opening(opening: Opening, semi: float, soil: Soil) -> Opening:
    """Lay dirt on an opening, for ghosts.

    Parameters
    ----------
    opening : Opening
        From `make_opening`; its edges stay as they are.
    semi : float
        Semi-diameter of the round opening, mm.
    soil : Soil

    Returns
    -------
    Opening
        With a mask that holds what dirt lets through, and the iris image where there is one.
    """
    spacing = 2.0 * SOIL_SPAN / SOIL_SIDE
    at = np.asarray((np.arange(SOIL_SIDE) + 0.5) * spacing - SOIL_SPAN, dtype=np.float64)
    _, light = rasterise(lay_elements(soil.dirt, semi), at)
    for image, half in ((soil.image, 1.0), (opening.mask, opening.half / semi)):
        if image is not None:
            seen = transmission(Iris(), half, at, at[:, None], mask=image)
            if image is soil.image:
                seen[np.maximum(np.abs(at), np.abs(at)[:, None]) >= 1.0] = 1.0
            light = light * seen
    return replace(opening, mask=np.ascontiguousarray(light[::-1]), half=SOIL_SPAN * semi)


def _straight(border: Floats) -> Floats:
    """Turn a closed counter-clockwise polyline into straight edges (normal, offset, curvature 0)."""
    along = np.roll(border, -1, axis=0) - border
    length = np.hypot(along[:, 0], along[:, 1])
    along, start = along[length > 1e-12] / length[length > 1e-12, None], border[length > 1e-12]
    normal = np.stack([along[:, 1], -along[:, 0]], axis=1)
    offset = (normal * start).sum(axis=1)
    return np.column_stack([normal, offset, np.zeros(len(offset))])
