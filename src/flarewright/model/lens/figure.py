"""Figure error: departure of a real surface from its ideal form."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from ..base import Frozen

MOST_NOLL = 28
"""Largest Noll index: all terms up to the sixth power of the radius."""

LARGEST_NM = 1e5

Amplitude = Annotated[float, Field(ge=-LARGEST_NM, le=LARGEST_NM)]


class Figure(Frozen):
    """Height of a real surface above its ideal form, along the axis, over its semi-diameter.

    Attributes
    ----------
    zernike_nm : tuple of (int, float)
        Noll's index, 2 to 28, and the term's root mean square over the clear aperture, nm; signed.
    image : str or None
        Path of a grey image that spans the square around the clear aperture; seen from behind the camera, row 0 up.
    peak_valley_nm : float or None
        Height from black to white of the image.
    heights : tuple of tuple of float or None
        The image as read: rows from x = -semi_diameter to +semi_diameter, each from -y to +y, black 0 and white 1.
        Not written to files.
    """

    zernike_nm: tuple[tuple[Annotated[int, Field(ge=2, le=MOST_NOLL)], Amplitude], ...] = ()
    image: str | None = None
    peak_valley_nm: Amplitude | None = None
    heights: tuple[tuple[float, ...], ...] | None = Field(None, exclude=True, repr=False)

    @model_validator(mode="after")
    def _image_has_a_height(self) -> Figure:
        if (self.image is None) != (self.peak_valley_nm is None):
            raise ValueError("an image needs peak_valley_nm, its height from black to white, and the other way round")
        return self
