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
    # thousands of numbers tell nothing in a terminal
    pixels: Pixels = field(repr=False)
    window: tuple[int, int, int, int]
    about: dict[str, str | float] = field(default_factory=dict)


def part_inside(window: tuple[int, int, int, int], size_px: tuple[int, int]) -> tuple[int, int, int, int]:
    """Return the part of a window that lies inside a picture.

    Parameters
    ----------
    window : tuple of int
        x, y, width, height.
    size_px : tuple of int
        Width and height of the picture.

    Returns
    -------
    left, top, right, bottom : int
        Right is at most left, or bottom at most top, where no part is inside.
    """
    x, y, width, height = window
    return max(x, 0), max(y, 0), min(x + width, size_px[0]), min(y + height, size_px[1])
