"""The part of a measured flare that counts as flare: its ghosts, and all other light except the light's own image.

Star, halo and residual around the light include the light's own image, and photographs of one light cannot separate
them. Therefore only ghosts count near the light, and all light counts beyond.
"""

from __future__ import annotations

from math import ceil
from typing import Literal

import numpy as np

from ...model.layer import Layer
from ...model.measurement.ghost_model import GhostModel
from ...typing import Floats
from ..core.binning import binned
from ..core.parameter_vector import fit_in
from ..glow.subtraction import AROUND_LIGHT
from .model_image import light_px, replay_model

# least and largest oversampling per axis, as detail between pixel centres would be missed otherwise; width of a spike
# in standard deviations
_FINER, _FINEST, _SPIKE = 2, 4, 1.5
# strips per row of pixels; in each strip a disc is cut as a rectangle
_STRIPS = 4


def counted_flare(
    model: GhostModel,
    constellation_deg: float,
    *,
    roll_deg: float = 0.0,
    size_px: tuple[int, int],
    around: float = AROUND_LIGHT,
    gain: float = 1.0,
    colors: Literal["camera", "rec709"] = "camera",
) -> tuple[Layer, ...]:
    """Draw the light of a measured flare that counts as flare.

    Parameters
    ----------
    model : GhostModel
    constellation_deg, roll_deg : float
    size_px : tuple of int
    around : float
        Radius around the light's image within which only ghosts count, part of the picture's width.
    gain, colors
        As for `replay_model`.

    Returns
    -------
    tuple of Layer
        "ghosts", and as "scatter" all other light beyond that radius. Pixels are means over their squares, and the sum
        of both is not negative in the camera's colours.

    Raises
    ------
    FlarewrightError
        As for `replay_model`.
    """
    (width, height), finer = size_px, _finer(model, size_px[0])
    fine = width * finer, height * finer
    layers = {
        layer.name: layer.pixels
        for layer in replay_model(model, constellation_deg, roll_deg=roll_deg, size_px=fine, gain=gain, colors=colors)
    }
    scale, top = fit_in(model, fine)
    x, y = light_px(model, constellation_deg, roll_deg)
    own = _within_disc((x * scale, y * scale + top), around * fine[0], fine)
    beyond = (layers["beauty"] - layers["ghosts"]) * (1.0 - own[..., None])
    return tuple(
        Layer(name, binned(pixels, finer).astype(np.float32), (0, 0, width, height))
        for name, pixels in (("ghosts", layers["ghosts"]), ("scatter", beyond))
    )


def nothing_beyond(model: GhostModel) -> float:
    """Return the largest distance from a light in the middle of a picture, part of its width."""
    width, height = model.size_px
    return 0.5 * float(np.hypot(1.0, height / width))


def _within_disc(middle_px: tuple[float, float], radius_px: float, size_px: tuple[int, int]) -> Floats:
    """Return the part of each pixel, shape (H, W), that a disc covers; sums are continuous in its position."""
    width, height = size_px
    down = (np.arange(_STRIPS * height) + 0.5) / _STRIPS - middle_px[1]
    half = np.sqrt(np.maximum(radius_px**2 - down**2, 0.0))[:, None]
    covered = np.diff(np.clip(np.arange(width + 1) - middle_px[0], -half, half), axis=1)
    return np.asarray(covered.reshape(height, _STRIPS, width).mean(axis=1))


def _finer(model: GhostModel, width_px: int) -> int:
    """Return the oversampling per axis at which no sample is wider than a spike of the star."""
    if model.star is None:
        return _FINER
    needed = ceil(model.size_px[0] / width_px / (_SPIKE * model.star.width_px))
    return min(max(needed, _FINER), _FINEST)
