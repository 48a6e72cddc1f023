"""What is left at the borders of ghosts goes where these go, between the constellations that were photographed.

A ghost that is not drawn quite as it is leaves light, and lack of light, along its borders. Two photographs show them
at two places; halfway between, neither is right, and their mean is both. The ghost's numbers tell how it moves and
grows, and what is left beside its borders goes with it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..kernels.measure_mesh import window_of
from ..model.ghost_model import GhostModel
from ..model.sprite import Sprite
from .moved import mixed
from .numbers import field, visible
from .packed import Packed, one_colour, posed_numbers
from .sprites import Pixels, cells_frame, interval, samples, sprite_at

Floats = NDArray[np.float64]

# cells to each side of a border that go with it
_BESIDE = 2
# pixels that no ghost reaches, and how much larger one may be than where it was photographed
_FAR, _GROWN = 20000, 3.0


# rows and columns of a sprite's cells
_Window = tuple[slice, slice]
# values of a window
_Part = tuple[_Window, Floats]
# light of a window, and 1 for rows and for columns of all cells that the photograph showed, 0 for others
_Moved = tuple[_Window, Floats, tuple[Floats, Floats]]


@dataclass(frozen=True)
class _Box:
    """Where a ghost is: its middle towards the light and at right angles, and half its sizes, pixels from the axis."""

    along: float
    across: float
    length: float
    width: float


def carried(sprite: Sprite, packed: Packed, model: GhostModel, constellation_deg: float) -> Pixels:
    """Return the picture of a sprite that follows ghosts.

    Parameters
    ----------
    sprite : Sprite
    packed : Packed
        The model's ghosts, from `pack`.
    model : GhostModel
    constellation_deg : float

    Returns
    -------
    ndarray, shape (rows, columns, 3), float32
        At constellations that were photographed the sprite's own pictures.

    Notes
    -----
    Each cell of a photographed picture is divided among the ghosts by the squares of how steep they are around it, and
    what remains where none is stays in its place. A ghost's share is moved and stretched as the box around the ghost
    is, from the picture before and from the one after; where one of them did not show it, the other tells alone. A
    sprite that has moves goes with them where they foretold photographs better (`moved.mixed`).
    """
    k = interval(sprite, constellation_deg)
    stands = sprite.moves is None and not packed[0]
    # of a single row or column nothing tells how steep a ghost is
    if k is None or stands or min(sprite.rows, sprite.columns) < 2:
        return sprite_at(sprite, constellation_deg)
    with_boxes = boxed(sprite, packed, model, (k, k + 1), constellation_deg)
    if sprite.moves is None:
        return np.asarray(with_boxes, dtype=np.float32)
    return np.asarray(mixed(sprite, sprite.moves, packed, model, k, constellation_deg, with_boxes), dtype=np.float32)


def boxed(sprite: Sprite, packed: Packed, model: GhostModel, ends: tuple[int, int], constellation_deg: float) -> Floats:
    """Return what is left between two pictures of a sprite as it goes with the boxes of ghosts.

    Parameters
    ----------
    sprite, packed, model, constellation_deg
        As of `carried`.
    ends : tuple of int
        Indices of the pictures before and after.

    Returns
    -------
    ndarray, shape (rows, columns, 3)
    """
    angles = [sprite.constellation_deg[n] for n in ends]
    part = (constellation_deg - angles[0]) / (angles[1] - angles[0])
    now = _boxes(packed, model, constellation_deg)
    out = np.zeros(sprite.pictures.shape[1:])
    moved: dict[int, list[tuple[float, _Moved]]] = {}
    for n, then, weight in zip(ends, angles, (1.0 - part, part), strict=True):
        picture = sprite.pictures[n]
        before = _boxes(packed, model, then)
        steep = {
            g: edge
            for g, edge in _edges(sprite, packed, model, then).items()
            if g in now and g in before and _alike(before[g], now[g])
        }
        whole: Floats = np.full(picture.shape[:2], sprite.unit**2)
        for window, edge in steep.values():
            whole[window] += edge**2
        out += weight * (sprite.unit**2 / whole)[..., None] * picture
        for g, (window, edge) in steep.items():
            share = (edge**2 / whole[window])[..., None] * picture[window]
            moved.setdefault(g, []).append((weight, _moved(share, window, sprite, model, then, before[g], now[g])))
    for pair in moved.values():
        for weight, (window, light, shown) in pair:
            if len(pair) == 1:
                # it is born or dies between the two, and comes or goes with its light
                out[window] += weight * light
                continue
            both = sum(each * _shown(told, window) for each, (_, _, told) in pair)
            out[window] += (weight * _shown(shown, window) / np.maximum(both, 1e-9))[..., None] * light
    return out


def _shown(lines: tuple[Floats, Floats], window: _Window) -> Floats:
    """Return 1 for cells of a window that a photograph showed, 0 for others."""
    return np.outer(lines[0][window[0]], lines[1][window[1]])


def _alike(one: _Box, other: _Box) -> bool:
    sizes = (one.length / other.length, one.width / other.width)
    return all(1.0 / _GROWN < size < _GROWN for size in sizes)


def _greens(packed: Packed, model: GhostModel, constellation_deg: float) -> tuple[Floats, NDArray[np.int64], float]:
    """Return the ghosts' numbers in green at a constellation, how many discs cut each, and the field."""
    meshes, numbers, counts, _ = packed
    sigma = abs(field(constellation_deg, model.largest_deg))
    return posed_numbers(meshes, numbers, constellation_deg, sigma)[1], counts[1], sigma


def _boxes(packed: Packed, model: GhostModel, constellation_deg: float) -> dict[int, _Box]:
    """Return where ghosts are, also where they are out of the picture; those that are shut have no box."""
    green, counts, sigma = _greens(packed, model, constellation_deg)
    frame = np.array([_FAR, _FAR, 1.0, 0.0, 1.0])
    found = {}
    for g in range(len(green)):
        left, top, width, height = window_of(green[g], counts[g], sigma, frame, 2 * _FAR, 2 * _FAR)
        if 0 < width < _FAR and 0 < height < _FAR:
            found[g] = _Box(left + 0.5 * width - _FAR, top + 0.5 * height - _FAR, 0.5 * width, 0.5 * height)
    return found


def _edges(sprite: Sprite, packed: Packed, model: GhostModel, constellation_deg: float) -> dict[int, _Part]:
    """Return how steep each ghost's green is around each cell of a sprite, radiance a cell; flat ones left out."""
    green, counts, sigma = _greens(packed, model, constellation_deg)
    there = visible(packed[0], constellation_deg)
    frame = cells_frame(sprite)
    found = {}
    for g in np.flatnonzero(there):
        lit = window_of(green[g], counts[g], sigma, frame, sprite.columns, sprite.rows)
        if not (lit[2] and lit[3]):
            continue
        # as far beyond its light as its edge goes
        rows, columns = (
            slice(max(begin - _BESIDE - 2, 0), min(begin + size + _BESIDE + 2, most))
            for begin, size, most in ((lit[1], lit[3], sprite.rows), (lit[0], lit[2], sprite.columns))
        )
        one = slice(g, g + 1)
        shifted = frame - np.array([columns.start, rows.start, 0.0, 0.0, 0.0])
        shape = rows.stop - rows.start, columns.stop - columns.start
        light = np.maximum(one_colour(green[one], counts[one], there[one], sigma, shifted, shape), 0.0)
        edge = _most_around(np.hypot(*np.gradient(light)))
        if edge.max() > sprite.unit:
            found[int(g)] = (rows, columns), edge
    return found


def _most_around(values: Floats) -> Floats:
    """Return the largest value of the cells around each."""
    out = values
    for axis in (0, 1):
        padded = np.pad(out, [(_BESIDE, _BESIDE) if m == axis else (0, 0) for m in (0, 1)], mode="edge")
        count = out.shape[axis]
        out = np.max([padded.take(range(k, k + count), axis) for k in range(2 * _BESIDE + 1)], axis=0)
    return out


def _moved(
    share: Floats, window: _Window, sprite: Sprite, model: GhostModel, then: float, before: _Box, now: _Box
) -> _Moved:
    """Move what a window of a picture holds as a box moves."""
    grain = sprite.grain_px
    along = sprite.corner_px[0] + grain * (np.arange(sprite.columns) + 0.5)
    down = sprite.corner_px[1] + grain * (np.arange(sprite.rows) + 0.5)
    along = before.along + (along - now.along) * (before.length / now.length)
    down = before.across + (down - now.across) * (before.width / now.width)
    side = -1.0 if then < 0.0 else 1.0
    x, y = model.axis_px[0] + side * along, model.axis_px[1] + side * down
    shown = ((y >= 0.0) & (y <= model.size_px[1])).astype(float), ((x >= 0.0) & (x <= model.size_px[0])).astype(float)
    column = (along - sprite.corner_px[0]) / grain - 0.5 - window[1].start
    row = (down - sprite.corner_px[1]) / grain - 0.5 - window[0].start
    near_r = np.flatnonzero((row > -2.0) & (row < share.shape[0] + 1.0))
    near_c = np.flatnonzero((column > -2.0) & (column < share.shape[1] + 1.0))
    if not (near_r.size and near_c.size):
        return (slice(0, 0), slice(0, 0)), np.zeros((0, 0, 3)), shown
    at_r, at_c = np.meshgrid(row[near_r], column[near_c], indexing="ij")
    light = samples(share.astype(np.float32), at_c.ravel(), at_r.ravel()).reshape(*at_r.shape, 3)
    # they follow each other, for a box keeps their order
    to = slice(int(near_r[0]), int(near_r[-1]) + 1), slice(int(near_c[0]), int(near_c[-1]) + 1)
    return to, light.astype(float), shown
