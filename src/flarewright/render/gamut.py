"""Colours outside the primaries of a file: how many, and a picture without them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from ..model import Layer

__all__ = ["compressed", "negative_share", "within"]


def within(gamut: Literal["keep", "compress"], layers: Sequence[Layer]) -> list[Layer]:
    """Return layers as `Output.gamut` wants them.

    Parameters
    ----------
    gamut : {"keep", "compress"}
    layers : sequence of Layer
        Variances stay as they are.

    Returns
    -------
    list of Layer
    """
    if gamut == "keep":
        return list(layers)
    return [layer if layer.name.endswith(".variance") else compressed(layer) for layer in layers]


def compressed(layer: Layer) -> Layer:
    """Return a layer without negative channels, for who keys and blurs.

    Parameters
    ----------
    layer : Layer

    Returns
    -------
    Layer
        Colours outside the primaries, and those close to them, are moved along the line to the white of their largest
        channel, which stays (`kernels.screen.compress_gamut`).
    """
    # compiled code is loaded where it is called
    from ..kernels.screen import compress_gamut

    pixels = np.array(layer.pixels, dtype=np.float32, order="C")
    compress_gamut(pixels)
    return replace(layer, pixels=pixels)


def negative_share(layer: Layer) -> float:
    """Return which part of a layer's pixels has a negative channel."""
    return float((layer.pixels.min(axis=-1) < 0.0).mean()) if layer.pixels.size else 0.0
