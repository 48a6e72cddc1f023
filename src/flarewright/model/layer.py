"""A named linear image: render passes return layers, compose adds them, image files store them."""

from __future__ import annotations

from dataclasses import dataclass, field

from ..typing import Pixels


@dataclass(frozen=True)
class Layer:
    """One linear, scene-referred image of irradiance on the sensor.

    Attributes
    ----------
    name : str
        "beauty", "starburst", "ghosts", or "ghost.J-I" for a single path. Four-reflection ghosts are in
        "ghosts.order4" and "ghost.J-I-K-L". Reference quality has "ghosts.order4+". The suffix ".variance" marks the
        variance of the pixels of a layer.
    pixels : ndarray, shape (height, width, 3), float32
        RGB inside the window; row 0 is the top of the upright image.
    window : tuple of int
        (x, y, width, height) of the pixels within the full image; the layer is 0 outside it.
    about : dict of str to str or float
        Metadata written to the file with the pixels.
    """

    name: str
    pixels: Pixels
    window: tuple[int, int, int, int]
    about: dict[str, str | float] = field(default_factory=dict)
