"""One path of one light, with its accepted pupil: an item of the ghost pass in final quality."""

from __future__ import annotations

from dataclasses import dataclass

from ...optics.lens.paths import LightPath
from ...optics.rays.pupil_region import Region
from ...optics.scattering.sensor_grating import GratingOrder
from ...typing import Floats
from ..scene.art_rules import Frame, PathArt
from ..scene.shot import Shot


@dataclass(frozen=True)
class FinalPass:
    """One path of one light that passes light, ready to be drawn.

    Attributes
    ----------
    shot : Shot
    path : LightPath
    region : Region
        Accepted pupil and rough estimates, for unit irradiance.
    to_pixels : ndarray, shape (4,)
        Of the shot, moved and scaled by `art`.
    view_radius : float
        Rays that land farther from the axis miss the picture, mm.
    art : PathArt
    frame : Frame or None
        Centre and size of the ghost, if `art` needs them.
    source : ndarray, shape (N, 5), or None
        The shape over which an area light spreads the ghost: columns and rows relative to its position.
    detail : int
        How often the resolution can be halved because the ghost is spread.
    orders : tuple of GratingOrder
        Diffraction orders of the sensor grating; empty for a mirror reflection.
    least_steps : int
        Least number of drawings from one traced wavelength to the next. A sliver needs two: its throughput is curved
        even there, and interpolated rays show it.
    pictured : ndarray, shape (4,), or None
        Place in the picture of the shot, as `to_pixels`, of a ghost that is drawn on a sheet of another size.
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
    least_steps: int = 1
    pictured: Floats | None = None

    @property
    def in_picture(self) -> Floats:
        """Place of the ghost in the picture of the shot: which rays are seen there decides its colour."""
        return self.to_pixels if self.pictured is None else self.pictured

    @property
    def alone(self) -> tuple[object, ...]:
        """Key of ghosts that can share a separate plane; empty for a ghost that needs no separate plane."""
        if self.source is None and not self.art.alone:
            return ()
        return (self.detail, None if self.source is None else self.source.tobytes(), self.art.blur)

    @property
    def gain(self) -> float:
        """Factor from unit irradiance to the drawn brightness: the light's intensity and falloff, and the art gain."""
        return self.plain_gain * self.art.visible_gain

    @property
    def plain_gain(self) -> float:
        """The same without the art gain."""
        return self.shot.light.intensity * self.shot.incidence.falloff
