"""Learn sprites: the residual of views beside ghosts, star and halo, as small images over the constellation.

The star's shape follows the pupil, which rims vignette at larger constellations; the radial and angular laws of the
model do not describe that. Aligned at the light the star changes slowly, while unknown ghosts move across it and are
down-weighted as outliers. The remaining residual, mostly large faint ghosts, is stored coarsely about the axis for each
constellation.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from ...kernels.ghost_model.box_means import box_means
from ...model.measurement.sprite import Sprite, encode_pictures
from ...typing import Floats, Indices, Mask, Pixels
from ..core.parallel import map_batched
from ..core.parameter_vector import frame
from ..core.robust import MAD_TO_SIGMA
from ..core.views import View
from ..replay.sprites import draw_sprites, samples, sprite_at, sprite_interval, turned_ways, ways

# cells of the coarsest images that follow the light, across a picture, and their number on each side of the light; a
# larger image would learn borders of ghosts, which do not follow the light
_COARSE, _AROUND = 44, 24
# radius of the star's core, part of the picture's width
_CORE = 0.07
# of the sprite about the axis: pixels per cell, and largest and least number of cells across a picture
_CELL_PX, _MOST_CELLS, _LEAST_CELLS = 3.0, 240, 90
# unknown cells that interpolation reads beyond the last known one; they repeat it
_NEXT = 3
# views per image that follows the light, and largest number of images: following the light, and about the axis
VIEWS, _MOST_LIGHT, _MOST_AXIS = 5, 12, 60
# regularization of cells over the constellation against the weight of one view: second differences and first
_BEND, _SLOPE = 0.02, 0.002
# rounds of down-weighting outliers, and deviation of an outlier, in median deviations
_ROUNDS, _FAR = 4, 3.0
# signal-to-noise power ratio below which a cell is noise
_NOISE = 1.5
# least measured part of a cell, and least part of the views of an image that must know it
_MEASURED, ENOUGH = 0.3, 0.6
# quantization step of a cell, part of the noise of the darkest pixels averaged over the cell
DIGIT = 0.3
_CHUNK = 2000


def light_sprites(
    views: Sequence[View], pixels: Sequence[Pixels], starry: bool, pool: ThreadPoolExecutor | None = None,
    series: int = 1,
) -> tuple[Sprite, ...]:  # fmt: skip
    """Learn the sprites that follow the light.

    Parameters
    ----------
    views : sequence of View
        Sorted by constellation.
    pixels : sequence of ndarray, shape (H, W, 3)
        Residual of the views; NaN where nothing was measured.
    starry : bool
        Whether there is a star. It does not turn when the light rolls, nor do images within its core. All others turn
        with the light, as ghosts do.
    pool : executor, optional
    series : int
        Number of series of captures, of different rolls, that share the largest number of images.

    Returns
    -------
    tuple of Sprite
        From coarse and large to fine; their images are summed.
    """
    width = views[0].size_px[0]
    finest = max(0, int(np.floor(np.log2(max(width / _COARSE, 1.0)))))
    left = list(pixels)
    found: list[Sprite] = []
    angles = even_knots(views, min(_MOST_LIGHT // series, len(views) // VIEWS))
    usual = float(np.median(np.unwrap([view.roll_deg for view in views], period=360.0)))
    for level in range(finest, -1, -1):
        grain = 2.0**level
        side = _AROUND * grain
        turns = not starry or (level > 0 and side > _CORE * width)
        sprite = _fitted(views, left, grain, side, angles, usual if turns else None, pool)
        found.append(sprite)
        left = beside_sprites(left, (sprite,), views, pool)
    return tuple(found)


def beside_sprites(
    left: Sequence[Pixels], sprites: Sequence[Sprite], views: Sequence[View], pool: ThreadPoolExecutor | None = None
) -> list[Pixels]:
    """Subtract sprites from the residual of views."""
    return map_batched(lambda each, view: each - drawn(sprites, view), left, views, pool=pool)


def axis_sprite(
    views: Sequence[View], pixels: Sequence[Pixels], pool: ThreadPoolExecutor | None = None, series: int = 1
) -> Sprite:
    """Learn the remaining residual, coarsely, about the axis.

    Parameters
    ----------
    views, pixels, pool, series
        As for `light_sprites`.
    """
    width, height = views[0].size_px
    grain = min(max(width / _MOST_CELLS, _CELL_PX), width / _LEAST_CELLS)
    corners = np.array([[x, y] for x in (0.0, width) for y in (0.0, height)])
    places = np.concatenate([_turned(corners - view.frame[:2], view) for view in views])
    low, high = np.floor(places.min(axis=0) / grain), np.ceil(places.max(axis=0) / grain)
    columns, rows = (high - low).astype(int)
    along, down = _middles(low[0] * grain, low[1] * grain, grain, int(rows), int(columns))
    groups = np.array_split(np.arange(len(views)), min(len(views), max(1, _MOST_AXIS // series)))

    def of(group: Indices) -> tuple[Floats, Floats]:
        light, noise, total = np.zeros((3, rows, columns, 3))
        for k in group:
            mean, variance, weight = _cells(pixels[k], views[k], *_placed(views[k], along, down), grain)
            light, noise, total = light + weight * mean, noise + weight**2 * variance, total + weight
        known = total > 0.0
        light = np.where(known, light / np.maximum(total, 1e-9), np.nan)
        return light, np.where(known, noise / np.maximum(total, 1e-9) ** 2, 0.0)

    pictures, noises = zip(*map_batched(of, groups, pool=pool), strict=True)
    unit, cells = encode_pictures(
        filled_from_neighbours(_filled(filled_from_neighbours(sure(np.stack(pictures), np.stack(noises)), _NEXT))),
        DIGIT * darkest_noise(views) / grain,
    )
    rolls = np.unwrap([view.roll_deg for view in views], period=360.0)
    return Sprite(
        follows="ghosts", grain_px=grain, corner_px=(float(low[0] * grain), float(low[1] * grain)),
        rolls_deg=tuple(float(rolls[group].mean()) for group in groups),
        constellation_deg=tuple(float(np.mean([views[int(k)].constellation_deg for k in group])) for group in groups),
        rows=int(rows), columns=int(columns), unit=unit, cells=cells,
    )  # fmt: skip


def nearest_views(sprite: Sprite, views: Sequence[View]) -> list[int]:
    """Return the index of the view nearest to the constellation of each image of a sprite."""
    angles = [view.constellation_deg for view in views]
    return [int(np.argmin(np.abs(np.subtract(angles, at)))) for at in sprite.constellation_deg]


def light_in_cells(sprite: Sprite, view: View) -> tuple[Floats, Floats]:
    """Return the light of a view in the cells of a sprite about the axis, and its noise.

    Returns
    -------
    light, noise : ndarray, shape (rows, columns, 3)
        Means and their standard deviations; NaN where nothing was measured.
    """
    along, down = _middles(*sprite.corner_px, sprite.grain_px, sprite.rows, sprite.columns)
    mean, variance, weight = _cells(view.measured, view, *_placed(view, along, down), sprite.grain_px)
    seen = weight > 0.0
    return np.where(seen, mean, np.nan), np.where(seen, np.sqrt(variance), np.nan)


def fine_cells(sprite: Sprite, view: View, pixels: Pixels, parts: int) -> tuple[Floats, Floats]:
    """Return the mean in each part of a sprite's cells, and its variance.

    Parameters
    ----------
    sprite : Sprite
        Sprite about the axis.
    view : View
    pixels : ndarray, shape (H, W, 3)
        Residual of the view; NaN where unknown.
    parts : int
        Parts along each side of a cell.

    Returns
    -------
    light, variance : ndarray, shape (parts rows, parts columns, 3)
        Means; NaN where nothing was measured.
    """
    grain = sprite.grain_px / parts
    along, down = _middles(*sprite.corner_px, grain, sprite.rows * parts, sprite.columns * parts)
    mean, variance, weight = _cells(pixels, view, *_placed(view, along, down), grain)
    return np.where(weight > 0.0, mean, np.nan), variance


def _placed(view: View, along: Floats, down: Floats) -> tuple[Floats, Floats]:
    """Return columns and rows of places given towards the light and across its line, from the axis."""
    ax, ay, cosine, sine, _ = view.frame
    return ax + cosine * along + sine * down, ay - sine * along + cosine * down


def drawn(sprites: Sequence[Sprite], view: View) -> Pixels:
    """Draw sprites as a view shows them, shape (H, W, 3)."""
    ax, ay, _, _, _ = view.frame
    axis = float(ax), float(ay)
    out = np.zeros_like(view.pixels)
    for one in sprites:
        picture = [sprite_at(one, view.constellation_deg)]
        for way in ways(one, view.constellation_deg, view.roll_deg, _off_axis(view)):
            _, _, cosine, sine, _ = frame(axis, way.roll_deg, view.constellation_deg, 1.0)
            toward = float(cosine), float(sine)
            light = draw_sprites([one], picture, view.light_px, axis, toward, view.size_px, turned_deg=way.turned_deg)
            out += np.float32(way.share) * light
    return out


def _off_axis(view: View) -> float:
    """Return the distance of a view's light from the axis, part of the picture's width."""
    return view.off_axis_px / view.size_px[0]


def darkest_noise(views: Sequence[View]) -> float:
    """Return the standard deviation of the darkest pixels; 0 where nothing was measured."""
    least = min((view.darkest_noise for view in views), default=0.0)
    return least if np.isfinite(least) else 0.0


def even_knots(views: Sequence[View], count: int) -> tuple[float, ...]:
    """Return `count` constellations, evenly spaced from the first to the last; their mean if `count` is below two."""
    angles = [view.constellation_deg for view in views]
    if count < 2:
        return (float(np.mean(angles)),)
    return tuple(map(float, np.linspace(angles[0], angles[-1], count)))


def _turned(offsets: Floats, view: View) -> Floats:
    """Rotate offsets (right, down) to (towards the light, across its line)."""
    cosine, sine = view.frame[2], view.frame[3]
    return np.stack([cosine * offsets[:, 0] - sine * offsets[:, 1], sine * offsets[:, 0] + cosine * offsets[:, 1]], 1)


def _middles(left: float, top: float, grain: float, rows: int, columns: int) -> tuple[Floats, Floats]:
    x, y = np.meshgrid(left + grain * (np.arange(columns) + 0.5), top + grain * (np.arange(rows) + 0.5))
    return x, y


def _fitted(
    views: Sequence[View],
    pixels: Sequence[Pixels],
    grain: float,
    side: float,
    angles: tuple[float, ...],
    roll_deg: float | None,
    pool: ThreadPoolExecutor | None,
) -> Sprite:
    """Fit the images of one cell size, cell by cell, up to `side` on each side of the light.

    They turn with the light, starting at `roll_deg`, or stay upright if that is None.
    """
    rolls = () if roll_deg is None else (roll_deg,) * len(angles)
    columns = rows = 2 * round(side / grain)
    right, down = _middles(-side, -side, grain, rows, columns)
    values = np.zeros((len(views), rows, columns, 3), np.float32)
    weights, noise = np.zeros_like(values), np.zeros_like(values[0])

    def one(view: View, picture: Pixels) -> tuple[Floats, Floats, Floats]:
        return _cells(picture, view, *_beside_light(view, right, down, roll_deg), grain)

    for k, (mean, variance, weight) in enumerate(map_batched(one, views, pixels, pool=pool)):
        values[k], weights[k] = mean, weight
        noise += weights[k] ** 2 * variance
    pictures = pictures_over(angles, views, values, weights, noise, pool)
    # fade a fine image to 0 at its border, where the coarse images continue
    pictures *= np.outer(_window(rows), _window(columns))[..., None]
    unit, cells = encode_pictures(pictures, DIGIT * darkest_noise(views) / grain)
    return Sprite(
        follows="light", grain_px=grain, corner_px=(-side, -side), rolls_deg=rolls, constellation_deg=angles,
        rows=rows, columns=columns, unit=unit, cells=cells,
    )  # fmt: skip


def _beside_light(view: View, right: Floats, down: Floats, roll_deg: float | None) -> tuple[Floats, Floats]:
    """Return columns and rows of places beside the light, rotated like the largest share of `ways`."""
    turned = 0.0
    if roll_deg is not None:
        turned = max(turned_ways(roll_deg, view.roll_deg, _off_axis(view)), key=lambda way: way.share).turned_deg
    cosine, sine = np.cos(np.radians(turned)), np.sin(np.radians(turned))
    return view.light_px[0] + cosine * right + sine * down, view.light_px[1] - sine * right + cosine * down


def pictures_over(
    angles: tuple[float, ...], views: Sequence[View], values: Pixels, weights: Pixels, noise: Floats | Pixels,
    pool: ThreadPoolExecutor | None = None,
) -> Pixels:  # fmt: skip
    """Fit images over the constellation to the cells of views.

    Parameters
    ----------
    angles : tuple of float
        Constellations of the images.
    views : sequence of View
    values, weights : ndarray, shape (V, rows, columns, 3)
        Values of each view and their weights; 0: not measured.
    noise : ndarray, shape (rows, columns, 3)
        Variance of the values times squared weights, summed over the views.
    pool : executor, optional

    Returns
    -------
    ndarray, shape (K, rows, columns, 3), float32
        Cells with too few views, in total or near an image's constellation, are filled from their neighbours.
    """
    angles_deg, knots = np.array([view.constellation_deg for view in views]), np.array(angles)
    flat, shape = (len(views), -1), (len(angles), *noise.shape)
    found = over_angles(values.reshape(flat), weights.reshape(flat), angles_deg, knots, pool)
    near = seen_near(weights.reshape(flat), angles_deg, knots)
    total = weights.sum(axis=0)
    known = total >= ENOUGH * len(views) / max(len(angles), VIEWS)
    noise = np.where(known, noise * len(angles) / np.maximum(total, 1e-9) ** 2, 0.0)
    pictures = np.where(known & near.reshape(shape), found.reshape(shape), np.nan)
    return filled_from_neighbours(sure(pictures, np.broadcast_to(noise, shape)))


def _window(count: int) -> Pixels:
    """Return a window of 1 that falls smoothly to 0 over the outer eighths."""
    away = np.minimum(np.arange(count), count - 1 - np.arange(count)) / max(count / 8.0, 1.0)
    return np.asarray(np.sin(0.5 * np.pi * np.minimum(away, 1.0)) ** 2, dtype=np.float32)


def over_angles(
    values: Pixels, weights: Pixels, angles_deg: Floats, knots: Floats, pool: ThreadPoolExecutor | None = None
) -> Pixels:
    """Fit every cell over the constellation, linearly between knots, robust against outliers; shape (K, cells)."""
    basis = _hats(angles_deg, knots)
    count = knots.size
    bend, slope = np.diff(np.eye(count), 2, axis=0), np.diff(np.eye(count), axis=0)
    stiff = _BEND * bend.T @ bend + _SLOPE * slope.T @ slope + 1e-6 * np.eye(count)
    products = (basis[:, :, None] * basis[:, None, :]).reshape(angles_deg.size, -1)
    out = np.zeros((count, values.shape[1]), np.float32)
    seen = np.flatnonzero(weights.any(axis=0))

    def fit(part: Indices) -> None:
        value, own = values[:, part].astype(float), weights[:, part].astype(float)
        weight = own
        for turn in range(_ROUNDS):
            matrix = (products.T @ weight).T.reshape(-1, count, count) + stiff
            solved = np.linalg.solve(matrix, (basis.T @ (weight * value)).T[..., None])[..., 0]
            if turn == _ROUNDS - 1:
                break
            off = value - basis @ solved.T
            known = np.where(own > 0.0, np.abs(off), np.nan)
            off = off / (_FAR * MAD_TO_SIGMA * np.maximum(np.nanmedian(known, axis=0), 1e-12))
            # positive outliers are unknown ghosts, so they lose more weight
            weight = own / (1.0 + np.where(off > 0.0, off, 0.5 * off) ** 2)
        out[:, part] = solved.T

    map_batched(fit, np.array_split(seen, max(1, seen.size // _CHUNK)), pool=pool)
    return out


def seen_near(weights: Pixels, angles_deg: Floats, knots: Floats) -> Mask:
    """Return which cells views show near each constellation; elsewhere a fit only extrapolates; shape (K, cells).

    Where the light rolls, images contain such cells: to the right of a light that was always at the right, for example.
    """
    hats = _hats(angles_deg, knots)
    least = np.minimum(ENOUGH, 0.5 * hats.sum(axis=0))
    return np.asarray(hats.T @ weights >= least[:, None])


def _hats(angles_deg: Floats, knots: Floats) -> Floats:
    """Return the weight of each knot at some constellations, linear between knots, shape (V, K)."""
    if knots.size == 1:
        return np.ones((angles_deg.size, 1))
    k, part = sprite_interval(knots, angles_deg)
    basis = np.zeros((angles_deg.size, knots.size))
    basis[np.arange(angles_deg.size), k], basis[np.arange(angles_deg.size), k + 1] = 1.0 - part, part
    return basis


def _boxes(picture: Pixels, x: Floats, y: Floats, side: float) -> tuple[Floats, Floats]:
    """Return the mean of upright squares around places and their measured part, shape (..., 3) each."""
    mean, part = np.empty((2, x.size, 3))
    box_means(np.asarray(picture, dtype=np.float32), x.ravel(), y.ravel(), side, mean, part)
    return mean.reshape(*x.shape, 3), part.reshape(*x.shape, 3)


def _cells(picture: Pixels, view: View, x: Floats, y: Floats, side: float) -> tuple[Floats, Floats, Floats]:
    """Return light, its variance and its weight (0: not measured) around places, shape (..., 3) each."""
    if side > 1.0:
        mean, part = _boxes(picture, x, y, side)
    else:
        mean, part = cell_points(picture, x, y)
    row = np.clip(y.astype(np.int64), 0, picture.shape[0] - 1)
    column = np.clip(x.astype(np.int64), 0, picture.shape[1] - 1)
    weight = np.where((part > _MEASURED) & np.isfinite(view.variance[row, column]), part, 0.0)
    variance = np.where(weight > 0.0, view.variance[row, column] / np.maximum(part * side**2, 1e-9), 0.0)
    return np.where(weight > 0.0, mean, 0.0), variance, weight


def sure(pictures: Floats, variance: Floats) -> Floats:
    """Attenuate each cell of images by its signal-to-noise ratio; NaN stays NaN.

    For light of power s in noise of power n, least squares keep 1 - n / (s + n) (Wiener); s + n is the mean over the
    colours and the adjacent cells.
    """
    ratio = np.where(np.isnan(pictures), 0.0, pictures**2 / np.maximum(variance, 1e-30)).mean(axis=3)
    padded = np.pad(ratio, ((0, 0), (1, 1), (1, 1)), mode="edge")
    rows, columns = ratio.shape[1:]
    power = sum(padded[:, a : a + rows, b : b + columns] for a in range(3) for b in range(3)) / 9.0
    kept = np.where(power > _NOISE, 1.0 - 1.0 / np.maximum(power, 1.0), 0.0)
    return np.asarray(pictures * kept[..., None])


def cell_points(picture: Pixels, x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Return values between pixels, and 1 where all pixels around were measured, shape (..., 3) each."""
    height, width = picture.shape[:2]
    # up to the picture's border, half a pixel beyond the centres of the outermost pixels
    inside = (x >= 0.0) & (x <= width) & (y >= 0.0) & (y <= height)
    column, row = np.clip(x - 0.5, 0.0, width - 1.0).ravel(), np.clip(y - 0.5, 0.0, height - 1.0).ravel()
    unknown = ~np.isfinite(picture)
    values = samples(np.where(unknown, 0.0, picture).astype(np.float32), column, row).reshape(*x.shape, 3)
    gaps = np.pad(unknown, ((1, 2), (1, 2), (0, 0)), mode="edge")
    near = np.zeros_like(unknown)
    for a in range(4):
        for b in range(4):
            near |= gaps[a : a + height, b : b + width]
    clear = ~near[row.astype(np.int64), column.astype(np.int64)].reshape(*x.shape, 3)
    return values.astype(float), (clear & inside[..., None]).astype(float)


def filled_from_neighbours(pictures: Floats | Pixels, far: int | None = None) -> Pixels:
    """Fill unknown cells from adjacent known ones, ring by ring; with 0 in images without any known cell.

    With `far`, fill only this many rings; cells beyond stay NaN.
    """
    out = np.asarray(pictures, dtype=np.float32)
    while far is None or far > 0:
        gaps = np.isnan(out)
        if not gaps.any() or gaps.all(axis=(1, 2)).any():
            return np.nan_to_num(out) if far is None else out
        far = None if far is None else far - 1
        padded = np.pad(out, ((0, 0), (1, 1), (1, 1), (0, 0)), constant_values=np.nan)
        around = np.stack([padded[:, :-2, 1:-1], padded[:, 2:, 1:-1], padded[:, 1:-1, :-2], padded[:, 1:-1, 2:]])
        count = np.isfinite(around).sum(axis=0)
        mean = np.nansum(around, axis=0) / np.maximum(count, 1)
        out = np.where(gaps & (count > 0), mean, out)
    return out


def _filled(pictures: Floats | Pixels) -> Pixels:
    """Fill cells without a value at one constellation from the nearest constellation that has one."""
    count = len(pictures)
    out = pictures.copy()
    for k in range(count):
        for other in sorted(range(count), key=lambda n: abs(n - k)):
            gaps = np.isnan(out[k])
            if not gaps.any():
                break
            out[k][gaps] = pictures[other][gaps]
    return np.asarray(out, dtype=np.float32)
