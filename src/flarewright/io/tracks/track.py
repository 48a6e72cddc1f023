"""Places of lights in a picture over time."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from ...typing import Floats, Mask

Origin = Literal["top-left", "bottom-left"]
"""The corner of the picture from which pixels count. The centre of its pixel is (0.5, 0.5)."""


@dataclass(frozen=True, eq=False)
class Track:
    """The path of one light through a picture.

    Attributes
    ----------
    name : str
    frames : ndarray, shape (N,)
        Rising numbers of frames, usually whole.
    places : ndarray, shape (N, 2)
        Pixels right of and below the top left corner, or above the bottom left one.
    origin : {"top-left", "bottom-left"}
    size_px : tuple of float or None
        Width and height of the picture in which the places count; (1, 1) for parts of the picture. None: unknown.
    intensity : ndarray, shape (N,), or None
        Irradiance of the light.
    rgb : ndarray, shape (N, 3), or None
        Its colour, linear Rec.709.
    directions : ndarray, shape (N, 2), or None
        Of a light in a 3D scene: tan X and tan Y of its field angles.
    hidden : ndarray, shape (N,), or None
        Frames in which the light is off or behind the camera.
    diameter_deg : float
        Largest angular diameter of the light, at most 60; 0 for a point or if unknown.
    """

    name: str
    frames: Floats
    places: Floats
    origin: Origin = "top-left"
    size_px: tuple[float, float] | None = None
    intensity: Floats | None = None
    rgb: Floats | None = None
    directions: Floats | None = None
    hidden: Mask | None = None
    diameter_deg: float = 0.0

    def from_top_left(self, size_px: tuple[float, float]) -> Floats:
        """Return the places from the top left corner in a picture of another size, shape (N, 2).

        Parameters
        ----------
        size_px : tuple of float
            Width and height; also the size of the track's picture if that is unknown.
        """
        own = np.array(self.size_px or size_px, dtype=np.float64)
        parts = self.places / own
        if self.origin == "bottom-left":
            parts = np.column_stack([parts[:, 0], 1.0 - parts[:, 1]])
        return np.asarray(parts * size_px)

    def shifted(self, frames: float) -> Track:
        """Return the track with a number added to its frames."""
        return replace(self, frames=self.frames + frames)


@dataclass(frozen=True)
class TrackFile:
    """What a file of tracks holds.

    Attributes
    ----------
    tracks : tuple of Track
        At least one.
    format : str
        Name of the format, as of `--track-format`.
    fps : float or None
        Frames per second, if the file states them.
    remarks : tuple of str
    """

    tracks: tuple[Track, ...]
    format: str
    fps: float | None = None
    remarks: tuple[str, ...] = ()
