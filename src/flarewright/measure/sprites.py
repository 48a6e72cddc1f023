"""Draw the sprites of a measured flare: small pictures that go with the light or stay about the axis."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..kernels.measure_sprite import cubic_samples
from ..model.ghost_model import GhostModel
from ..model.sprite import Sprite

Pixels = NDArray[np.float32]


# one photograph is compared with the one before and the one after
_FEWEST = 3
# where the light is within this part of the picture's width of the axis, not all that is left turns with it
_NEAR_AXIS = 0.04


@dataclass(frozen=True)
class Way:
    """How a sprite is drawn: which share of it, the light's direction, and by how much what goes with the light turns.

    Directions are degrees, counterclockwise from the right in the upright picture.
    """

    share: float
    roll_deg: float
    turned_deg: float = 0.0


def where_foretold(model: GhostModel, learn: Callable[[Sprite], Sprite]) -> GhostModel:
    """Return a model whose sprites that follow ghosts have learned; those of fewer than three pictures stay."""
    sprites = tuple(
        learn(one) if one.follows == "ghosts" and len(one.constellation_deg) >= _FEWEST else one
        for one in model.sprites
    )
    out: GhostModel = model.replace(sprites=sprites)
    return out


def between(
    knots: NDArray[np.float64], constellation_deg: float | NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Tell between which of two or more rising constellations some lie: the index below, and the part of the way.

    Those before the first and beyond the last are as there.
    """
    k = np.clip(np.searchsorted(knots, constellation_deg) - 1, 0, knots.size - 2)
    return k, np.clip((constellation_deg - knots[k]) / (knots[k + 1] - knots[k]), 0.0, 1.0)


def interval(sprite: Sprite, constellation_deg: float) -> int | None:
    """Return the index of a sprite's picture before a constellation; None at a picture and where none is after it."""
    angles = np.array(sprite.constellation_deg)
    if not angles[0] < constellation_deg < angles[-1] or constellation_deg in angles:
        return None
    return int(between(angles, constellation_deg)[0])


def cells_frame(sprite: Sprite) -> NDArray[np.float64]:
    """Return the axis, the light's direction and the scale of a sprite's cells, as `numbers.frame` does of pictures."""
    grain = sprite.grain_px
    return np.array([-sprite.corner_px[0] / grain, -sprite.corner_px[1] / grain, 1.0, 0.0, 1.0 / grain])


def sprite_at(sprite: Sprite, constellation_deg: float) -> Pixels:
    """Return a sprite's picture at a constellation, shape (rows, columns, 3)."""
    angles = np.array(sprite.constellation_deg)
    pictures: Pixels = sprite.pictures
    if angles.size == 1:
        return np.asarray(pictures[0], dtype=np.float32)
    k, far = between(angles, constellation_deg)
    part = np.float32(far)
    return np.asarray((1.0 - part) * pictures[k] + part * pictures[k + 1], dtype=np.float32)


def ways(sprite: Sprite, constellation_deg: float, roll_deg: float, off: float) -> tuple[Way, ...]:
    """Tell in which directions a sprite is drawn.

    Parameters
    ----------
    sprite : Sprite
    constellation_deg, roll_deg : float
    off : float
        How far the light's image is from the axis, part of the picture's width.

    Returns
    -------
    tuple of Way
        Their shares add up to 1.

    Notes
    -----
    Next to the axis a flare hardly knows from where the light comes: what is left there, of polygons above all, lies as
    it was photographed, and turns with the light from there on (docs/adr/0021).
    """
    if not sprite.rolls_deg:
        return (Way(1.0, roll_deg),)
    angles, rolls = np.array(sprite.constellation_deg), np.unwrap(sprite.rolls_deg, period=360.0)
    photographed = float(np.interp(constellation_deg, angles, rolls))
    return turned_ways(photographed, roll_deg, off)


def turned_ways(photographed_deg: float, roll_deg: float, off: float) -> tuple[Way, ...]:
    """Tell in which directions what was photographed with the light in one direction is drawn with it in another."""
    far, turned_deg = off / _NEAR_AXIS, roll_deg - photographed_deg
    if far >= 1.0 or turned_deg == 0.0:
        return (Way(1.0, roll_deg, turned_deg),)
    turned = float(far * far * (3.0 - 2.0 * far))
    return Way(turned, roll_deg, turned_deg), Way(1.0 - turned, photographed_deg)


def draw_sprites(
    sprites: Sequence[Sprite],
    pictures: Sequence[Pixels],
    light_px: tuple[float, float],
    axis_px: tuple[float, float],
    direction: tuple[float, float],
    size_px: tuple[int, int],
    scale: float = 1.0,
    turned_deg: float = 0.0,
) -> Pixels:
    """Draw sprites into one picture.

    Parameters
    ----------
    sprites : sequence of Sprite
    pictures : sequence of ndarray, shape (rows, columns, 3)
        Of each sprite, at one constellation; or of its cells divided, as many times along both sides.
    light_px, axis_px : tuple of float
        Pixels of the picture.
    direction : tuple of float
        Cosine and sine of the light's direction, counterclockwise from the right in the upright picture.
    size_px : tuple of int
        Width and height.
    scale : float
        Pixels of the picture per pixel of the sprites.
    turned_deg : float
        By how much what goes with the light is turned against its photographs, counterclockwise.

    Returns
    -------
    ndarray, shape (H, W, 3), float32
        Radiance; nothing beyond the cells.
    """
    width, height = size_px
    out = np.zeros((height, width, 3), np.float32)
    for sprite, cells in zip(sprites, pictures, strict=True):
        turn = np.radians(sprite.turn_deg + turned_deg)
        goes = sprite.follows == "light"
        cosine, sine = (float(np.cos(turn)), float(np.sin(turn))) if goes else direction
        x0, y0 = light_px if goes else axis_px
        grain = sprite.grain_px * sprite.columns / cells.shape[1]
        step = 1.0 / (scale * grain)
        # along = cos dx - sin dy and down = sin dx + cos dy, dx and dy counted right and down
        sides = np.array([1.0, 1.0 / sprite.stretch])
        matrix = step * sides[:, None] * np.array([[cosine, sine], [-sine, cosine]])
        corner = np.array(sprite.corner_px[::-1]) * sides / grain
        begin = matrix @ np.array([0.5 - y0, 0.5 - x0]) - corner - 0.5
        top, left, rows, columns = _window(matrix, begin, cells.shape[:2], (height, width))
        if not (rows and columns):
            continue
        r, c = np.mgrid[top : top + rows, left : left + columns]
        at = matrix @ np.stack([r.ravel(), c.ravel()]) + begin[:, None]
        inside = ((at >= -0.5) & (at <= np.array(cells.shape[:2])[:, None] - 0.5)).all(axis=0)
        r, c, at = r.ravel()[inside], c.ravel()[inside], at[:, inside]
        out[r, c] += samples(cells, at[1], at[0])
    return out


def samples(cells: Pixels, column: NDArray[np.float64], row: NDArray[np.float64]) -> Pixels:
    """Return a picture's light between its cells' middles, shape (N, 3); see `cubic_samples`."""
    out = np.empty((column.size, 3))
    # each other layout in memory would be another kernel to compile
    column, row = np.ascontiguousarray(column), np.ascontiguousarray(row)
    cubic_samples(np.ascontiguousarray(cells, dtype=np.float32), column, row, out)
    return out.astype(np.float32)


def _window(
    matrix: NDArray[np.float64], begin: NDArray[np.float64], cells: tuple[int, ...], size: tuple[int, int]
) -> tuple[int, int, int, int]:
    """Return top, left, rows and columns of the pixels that a sprite's cells cover."""
    corners = np.array([[r, c] for r in (-0.5, cells[0] - 0.5) for c in (-0.5, cells[1] - 0.5)])
    at = np.linalg.solve(matrix, (corners - begin).T)
    low = np.clip(np.ceil(at.min(axis=1)), 0, size).astype(int)
    high = np.clip(np.floor(at.max(axis=1)) + 1, 0, size).astype(int)
    return int(low[0]), int(low[1]), int(max(high[0] - low[0], 0)), int(max(high[1] - low[1], 0))
