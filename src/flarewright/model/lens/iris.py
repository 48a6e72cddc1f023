"""The iris: shape of the opening in the stop."""

from __future__ import annotations

from pydantic import Field, field_validator

from ..base import Frozen


class Iris(Frozen):
    """Shape of the opening at the stop; its size comes from the f-number.

    Blades make a regular polygon of the same area as the round opening of that f-number, so blades change the shape
    of a ghost and not the exposure. Seen from behind the camera, first blade edge up.

    Attributes
    ----------
    blades : int
        0 is a round opening; 3 to 24 blades otherwise.
    rotation_deg : float
        Turns the blades counter-clockwise in the upright picture.
    rounding : float
        0 straight edges, 1 a full circle.
    mask : str or None
        Path of an image (PNG or EXR, grey; white transmits) that replaces the blades. Its inscribed circle
        is the round opening of the f-number.
    roughness_um : float
        RMS deviation of the blade edges from their ideal line, micrometres; affects the starburst. 0 is smooth.
    roughness_length_um : float
        Correlation length of that deviation along the edge, micrometres.
    roughness_seed : int
    """

    blades: int = Field(0, ge=0, le=24)
    rotation_deg: float = Field(0.0, ge=-360.0, le=360.0)
    rounding: float = Field(0.0, ge=0.0, le=1.0)
    mask: str | None = None
    roughness_um: float = Field(0.0, ge=0.0, le=1000.0)
    roughness_length_um: float = Field(200.0, gt=0.0, le=100000.0)
    roughness_seed: int = Field(0, ge=0, lt=2**63)

    @field_validator("blades")
    @classmethod
    def _blades_make_an_opening(cls, blades: int) -> int:
        if blades in (1, 2):
            raise ValueError("an iris has 0 blades (round) or at least 3")
        return blades
