"""A sheet: memory on which ghosts are drawn apart from the picture, one group after another."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import prod

import numpy as np

from ...kernels.raster.plane_memory import black_memory
from ...kernels.raster.polygons import BLOCK, plane_shape, to_pixels
from ...typing import Pixels
from .canvas import DETAILS, Canvas, lit_window


@dataclass(frozen=True)
class Sheet:
    """Memory for one plane at a time, black between two of them.

    A plane with margins is larger than the picture. To clear and copy it for each group of ghosts would cost more than
    to draw many of them, so a worker keeps its memory, and only the lit part is copied and cleared.

    Attributes
    ----------
    memory : list of ndarray
        One black array of float32, as large as the largest plane so far.
    """

    memory: list[Pixels] = field(default_factory=lambda: [np.zeros(0, dtype=np.float32)], repr=False)

    def canvas(self, size_px: tuple[int, int]) -> Canvas:
        """Return an empty canvas of (width, height) pixels whose full resolution lies in this memory.

        It is valid until `lift`.
        """
        shape = plane_shape(*size_px)
        count = prod(shape)
        if self.memory[0].size < count:
            self.memory[0] = black_memory(count)
        return Canvas(size_px, [self.memory[0][:count].reshape(shape), *[None] * (DETAILS - 1)])

    def lift(self, canvas: Canvas) -> tuple[Pixels, tuple[int, int]]:
        """Take the light at full resolution off a canvas of this sheet, which leaves the memory black.

        Parameters
        ----------
        canvas : Canvas
            From `canvas`.

        Returns
        -------
        light : ndarray, shape (H, W, 3), float32
            The smallest window with all light, flux per pixel; empty if there is none.
        corner : tuple of int
            Column and row of its first pixel.
        """
        plane = canvas.plane()
        x0, y0, x1, y1 = lit_window(plane.reshape(*plane.shape[:2], -1))
        window = plane[y0:y1, x0:x1]
        # the last block of a row may hold light beyond the width
        pixels = to_pixels(window, canvas.size_px[0] - x0 * BLOCK)
        window[...] = 0.0
        left, top, right, bottom = lit_window(pixels)
        return pixels[top:bottom, left:right], (x0 * BLOCK + left, y0 + top)
