"""The values of a plate that count for its lights: primaries converted, clipped highlights expanded, mattes applied."""

from __future__ import annotations

import numpy as np

from ..io.images.plate_picture import PlatePicture
from ..model.project.camera import Colorspace
from ..optics.colour.rgb import xyz_to_rgb_matrix
from ..typing import Floats, Pixels


def converted(plate: PlatePicture, colorspace: Colorspace) -> Pixels:
    """Return the pixels of a plate with the primaries of a colour space.

    Parameters
    ----------
    plate : PlatePicture
        Without stated primaries it counts as Rec.709.
    colorspace : {"rec709", "acescg"}
    """
    stated: Colorspace = plate.colorspace or "rec709"
    if stated == colorspace:
        return plate.pixels
    matrix = _matrix(stated, colorspace).astype(np.float32)
    return plate.pixels @ matrix.T


def _matrix(source: Colorspace, target: Colorspace) -> Floats:
    return xyz_to_rgb_matrix(target) @ np.linalg.inv(xyz_to_rgb_matrix(source))


def expanded(values: Pixels, highlights: float, white: float = 1.0) -> Pixels:
    """Expand display values, in which a shoulder has compressed bright lights.

    Parameters
    ----------
    values : ndarray
        Linear, 0 to `white`.
    highlights : float
        Value that white stands for.
    white : float
        Value at which the plate clips.

    Returns
    -------
    ndarray
        x / (1 - a x) with a = 1 / `white` - 1 / `highlights`: the inverse of the shoulder y = x / (1 + a x), which
        leaves dark values as they are.

    Examples
    --------
    >>> expanded(np.array([0.01, 0.5, 1.0], np.float32), 50.0).round(3).tolist()
    [0.009999999776482582, 0.9800000190734863, 50.0]
    """
    part = np.clip(values, 0.0, white)
    return (part / (1.0 - np.float64(1.0 / white - 1.0 / highlights) * part)).astype(np.float32)


def measured_pixels(plate: PlatePicture, highlights: float | None) -> Pixels:
    """Return linear Rec.709 values for the search of sources.

    Parameters
    ----------
    plate : PlatePicture
    highlights : float or None
        As of `expanded`, for plates that clip.
    """
    pixels = converted(plate, "rec709")
    return pixels if highlights is None or plate.white is None else expanded(pixels, highlights, plate.white)
