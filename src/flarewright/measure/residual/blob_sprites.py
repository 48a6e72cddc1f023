"""Learn the residual at blobs: small bright ghosts, each with images in subpixel cells that move with it.

Each view samples a blob at other positions of the pixel grid, so that several views together resolve cells finer than
pixels (least squares). Only the residual of a blob is learned; the ghost keeps explaining the rest of its light.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import groupby
from math import ceil, floor

import numpy as np

from ...kernels.ghost_model.blob_cells import gather_cells, read_cells, square_cells
from ...model.measurement.ghost_model import GhostModel
from ...model.measurement.sprite import Sprite, encode_pictures
from ...typing import Floats, Indices, Mask, Pixels
from ..core.neighbourhood import brightest
from ..core.parallel import map_batched
from ..core.parameter_vector import visible
from ..core.views import View
from ..replay.blob_drawing import Grid, Outline, add_blob, blob_outline, reading
from ..replay.ghost_arrays import Packed, pack
from ..replay.sprites import sprite_at, sprite_interval
from .sprite_fit import DIGIT, darkest_noise, even_knots

# lengths below are pixels of images up to this width, and scale with wider ones
_WIDTH = 720.0
# half the longer side of the largest blob, and the part of it that is the soft border of any ghost: small images have
# the whole border too, and with it a ghost of 1 px radius has 7
_LARGEST_HALF_PX, _BORDER_PX = 12.0, 6.0
# least peak of a blob over the noise of the darkest pixels; the coarse images represent fainter ones as well
_BRIGHT = 100.0
# least residual, part of the light, at the place of a blob for it to count as visible where the model hides it
_LEAST_RESIDUAL = 0.5
# least number of consecutive views; the coarse sprites interpolate shorter rows as well
_LEAST_VIEWS = 3
# side of a cell, and extent of the cells beyond the lit box
_CELL_PX, _BESIDE_PX = 1.0 / 3.0, 3.0
# margin around the lit box in which no other sprite is learned
_AROUND_PX = 1.0
# views per image
_VIEWS_PER_IMAGE = 3
# regularization of cells against the weight of one view: along the constellation, towards 0, and towards their
# neighbours, since a pixel does not resolve waves as long as it is wide. Strong along the constellation: where a blob
# moves by whole pixels, consecutive views sample it alike, and only distant views resolve its subpixel structure
_BEND, _DAMP, _ROUGH = 1.0, 0.05, 0.2
# systematic error of a pixel besides its noise, part of its light
_RELATIVE_ERROR = 0.01
# largest number of solver steps, and part of the first residual at which the solver ends
_STEPS, _GOOD = 150, 1e-4
# cells below this part of the brightest cell belong to the surroundings and are dropped, unless beside a brighter cell
_LEAST_CELL = 0.01


@dataclass(frozen=True)
class Blob:
    """A small bright ghost and the consecutive views that show it.

    Attributes
    ----------
    name : str
    first : int
        Index of the first view.
    outlines : tuple of Outline
        Outlines in that view and the following ones.
    beyond : tuple of (int, Outline)
        Index and outline for other views that contain its position although the model hides it there; it can still be
        visible.
    """

    name: str
    first: int
    outlines: tuple[Outline, ...]
    beyond: tuple[tuple[int, Outline], ...]


@dataclass(frozen=True)
class _Equations:
    """Linear equations of a blob's cells, as `kernels.ghost_model.blob_cells` takes them; values, shape (P, 3)."""

    cells: Indices
    weights: Floats
    before: Indices
    part: Floats
    sure: Floats
    values: Floats


def blobs_of(model: GhostModel, views: Sequence[View]) -> tuple[Blob, ...]:
    """Return the small ghosts of a model that are brighter than their surroundings, each in its longest row of views.

    Parameters
    ----------
    model : GhostModel
    views : sequence of View
        Sorted by constellation.
    """
    drawn = pack(model)
    least = _BRIGHT * darkest_noise(views)
    found = []
    for ghost in drawn[0]:
        placed = {k: at for k, view in enumerate(views) if (at := _small(drawn, model, ghost.name, view)) is not None}
        shown = [
            k
            for k, at in placed.items()
            if visible([ghost], views[k].constellation_deg)[0] > 0.0 and at.peak > _around(views[k], at)
        ]
        rows = [[k for _, k in group] for _, group in groupby(enumerate(shown), lambda pair: pair[1] - pair[0])]
        longest = max(rows, key=len, default=[])
        if len(longest) >= _LEAST_VIEWS and max(placed[k].peak for k in longest) > least:
            beyond = tuple((k, at) for k, at in placed.items() if k not in longest)
            found.append(Blob(ghost.name, longest[0], tuple(placed[k] for k in longest), beyond))
    return tuple(found)


def _unit(view: View) -> float:
    return max(1.0, view.size_px[0] / _WIDTH)


def _small(drawn: Packed, model: GhostModel, name: str, view: View) -> Outline | None:
    """Return the outline of a ghost in a view, or None if it is large or outside the picture."""
    largest = _BORDER_PX + (_LARGEST_HALF_PX - _BORDER_PX) * min(1.0, view.size_px[0] / _WIDTH)
    at = blob_outline(drawn, model, name, view.constellation_deg, largest * _unit(view))
    if at is None:
        return None
    inside = all(0.0 <= each <= side for each, side in zip(at.place(view.frame), view.size_px, strict=True))
    return at if inside else None


def _around(view: View, at: Outline) -> float:
    """Return the median green light beside a blob."""
    margin = _BESIDE_PX * _unit(view)
    window, *off = _about(view, at, margin)
    light, variance = view.pixels[window][..., 1], view.variance[window][..., 1]
    beside = ~_within(at, off, _AROUND_PX * _unit(view)) & _within(at, off, margin) & np.isfinite(variance)
    return float(np.median(light[beside])) if beside.any() else np.inf


def _about(view: View, at: Outline, margin: float) -> tuple[tuple[slice, slice], Floats, Floats]:
    """Return the window of a picture around a blob, and the distances of its pixels from the middle: along, across."""
    _, _, cosine, sine, _ = view.frame
    x, y = at.place(view.frame)
    reach = float(np.hypot(*at.half)) + margin
    rows, columns = (
        slice(max(floor(middle - reach), 0), max(min(floor(middle + reach) + 1, side), 0))
        for middle, side in ((y, view.size_px[1]), (x, view.size_px[0]))
    )
    row, column = np.mgrid[rows, columns]
    dx, dy = column + 0.5 - x, row + 0.5 - y
    return (rows, columns), np.abs(cosine * dx - sine * dy), np.abs(sine * dx + cosine * dy)


def _within(at: Outline, off: Sequence[Floats], margin: float) -> Mask:
    return np.asarray((off[0] < at.half[0] + margin) & (off[1] < at.half[1] + margin))


def covered_cells(blobs: Sequence[Blob], views: Sequence[View], left: Sequence[Pixels]) -> list[Mask]:
    """Return masks of the blobs in each view, shape (H, W) each; other sprites cannot be learned there.

    Parameters
    ----------
    blobs : sequence of Blob
    views : sequence of View
    left : sequence of ndarray, shape (H, W, 3)
        Residual of each view beside ghosts, star and halo. Where the model hides a blob, it counts as visible if the
        residual is most of the light.
    """
    masks = [np.zeros(view.pixels.shape[:2], dtype=np.bool_) for view in views]
    least = _BRIGHT * darkest_noise(views)
    for blob in blobs:
        shown = enumerate(blob.outlines, start=blob.first)
        beyond = ((k, at) for k, at in blob.beyond if _outshone(views[k], at, left[k], least))
        for k, at in (*shown, *beyond):
            margin = _AROUND_PX * _unit(views[k])
            window, *off = _about(views[k], at, margin)
            masks[k][window] |= _within(at, off, margin)
    return masks


def _outshone(view: View, at: Outline, left: Pixels, least: float) -> bool:
    """Return whether the residual at the place of a blob is bright and most of the light."""
    window, *off = _about(view, at, 0.0)
    inside = _within(at, off, 0.0)
    rest, light = np.abs(left[window][inside]), view.pixels[window][inside]
    known = np.isfinite(rest)
    return bool(
        known.any() and rest[known].max() > least and rest[known].mean() > _LEAST_RESIDUAL * light[known].mean()
    )


def blob_sprites(
    blobs: Sequence[Blob], views: Sequence[View], pixels: Sequence[Pixels], masks: Sequence[Mask]
) -> tuple[Sprite, ...]:
    """Learn the residual at blobs.

    Parameters
    ----------
    blobs : sequence of Blob
        From `blobs_of`.
    views : sequence of View
    pixels : sequence of ndarray, shape (H, W, 3)
        Residual of each view beside everything else.
    masks : sequence of ndarray, shape (H, W)
        Where the residual is reliable.

    Returns
    -------
    tuple of Sprite
        Sprites with at least one nonzero image.
    """
    step = DIGIT * darkest_noise(views) / (_CELL_PX * _unit(views[0]))
    left = [each.copy() for each in pixels]
    found = []
    for blob in blobs:
        sprite = _learned(blob, views, left, masks, step)
        if sprite is None:
            continue
        found.append(sprite)
        for k, at in enumerate(blob.outlines, start=blob.first):
            picture = sprite_at(sprite, views[k].constellation_deg)
            add_blob(left[k], Grid.of(sprite), at, views[k].frame, -picture)
    return tuple(found)


def _grid(blob: Blob, unit: float) -> Grid:
    """Return cells that cover a blob at its largest size."""
    largest = max(blob.outlines, key=lambda one: one.half[0] * one.half[1])
    grain = _CELL_PX * unit
    columns, rows = (2 * ceil((half + _BESIDE_PX * unit) / grain) for half in largest.half)
    return Grid(grain, (-0.5 * columns * grain, -0.5 * rows * grain), rows, columns, largest.spread)


def _learned(
    blob: Blob, views: Sequence[View], pixels: Sequence[Pixels], masks: Sequence[Mask], step: float
) -> Sprite | None:
    """Solve for the images of one blob; None when its residual is negligible."""
    grid = _grid(blob, _unit(views[0]))
    shown = views[blob.first : blob.first + len(blob.outlines)]
    angles = even_knots(shown, max(2, ceil(len(shown) / _VIEWS_PER_IMAGE)))
    equations = _equations(grid, angles, shown, blob, pixels, masks)
    if equations is None:
        return None
    solved = _solved(equations, len(angles), grid)
    pictures = _bright(solved.reshape(len(angles), grid.rows, grid.columns, 3))
    if not np.abs(pictures).max() > step:
        return None
    unit, packed_cells = encode_pictures(pictures, step)
    return Sprite(
        follows="speck", ghost=blob.name, spread_px=grid.spread_px, grain_px=grid.grain_px, corner_px=grid.corner_px,
        constellation_deg=angles, rows=grid.rows, columns=grid.columns, unit=unit,
        cells=packed_cells,
    )  # fmt: skip


def _equations(
    grid: Grid, angles: tuple[float, ...], shown: Sequence[View], blob: Blob, pixels: Sequence[Pixels],
    masks: Sequence[Mask],
) -> _Equations | None:  # fmt: skip
    """Collect the equations of a blob's cells from all views; None where fewer than `_LEAST_VIEWS` views contribute."""
    parts = []
    for k, (view, at) in enumerate(zip(shown, blob.outlines, strict=True), start=blob.first):
        read = reading(grid, at, view.frame, view.size_px)
        value = pixels[k][read.rows, read.columns].astype(np.float64)
        known = masks[k][read.rows, read.columns] & np.isfinite(value).all(axis=1) & read.weights.any(axis=1)
        if not known.any():
            continue
        own, light = (each[read.rows[known], read.columns[known]].mean(axis=1) for each in (view.variance, view.pixels))
        before, far = sprite_interval(np.array(angles), view.constellation_deg)
        count = int(known.sum())
        parts.append((
            read.cells[known], read.weights[known], np.full(count, before), np.full(count, far),
            1.0 / np.sqrt(own + (_RELATIVE_ERROR * light) ** 2).astype(np.float64), value[known],
        ))  # fmt: skip
    if len(parts) < _LEAST_VIEWS:
        return None
    taps = max(part[0].shape[1] for part in parts)
    wide = [[np.pad(each, ((0, 0), (0, taps - each.shape[1]))) for each in part[:2]] for part in parts]
    cells, weights = (np.concatenate([pair[n] for pair in wide]) for n in (0, 1))
    return _Equations(cells, weights, *(np.concatenate([part[n] for part in parts]) for n in (2, 3, 4, 5)))


def _solved(equations: _Equations, count: int, grid: Grid) -> Floats:
    """Solve for images, shape (count, cells, 3), by conjugate gradients on the normal equations.

    Hestenes and Stiefel (1952), Methods of conjugate gradients for solving linear systems; the system is a Tikhonov
    regularization. The three colours are solved in parallel.
    """
    system, cells = (
        (equations.cells, equations.weights, equations.before, equations.part, equations.sure),
        grid.rows * grid.columns,
    )
    squares = np.zeros((count, cells))
    square_cells(*system, squares)
    # scale cells so that the regularization has the same relative strength in bright and dark, known and unknown cells
    size = np.sqrt(np.maximum(squares.mean(axis=0), 1e-12 * squares.max()))[None, :, None]
    shape, known = (count, grid.rows, grid.columns, 3), size.reshape(1, grid.rows, grid.columns, 1)
    bend = np.diff(np.eye(count), min(2, count - 1), axis=0)
    stiff = _BEND**2 * bend.T @ bend + _DAMP**2 * np.eye(count)

    def back(values: Floats) -> Floats:
        out = np.zeros((count, cells, 3))
        gather_cells(*system, values, out)
        return np.asarray(out / size)

    def normal(scaled: Floats) -> Floats:
        out = np.zeros((len(equations.sure), 3))
        read_cells(*system, scaled / size, out)
        rough = _bends(known**2 * _bends((scaled / size).reshape(shape))).reshape(scaled.shape) / size
        return np.asarray(back(out) + np.tensordot(stiff, scaled, axes=1) + _ROUGH**2 * rough)

    rest = back(equations.values * equations.sure[:, None])
    found, way = np.zeros_like(rest), rest
    power = (rest**2).sum(axis=(0, 1))
    enough = _GOOD**2 * power
    for _ in range(_STEPS):
        if (power <= enough).all():
            break
        turned = normal(way)
        step = power / np.maximum((way * turned).sum(axis=(0, 1)), 1e-300)
        found, rest = found + step * way, rest - step * turned
        now = (rest**2).sum(axis=(0, 1))
        way = rest + now / np.maximum(power, 1e-300) * way
        power = now
    return np.asarray(found / size)


def _bends(pictures: Floats) -> Floats:
    """Return the sum of differences of each cell from its neighbours, shape (K, rows, columns, 3); 0 beyond borders."""
    out = 4.0 * pictures
    out[:, 1:] -= pictures[:, :-1]
    out[:, :-1] -= pictures[:, 1:]
    out[:, :, 1:] -= pictures[:, :, :-1]
    out[:, :, :-1] -= pictures[:, :, 1:]
    return out


def _bright(pictures: Floats) -> Pixels:
    """Clear cells of a blob's surroundings, which do not move with it."""
    largest = np.abs(pictures).max(axis=(0, 3))
    kept = brightest(largest, 1) > _LEAST_CELL * largest.max()
    return np.asarray(pictures * kept[:, :, None], dtype=np.float32)


def all_hidden(
    pictures: Sequence[Pixels], masks: Sequence[Mask], pool: ThreadPoolExecutor | None = None
) -> list[Pixels]:
    """Return images with NaN inside their masks."""

    def hidden(pixels: Pixels, mask: Mask) -> Pixels:
        return np.where(mask[..., None], np.float32(np.nan), pixels)

    return map_batched(hidden, pictures, masks, pool=pool)
