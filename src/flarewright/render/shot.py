"""One light seen through a settled lens: everything the passes share."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..model import Light
from ..model.camera import Colorspace
from ..model.grating import SensorGrating
from ..model.light import Spectrum
from ..optics.bundle import Incidence, incidence
from ..optics.coating_curves import CURVE_NM, BandCurves, PathSpectrum
from ..optics.pack import PackedLens, facing
from ..optics.spectrum import band_parts, band_weights, hats
from .between import Between
from .opening import Opening

if TYPE_CHECKING:
    from .ringing import Ringing

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Shot:
    """One light, ready to be drawn.

    Attributes
    ----------
    light : Light
        As it is drawn: of an area light one part, a point.
    incidence : Incidence
    packed : PackedLens
        At the wavelengths traced for this light.
    opening : Opening
    to_pixels : ndarray, shape (4,)
        Column and row of the axis, pixels per mm across and down.
    size_px : tuple of int
    colorspace : {"rec709", "acescg"}
    ringing : Ringing or None
        How ghosts show the diffraction at the iris; None: not at all.
    number : int
        Which of the project's lights it is, or is a part of.
    share : float
        Its part of that light.
    border : ndarray, shape (N, 5), or None
        Of the part, or of what is seen of it (`optics.border`), in slopes (tan X, tan Y) from its own; None for a
        point.
    grating : SensorGrating or None
        What the sensor's pixels make of the light that it reflects.
    curves : BandCurves or None
        What coatings do between the traced wavelengths, whose rays carry the means over bands; None where rays carry
        the reflectances at the traced wavelengths, and colours between them are straight.
    between : Between or None
        The lens between the traced wavelengths; None where there is no light, or none is drawn.
    """

    light: Light
    incidence: Incidence
    packed: PackedLens
    opening: Opening
    to_pixels: Floats
    size_px: tuple[int, int]
    colorspace: Colorspace
    ringing: Ringing | None = None
    number: int = 0
    share: float = 1.0
    border: Floats | None = None
    grating: SensorGrating | None = None
    curves: BandCurves | None = None
    between: Between | None = None

    @property
    def gain(self) -> float:
        """Irradiance on the plane of the first vertex."""
        return self.light.intensity * self.incidence.cosine

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
            The traced ones, and any between them where what rays carry is interpolated.
        spectrum : PathSpectrum, optional
            What the path lets pass; None: what is straight between the wavelengths.

        Returns
        -------
        ndarray
            For each wavelength the colour of its band's light that passes, over what rays carry there.
        """
        look = self.light.spectrum, tuple(wavelengths_nm), self.colorspace
        if spectrum is None:
            return _weights(*look)
        carried = carried_at(self, spectrum, wavelengths_nm)
        # not `tensordot`: its library's threads wait busily beside ours
        weights: Floats = np.einsum("...l,lwc->...wc", spectrum.passed, _parts(*look))
        return np.divide(weights, carried[..., None], out=np.zeros_like(weights), where=carried[..., None] > 0.0)


def carried_at(shot: Shot, spectrum: PathSpectrum, wavelengths_nm: Floats) -> Floats:
    """Interpolate what rays carry between the traced wavelengths, shape (N,) or (P, N)."""
    traced_nm = shot.packed.wavelengths_nm
    if len(wavelengths_nm) == len(traced_nm):
        return spectrum.carried
    carried: Floats = spectrum.carried @ hats(wavelengths_nm, traced_nm)
    return carried


def moved(shot: Shot, slope: Floats) -> Shot:
    """Put a shot's light elsewhere.

    Parameters
    ----------
    shot : Shot
    slope : ndarray, shape (2,)
        tan X and tan Y of the field angles.

    Returns
    -------
    Shot
        A point.
    """
    x, y = (float(angle) for angle in np.degrees(np.arctan(slope)))
    light = shot.light.replace(field_deg=(x, y))
    seen = incidence((x, y), light.distance, shot.packed.first_order.entrance_pupil_z)
    packed = facing(shot.packed, seen.axes, seen.nearness)
    return replace(shot, light=light, incidence=seen, packed=packed, border=None)


def finer(shot: Shot) -> Shot:
    """Return a shot at the many wavelengths that its `between` has."""
    assert shot.between is not None, "no light between the traced wavelengths"
    packed, bands = shot.between.finer
    seen = shot.incidence
    return replace(shot, packed=facing(packed, seen.axes, seen.nearness), curves=bands, between=None)


@lru_cache(maxsize=512)
def _weights(spectrum: Spectrum, wavelengths_nm: tuple[float, ...], colorspace: Colorspace) -> Floats:
    return band_weights(spectrum, np.array(wavelengths_nm), colorspace)


@lru_cache(maxsize=256)
def _parts(spectrum: Spectrum, wavelengths_nm: tuple[float, ...], colorspace: Colorspace) -> Floats:
    return band_parts(spectrum, np.array(wavelengths_nm), colorspace, CURVE_NM)
