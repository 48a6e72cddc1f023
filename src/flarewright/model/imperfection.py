"""What assembly and polishing leave: tolerances, and a seed that chooses one sample within them."""

from __future__ import annotations

from pydantic import Field

from .base import Frozen


class Imperfection(Frozen):
    """One sample of a lens as it comes from the factory.

    Attributes
    ----------
    seed : int
        Which sample.
    decentre_um : float
        Each glass, or group of cemented glasses, is moved by up to this, in any direction across the axis.
    tilt_arcmin : float
        And turned by up to this about any axis across its own, at its first vertex.
    figure_nm : float
        Each surface departs from its form by up to this root mean square, in low-order Zernike terms.
    ghost_offset_mm : float
        Each ghost is moved on the sensor by chance, with this standard deviation along either axis: an artist's
        stand-in for all of the above, so the picture is no longer physical (Hullin et al. 2011, section 7, "Imperfect
        Symmetries").
    """

    seed: int = Field(ge=0, le=2**63 - 1)
    decentre_um: float = Field(10.0, ge=0.0, le=1e4)
    tilt_arcmin: float = Field(1.0, ge=0.0, le=600.0)
    figure_nm: float = Field(0.0, ge=0.0, le=1e4)
    ghost_offset_mm: float = Field(0.0, ge=0.0, le=100.0)
