"""Draw a measured flare at any constellation and roll, as layers."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import lru_cache
from typing import Literal, cast

import numpy as np
from numpy.typing import NDArray

from ..errors import FlarewrightError
from ..kernels.measure_bezier import BORDER, draw_beziers
from ..kernels.measure_edges import sum_into
from ..kernels.measure_ghosts import draw_ghosts
from ..model.ghost_model import AberrationGhost, BezierGhost, GhostModel
from ..model.layer import Layer
from ..render.compose import beauty
from .glow import halo_at, offsets, star_at
from .held import held
from .numbers import bezier_numbers, field, fit_in, frame_in, visible
from .packed import Packed, pack, posed_numbers
from .rest_drawn import draw_rest
from .shared_out import shared_out
from .sprites import between, interval

Floats = NDArray[np.float64]

# farther beyond the measured range than this, degrees, nothing is replayed
BEYOND_DEG = 1.0
# of all of a ghost's light, in one pixel: less is none
_ROUNDING = 1e-12
# colours are drawn apart, green in halves, for two cores to have as much to do: plane, colour, the first ghost, and how
# many it is to the next
_PIECES = ((0, 0, 0, 1), (2, 2, 0, 1), (1, 1, 0, 2), (3, 1, 1, 2))
# other work is done in so many rows at a time: the same pixels, however many threads there are
_ROWS = 30
# it is kept: what a thread has had of memory it need not ask for again
_POOL = ThreadPoolExecutor(len(_PIECES))


def light_px(model: GhostModel, constellation_deg: float, roll_deg: float = 0.0) -> tuple[float, float]:
    """Return where the light's image lies in the captures' picture, (x, y)."""
    t = float(np.tan(np.radians(constellation_deg)))
    reach = model.focal_px * t * (1.0 + model.distortion * t * t)
    turn = np.radians(roll_deg)
    return (
        model.axis_px[0] + reach * float(np.cos(turn)),
        model.axis_px[1] - reach * float(np.sin(turn)),
    )


def replay(
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
        Multiplies everything (`measure.placing.brightness`).
    single : bool
        Also a layer for each ghost, "ghost.NAME".
    colors : {"camera", "rec709"}
        The captures' red, green and blue, or linear Rec.709 by the camera's matrix.

    Returns
    -------
    tuple of Layer
        "beauty", "ghosts", with a star, halo or sprites also "starburst", "halo" and "residual", then the single
        ghosts. Radiance in the captures' unit; the residual may be below 0.

    Raises
    ------
    FlarewrightError
        When the constellation lies outside what was measured, the roll is no direction, or the model knows no matrix.

    Notes
    -----
    Walch 2017, section 8.2: the constellation chooses the numbers, the roll turns the ghosts about the axis.
    """
    within_reach(model, constellation_deg, roll_deg)
    size = size_px or model.size_px
    about: dict[str, str | float] = {"constellation_deg": constellation_deg, "roll_deg": roll_deg}
    parts = _held(pack(model), model, constellation_deg, roll_deg, size)
    layers = [
        Layer(name, (gain * light).astype(np.float32), (0, 0, *size), about if name == "ghosts" else {})
        for name, light in parts.items()
    ]
    whole = beauty(layers, size)
    singles = _single(model, constellation_deg, roll_deg, size, gain) if single else []
    drawn = (whole, *layers, *singles)
    return drawn if colors == "camera" else tuple(_in_rec709(layer, model) for layer in drawn)


def within_reach(model: GhostModel, constellation_deg: float, roll_deg: float) -> None:
    """Refuse a place of the light that was not measured, or is none.

    Parameters
    ----------
    model : GhostModel
    constellation_deg, roll_deg : float

    Raises
    ------
    FlarewrightError
        When the constellation lies outside what was measured, or the roll is no direction.
    """
    low, high = model.constellation_deg
    if not low - BEYOND_DEG <= constellation_deg <= high + BEYOND_DEG:
        raise FlarewrightError(
            f"the model was measured from {low:g} to {high:g} degrees; it cannot tell the flare at "
            f"{constellation_deg:g}: {_remedy(model, constellation_deg, roll_deg)}"
        )
    if not np.isfinite(roll_deg):
        raise FlarewrightError(f"roll {roll_deg:g} is no direction; choose degrees between -360 and 360")


def _remedy(model: GhostModel, constellation_deg: float, roll_deg: float) -> str:
    """Say which constellation would do."""
    low, high = model.constellation_deg
    if low <= -constellation_deg <= high:
        return f"choose {-constellation_deg:g} with roll {(roll_deg + 180.0) % 360.0:g}, where the light stands as well"
    return "choose degrees in between"


def _held(
    packed: Packed, model: GhostModel, constellation_deg: float, roll_deg: float, size: tuple[int, int]
) -> dict[str, Floats]:
    """Draw the parts of a flare; between two photographs no place is darker or brighter than these tell."""
    parts = _parts(packed, model, constellation_deg, roll_deg, size)
    sprite = next((one for one in model.sprites if one.reaches is not None), None)
    if sprite is None:
        return parts
    angles = sprite.constellation_deg
    # where the light changes sides ghosts turn about the axis
    crossed = angles[0] < 0.0 < angles[-1] and abs(constellation_deg) < np.diff(angles).max()
    k = interval(sprite, constellation_deg)
    if k is None or crossed:
        return parts
    before, after = (_photographed(model, angle, roll_deg, size) for angle in angles[k : k + 2])
    part = float(between(np.array(angles), constellation_deg)[1])
    whole = _sum(parts)
    placed = frame_in(model, constellation_deg, roll_deg, size)
    parts["residual"] = parts["residual"] + held(whole, before, after, sprite, k, part, placed) - whole
    return parts


# the replays of an interval share both, and those of the next one the second
@lru_cache(maxsize=2)
def _photographed(
    model: GhostModel, constellation_deg: float, roll_deg: float, size: tuple[int, int]
) -> NDArray[np.float32]:
    """Draw all light at a constellation that was photographed, shape (H, W, 3); not to be changed."""
    light = _sum(_parts(pack(model), model, constellation_deg, roll_deg, size)).astype(np.float32)
    light.flags.writeable = False
    return light


def _sum(parts: dict[str, Floats]) -> Floats:
    return np.asarray(np.sum(list(parts.values()), axis=0))


def _parts(
    packed: Packed, model: GhostModel, constellation_deg: float, roll_deg: float, size: tuple[int, int]
) -> dict[str, Floats]:
    """Draw ghosts, star, halo and sprites as far as a model has them, by their layers' names."""
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
        parts["residual"] = draw_rest(packed, model, constellation_deg, roll_deg, place, size, _sum(parts))
    return parts


def _in_rec709(layer: Layer, model: GhostModel) -> Layer:
    if model.to_rec709 is None:
        raise FlarewrightError(
            "the model does not know its camera's colour matrix (to_rec709): replay it in the camera's own colours"
        )
    pixels = layer.pixels @ np.array(model.to_rec709, dtype=np.float32).T
    return replace(layer, pixels=np.asarray(pixels, dtype=np.float32))


def draw(model: GhostModel, constellation_deg: float, roll_deg: float, size_px: tuple[int, int]) -> Floats:
    """Draw all ghosts of a model together.

    Parameters
    ----------
    model : GhostModel
    constellation_deg, roll_deg : float
    size_px : tuple of int

    Returns
    -------
    ndarray, shape (H, W, 3)
        Radiance.
    """
    return draw_packed(pack(model), model, constellation_deg, roll_deg, size_px)


def _there(model: GhostModel, ghosts: Sequence[AberrationGhost | BezierGhost], constellation_deg: float) -> Floats:
    """Return which part of each ghost is seen: beyond what was measured as it is seen where that ends."""
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
    """Draw all ghosts of a packed model together, colours in a pool's threads or one after the other; see `draw`."""
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

        # pieces know nothing of each other, and neither kernel nor interpreter holds one up for another
        shared_out(draw_piece, *zip(*_PIECES, strict=True), pool=pool)
        shared_out(lambda top: sum_into(planes, top, top + _ROWS, pixels), range(0, height, _ROWS), pool=pool)
    there = _there(model, curves, constellation_deg)
    shown = [_curved(ghost, part, constellation_deg) for ghost, part in zip(curves, there, strict=True) if part > 0.0]
    if shown:
        curved = np.array(shown)
        shared_out(
            lambda top: draw_beziers(curved, placed, 0, top, pixels[top : top + _ROWS]), range(0, height, _ROWS),
            pool=pool,
        )  # fmt: skip
    return pixels


def _curved(ghost: BezierGhost, part: float, constellation_deg: float) -> Floats:
    """Return the numbers of a Bezier ghost of which a part is there."""
    numbers = bezier_numbers(ghost, constellation_deg)
    numbers[BORDER:] *= part
    return numbers


def _most_light(ghost: AberrationGhost | BezierGhost) -> float:
    """Return what all of a ghost's light is at most, radiance times pixels; 0 for one that is drawn without sums."""
    if isinstance(ghost, BezierGhost):
        return 0.0
    return float(np.pi * max(np.abs(one.intensity).sum() for one in (ghost.red, ghost.green, ghost.blue)))


def _single(
    model: GhostModel, constellation_deg: float, roll_deg: float, size: tuple[int, int], gain: float
) -> Sequence[Layer]:
    """Draw each visible ghost on a layer of its own, cropped to what it touches."""
    layers = []
    # a copy is validated, and the cells of what is no ghost take long
    bare = model.replace(sprites=())
    for ghost, there in zip(model.ghosts, _there(model, model.ghosts, constellation_deg), strict=True):
        if not there:
            continue
        alone = cast(GhostModel, bare.replace(ghosts=(ghost,)))
        pixels = draw(alone, constellation_deg, roll_deg, size) * gain
        # rows are sums of differences, of which rounding leaves something where there is no light
        lit = np.argwhere((pixels > _ROUNDING * gain * _most_light(ghost)).any(axis=2))
        if not lit.size:
            continue
        (top, left), (bottom, right) = lit.min(axis=0), lit.max(axis=0) + 1
        crop = pixels[top:bottom, left:right].astype(np.float32)
        layers.append(
            Layer(f"ghost.{ghost.name}", crop, (int(left), int(top), int(right - left), int(bottom - top)), {})
        )
    return layers
