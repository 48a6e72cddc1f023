"""Holdouts: images or depth plates of objects between the lights and the lens."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, StrictBool, model_validator

from ..base import Frozen

Part = Annotated[float, Field(ge=0.01, le=1.0)]


class Holdout(Frozen):
    """An image in the picture's frame that defines what hides lights.

    Attributes
    ----------
    image : str or None
        Path of an image (PNG or EXR, grey): white lets light through, black hides it.
    depth : str or None
        Path of an EXR depth plate instead: objects nearer than the light hide it. 0, infinity and the largest half
        float mean no object.
    depth_unit_mm : float
        Length of a depth of 1, mm; 1000 for metres.
    invert : bool
        White hides instead of black, as in the alpha channel of a foreground object.
    overscan : float
        Width and height of the image relative to the frame's, around the same centre.
    frame : tuple of float
        Parts of the picture's width and height that the frame has, around the same centre; below 1 in a picture with
        overscan.
    """

    image: str | None = None
    depth: str | None = None
    depth_unit_mm: float = Field(1000.0, gt=0.0, le=1e9)
    invert: StrictBool = False
    overscan: float = Field(1.0, ge=1.0, le=100.0)
    frame: tuple[Part, Part] = (1.0, 1.0)

    @model_validator(mode="after")
    def _one_plate(self) -> Holdout:
        if (self.image is None) == (self.depth is None):
            raise ValueError("a holdout is an image or a depth plate; give one of them")
        if self.invert and self.depth is not None:
            raise ValueError("invert is for an image; in a depth plate, the depth decides what hides a light")
        return self
