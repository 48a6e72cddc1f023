"""Starburst settings besides the iris: dirt in the pupil, and artistic changes."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, StrictBool, field_validator

from ..base import Frozen

Diameter = Annotated[float, Field(gt=0.0, le=5000.0)]


class Dirt(Frozen):
    """Dust, scratches and a fingerprint in the plane of the stop, or a drawn image of dirt.

    Seed and positions in mm determine the pattern, so stopping down shows a smaller part of the same dirt.

    Attributes
    ----------
    dust_per_mm2 : float
        Opaque particles per mm^2 of the stop's plane.
    dust_um : tuple of float
        Least and largest diameter in micrometres, log-uniform: as many particles from 5 to 10 as from 50 to 100.
    scratches_per_cm2 : float
        Scratches per cm^2.
    scratch_um : float
        Their mean width in micrometres; the widest are eight times as wide as the narrowest.
    scratch_mm : float
        Their mean length.
    fingerprint : float
        Fraction of the light that the ridge droplets of one fingerprint block; 0 is no fingerprint.
    image : str or None
        Path of a grey image (PNG or EXR, white transmits) over the square around the round opening.
    seed : int
    in_ghosts : bool
        Whether the dirt also shows inside ghosts, as shadows at the stop.
    """

    dust_per_mm2: float = Field(0.0, ge=0.0, le=200.0)
    dust_um: tuple[Diameter, Diameter] = (5.0, 100.0)
    scratches_per_cm2: float = Field(0.0, ge=0.0, le=1000.0)
    scratch_um: float = Field(20.0, gt=0.0, le=1000.0)
    scratch_mm: float = Field(5.0, gt=0.0, le=200.0)
    fingerprint: float = Field(0.0, ge=0.0, le=1.0)
    image: str | None = None
    seed: int = Field(0, ge=0, lt=2**63)
    in_ghosts: StrictBool = False

    @field_validator("dust_um")
    @classmethod
    def _diameters_rise(cls, dust_um: tuple[float, float]) -> tuple[float, float]:
        if dust_um[0] > dust_um[1]:
            raise ValueError(f"the least diameter {dust_um[0]:g} is above the largest {dust_um[1]:g}")
        return dust_um

    @property
    def clean(self) -> bool:
        """Whether there is no dirt at all."""
        laid = self.dust_per_mm2 > 0.0 or self.scratches_per_cm2 > 0.0 or self.fingerprint > 0.0
        return not laid and self.image is None


class Starburst(Frozen):
    """Drawing of the diffracted direct image; the defaults are physical.

    Attributes
    ----------
    size : float
        Stretches the pattern at constant flux (Hullin et al. 2011, equation 3).
    intensity : float
        Multiplies the layer (Hullin et al. 2011, equation 4).
    spiral_deg : float
        Smears the pattern over this angle while scaling it, which hides residual fringes (greje656's filter); 0: off.
    cats_eye : bool
        Clip the pupil by the rims and foreshorten it for the light's field angle. False: the iris alone.
    """

    size: float = Field(1.0, ge=0.001, le=1000.0)
    intensity: float = Field(1.0, ge=0.0, le=1e9)
    spiral_deg: float = Field(0.0, ge=0.0, le=90.0)
    cats_eye: StrictBool = False
