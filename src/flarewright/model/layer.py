"""A named picture: what passes make, compose adds and files hold."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Layer:
    """One linear, scene-referred picture of irradiance on the sensor.

    Attributes
    ----------
    name : str
        "beauty", "starburst", "ghosts", or "ghost.J-I" for a single path; four reflections are in
        "ghosts.order4" and "ghost.J-I-K-L"; reference quality has "ghosts.order4+", and ".variance" behind a name holds
        the variance of its pixels.
    pixels : ndarray, shape (height, width, 3), float32
        RGB inside the window; row 0 is the top of the upright picture.
    window : tuple of int
        (x, y, width, height) of the pixels within the picture; outside it the layer is 0.
    about : dict of str to str or float
        Facts that go into the file beside the pixels.
    """

    name: str
    pixels: NDArray[np.float32]
    window: tuple[int, int, int, int]
    about: dict[str, str | float] = field(default_factory=dict)
