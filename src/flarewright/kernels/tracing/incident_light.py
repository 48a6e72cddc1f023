"""The rays of a light source in front of the lens, one argument of the kernels."""

from __future__ import annotations

from typing import NamedTuple


class IncidentLight(NamedTuple):
    """The rays of a light source in front of the lens.

    Attributes
    ----------
    tilt : float
        The ray through the first vertex runs along (0, sin tilt, cos tilt) in the meridional frame.
    nearness : float
        1 / distance from the light source to the first vertex, 1/mm; 0 for a distant one, whose rays are parallel.
    """

    tilt: float
    nearness: float
