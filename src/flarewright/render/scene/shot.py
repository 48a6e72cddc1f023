"""A shot: one light and the settled lens, with all data that the passes share."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from math import isfinite
from typing import Any, Protocol

import numpy as np

from ...model import Light
from ...model.lens.grating import SensorGrating
from ...model.project.camera import Colorspace
from ...model.project.light import Spectrum
from ...optics.colour.spectrum import band_parts, band_weights, hats
from ...optics.lens.paths import LightPath
from ...optics.rays.bundle import Bundle, Incidence, incidence
from ...optics.rays.pack import PackedLens, facing
from ...optics.rays.path_reflectance import CURVE_NM, BandCurves, PathSpectrum
from ...typing import Floats
from .between_wavelengths import Between
from .opening import Opening


class RingMaker(Protocol):
    """Interface of the diffraction in ghosts, implemented by `ghosts.diffraction_rings.Ringing`."""

    @property
    def form(self) -> Any:
        """Shape of the blades if their patterns come from tables, or None."""

    def of(
        self,
        packed: PackedLens,
        path: LightPath,
        light: Light,
        bundle: Bundle,
        pixels_per_mm: tuple[float, float],
        nearness: float = 0.0,
        blur_px: tuple[float, float] = (1.0, 1.0),
    ) -> Any:
        """Return the rings of a ghost, or None if it shows none."""


@dataclass(frozen=True)
class Shot:
    """One light, or one part of an area light, ready to be drawn.

    Attributes
    ----------
    light : Light
        As drawn: for an area light, a point at the centre of one part.
    incidence : Incidence
    packed : PackedLens
        At the traced wavelengths of this light.
    opening : Opening
    to_pixels : ndarray, shape (4,)
        Column and row of the axis, pixels per mm across and down.
    size_px : tuple of int
    colorspace : {"rec709", "acescg"}
    ringing : RingMaker or None
        Diffraction at the iris inside ghosts; None: not drawn.
    number : int
        Index of the project's light.
    share : float
        Part of that light, 0 to 1.
    border : ndarray, shape (N, 5), or None
        Border of the part, or of its visible area (`optics.pupil.polygon`), in slopes (tan X, tan Y) relative to the
        traced direction; None for a point.
    grating : SensorGrating or None
        Grating formed by the sensor's pixels, which diffracts reflected light.
    curves : BandCurves or None
        Coating curves between the traced wavelengths; rays then carry means over bands. None: rays carry the
        reflectances at the traced wavelengths, and colours are interpolated linearly.
    between : Between or None
        The lens at other wavelengths; None if the spectrum has no light there or none is drawn.
    dense : bool
        Whether the wavelengths sample all visible light (`optics.colour.spectrum.sampled_wavelengths`), so that colours
        are interpolated cubically.
    scale : float
        Factor on the light that is drawn: 1 for flux per pixel, the inverse of the pixel area for irradiance.
    """

    light: Light
    incidence: Incidence
    packed: PackedLens
    opening: Opening
    to_pixels: Floats
    size_px: tuple[int, int]
    colorspace: Colorspace
    ringing: RingMaker | None = None
    number: int = 0
    share: float = 1.0
    border: Floats | None = None
    grating: SensorGrating | None = None
    curves: BandCurves | None = None
    between: Between | None = None
    dense: bool = False
    scale: float = 1.0

    @property
    def gain(self) -> float:
        """Irradiance at the plane of the first vertex, times `scale`."""
        return self.light.intensity * self.incidence.cosine * self.scale

    @property
    def pixel_area(self) -> float:
        """Area of a pixel, mm^2."""
        return 1.0 / float(self.to_pixels[2] * self.to_pixels[3])

    @property
    def working_f_number(self) -> float:
        """Distance of the sensor from the exit pupil over its diameter: at infinity the f-number, larger at near focus.

        The cone of light behind the lens has this ratio, so it sets the exposure and the size of the diffraction
        pattern (docs/physics.md, "Radiometry").
        """
        order = self.packed.first_order
        if not isfinite(order.exit_pupil_z):
            return order.f_number
        return abs(self.packed.sensor_z - order.exit_pupil_z) / order.exit_pupil_diameter

    @property
    def view_radius(self) -> float:
        """Half diagonal of the picture on the sensor, mm."""
        half_width = 0.5 * self.size_px[0] / self.to_pixels[2]
        return float(np.hypot(half_width, 0.5 * self.size_px[1] / self.to_pixels[3]))

    def weights(self, wavelengths_nm: Floats, spectrum: PathSpectrum | None = None) -> Floats:
        """Return the RGB weights of wavelengths for this light, shape (N, 3), or (P, N, 3) for P paths.

        Parameters
        ----------
        wavelengths_nm : ndarray, shape (N,)
            The traced wavelengths, or wavelengths between them at which rays are interpolated.
        spectrum : PathSpectrum, optional
            What the path passes; None: linear or cubic between the traced wavelengths, by `dense`.

        Returns
        -------
        ndarray
            For each wavelength, the colour of the light that passes in its band, divided by what rays carry there.
        """
        look = self.light.spectrum, tuple(wavelengths_nm), self.colorspace
        if spectrum is None:
            return _weights(*look, self.dense)
        carried = carried_at(self, spectrum, wavelengths_nm)
        # `tensordot` would use a threaded library, whose threads compete with ours
        weights: Floats = np.einsum("...l,lwc->...wc", spectrum.passed, _parts(*look))
        return np.divide(weights, carried[..., None], out=np.zeros_like(weights), where=carried[..., None] > 0.0)


def carried_at(shot: Shot, spectrum: PathSpectrum, wavelengths_nm: Floats) -> Floats:
    """Interpolate what rays carry at some wavelengths, shape (N,) or (P, N)."""
    traced_nm = shot.packed.wavelengths_nm
    if len(wavelengths_nm) == len(traced_nm):
        return spectrum.carried
    return spectrum.carried @ hats(wavelengths_nm, traced_nm)


def seen_light(shot: Shot) -> Floats:
    """Return the weights of a shot's light in the channels, shape (L, 3), at `CURVE_NM`."""
    one_nm = float(CURVE_NM[len(CURVE_NM) // 2])
    return _parts(shot.light.spectrum, (one_nm,), shot.colorspace)[:, 0]


def moved(shot: Shot, slope: Floats) -> Shot:
    """Return a shot with its light in another direction.

    Parameters
    ----------
    shot : Shot
    slope : ndarray, shape (2,)
        tan X and tan Y of the field angles.

    Returns
    -------
    Shot
        With a point light.
    """
    x, y = (float(angle) for angle in np.degrees(np.arctan(slope)))
    light = shot.light.replace(field_deg=(x, y))
    seen = incidence((x, y), light.distance, shot.packed.first_order.entrance_pupil_z)
    packed = facing(shot.packed, seen.axes, seen.nearness)
    return replace(shot, light=light, incidence=seen, packed=packed, border=None)


def at_fine_wavelengths(shot: Shot) -> Shot:
    """Return a shot at the wavelengths of its `between`."""
    assert shot.between is not None, "no light between the traced wavelengths"
    packed, bands = shot.between.finer
    seen = shot.incidence
    return replace(shot, packed=facing(packed, seen.axes, seen.nearness), curves=bands, between=None)


@lru_cache(maxsize=512)
def _weights(spectrum: Spectrum, wavelengths_nm: tuple[float, ...], colorspace: Colorspace, cubic: bool) -> Floats:
    return band_weights(spectrum, np.array(wavelengths_nm), colorspace, cubic=cubic)


@lru_cache(maxsize=256)
def _parts(spectrum: Spectrum, wavelengths_nm: tuple[float, ...], colorspace: Colorspace) -> Floats:
    return band_parts(spectrum, np.array(wavelengths_nm), colorspace, CURVE_NM)
