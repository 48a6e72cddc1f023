"""Random rays through the whole lens, in numbered batches: what the reference renderer and the ledger share."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from threading import Event
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..kernels.montecarlo import BESIDE, ENTERED, IN_PICTURE, TALLIES, trace_batch
from ..kernels.stray import STRAYS
from ..optics.border import brightness, content, mapped, points, solid_angle
from ..optics.color import luminance_weights
from ..optics.region import front_box
from ..optics.scatter import ScatterTables
from .camera_rays import CameraSource, run_camera
from .shot import Shot, moved

Floats = NDArray[np.float64]
Batch = dict[str, NDArray[Any]]

# wavelengths traced from one point of the front: light of one place in several colours makes grey noise of coloured
HEROES = 4
# reflections to follow, on average, while a ray of high order crosses the lens once
FOLLOWED = 0.5
# rays that a ray of high order splits off at most, on average
MOST_BRED = 0.9
# directions squared into which a batch divides its points for an area light
AIMS = 8
# side of the blocks for which errors are kept, pixels
BLOCK = 16
# figures behind the kernel's tallies: what all ends of light differ by from what entered, and all ghosts in the picture
BALANCE, GHOSTS = TALLIES, TALLIES + 1
# and behind these, where surfaces scatter, what became of that light (`kernels.stray`)
STRAY = TALLIES + 2


@dataclass(frozen=True)
class RaySource:
    """One light and lens as the kernel reads them.

    Attributes
    ----------
    shot : Shot
    before, behind : tuple
        What the kernel takes before and behind the number of the batch.
    seed, side, light : int
    followed : tuple of float
    scatter : ScatterTables or None
    drawn : bool
        As given to `ray_source`.
    """

    shot: Shot
    before: tuple[Any, ...]
    behind: tuple[Any, ...]
    seed: int
    side: int
    light: int
    followed: tuple[float, float]
    scatter: ScatterTables | None = None
    drawn: bool = True


def ray_source(
    shot: Shot,
    seed: int,
    *,
    side: int,
    light: int,
    followed: tuple[float, float] = (FOLLOWED, FOLLOWED),
    scatter: ScatterTables | None = None,
    drawn: bool = True,
    chances: Chances | None = None,
) -> RaySource:
    """Prepare a light for random rays.

    Parameters
    ----------
    shot : Shot
        Its wavelengths are the spectral samples.
    seed : int
    side : int
        A batch has side x side points of the front.
    light : int
        Its number, which keeps its random numbers apart from those of other lights.
    followed : tuple of float
        Reflections to follow, on average, while a ray crosses the lens once: of rays of two or three reflections, and
        of those of more.
    scatter : ScatterTables, optional
        What surfaces scatter of the direct light; None: nothing.
    drawn : bool
        Whether the picture takes its ghosts; they may be met from the camera instead.
    chances : Chances, optional
        Of this shot or of one that differs in place and intensity only.

    Returns
    -------
    RaySource
    """
    packed, tilt, axes = shot.packed, shot.incidence.tilt, shot.incidence.axes
    box = front_box(packed, tilt)
    if packed.symmetric:
        box[0] = -box[1]
    direction = np.array([np.sin(tilt) * axes[1, 0], np.sin(tilt) * axes[1, 1], np.cos(tilt), packed.nearness])
    # rays run in the lens' own frame here, whatever the light
    form = packed.conic if packed.shapes is None else packed.shapes
    before = (
        packed.curvature, form, packed.z_vertex, packed.inv_semi, packed.n_gap, packed.reflectance,
        packed.sensor_z, (int(np.flatnonzero(packed.inv_semi == 0.0)[0]), packed.first_surface), direction, axes, box,
        side, *spectrum_of(shot, shot.gain, seed, followed, chances),
    )  # fmt: skip
    opening = shot.opening
    behind = (light, opening.blades, opening.mask, opening.half, shot.to_pixels, shot.size_px)
    return RaySource(shot, before, behind, seed, side, light, followed, scatter, drawn)


def _most_bred(followed: tuple[float, float]) -> Floats:
    """How many rays one may split off: as many as are wanted, and room; those of high order must die out."""
    return np.array([max(2.0 * followed[0], MOST_BRED), MOST_BRED])


@dataclass(frozen=True)
class Chances:
    """How often random rays are of each wavelength and what that makes of their colours, wherever their light stands.

    Attributes
    ----------
    cumulative : ndarray, shape (W,)
    rgb : ndarray, shape (W, 3)
    over : ndarray, shape (W, 1)
        1 over the chance; 0 where there is none.
    luminance : ndarray, shape (3,)
    reflected : float
        R of the whole lens at normal incidence.
    """

    cumulative: Floats
    rgb: Floats
    over: Floats
    luminance: Floats
    reflected: float


def chances_of(shot: Shot) -> Chances:
    """Choose wavelengths for a shot's light: a sample is drawn as often as it colours the picture."""
    rgb = shot.weights(shot.packed.wavelengths_nm)
    chance = np.abs(rgb).sum(axis=1)
    chance /= chance.sum()
    over = np.divide(1.0, chance, out=np.zeros_like(chance), where=chance > 0.0)[:, None]
    total = float(shot.packed.reflectance[len(rgb) // 2, :, -1].sum())
    return Chances(np.cumsum(chance), rgb, over, luminance_weights(shot.colorspace), total)


def spectrum_of(
    shot: Shot,
    gain: float,
    seed: int,
    followed: tuple[float, float] = (FOLLOWED, FOLLOWED),
    chances: Chances | None = None,
) -> tuple[Any, ...]:
    """Return what random rays take of wavelengths and chance, from `cumulative` to `key` of `trace_batch`.

    Parameters
    ----------
    shot : Shot
    gain : float
        Of a light of irradiance or radiance 1.
    seed : int
    followed : tuple of float
    chances : Chances, optional
        As in `ray_source`.

    Returns
    -------
    tuple
    """
    known = chances_of(shot) if chances is None else chances
    colors = known.over * gain * known.rgb
    # R of the whole lens decides how many reflections of high order are worth following
    return (
        known.cumulative, colors @ known.luminance, colors, min(HEROES, len(colors)),
        np.concatenate([np.array(followed) / max(known.reflected, 1e-9), _most_bred(followed)]),
        np.array([seed & 0xFFFFFFFF, seed >> 32], dtype=np.uint64),
    )  # fmt: skip


def _aimed(source: RaySource, batch: int) -> Iterator[RaySource]:
    """Yield a light as one batch sees it: of an area light some directions at random, each with its part of the points.

    Every batch has directions of its own, so the variance over batches knows of them.
    """
    shot = source.shot
    if shot.border is None:
        yield source
        return
    rng = np.random.default_rng([source.seed, batch, source.light])
    here = np.tan(np.radians(shot.light.field_deg))
    aims = AIMS if source.side % AIMS == 0 else 1
    mean = content(shot.border) / solid_angle(mapped(shot.border, np.eye(2), here))
    chances = chances_of(shot)
    for k, offset in enumerate(_points_within(shot.border, aims * aims, rng)):
        # even radiance: by solid angle
        share = mean / (1.0 + (here + offset) @ (here + offset)) ** 1.5 / aims**2
        there = moved(shot, here + offset)
        there = replace(there, light=there.light.replace(intensity=shot.light.intensity * share))
        # numbers of points stay apart from those of parts
        number = (source.light + 1) * 4096 + k
        yield ray_source(
            there,
            source.seed,
            side=source.side // aims,
            light=number,
            followed=source.followed,
            scatter=source.scatter,
            drawn=source.drawn,
            chances=chances,
        )


def _points_within(border: Floats, count: int, rng: np.random.Generator) -> Floats:
    """Draw points from a shape as it is bright, shape (count, 2)."""
    low, high = points(border).min(axis=0), points(border).max(axis=0)
    lit = max(abs(content(border)) / float(np.prod(high - low)), 1e-3)
    found = np.empty((0, 2))
    while len(found) < count:
        tried = low + (high - low) * rng.random((int(2.0 * count / lit), 2))
        found = np.concatenate([found, tried[rng.random(len(tried)) < brightness(border, tried)]])
    return found[:count]


def run_batch(
    sources: Sequence[RaySource],
    batch: int,
    *,
    picture: bool,
    fours: int = 0,
    cameras: Sequence[CameraSource] = (),
) -> Batch:
    """Trace one batch of every light.

    Parameters
    ----------
    sources : sequence of RaySource
    batch : int
        Its number; the same number gives the same light.
    picture : bool
        Whether pixels are wanted, or numbers only.
    fours : int
        For how many rays of four reflections of a light there is room to begin with; 0: they are not asked for.
    cameras : sequence of CameraSource
        Of lights whose ghosts are met from the camera, and not `drawn` from the light.

    Returns
    -------
    dict of str to ndarray
        "figures", shape (15,): luminous flux by what became of it (`kernels.montecarlo`), all from the lights, then
        BALANCE, and GHOSTS as the picture has them;
        where surfaces scatter 3 more, STRAY. "paths", shape (2, K, K): of two reflections, in the picture and beside
        it. With a picture also "planes", shape (2, 3, H, W), float32: flux per pixel after two reflections and after
        more, and third what was scattered; "blocks", shape (2, A, B): luminous flux in blocks of 16 x 16 pixels, after
        two reflections and of all ghosts, and third what was scattered. With `fours` also "fours", shape (N, 2): the
        rows of four reflections as one number, and luminous flux, ray by ray.
    """
    width, height = sources[0].shot.size_px
    rows = len(sources[0].shot.packed.curvature)
    planes = np.zeros((2, 3, height if picture else 0, width if picture else 0), dtype=np.float32)
    figures, paths = np.zeros(TALLIES + 2), np.zeros((2, rows, rows))
    strays, plane = np.zeros(STRAYS), np.zeros(planes.shape[1:], dtype=np.float32)
    notes = []
    nowhere, ghosts = np.zeros((2, 3, 0, 0), dtype=np.float32), 0.0
    for source in (aimed for each in sources for aimed in _aimed(each, batch)):
        room, ghosts_before = np.empty((fours, 2)), figures[IN_PICTURE + 1 : BESIDE].sum()
        table = source.scatter
        scatter = None if table is None else (table.tables, table.amounts, strays, plane)
        own = planes if source.drawn else nowhere
        noted = trace_batch(*source.before, batch, *source.behind, own, figures[:TALLIES], paths, room, scatter)
        ghosts += (figures[IN_PICTURE + 1 : BESIDE].sum() - ghosts_before) * source.drawn
        if 0 < fours < noted:
            # the same rays once more, for their notes only
            room = np.empty((noted, 2))
            aside = np.zeros(TALLIES), np.zeros_like(paths)
            elsewhere = None if table is None else (table.tables, table.amounts, np.zeros(STRAYS), nowhere[0])
            trace_batch(*source.before, batch, *source.behind, nowhere, *aside, room, elsewhere)
        notes.append(room[:noted])
    for camera in cameras:
        ghosts += run_camera(camera, batch, planes, np.zeros_like(paths))[1:].sum()
    figures[BALANCE] = figures[ENTERED + 1 : TALLIES].sum() + strays.sum() - figures[ENTERED]
    figures[GHOSTS] = ghosts
    scatters = sources[0].scatter is not None
    result: Batch = {"figures": np.concatenate([figures, strays]) if scatters else figures, "paths": paths}
    if fours:
        result["fours"] = np.concatenate(notes)
    if picture:
        if scatters:
            planes = np.concatenate([planes, plane[None]])
        light = np.tensordot(luminance_weights(sources[0].shot.colorspace), planes, (0, 1))
        two, more, *stray = (_in_blocks(plane) for plane in light)
        result |= {"planes": planes, "blocks": np.stack([two, two + more, *stray])}
    return result


def _in_blocks(plane: Floats) -> Floats:
    """Add up a picture in blocks of 16 x 16 pixels; those at the right and lower edge may be smaller."""
    height, width = plane.shape
    rows = np.add.reduceat(plane, np.arange(0, height, BLOCK), axis=0)
    blocks: Floats = np.add.reduceat(rows, np.arange(0, width, BLOCK), axis=1)
    return blocks


class Sums:
    """Sums over batches and of their squares; the memory is used again, so nobody else holds them."""

    def __init__(self, batches: int, sums: dict[str, Floats], squares: dict[str, Floats]) -> None:
        self.batches = batches
        self.sums = {name: array.copy() for name, array in sums.items()}
        self.squares = {name: array.copy() for name, array in squares.items()}

    def add(self, result: Batch) -> None:
        """Add the next batch."""
        for name, value in result.items():
            if name not in self.sums:
                self.sums[name], self.squares[name] = np.zeros(value.shape), np.zeros(value.shape)
            wide = value.astype(np.float64)
            self.sums[name] += wide
            wide *= wide
            self.squares[name] += wide
        self.batches += 1

    def mean(self, name: str) -> Floats:
        """Mean over the batches."""
        return self.sums[name] / self.batches

    def variance(self, name: str) -> Floats:
        """Variance of that mean, without bias; 0 before the second batch."""
        n = self.batches
        if n < 2:
            return np.zeros(self.sums[name].shape)
        spread = self.squares[name] - self.sums[name] ** 2 / n
        # rounding may leave a little below 0 where every batch gave the same
        variance: Floats = np.maximum(spread, 0.0) / (n * (n - 1.0))
        return variance


def batches_in_order(work: Callable[[int], Batch], first: int, threads: int) -> Generator[Batch, None, None]:
    """Work on batches in threads and hand them out in the order of their numbers, without end.

    Parameters
    ----------
    work : callable
        Gets a batch's number.
    first : int
    threads : int
        As many batches are in work at once.

    Yields
    ------
    dict of str to ndarray
        What `work` returned.
    """
    waiting: deque[Future[Batch]] = deque()
    left_off = Event()

    def unless_left_off(number: int) -> Batch:
        return {} if left_off.is_set() else work(number)

    with ThreadPoolExecutor(threads) as pool:
        try:
            while True:
                while len(waiting) < threads:
                    waiting.append(pool.submit(unless_left_off, first))
                    first += 1
                yield waiting.popleft().result()
        finally:
            left_off.set()
            for future in waiting:
                future.cancel()
