"""Add layers: the beauty is the sum of the passes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import FlarewrightError
from ...kernels.raster.plane_memory import black_picture, unset_picture
from ...model.layer import Layer, part_inside


def beauty(layers: Sequence[Layer], size_px: tuple[int, int] | None = None) -> Layer:
    """Add layers, each inside its window.

    Parameters
    ----------
    layers : sequence of Layer
        Disjoint light: pass either "ghosts" or the single "ghost.J-I" layers, not both.
    size_px : tuple of int, optional
        Width and height of the picture; parts of windows outside it are ignored. None: the smallest picture from the
        origin that contains every window.

    Returns
    -------
    Layer
        Named "beauty", its window the whole picture; pixels of shape (height, width, 3), float32.

    Raises
    ------
    FlarewrightError
        Neither a layer nor a size is given.

    Notes
    -----
    Layers are added in the given order, so the sum does not depend on the number of threads.
    """
    if size_px is None:
        if not layers:
            raise FlarewrightError("a picture without layers needs a size")
        size_px = (
            max(1, *(layer.window[0] + layer.window[2] for layer in layers)),
            max(1, *(layer.window[1] + layer.window[3] for layer in layers)),
        )
    width, height = size_px
    whole = (0, 0, width, height)
    rest = list(layers)
    if rest and rest[0].window == whole:
        # copying is faster than adding to zeros
        total = unset_picture(width, height)
        total[:] = rest.pop(0).pixels
    else:
        total = black_picture(width, height)
    for layer in rest:
        add_layer(total, layer)
    return Layer("beauty", total, whole)


def add_layer(total: NDArray[np.floating[Any]], layer: Layer) -> None:
    """Add a layer, inside its window, to a picture.

    Parameters
    ----------
    total : ndarray, shape (H, W, 3)
        Modified.
    layer : Layer
        Parts of its window outside the picture are ignored.
    """
    x, y, *_ = layer.window
    left, top, right, bottom = part_inside(layer.window, (total.shape[1], total.shape[0]))
    if left < right and top < bottom:
        total[top:bottom, left:right] += layer.pixels[top - y : bottom - y, left - x : right - x]
