"""The comp: a plate with its flare.

The plate shows the light sources already, as the camera has imaged them. So inside the found areas the starburst, whose
core is the direct image of the light, is left out; everywhere else all passes add. Where the plate is known to show a
light too dark, because it clips, the brighter of both images is shown: else a dark disc lies in a bright starburst.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.ndimage import maximum_filter, uniform_filter

from ..model import Layer
from ..typing import Pixels
from .detection import plate_luminance

STARBURST = "starburst"
"""Name of the layer that shows the light itself."""

# pixels by which the mask of the sources grows, and over which its edge is soft
_GROW_PX, _SOFT_PX = 1, 3


def source_mask(pixels: Pixels, threshold: float, matte: Pixels | None = None) -> Pixels:
    """Return where a plate shows its sources: 1 inside, 0 outside, with a soft edge.

    Parameters
    ----------
    pixels : ndarray, shape (H, W, 3)
        Linear Rec.709, as searched.
    threshold : float
    matte : ndarray, shape (H, W), optional

    Returns
    -------
    ndarray, shape (H, W), float32
    """
    bright = plate_luminance(pixels)
    over = (bright if matte is None else bright * matte) > threshold
    grown = maximum_filter(over.astype(np.float32), 2 * _GROW_PX + 1)
    found: Pixels = np.clip(uniform_filter(grown, _SOFT_PX), 0.0, 1.0)
    return found


def composed(plate: Pixels, layers: Sequence[Layer], mask: Pixels, *, too_dark: bool = False) -> Layer:
    """Add the flare to a plate.

    Parameters
    ----------
    plate : ndarray, shape (H, W, 3)
        In the primaries of the layers.
    layers : sequence of Layer
        Passes that add up, of the size of the plate, in units of the plate.
    mask : ndarray, shape (H, W)
        From `source_mask`.
    too_dark : bool
        Whether the plate shows its lights darker than they are.

    Returns
    -------
    Layer
        "comp".
    """
    total = plate.astype(np.float32, copy=True)
    for layer in layers:
        x, y, width, height = layer.window
        window = (slice(y, y + height), slice(x, x + width))
        light = layer.pixels
        if layer.name == STARBURST:
            inside = mask[window][..., None]
            light = light * (1.0 - inside)
            if too_dark:
                light += inside * np.maximum(layer.pixels - plate[window], 0.0)
        total[window] += light
    return Layer("comp", total, (0, 0, plate.shape[1], plate.shape[0]))
