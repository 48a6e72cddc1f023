"""What of a measured flare counts as flare: its ghosts, and all else but the light's own image.

Star, halo and what is left around the light hold the light's own image, and photographs of one light do not tell them
apart. So near the light only ghosts count, and farther out everything.
"""

from __future__ import annotations

from math import ceil
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..model.ghost_model import GhostModel
from ..model.layer import Layer
from .blocks import reduced
from .dimmed import AROUND_LIGHT
from .numbers import fit_in
from .replay import light_px, replay

Floats = NDArray[np.float64]

# pixels are drawn so many times finer to each side and averaged, at least and at most: what lies between two pixels'
# middles would be missed. A spike is as wide as so many standard deviations
_FINER, _FINEST, _SPIKE = 2, 4, 1.5
# of a row of pixels; a disc is cut from each as a rectangle
_STRIPS = 4


def counted(
    model: GhostModel,
    constellation_deg: float,
    *,
    roll_deg: float = 0.0,
    size_px: tuple[int, int],
    around: float = AROUND_LIGHT,
    gain: float = 1.0,
    colors: Literal["camera", "rec709"] = "camera",
) -> tuple[Layer, ...]:
    """Draw what counts of a measured flare.

    Parameters
    ----------
    model : GhostModel
    constellation_deg, roll_deg : float
    size_px : tuple of int
    around : float
        How far around the light's image only ghosts count, part of the picture's width.
    gain, colors
        As `replay` takes them.

    Returns
    -------
    tuple of Layer
        "ghosts", and as "scatter" all else beyond that distance; pixels are means over their squares, and their sum is
        not below 0 in the camera's colours.

    Raises
    ------
    FlarewrightError
        As `replay`.
    """
    (width, height), finer = size_px, _finer(model, size_px[0])
    fine = width * finer, height * finer
    layers = {
        layer.name: layer.pixels
        for layer in replay(model, constellation_deg, roll_deg=roll_deg, size_px=fine, gain=gain, colors=colors)
    }
    scale, top = fit_in(model, fine)
    x, y = light_px(model, constellation_deg, roll_deg)
    own = within((x * scale, y * scale + top), around * fine[0], fine)
    beyond = (layers["beauty"] - layers["ghosts"]) * (1.0 - own[..., None])
    return tuple(
        Layer(name, reduced(pixels, finer).astype(np.float32), (0, 0, width, height))
        for name, pixels in (("ghosts", layers["ghosts"]), ("scatter", beyond))
    )


def nothing_beyond(model: GhostModel) -> float:
    """Return the part of a picture's width from which on nothing lies farther away from a light in its middle."""
    width, height = model.size_px
    return 0.5 * float(np.hypot(1.0, height / width))


def within(middle_px: tuple[float, float], radius_px: float, size_px: tuple[int, int]) -> Floats:
    """Compute how much of each pixel lies in a disc.

    Parameters
    ----------
    middle_px : tuple of float
        (x, y), anywhere.
    radius_px : float
    size_px : tuple of int
        Width and height.

    Returns
    -------
    ndarray, shape (H, W)
        0 to 1: it changes evenly with the disc's place, so that sums over pixels do.
    """
    width, height = size_px
    down = (np.arange(_STRIPS * height) + 0.5) / _STRIPS - middle_px[1]
    half = np.sqrt(np.maximum(radius_px**2 - down**2, 0.0))[:, None]
    covered = np.diff(np.clip(np.arange(width + 1) - middle_px[0], -half, half), axis=1)
    return np.asarray(covered.reshape(height, _STRIPS, width).mean(axis=1))


def _finer(model: GhostModel, width_px: int) -> int:
    """Return how many times finer pixels are drawn to each side, so that none is wider than a spike of the star."""
    if model.star is None:
        return _FINER
    needed = ceil(model.size_px[0] / width_px / (_SPIKE * model.star.width_px))
    return min(max(needed, _FINER), _FINEST)
