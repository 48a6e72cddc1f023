"""A path as one light makes it, found worth drawing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..optics.grating import GratingOrder
from ..optics.paths import LightPath
from ..optics.region import Region
from .art import Frame, PathArt
from .shot import Shot

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class FinalPass:
    """A path as one light makes it, found worth drawing.

    Attributes
    ----------
    shot : Shot
    path : LightPath
    region : Region
        Accepted pupil and rough estimates, per unit irradiance.
    to_pixels : ndarray, shape (4,)
        The shot's, moved and scaled by `art`.
    view_radius : float
        What lands farther from the axis does not come into the picture, mm.
    art : PathArt
    frame : Frame or None
        The ghost's own centre and size, where `art` asks for them.
    source : ndarray, shape (N, 2), or None
        What the extent of an area light spreads it over: columns and rows from its place.
    detail : int
        How often the resolution may be halved because it is spread.
    orders : tuple of GratingOrder
        Into which the sensor diffracts it; empty for one that is mirrored.
    """

    shot: Shot
    path: LightPath
    region: Region
    to_pixels: Floats
    view_radius: float
    art: PathArt
    frame: Frame | None
    source: Floats | None = None
    detail: int = 0
    orders: tuple[GratingOrder, ...] = ()

    @property
    def alone(self) -> tuple[object, ...]:
        """What ghosts on one plane of their own must share; empty when it needs none."""
        if self.source is None and not self.art.alone:
            return ()
        return (self.detail, None if self.source is None else self.source.tobytes(), self.art.blur)

    @property
    def gain(self) -> float:
        """What makes the path brighter than its region says: the light, and a person's wish."""
        return self.shot.light.intensity * self.shot.incidence.falloff * self.art.visible_gain
