"""Learn what is left at specks: small bright ghosts, each in pictures finer than a pixel that go with it.

Every view shows a speck in other places of the pixels' grid, so that all together tell more than one: least squares
for cells that are finer than pixels. What is left of it is taken, so that the ghost stays what explains the light.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import groupby
from math import ceil, floor

import numpy as np
from numpy.typing import NDArray

from ..kernels.measure_speck import gather_cells, read_cells, square_cells
from ..model.ghost_model import GhostModel
from ..model.sprite import Sprite, packed
from .numbers import Floats, visible
from .packed import Packed, pack
from .shared_out import shared_out
from .specks_drawn import Grid, Outline, add_speck, outline, reading
from .sprite_fit import DIGIT, darkest_noise, even_knots
from .sprites import between, sprite_at
from .views import Pixels, View

Mask = NDArray[np.bool_]

# lengths below are pixels of pictures no wider than this, and grow with wider ones
_WIDTH = 720.0
# half the longer side of the largest speck
_LARGEST_PX = 12.0
# a speck's light over the noise of the darkest pixels; what is fainter, coarse pictures hold as well
_BRIGHT = 100.0
# part of a picture's light that what is left must be where a speck is taken to be that the model does not show
_MOST_OF_IT = 0.5
# fewer views in a row are interpolated as well
_FEWEST = 3
# side of a cell, and how far beyond the lit box cells go
_CELL_PX, _BESIDE_PX = 1.0 / 3.0, 3.0
# nothing else is learned so near to the lit box
_AROUND_PX = 1.0
# views for each picture
_VIEWS = 3
# how stiff cells are against what one view tells of them: over the constellation, towards 0, and against their
# neighbours, for a pixel tells nothing of waves that are as long as it is wide. Over the constellation stiff: where a
# speck moves by whole pixels, many views in a row show the same of it, and others far off tell what lies between pixels
_BEND, _DAMP, _ROUGH = 1.0, 0.05, 0.2
# part of its light by which a pixel may be off beside its noise
_OFF = 0.01
# steps of the solver, and the part of the first residual at which it ends
_STEPS, _GOOD = 150, 1e-4
# part of the brightest cell below which a cell tells of the surroundings; none is kept that is beside no brighter one
_LEAST = 0.01


@dataclass(frozen=True)
class Speck:
    """A small bright ghost in the views that show it so.

    Attributes
    ----------
    name : str
    first : int
        Index of the first view.
    outlines : tuple of Outline
        In it and the ones that follow.
    beyond : tuple of (int, Outline)
        Other views in whose pictures it would be, though the model does not show it: it may be there all the same.
    """

    name: str
    first: int
    outlines: tuple[Outline, ...]
    beyond: tuple[tuple[int, Outline], ...]


@dataclass(frozen=True)
class _Told:
    """What pixels of all views tell of cells, as `kernels.measure_speck` takes it; values, shape (P, 3)."""

    cells: NDArray[np.int64]
    weights: Floats
    before: NDArray[np.int64]
    part: Floats
    sure: Floats
    values: Floats


def specks_of(model: GhostModel, views: Sequence[View]) -> tuple[Speck, ...]:
    """Return the ghosts of a model that are small and outshine what is around them, each in its longest row of views.

    Parameters
    ----------
    model : GhostModel
    views : sequence of View
        By rising constellation.

    Returns
    -------
    tuple of Speck
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
        if len(longest) >= _FEWEST and max(placed[k].peak for k in longest) > least:
            beyond = tuple((k, at) for k, at in placed.items() if k not in longest)
            found.append(Speck(ghost.name, longest[0], tuple(placed[k] for k in longest), beyond))
    return tuple(found)


def _unit(view: View) -> float:
    return max(1.0, view.size_px[0] / _WIDTH)


def _small(drawn: Packed, model: GhostModel, name: str, view: View) -> Outline | None:
    """Return the outline of a ghost whose place is in a view, if it is small there."""
    at = outline(drawn, model, name, view.constellation_deg, _LARGEST_PX * _unit(view))
    if at is None:
        return None
    inside = all(0.0 <= each <= side for each, side in zip(at.place(view.frame), view.size_px, strict=True))
    return at if inside else None


def _around(view: View, at: Outline) -> float:
    """Return how bright a picture is in green beside a speck."""
    margin = _BESIDE_PX * _unit(view)
    window, *off = _about(view, at, margin)
    light, variance = view.pixels[window][..., 1], view.variance[window][..., 1]
    beside = ~_within(at, off, _AROUND_PX * _unit(view)) & _within(at, off, margin) & np.isfinite(variance)
    return float(np.median(light[beside])) if beside.any() else np.inf


def _about(view: View, at: Outline, margin: float) -> tuple[tuple[slice, slice], Floats, Floats]:
    """Return the window of a picture that holds a speck, and how far its pixels are from the middle: along, across."""
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


def covered(specks: Sequence[Speck], views: Sequence[View], left: Sequence[Pixels]) -> list[Mask]:
    """Return where specks are in each view, shape (H, W) each; nothing else can be told there.

    Parameters
    ----------
    specks : sequence of Speck
    views : sequence of View
    left : sequence of ndarray, shape (H, W, 3)
        What they show beside ghosts, star and halo. Where the model does not show a speck, it is taken to be there
        if that is most of the light.
    """
    masks = [np.zeros(view.pixels.shape[:2], dtype=np.bool_) for view in views]
    least = _BRIGHT * darkest_noise(views)
    for speck in specks:
        shown = enumerate(speck.outlines, start=speck.first)
        beyond = ((k, at) for k, at in speck.beyond if _outshone(views[k], at, left[k], least))
        for k, at in (*shown, *beyond):
            margin = _AROUND_PX * _unit(views[k])
            window, *off = _about(views[k], at, margin)
            masks[k][window] |= _within(at, off, margin)
    return masks


def _outshone(view: View, at: Outline, left: Pixels, least: float) -> bool:
    """Tell whether most of the light where a speck would be is not explained, and bright."""
    window, *off = _about(view, at, 0.0)
    inside = _within(at, off, 0.0)
    rest, light = np.abs(left[window][inside]), view.pixels[window][inside]
    known = np.isfinite(rest)
    return bool(known.any() and rest[known].max() > least and rest[known].mean() > _MOST_OF_IT * light[known].mean())


def speck_sprites(
    specks: Sequence[Speck], views: Sequence[View], pixels: Sequence[Pixels], masks: Sequence[Mask]
) -> tuple[Sprite, ...]:
    """Learn what is left at specks.

    Parameters
    ----------
    specks : sequence of Speck
        From `specks_of`.
    views : sequence of View
    pixels : sequence of ndarray, shape (H, W, 3)
        What they show beside everything else.
    masks : sequence of ndarray, shape (H, W)
        Where that may be believed.

    Returns
    -------
    tuple of Sprite
        Those whose pictures hold anything.
    """
    step = DIGIT * darkest_noise(views) / (_CELL_PX * _unit(views[0]))
    left = [each.copy() for each in pixels]
    found = []
    for speck in specks:
        sprite = _learned(speck, views, left, masks, step)
        if sprite is None:
            continue
        found.append(sprite)
        for k, at in enumerate(speck.outlines, start=speck.first):
            picture = sprite_at(sprite, views[k].constellation_deg)
            add_speck(left[k], Grid.of(sprite), at, views[k].frame, -picture)
    return tuple(found)


def _grid(speck: Speck, unit: float) -> Grid:
    """Return cells that hold a speck where it is largest."""
    largest = max(speck.outlines, key=lambda one: one.half[0] * one.half[1])
    grain = _CELL_PX * unit
    columns, rows = (2 * ceil((half + _BESIDE_PX * unit) / grain) for half in largest.half)
    return Grid(grain, (-0.5 * columns * grain, -0.5 * rows * grain), rows, columns, largest.spread)


def _learned(
    speck: Speck, views: Sequence[View], pixels: Sequence[Pixels], masks: Sequence[Mask], step: float
) -> Sprite | None:
    """Solve for one speck's pictures; None where nothing of it is left."""
    grid = _grid(speck, _unit(views[0]))
    shown = views[speck.first : speck.first + len(speck.outlines)]
    angles = even_knots(shown, max(2, ceil(len(shown) / _VIEWS)))
    told = _told(grid, angles, shown, speck, pixels, masks)
    if told is None:
        return None
    solved = _solved(told, len(angles), grid)
    pictures = _bright(solved.reshape(len(angles), grid.rows, grid.columns, 3))
    if not np.abs(pictures).max() > step:
        return None
    unit, packed_cells = packed(pictures, step)
    return Sprite(
        follows="speck", ghost=speck.name, spread_px=grid.spread_px, grain_px=grid.grain_px, corner_px=grid.corner_px,
        constellation_deg=angles, rows=grid.rows, columns=grid.columns, unit=unit,
        cells=packed_cells,
    )  # fmt: skip


def _told(
    grid: Grid, angles: tuple[float, ...], shown: Sequence[View], speck: Speck, pixels: Sequence[Pixels],
    masks: Sequence[Mask],
) -> _Told | None:  # fmt: skip
    """Gather what views tell of a speck's cells; None where too few do."""
    parts = []
    for k, (view, at) in enumerate(zip(shown, speck.outlines, strict=True), start=speck.first):
        read = reading(grid, at, view.frame, view.size_px)
        value = pixels[k][read.rows, read.columns].astype(np.float64)
        known = masks[k][read.rows, read.columns] & np.isfinite(value).all(axis=1) & read.weights.any(axis=1)
        if not known.any():
            continue
        own, light = (each[read.rows[known], read.columns[known]].mean(axis=1) for each in (view.variance, view.pixels))
        before, far = between(np.array(angles), view.constellation_deg)
        count = int(known.sum())
        parts.append((
            read.cells[known], read.weights[known], np.full(count, before), np.full(count, far),
            1.0 / np.sqrt(own + (_OFF * light) ** 2).astype(np.float64), value[known],
        ))  # fmt: skip
    if len(parts) < _FEWEST:
        return None
    taps = max(part[0].shape[1] for part in parts)
    wide = [[np.pad(each, ((0, 0), (0, taps - each.shape[1]))) for each in part[:2]] for part in parts]
    cells, weights = (np.concatenate([pair[n] for pair in wide]) for n in (0, 1))
    return _Told(cells, weights, *(np.concatenate([part[n] for part in parts]) for n in (2, 3, 4, 5)))


def _solved(told: _Told, count: int, grid: Grid) -> Floats:
    """Solve for pictures, shape (count, cells, 3), by conjugate gradients on the normal equations.

    Hestenes and Stiefel (1952), Methods of conjugate gradients for solving linear systems; the system has the form of
    Tikhonov's. Colours are solved side by side.
    """
    how, cells = (told.cells, told.weights, told.before, told.part, told.sure), grid.rows * grid.columns
    squares = np.zeros((count, cells))
    square_cells(*how, squares)
    # so that every cell is as stiff, whether it is bright and little known or dark and well known
    size = np.sqrt(np.maximum(squares.mean(axis=0), 1e-12 * squares.max()))[None, :, None]
    shape, known = (count, grid.rows, grid.columns, 3), size.reshape(1, grid.rows, grid.columns, 1)
    bend = np.diff(np.eye(count), min(2, count - 1), axis=0)
    stiff = _BEND**2 * bend.T @ bend + _DAMP**2 * np.eye(count)

    def back(values: Floats) -> Floats:
        out = np.zeros((count, cells, 3))
        gather_cells(*how, values, out)
        return np.asarray(out / size)

    def normal(scaled: Floats) -> Floats:
        out = np.zeros((len(told.sure), 3))
        read_cells(*how, scaled / size, out)
        rough = _bends(known**2 * _bends((scaled / size).reshape(shape))).reshape(scaled.shape) / size
        return np.asarray(back(out) + np.tensordot(stiff, scaled, axes=1) + _ROUGH**2 * rough)

    rest = back(told.values * told.sure[:, None])
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
    """Return by how much each cell differs from those beside it, added up, shape (K, rows, columns, 3); 0 beyond."""
    out = 4.0 * pictures
    out[:, 1:] -= pictures[:, :-1]
    out[:, :-1] -= pictures[:, 1:]
    out[:, :, 1:] -= pictures[:, :, :-1]
    out[:, :, :-1] -= pictures[:, :, 1:]
    return out


def _bright(pictures: Floats) -> Pixels:
    """Leave out cells that tell of a speck's surroundings, which do not go with it."""
    largest = np.abs(pictures).max(axis=(0, 3))
    around = np.lib.stride_tricks.sliding_window_view(np.pad(largest, 1), (3, 3)).max(axis=(2, 3))
    kept = around > _LEAST * largest.max()
    return np.asarray(pictures * kept[:, :, None], dtype=np.float32)


def all_hidden(
    pictures: Sequence[Pixels], masks: Sequence[Mask], pool: ThreadPoolExecutor | None = None
) -> list[Pixels]:
    """Return pictures with what is in their masks not measured."""

    def hidden(pixels: Pixels, mask: Mask) -> Pixels:
        return np.where(mask[..., None], np.float32(np.nan), pixels)

    return shared_out(hidden, pictures, masks, pool=pool)
