"""Draw the sprites of a measured flare: small images that follow the light or stay about the axis."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ...kernels.ghost_model.cubic_sampling import cubic_samples
from ...model.measurement.ghost_model import GhostModel
from ...model.measurement.sprite import Sprite
from ...typing import Floats, Indices, Pixels

# least number of images to learn from: each is compared with the one before and the one after
_FEWEST = 3
# within this distance of the light from the axis, part of the picture's width, the residual turns only partly
_NEAR_AXIS = 0.04
# distances of a roll from all photographed ones between which the residual fades, degrees, and the part that remains
_FADE_DEG, _REMAINS = (5.0, 30.0), 0.5


@dataclass(frozen=True)
class Way:
    """One drawing of a sprite: its share, the light's direction, and the rotation of what follows the light.

    Directions are degrees, counterclockwise from the right in the upright picture.
    """

    share: float
    roll_deg: float
    turned_deg: float = 0.0


def where_predicted(model: GhostModel, learn: Callable[[Sprite], Sprite]) -> GhostModel:
    """Apply `learn` to the sprites that follow ghosts and have at least three images; return the new model."""
    sprites = tuple(
        learn(one) if one.follows == "ghosts" and len(one.constellation_deg) >= _FEWEST else one
        for one in model.sprites
    )
    return model.replace(sprites=sprites)


def sprite_interval(knots: Floats, constellation_deg: float | Floats) -> tuple[Indices, Floats]:
    """Return the index of the knot below each constellation and the relative position to the next knot.

    Knots are two or more rising constellations; values outside their range are clamped to it.
    """
    k = np.clip(np.searchsorted(knots, constellation_deg) - 1, 0, knots.size - 2)
    return k, np.clip((constellation_deg - knots[k]) / (knots[k + 1] - knots[k]), 0.0, 1.0)


def interval(sprite: Sprite, constellation_deg: float) -> int | None:
    """Return the index of a sprite's image before a constellation; None at an image and outside their range."""
    angles = np.array(sprite.constellation_deg)
    if not angles[0] < constellation_deg < angles[-1] or constellation_deg in angles:
        return None
    return int(sprite_interval(angles, constellation_deg)[0])


def cells_frame(sprite: Sprite) -> Floats:
    """Return a sprite's axis, light direction and scale in units of its cells, as `parameter_vector.frame` does."""
    grain = sprite.grain_px
    return np.array([-sprite.corner_px[0] / grain, -sprite.corner_px[1] / grain, 1.0, 0.0, 1.0 / grain])


def sprite_at(sprite: Sprite, constellation_deg: float) -> Pixels:
    """Return a sprite's image at a constellation, interpolated linearly, shape (rows, columns, 3)."""
    angles = np.array(sprite.constellation_deg)
    pictures: Pixels = sprite.pictures
    if angles.size == 1:
        return np.asarray(pictures[0], dtype=np.float32)
    k, far = sprite_interval(angles, constellation_deg)
    part = np.float32(far)
    return np.asarray((1.0 - part) * pictures[k] + part * pictures[k + 1], dtype=np.float32)


def kept_part(sprites: Sequence[Sprite], roll_deg: float) -> float:
    """Return the part of the residual that is drawn at a roll: 1 at photographed ones, less far from them.

    The rims of a lens turn with the light, the blades and the sensor do not, so a residual of both holds for its own
    roll only, and light of ghosts that the model lacks for all. Half of both has a smaller error than all or
    none (docs/adr/0021). Models without rolls keep all of it.
    """
    rolls = np.array([roll for one in sprites for roll in one.rolls_deg])
    if rolls.size == 0:
        return 1.0
    away, (begin, end) = float(np.abs((rolls - roll_deg + 180.0) % 360.0 - 180.0).min()), _FADE_DEG
    far = min(max((away - begin) / (end - begin), 0.0), 1.0)
    return 1.0 - (1.0 - _REMAINS) * far * far * (3.0 - 2.0 * far)


def ways(sprite: Sprite, constellation_deg: float, roll_deg: float, off: float, kept: float = 1.0) -> tuple[Way, ...]:
    """Return the drawings whose weighted sum is a sprite at a roll.

    Parameters
    ----------
    sprite : Sprite
    constellation_deg, roll_deg : float
    off : float
        Distance of the light's image from the axis, part of the picture's width.
    kept : float
        From `kept_part`; near the axis, where a roll has no meaning, more is kept.

    Returns
    -------
    tuple of Way
        Their shares sum to 1, or to less at rolls that were not photographed.

    Notes
    -----
    Near the axis a flare depends little on the light's direction: there the residual, mostly of polygons, keeps its
    photographed orientation, and turns with the light farther out (docs/adr/0021).
    """
    if not sprite.rolls_deg:
        return (Way(1.0 - _turned(off) * (1.0 - kept), roll_deg),)
    angles, rolls = np.array(sprite.constellation_deg), np.unwrap(sprite.rolls_deg, period=360.0)
    photographed = float(np.interp(constellation_deg, angles, rolls))
    return turned_ways(photographed, roll_deg, off, kept)


def turned_ways(photographed_deg: float, roll_deg: float, off: float, kept: float = 1.0) -> tuple[Way, ...]:
    """Return the drawings, at a roll, of a residual that was photographed at another roll."""
    turned, turned_deg = _turned(off), roll_deg - photographed_deg
    if turned == 1.0 or turned_deg == 0.0:
        return (Way(kept, roll_deg, turned_deg),)
    return Way(kept * turned, roll_deg, turned_deg), Way(1.0 - turned, photographed_deg)


def _turned(off: float) -> float:
    """Return how far the residual turns with the light, 0 on the axis and 1 away from it."""
    far = min(off / _NEAR_AXIS, 1.0)
    return float(far * far * (3.0 - 2.0 * far))


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
        Image of each sprite at one constellation, or an image with its cells subdivided equally along both axes.
    light_px, axis_px : tuple of float
        Pixels of the picture.
    direction : tuple of float
        Cosine and sine of the light's direction, counterclockwise from the right in the upright picture.
    size_px : tuple of int
        Width and height.
    scale : float
        Pixels of the picture per pixel of the sprites.
    turned_deg : float
        Rotation of what follows the light against its photographs, counterclockwise.

    Returns
    -------
    ndarray, shape (H, W, 3), float32
        Radiance; 0 beyond the cells.
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
        # along = cos dx - sin dy and down = sin dx + cos dy; dx counts right and dy down
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


def samples(cells: Pixels, column: Floats, row: Floats) -> Pixels:
    """Sample an image between the centres of its cells, shape (N, 3); see `cubic_samples`."""
    out = np.empty((column.size, 3))
    # contiguous arrays only: another memory layout would compile another kernel
    column, row = np.ascontiguousarray(column), np.ascontiguousarray(row)
    cubic_samples(np.ascontiguousarray(cells, dtype=np.float32), column, row, out)
    return out.astype(np.float32)


def _window(matrix: Floats, begin: Floats, cells: tuple[int, ...], size: tuple[int, int]) -> tuple[int, int, int, int]:
    """Return top, left, rows and columns of the pixels that a sprite's cells cover."""
    corners = np.array([[r, c] for r in (-0.5, cells[0] - 0.5) for c in (-0.5, cells[1] - 0.5)])
    at = np.linalg.solve(matrix, (corners - begin).T)
    low = np.clip(np.ceil(at.min(axis=1)), 0, size).astype(int)
    high = np.clip(np.floor(at.max(axis=1)) + 1, 0, size).astype(int)
    return int(low[0]), int(low[1]), int(max(high[0] - low[0], 0)), int(max(high[1] - low[1], 0))
