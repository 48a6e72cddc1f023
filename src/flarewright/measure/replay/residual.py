"""Draw the residual of a measured flare beside ghosts, star and halo: its sprites, at any roll and picture size."""

from __future__ import annotations

import numpy as np

from ...model.measurement.ghost_model import GhostModel
from ...model.measurement.sprite import Sprite
from ...typing import Floats, Pixels
from ..core.parameter_vector import frame_in
from .blob_drawing import draw_blobs
from .fine_detail import detail_at
from .ghost_arrays import Packed
from .motion_warp import warped_sprite
from .sprites import Way, draw_sprites, kept_part, sprite_at, ways

# largest number of detail cells per pixel
_CELLS = 1.5


def draw_residual(
    packed: Packed,
    model: GhostModel,
    constellation_deg: float,
    roll_deg: float,
    light_px: tuple[float, float],
    size_px: tuple[int, int],
    known: Floats,
) -> Floats:
    """Draw the sprites of a model.

    Parameters
    ----------
    packed : Packed
        The model's ghosts, from `pack`.
    model : GhostModel
    constellation_deg, roll_deg : float
    light_px : tuple of float
        Position in the picture.
    size_px : tuple of int
        Width and height of the picture.
    known : ndarray, shape (H, W, 3)
        All other light of the picture.

    Returns
    -------
    ndarray, shape (H, W, 3)
        Radiance; it can be negative, but its sum with `known` is not.
    """
    blobs = [one for one in model.sprites if one.follows == "speck"]
    standing = [one for one in model.sprites if one.follows != "speck"]
    placed = frame_in(model, constellation_deg, roll_deg, size_px)
    axis, scale = (float(placed[0]), float(placed[1])), float(placed[4])
    pictures = [
        warped_sprite(one, packed, model, constellation_deg)
        if one.follows == "ghosts"
        else sprite_at(one, constellation_deg)
        for one in standing
    ]
    # detail narrower than a pixel is invisible and would flicker
    fine = [one for one in standing if one.detail and one.detail.parts <= _CELLS * scale * one.grain_px]
    pictures += [detail_at(one, one.detail, constellation_deg) for one in fine if one.detail]
    off = abs(np.tan(np.radians(constellation_deg))) * model.focal_px / model.size_px[0]
    kept = kept_part(model.sprites, roll_deg)
    alike: dict[Way, list[tuple[Sprite, Pixels]]] = {}
    for pair in zip([*standing, *fine], pictures, strict=True):
        for way in ways(pair[0], constellation_deg, roll_deg, off, kept):
            alike.setdefault(way, []).append(pair)
    rest = np.zeros((size_px[1], size_px[0], 3))
    for way, pairs in alike.items():
        toward = frame_in(model, constellation_deg, way.roll_deg, size_px)
        sprites, cells = zip(*pairs, strict=True)
        direction = float(toward[2]), float(toward[3])
        drawn = draw_sprites(sprites, cells, light_px, axis, direction, size_px, scale, way.turned_deg)
        rest += way.share * drawn.astype(np.float64)
    rest += draw_blobs(blobs, packed, model, constellation_deg, placed, size_px)
    return np.asarray(np.maximum(rest, -known))
