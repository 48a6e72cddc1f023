"""Description of an iris of equal blades by one of its corners."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...typing import Floats


@dataclass(frozen=True)
class BladeForm:
    """An iris of equal blades, described at one corner.

    Attributes
    ----------
    corners : ndarray, shape (J, 2)
        Directions of the corners from the centre, counter-clockwise; none for a round opening.
    distance : float
        Distance of a corner from the centre, mm; the radius of a round opening.
    gamma : float
        Angle between a corner's direction and the normals of the adjacent blades, rad.
    offset, curvature : float
        Of a blade, as in `iris.blade_edges`.
    half_length : float
        Half the border of a blade, mm; for a round opening half its circumference.
    area : float
        Area of the opening, mm^2.
    """

    corners: Floats
    distance: float
    gamma: float
    offset: float
    curvature: float
    half_length: float
    area: float

    @property
    def halves(self) -> int:
        """Number of half blades along the border."""
        return 2 * max(len(self.corners), 1)

    @property
    def bend(self) -> float:
        """Angle by which a blade's normal turns from its middle to a corner, rad."""
        return math.asin(self.curvature * self.distance * math.sin(self.gamma))


def blade_form(edges: Floats) -> BladeForm:
    """Return the corner description of an iris.

    Parameters
    ----------
    edges : ndarray, shape (B, 4)
        From `iris.blade_edges`.
    """
    offset, curvature = float(edges[0, 2]), float(edges[0, 3])
    B = len(edges)
    if B == 1:
        return BladeForm(np.empty((0, 2)), offset, 0.0, offset, curvature, math.pi * offset, math.pi * offset**2)
    gamma = math.pi / B
    distance = to_corner(offset, curvature, gamma)
    chord = distance * math.sin(gamma)
    bend = math.asin(curvature * chord)
    half_length, segment = chord, 0.0
    if bend > 1e-6:
        half_length, segment = bend / curvature, (bend - 0.5 * math.sin(2.0 * bend)) / curvature**2
    angle = np.arctan2(edges[:, 1], edges[:, 0]) + gamma
    corners = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    area = B * (chord * distance * math.cos(gamma) + segment)
    return BladeForm(corners, distance, gamma, offset, curvature, half_length, area)


def to_corner(offset: float, curvature: float, gamma: float) -> float:
    """Return the distance of the border from the centre in the direction gamma off a blade's normal."""
    k = curvature * offset
    b = (1.0 - k) * math.cos(gamma)
    return offset * (2.0 - k) / (b + math.sqrt(b * b + k * (2.0 - k)))
