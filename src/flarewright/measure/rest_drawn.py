"""Draw what a measured flare holds beside its ghosts, star and halo: its sprites, at any roll and in any picture."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..model.ghost_model import GhostModel
from ..model.sprite import Sprite
from .beyond import gone_on, shown
from .carried import carried
from .detail import detail_at
from .numbers import frame_in
from .packed import Packed
from .specks_drawn import draw_specks
from .sprites import Pixels, Way, draw_sprites, sprite_at, ways

Floats = NDArray[np.float64]

# most cells of detail to a pixel
_CELLS = 1.5
# where no photograph shows it, all light together is no darker than this part of what would go on from there
_DARKEST = 0.5


def draw_rest(
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
        In the picture.
    size_px : tuple of int
        Width and height of the picture.
    known : ndarray, shape (H, W, 3)
        All other light of the picture.

    Returns
    -------
    ndarray, shape (H, W, 3)
        Radiance; it may be below 0, but not by more than `known` is above it.

    Notes
    -----
    Where no photograph shows it, what is left goes on (`beyond`). A ghost that is drawn too bright in every photograph
    leaves darkness, which would go on beyond the ghost's end: there all light together is at least half of what it
    would be if it went on as a whole.
    """
    specks = [one for one in model.sprites if one.follows == "speck"]
    standing = [one for one in model.sprites if one.follows != "speck"]
    placed = frame_in(model, constellation_deg, roll_deg, size_px)
    axis, scale = (float(placed[0]), float(placed[1])), float(placed[4])
    pictures = [
        carried(one, packed, model, constellation_deg) if one.follows == "ghosts" else sprite_at(one, constellation_deg)
        for one in standing
    ]
    # what is narrower than a pixel is not seen, and would shimmer
    fine = [one for one in standing if one.detail and one.detail.parts <= _CELLS * scale * one.grain_px]
    pictures += [detail_at(one, one.detail, constellation_deg) for one in fine if one.detail]
    off = abs(np.tan(np.radians(constellation_deg))) * model.focal_px / model.size_px[0]
    alike: dict[Way, list[tuple[Sprite, Pixels]]] = {}
    for pair in zip([*standing, *fine], pictures, strict=True):
        for way in ways(pair[0], constellation_deg, roll_deg, off):
            alike.setdefault(way, []).append(pair)
    rest = np.zeros((size_px[1], size_px[0], 3))
    for way, pairs in alike.items():
        toward = frame_in(model, constellation_deg, way.roll_deg, size_px)
        sprites, cells = zip(*pairs, strict=True)
        direction = float(toward[2]), float(toward[3])
        drawn = draw_sprites(sprites, cells, light_px, axis, direction, size_px, scale, way.turned_deg)
        light: Floats = drawn.astype(np.float64)
        if any(one.rolls_deg for one in sprites):
            light = gone_on(light, _shown(model, axis, scale, way.turned_deg, size_px), axis)
        rest += way.share * light
    rest += draw_specks(specks, packed, model, constellation_deg, placed, size_px)
    least: Floats | float = 0.0
    turns = [way for one in standing if one.follows == "ghosts" for way in ways(one, constellation_deg, roll_deg, off)]
    if turns:
        mask = _shown(model, axis, scale, max(turns, key=lambda way: way.share).turned_deg, size_px)
        # at the photographs' own roll and sides they show all there is
        if not mask.all():
            onward = np.maximum(_DARKEST * gone_on(known + rest, mask, axis), 0.0)
            least = np.where(mask[..., None], 0.0, onward)
    return np.asarray(np.maximum(rest, least - known))


def _shown(
    model: GhostModel, axis_px: tuple[float, float], scale: float, turned_deg: float, size_px: tuple[int, int]
) -> NDArray[np.bool_]:
    """Tell which pixels of a picture photographs show when it is turned against them."""
    left, up = scale * model.axis_px[0], scale * model.axis_px[1]
    right, down = scale * model.size_px[0] - left, scale * model.size_px[1] - up
    return shown(axis_px, (left, up, right, down), turned_deg, size_px)
