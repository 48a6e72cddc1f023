"""Draw the residual at blobs in models that earlier versions wrote (ADR 0040).

It consists of images with subpixel cells that move and scale with one small ghost.

An image of the light source a few pixels wide can be a thousand times as bright as its surroundings. An error of a
tenth of its brightness exceeds all other errors in a picture, and cells of several pixels cannot represent it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil

import numpy as np

from ...kernels.ghost_model.ghost_mesh import window_of
from ...model.measurement.ghost_model import GhostModel
from ...model.measurement.sprite import Sprite
from ...typing import Floats, Indices, Pixels
from ..core.parameter_vector import field, visible
from .ghost_arrays import Packed, one_colour, posed_numbers
from .sprites import sprite_at

# oversampling of an outline against the model's pixels, largest number of samples across it, and threshold of the lit
# area, part of the peak
_FINER, _SAMPLES, _WITHIN = 8.0, 512.0, 0.02
# extent beyond every ghost, pixels
_FAR = 20000
# margin around the lit box, pixels
_MARGIN = 2


@dataclass(frozen=True)
class Outline:
    """Lit area of a ghost's green channel at a constellation, pixels of the model.

    Attributes
    ----------
    along : float
        Centroid of the lit area, measured from the axis towards the light.
    spread : tuple of float
        Standard deviation of the lit area, along the light's direction and across it.
    """

    along: float
    spread: tuple[float, float]

    def place(self, frame: Floats) -> tuple[float, float]:
        """Return the position of the centroid in a picture, pixels; `frame` is from `parameter_vector.frame`."""
        ax, ay, cosine, sine, scale = map(float, frame)
        return ax + scale * cosine * self.along, ay - scale * sine * self.along


@dataclass(frozen=True)
class Grid:
    """Cells of a blob's images.

    Attributes
    ----------
    grain_px : float
        Side of a cell when the ghost has the size `spread_px`.
    corner_px : tuple of float
        Corner of the first cell, measured from the middle of the ghost.
    rows, columns : int
    spread_px : tuple of float
        As `Outline.spread`.
    """

    grain_px: float
    corner_px: tuple[float, float]
    rows: int
    columns: int
    spread_px: tuple[float, float]

    @classmethod
    def of(cls, sprite: Sprite) -> Grid:
        """Return the cells of a sprite."""
        return cls(sprite.grain_px, sprite.corner_px, sprite.rows, sprite.columns, sprite.spread_px)


@dataclass(frozen=True)
class Reading:
    """Weights of a blob's cells in the pixels around it.

    Attributes
    ----------
    rows, columns : ndarray, shape (P,)
        Pixel positions.
    cells : ndarray, shape (P, T)
        Flat indices of cells, row by row; an index may repeat.
    weights : ndarray, shape (P, T)
    """

    rows: Indices
    columns: Indices
    cells: Indices
    weights: Floats


def blob_outline(packed: Packed, model: GhostModel, name: str, constellation_deg: float) -> Outline | None:
    """Compute the lit area of a ghost, also beyond the picture; None if it is vignetted, too large or missing.

    Parameters
    ----------
    packed : Packed
        The model's ghosts, from `pack`.
    model : GhostModel
    name : str
    constellation_deg : float
    """
    meshes, numbers, counts, _ = packed
    k = next((k for k, ghost in enumerate(meshes) if ghost.name == name), None)
    if k is None:
        return None
    one = slice(k, k + 1)
    sigma = abs(field(constellation_deg, model.largest_deg))
    green = posed_numbers(meshes[one], numbers[:, one], constellation_deg, sigma)[1]
    frame = np.array([_FAR, _FAR, 1.0, 0.0, 1.0])
    left, top, width, height = window_of(green[0], counts[1, k], sigma, frame, 2 * _FAR, 2 * _FAR)
    if not 0 < min(width, height) <= max(width, height) <= _FAR:
        return None
    left, top = left - _FAR - _MARGIN, top - _FAR - _MARGIN
    finer = min(_FINER, _SAMPLES / max(width, height))
    columns, rows = (ceil((side + 2 * _MARGIN) * finer) for side in (width, height))
    fine = np.array([-left * finer, -top * finer, 1.0, 0.0, finer])
    light = one_colour(green, counts[1, one], np.ones(1), sigma, fine, (rows, columns))
    peak = float(light.max())
    if not peak > 0.0:
        return None
    lit = light > _WITHIN * peak
    middles, spreads = [], []
    for start, axis in ((left, 0), (top, 1)):
        counted = lit.sum(axis=axis)
        places = start + (np.arange(counted.size) + 0.5) / finer
        middles.append(float(counted @ places / counted.sum()))
        spreads.append(float(np.sqrt(counted @ (places - middles[-1]) ** 2 / counted.sum())))
    return Outline(middles[0], (spreads[0], spreads[1]))


def reading(grid: Grid, at: Outline, frame: Floats, size_px: tuple[int, int]) -> Reading:
    """Compute the weight of each cell in each pixel; a pixel averages bilinearly interpolated cells over its square.

    Parameters
    ----------
    grid : Grid
    at : Outline
    frame : ndarray, shape (5,)
        From `parameter_vector.frame`.
    size_px : tuple of int
        Width and height of the picture.

    Returns
    -------
    Reading
        Of the pixels that cells can reach.
    """
    _, _, cosine, sine, scale = frame
    x0, y0 = at.place(frame)
    stretch = [now / then for now, then in zip(at.spread, grid.spread_px, strict=True)]
    sides = (-2.0 * grid.corner_px[0] * stretch[0], -2.0 * grid.corner_px[1] * stretch[1])
    reach = 0.5 * scale * float(np.hypot(*sides)) + 1.0
    spans = [
        np.arange(max(int(middle - reach), 0), min(int(middle + reach) + 1, side))
        for middle, side in zip((x0, y0), size_px, strict=True)
    ]
    x, y = (each.ravel() for each in np.meshgrid(*spans))
    # subdivide pixels so that no cell is skipped
    parts = max(1, ceil(1.0 / (scale * grid.grain_px * min(stretch))))
    cells, weights = [], []
    for across in range(parts):
        for down in range(parts):
            dx, dy = x + (across + 0.5) / parts - x0, y + (down + 0.5) / parts - y0
            along = (cosine * dx - sine * dy) / (scale * stretch[0])
            aside = (sine * dx + cosine * dy) / (scale * stretch[1])
            column, row = (
                (value - corner) / grid.grain_px - 0.5
                for value, corner in zip((along, aside), grid.corner_px, strict=True)
            )
            left, top = np.floor(column).astype(np.int64), np.floor(row).astype(np.int64)
            for r, near_r in ((top, top + 1.0 - row), (top + 1, row - top)):
                for c, near_c in ((left, left + 1.0 - column), (left + 1, column - left)):
                    inside = (r >= 0) & (r < grid.rows) & (c >= 0) & (c < grid.columns)
                    cells.append(np.where(inside, r * grid.columns + c, 0))
                    weights.append(np.where(inside, near_r * near_c, 0.0) / parts**2)
    return Reading(y, x, np.stack(cells, axis=1), np.stack(weights, axis=1))


def add_blob(pixels: Pixels, grid: Grid, at: Outline, frame: Floats, picture: Pixels | Floats) -> None:
    """Add a blob's image, shape (rows, columns, 3), to pixels, shape (H, W, 3), with the weights of `reading`."""
    read = reading(grid, at, frame, (pixels.shape[1], pixels.shape[0]))
    light = np.einsum("pt,ptm->pm", read.weights, picture.reshape(-1, 3)[read.cells])
    pixels[read.rows, read.columns] += light.astype(np.float32)


def draw_blobs(
    sprites: Sequence[Sprite],
    packed: Packed,
    model: GhostModel,
    constellation_deg: float,
    frame: Floats,
    size_px: tuple[int, int],
) -> Pixels:
    """Draw the sprites that follow blobs; a sprite without its ghost in the model is left out.

    Parameters
    ----------
    sprites : sequence of Sprite
    packed, model
        As for `blob_outline`.
    constellation_deg : float
    frame, size_px
        As for `reading`.

    Returns
    -------
    ndarray, shape (H, W, 3), float32
        Radiance.
    """
    out = np.zeros((size_px[1], size_px[0], 3), np.float32)
    for sprite in sprites:
        first, last = sprite.constellation_deg[0], sprite.constellation_deg[-1]
        if sprite.ghost is None or not first <= constellation_deg <= last:
            continue
        at = blob_outline(packed, model, sprite.ghost, constellation_deg)
        if at is None:
            continue
        there = visible([ghost for ghost in packed[0] if ghost.name == sprite.ghost], constellation_deg)[0]
        add_blob(out, Grid.of(sprite), at, frame, there * sprite_at(sprite, constellation_deg))
    return out
