"""Colours outside the primaries of a file: their share, and a picture without them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from ...model import Layer


def apply_gamut(gamut: Literal["keep", "compress"], layers: Sequence[Layer]) -> list[Layer]:
    """Return layers as `Output.gamut` requires.

    Parameters
    ----------
    gamut : {"keep", "compress"}
    layers : sequence of Layer
        Variances stay unchanged.
    """
    if gamut == "keep":
        return list(layers)
    return [layer if layer.name.endswith(".variance") else compressed(layer) for layer in layers]


def compressed(layer: Layer) -> Layer:
    """Return a layer without negative channels, for keying and blurring.

    Returns
    -------
    Layer
        Colours outside the primaries, and those close to the border, are moved along the line to the white of their
        largest channel, which stays constant (`kernels.raster.display_codes.compress_gamut`).
    """
    # imported here because it loads compiled code
    from ...kernels.raster.display_codes import compress_gamut

    pixels = np.array(layer.pixels, dtype=np.float32, order="C")
    compress_gamut(pixels)
    return replace(layer, pixels=pixels)


def negative_share(layer: Layer) -> float:
    """Return the part of a layer's pixels with a negative channel."""
    return float((layer.pixels.min(axis=-1) < 0.0).mean()) if layer.pixels.size else 0.0
