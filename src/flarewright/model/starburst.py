"""What shapes the starburst besides the iris: dirt in the pupil, and the artist's hand."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, StrictBool, field_validator

from .base import Frozen

Diameter = Annotated[float, Field(gt=0.0, le=5000.0)]


class Dirt(Frozen):
    """Dust, scratches and a fingerprint in the plane of the stop, or a drawn image of dirt.

    What is laid where follows from the seed and from places in mm, so stopping down shows less of the same dirt.

    Attributes
    ----------
    dust_per_mm2 : float
        Opaque specks per mm^2 of the stop's plane.
    dust_um : tuple of float
        Least and largest diameter in micrometres; as many specks between 5 and 10 as between 50 and 100.
    scratches_per_cm2 : float
        Scratches per cm^2.
    scratch_um : float
        Their mean width in micrometres; the widest are eight times as wide as the narrowest.
    scratch_mm : float
        Their mean length.
    fingerprint : float
        Part of the light that the ridges' droplets of one fingerprint take; 0 is no fingerprint.
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
    """How the diffracted direct image is drawn; the defaults are physics and change nothing.

    Attributes
    ----------
    size : float
        Stretches the pattern, its flux kept (Hullin et al. 2011, equation 3).
    intensity : float
        Multiplies the layer (Hullin et al. 2011, equation 4).
    spiral_deg : float
        Smears the pattern over this angle while it grows by as much, which hides fringes that are left (greje656's
        filter); 0 is none.
    cats_eye : bool
        Take the pupil as the light at that field angle finds it: clipped by rims, foreshortened. False: the iris alone.
    """

    size: float = Field(1.0, gt=0.0, le=1000.0)
    intensity: float = Field(1.0, ge=0.0, le=1e9)
    spiral_deg: float = Field(0.0, ge=0.0, le=90.0)
    cats_eye: StrictBool = False
