"""Manufacturing tolerances of a lens, and the seed that selects one sample."""

from __future__ import annotations

from pydantic import Field

from ..base import Frozen


class Imperfection(Frozen):
    """One manufactured sample of a lens.

    Attributes
    ----------
    seed : int
        Selects the sample.
    decentre_um : float
        Largest shift of each lens or cemented group, in any direction perpendicular to the axis.
    tilt_arcmin : float
        Largest tilt of each lens or cemented group, about any axis perpendicular to its own, at its first vertex.
    figure_nm : float
        Largest root mean square of each surface's figure error, in low-order Zernike terms.
    ghost_offset_mm : float
        Standard deviation of a random shift of each ghost on the sensor, along either axis. It is an artistic
        substitute for all of the above, so the image is no longer physical (Hullin et al. 2011, section 7, "Imperfect
        Symmetries").
    """

    seed: int = Field(ge=0, le=2**63 - 1)
    decentre_um: float = Field(10.0, ge=0.0, le=1e4)
    tilt_arcmin: float = Field(1.0, ge=0.0, le=600.0)
    figure_nm: float = Field(0.0, ge=0.0, le=1e4)
    ghost_offset_mm: float = Field(0.0, ge=0.0, le=100.0)
