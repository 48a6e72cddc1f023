"""What stands between the lights and the lens."""

from __future__ import annotations

from pydantic import Field, StrictBool, model_validator

from .base import Frozen


class Holdout(Frozen):
    """An image in the picture's frame that says what hides lights.

    Attributes
    ----------
    image : str or None
        Path of an image (PNG or EXR, grey): white lets light through, black hides it.
    depth : str or None
        Path of an EXR depth plate instead: what it shows nearer than a light hides it. 0, infinity and the largest half
        float mean that nothing is there.
    depth_unit_mm : float
        What a depth of 1 is; 1000 for metres.
    invert : bool
        The image's white hides instead, as the alpha of what stands in front does.
    overscan : float
        The image covers so many times the picture's width and height, around the same middle.
    """

    image: str | None = None
    depth: str | None = None
    depth_unit_mm: float = Field(1000.0, gt=0.0, le=1e9)
    invert: StrictBool = False
    overscan: float = Field(1.0, ge=1.0, le=100.0)

    @model_validator(mode="after")
    def _one_plate(self) -> Holdout:
        if (self.image is None) == (self.depth is None):
            raise ValueError("a holdout is an image or a depth plate; give one of them")
        if self.invert and self.depth is not None:
            raise ValueError("invert is for an image; of a depth plate what is nearer than the light hides it")
        return self
