"""Draw a measured flare at any constellation and roll, as layers."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import lru_cache
from typing import Literal

import numpy as np

from ...errors import FlarewrightError
from ...kernels.ghost_model.bezier import BORDER, draw_beziers
from ...kernels.ghost_model.draw import draw_ghosts
from ...kernels.ghost_model.edge_coverage import sum_into
from ...model.layer import Layer
from ...model.measurement.ghost_model import AberrationGhost, BezierGhost, GhostModel
from ...render.image.compose import beauty
from ...typing import Floats, Pixels
from ..core.parallel import map_batched
from ..core.parameter_vector import bezier_numbers, field, fit_in, frame_in, visible
from ..glow.laws import halo_at, offsets, star_at
from .clamping import clamped
from .ghost_arrays import Packed, pack, posed_numbers
from .residual import draw_residual
from .sprites import interval, kept_part, sprite_interval

# the measured range ends at true angles; nominal ones may lie this far beyond, by the turntable's jitter, degrees
JITTER_DEG = 0.05
# rounding error of a pixel, part of a ghost's total light
_ROUNDING = 1e-12
# work items of equal size for two cores, green split in halves: plane, colour, first ghost, and step to the next ghost
_PIECES = ((0, 0, 0, 1), (2, 2, 0, 1), (1, 1, 0, 2), (3, 1, 1, 2))
# rows per item of other work, fixed so that pixels do not depend on the number of threads
_ROWS = 30
# one pool for all pictures: its threads keep their memory
_POOL = ThreadPoolExecutor(len(_PIECES))


def light_px(model: GhostModel, constellation_deg: float, roll_deg: float = 0.0) -> tuple[float, float]:
    """Return the position of the light's image in the captures' picture, (x, y)."""
    t = float(np.tan(np.radians(constellation_deg)))
    reach = model.focal_px * t * (1.0 + model.distortion * t * t)
    turn = np.radians(roll_deg)
    return (model.axis_px[0] + reach * float(np.cos(turn)), model.axis_px[1] - reach * float(np.sin(turn)))


def replay_model(
    model: GhostModel,
    constellation_deg: float,
    *,
    roll_deg: float = 0.0,
    size_px: tuple[int, int] | None = None,
    gain: float = 1.0,
    single: bool = False,
    colors: Literal["camera", "rec709"] = "camera",
) -> tuple[Layer, ...]:
    """Draw a measured flare.

    Parameters
    ----------
    model : GhostModel
    constellation_deg : float
        Angle between the optical axis and the light.
    roll_deg : float
        Direction of the light, counterclockwise from the right in the upright picture.
    size_px : tuple of int, optional
        Width and height; the picture shows the captures' field across its width. None: the captures' size.
    gain : float
        Multiplies everything (`replay.placement.brightness`).
    single : bool
        Whether to add a layer for each ghost, "ghost.NAME".
    colors : {"camera", "rec709"}
        The captures' red, green and blue, or linear Rec.709 by the camera's matrix.

    Returns
    -------
    tuple of Layer
        "beauty", "ghosts", "starburst", "halo" and "residual" where the model has them, then the single ghosts.
        Radiance in the captures' unit; the residual can be negative.

    Raises
    ------
    FlarewrightError
        When the constellation lies outside the measured range, the roll is not finite, or the model has no matrix.

    Notes
    -----
    Walch 2017, section 8.2: the constellation selects the parameters, the roll rotates the ghosts about the axis.
    """
    within_reach(model, constellation_deg, roll_deg)
    size = size_px or model.size_px
    about: dict[str, str | float] = {"constellation_deg": constellation_deg, "roll_deg": roll_deg}
    model, constellation_deg, roll_deg = _photographed_place(model, constellation_deg, roll_deg)
    parts = _held(pack(model), model, constellation_deg, roll_deg, size)
    layers = [
        Layer(name, (gain * light).astype(np.float32), (0, 0, *size), about if name == "ghosts" else {})
        for name, light in parts.items()
    ]
    whole = beauty(layers, size)
    singles = _single(model, constellation_deg, roll_deg, size, gain) if single else []
    drawn = (whole, *layers, *singles)
    return drawn if colors == "camera" else tuple(_in_rec709(layer, model) for layer in drawn)


def _photographed_place(
    model: GhostModel, constellation_deg: float, roll_deg: float
) -> tuple[GhostModel, float, float]:
    """Return the model with the sprites of one series of captures, and the place of the light as that series shows it.

    Of several series, the one that shows the constellation and is nearest in roll.
    """
    rolls = {one.captured_roll_deg for one in model.sprites if one.captured_roll_deg is not None}
    if len(rolls) < 2:
        return model, *_photographed_side(model, constellation_deg, roll_deg)
    (low, high), places = model.constellation_deg, [(constellation_deg, roll_deg)]
    if low <= -constellation_deg <= high:
        places.append((-constellation_deg, roll_deg + 180.0))

    def misses(offer: tuple[float, tuple[float, float]]) -> tuple[bool, float]:
        captured, (angle, roll) = offer
        series = _of_series(model, captured)
        angles = next((one.constellation_deg for one in series.sprites if one.follows == "ghosts"), (low, high))
        # a picture of a sprite can stand for several captures
        step = max(np.diff(angles).max(initial=0.0), JITTER_DEG)
        beyond = not angles[0] - step <= angle <= angles[-1] + step
        return beyond, abs((roll - captured + 180.0) % 360.0 - 180.0)

    captured, place = min(((captured, place) for captured in sorted(rolls) for place in places), key=misses)
    return _of_series(model, captured), *place


@lru_cache(maxsize=8)
def _of_series(model: GhostModel, captured_roll_deg: float) -> GhostModel:
    """Return a model with the sprites that were learned from the captures of one roll, and those of all."""
    sprites = tuple(one for one in model.sprites if one.captured_roll_deg in (None, captured_roll_deg))
    # `replace` validates the copy, and large sprites take long
    return model.model_copy(update={"sprites": sprites})


def _photographed_side(model: GhostModel, constellation_deg: float, roll_deg: float) -> tuple[float, float]:
    """Return the same place of the light, from the other side where the photographs of that side are nearer in roll."""
    low, high = model.constellation_deg
    other = -constellation_deg, roll_deg + 180.0
    nearer = kept_part(model.sprites, other[1]) > kept_part(model.sprites, roll_deg)
    return other if nearer and low <= other[0] <= high else (constellation_deg, roll_deg)


def within_reach(model: GhostModel, constellation_deg: float, roll_deg: float) -> None:
    """Raise when a position of the light was not measured or is invalid.

    Raises
    ------
    FlarewrightError
        When the constellation lies outside the measured range, or the roll is not finite.
    """
    low, high = model.constellation_deg
    if not low - JITTER_DEG <= constellation_deg <= high + JITTER_DEG:
        raise FlarewrightError(
            f"the model was measured from {low:g} to {high:g} degrees and does not cover {constellation_deg:g}: "
            f"{_remedy(model, constellation_deg, roll_deg)}"
        )
    if not np.isfinite(roll_deg):
        raise FlarewrightError(f"roll {roll_deg:g} is no direction; choose degrees between -360 and 360")


def _remedy(model: GhostModel, constellation_deg: float, roll_deg: float) -> str:
    """Return advice with a constellation that is covered."""
    low, high = model.constellation_deg
    if low <= -constellation_deg <= high:
        return f"choose {-constellation_deg:g} with roll {(roll_deg + 180.0) % 360.0:g}, where the light stands as well"
    return "choose degrees in between"


def _held(
    packed: Packed, model: GhostModel, constellation_deg: float, roll_deg: float, size: tuple[int, int]
) -> dict[str, Floats]:
    """Draw the parts of a flare; between two photographs each pixel is clamped to the range that these show."""
    parts = _parts(packed, model, constellation_deg, roll_deg, size)
    sprite = next((one for one in model.sprites if one.reaches is not None), None)
    if sprite is None:
        return parts
    angles = sprite.constellation_deg
    # in the interval that contains the axis ghosts rotate about it
    crossed = angles[0] < 0.0 < angles[-1] and abs(constellation_deg) < np.diff(angles).max()
    k = interval(sprite, constellation_deg)
    if k is None or crossed:
        return parts
    before, after = (_photographed(model, angle, roll_deg, size) for angle in angles[k : k + 2])
    part = float(sprite_interval(np.array(angles), constellation_deg)[1])
    whole = _sum(parts)
    placed = frame_in(model, constellation_deg, roll_deg, size)
    parts["residual"] = parts["residual"] + clamped(whole, before, after, sprite, k, part, placed) - whole
    return parts


# all replays of an interval share both photographs; those of the next interval share the second one
@lru_cache(maxsize=2)
def _photographed(model: GhostModel, constellation_deg: float, roll_deg: float, size: tuple[int, int]) -> Pixels:
    """Draw all light at a photographed constellation, shape (H, W, 3), read-only."""
    light = _sum(_parts(pack(model), model, constellation_deg, roll_deg, size)).astype(np.float32)
    light.flags.writeable = False
    return light


def _sum(parts: dict[str, Floats]) -> Floats:
    return np.asarray(np.sum(list(parts.values()), axis=0))


def _parts(
    packed: Packed, model: GhostModel, constellation_deg: float, roll_deg: float, size: tuple[int, int]
) -> dict[str, Floats]:
    """Draw ghosts, star, halo and sprites, where a model has them, by the names of their layers."""
    parts: dict[str, Floats] = {"ghosts": draw_packed(packed, model, constellation_deg, roll_deg, size)}
    scale, top = fit_in(model, size)
    at = light_px(model, constellation_deg, roll_deg)
    place = at[0] * scale, at[1] * scale + top
    x, y = offsets(place, size, scale)
    if model.star is not None:
        parts["starburst"] = np.asarray(star_at(model.star, constellation_deg, x, y))
    if model.halo is not None:
        parts["halo"] = np.asarray(halo_at(model.halo, constellation_deg, x, y))
    if model.sprites:
        parts["residual"] = draw_residual(packed, model, constellation_deg, roll_deg, place, size, _sum(parts))
    return parts


def _in_rec709(layer: Layer, model: GhostModel) -> Layer:
    if model.to_rec709 is None:
        raise FlarewrightError(
            "the model has no colour matrix of its camera (to_rec709): replay it in the camera's own colours"
        )
    pixels = layer.pixels @ np.array(model.to_rec709, dtype=np.float32).T
    return replace(layer, pixels=np.asarray(pixels, dtype=np.float32))


def draw(model: GhostModel, constellation_deg: float, roll_deg: float, size_px: tuple[int, int]) -> Floats:
    """Draw all ghosts of a model together.

    Returns
    -------
    ndarray, shape (H, W, 3)
        Radiance.
    """
    return draw_packed(pack(model), model, constellation_deg, roll_deg, size_px)


def _there(model: GhostModel, ghosts: Sequence[AberrationGhost | BezierGhost], constellation_deg: float) -> Floats:
    """Return the visible part of each ghost; beyond the measured range that at its end."""
    low, high = model.constellation_deg
    return visible(ghosts, min(max(constellation_deg, low), high))


def draw_packed(
    packed: Packed,
    model: GhostModel,
    constellation_deg: float,
    roll_deg: float,
    size_px: tuple[int, int],
    pool: ThreadPoolExecutor | None = _POOL,
) -> Floats:
    """Draw all ghosts of a packed model together, the colours in parallel in a pool, or serially; see `draw`."""
    meshes, numbers, counts, curves = packed
    width, height = size_px
    pixels = np.zeros((height, width, 3))
    placed = frame_in(model, constellation_deg, roll_deg, size_px)
    sigma = abs(field(constellation_deg, model.largest_deg))
    if meshes:
        there = _there(model, meshes, constellation_deg)
        numbers = posed_numbers(meshes, numbers, constellation_deg, sigma)
        planes = np.zeros((len(_PIECES), height, width + 1))

        def draw_piece(plane: int, channel: int, first: int, step: int) -> None:
            some = (np.ascontiguousarray(each[first::step]) for each in (numbers[channel], counts[channel], there))
            draw_ghosts(*some, sigma, placed, planes[plane])

        # items are independent, and the kernel releases the interpreter's lock
        map_batched(draw_piece, *zip(*_PIECES, strict=True), pool=pool)
        map_batched(lambda top: sum_into(planes, top, top + _ROWS, pixels), range(0, height, _ROWS), pool=pool)
    there = _there(model, curves, constellation_deg)
    shown = [_curved(ghost, part, constellation_deg) for ghost, part in zip(curves, there, strict=True) if part > 0.0]
    if shown:
        curved = np.array(shown)
        map_batched(
            lambda top: draw_beziers(curved, placed, 0, top, pixels[top : top + _ROWS]), range(0, height, _ROWS),
            pool=pool,
        )  # fmt: skip
    return pixels


def _curved(ghost: BezierGhost, part: float, constellation_deg: float) -> Floats:
    """Return the numbers of a Bezier ghost whose levels are scaled by its visible part."""
    numbers = bezier_numbers(ghost, constellation_deg)
    numbers[BORDER:] *= part
    return numbers


def _most_light(ghost: AberrationGhost | BezierGhost) -> float:
    """Return an upper bound of a ghost's light, radiance times pixels; 0 for a Bezier ghost, drawn without sums."""
    if isinstance(ghost, BezierGhost):
        return 0.0
    return float(np.pi * max(np.abs(one.intensity).sum() for one in (ghost.red, ghost.green, ghost.blue)))


def _single(
    model: GhostModel, constellation_deg: float, roll_deg: float, size: tuple[int, int], gain: float
) -> Sequence[Layer]:
    """Draw each visible ghost on a separate layer, cropped to its lit pixels."""
    layers = []
    # `replace` validates the copy, and large sprites take long
    bare = model.replace(sprites=())
    for ghost, there in zip(model.ghosts, _there(model, model.ghosts, constellation_deg), strict=True):
        if not there:
            continue
        alone = bare.replace(ghosts=(ghost,))
        pixels = draw(alone, constellation_deg, roll_deg, size) * gain
        # rows are sums of differences, whose rounding leaves values where there is no light
        lit = np.argwhere((pixels > _ROUNDING * gain * _most_light(ghost)).any(axis=2))
        if not lit.size:
            continue
        (top, left), (bottom, right) = lit.min(axis=0), lit.max(axis=0) + 1
        crop = pixels[top:bottom, left:right].astype(np.float32)
        layers.append(
            Layer(f"ghost.{ghost.name}", crop, (int(left), int(top), int(right - left), int(bottom - top)), {})
        )
    return layers
