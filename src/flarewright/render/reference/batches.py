"""Random rays through the whole lens in numbered batches, for reference quality and the energy ledger."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from threading import Event
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...kernels.montecarlo.arguments import Chances, FrontPoints, LightSums, Scattering, SpectralSamples
from ...kernels.montecarlo.forward import BESIDE, ENTERED, IN_PICTURE, TALLIES, trace_batch
from ...kernels.montecarlo.scattered_rays import STRAYS
from ...optics.colour.rgb import luminance_weights
from ...optics.pupil.polygon import content, mapped, points, shape_brightness, solid_angle
from ...optics.rays.pupil_region import front_box
from ...optics.scattering.brdf import ScatterTables
from ...typing import Floats, Pixels
from ..scene.shot import Shot, moved
from .camera_rays import CameraSource, run_camera
from .shot_arrays import shot_arrays

Batch = dict[str, NDArray[Any]]

# wavelengths traced from one point of the front: sharing a point turns coloured noise into grey noise
HEROES = 4
# mean number of reflections to follow per crossing of the lens, for rays of high order
FOLLOWED = 0.5
# largest mean number of rays that a ray of high order splits off
MOST_SPLIT = 0.9
# directions per axis over which a batch distributes its points for an area light
AIM_SIDE = 8
# side of the blocks for which errors are recorded, pixels
BLOCK = 16
# figures after the kernel's tallies: difference between all ends of light and its start, and all ghosts in the picture
BALANCE, GHOSTS = TALLIES, TALLIES + 1
# after these, if surfaces scatter: the ends of scattered light (`kernels.montecarlo.scattered_rays`)
STRAY = TALLIES + 2


@dataclass(frozen=True)
class RaySource:
    """One light and the lens, as kernel arguments.

    Attributes
    ----------
    shot : Shot
    points : FrontPoints
    samples : SpectralSamples
    chances : Chances
    seed, side, light : int
    followed : tuple of float
    scatter : ScatterTables or None
    drawn : bool
        As given to `ray_source`; `light`, `seed`, `side`, `followed` and `scatter` too.
    """

    shot: Shot
    points: FrontPoints
    samples: SpectralSamples
    chances: Chances
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
    sampling: SpectralSampling | None = None,
) -> RaySource:
    """Prepare a light for random rays.

    Parameters
    ----------
    shot : Shot
        Its wavelengths are spectral samples.
    seed : int
    side : int
        A batch has side x side points on the front.
    light : int
        Index of the light, which makes its random numbers independent of those of other lights.
    followed : tuple of float
        Mean number of reflections to follow per crossing of the lens: for rays of two or three reflections, and for
        rays of more.
    scatter : ScatterTables, optional
        Scatter of the direct light; None: no scatter.
    drawn : bool
        Whether its ghosts are added to the picture; False if they are traced from the camera instead.
    sampling : SpectralSampling, optional
        Of this shot, or of a shot that differs only in direction and intensity.
    """
    packed, tilt, axes = shot.packed, shot.incidence.tilt, shot.incidence.axes
    box = front_box(packed, tilt)
    if packed.symmetric:
        box[0] = -box[1]
    direction = np.array([np.sin(tilt) * axes[1, 0], np.sin(tilt) * axes[1, 1], np.cos(tilt), packed.nearness])
    points = FrontPoints(direction, axes, box, side, packed.first_surface)
    samples, chances = spectrum_of(shot, shot.gain, seed, followed, sampling)
    return RaySource(shot, points, samples, chances, seed, side, light, followed, scatter, drawn)


def _split_limits(followed: tuple[float, float]) -> Floats:
    """Return the limits of rays that one splits off: twice the target for low orders; high orders must die out."""
    return np.array([max(2.0 * followed[0], MOST_SPLIT), MOST_SPLIT])


@dataclass(frozen=True)
class SpectralSampling:
    """Probabilities of the spectral samples of random rays and the resulting colours, for any direction of the light.

    Attributes
    ----------
    cumulative : ndarray, shape (W,)
    rgb : ndarray, shape (W, 3)
    over : ndarray, shape (W, 1)
        1 / probability; 0 where it is 0.
    luminance : ndarray, shape (3,)
    reflected : float
        Sum of the surfaces' R at normal incidence.
    """

    cumulative: Floats
    rgb: Floats
    over: Floats
    luminance: Floats
    reflected: float


def spectral_sampling(shot: Shot) -> SpectralSampling:
    """Choose the probability of each spectral sample in proportion to its contribution to the picture."""
    rgb = shot.weights(shot.packed.wavelengths_nm)
    chance = np.abs(rgb).sum(axis=1)
    chance /= chance.sum()
    over = np.divide(1.0, chance, out=np.zeros_like(chance), where=chance > 0.0)[:, None]
    total = float(shot.packed.reflectance[len(rgb) // 2, :, -1].sum())
    return SpectralSampling(np.cumsum(chance), rgb, over, luminance_weights(shot.colorspace), total)


def spectrum_of(
    shot: Shot,
    gain: float,
    seed: int,
    followed: tuple[float, float] = (FOLLOWED, FOLLOWED),
    sampling: SpectralSampling | None = None,
) -> tuple[SpectralSamples, Chances]:
    """Return the wavelengths among which random rays choose, and their chances, as kernel arguments.

    Parameters
    ----------
    shot : Shot
    gain : float
        Factor for a light of irradiance or radiance 1.
    seed : int
    followed : tuple of float
    sampling : SpectralSampling, optional
        As in `ray_source`.

    Returns
    -------
    samples : SpectralSamples
    chances : Chances
    """
    known = spectral_sampling(shot) if sampling is None else sampling
    colors = known.over * gain * known.rgb
    # the lens' R determines how many reflections of high order to follow
    boosts = np.concatenate([np.array(followed) / max(known.reflected, 1e-9), _split_limits(followed)])
    return (
        SpectralSamples(known.cumulative, colors @ known.luminance, colors, min(HEROES, len(colors))),
        Chances(boosts, np.array([seed & 0xFFFFFFFF, seed >> 32], dtype=np.uint64)),
    )


def _aimed(source: RaySource, batch: int) -> Iterator[RaySource]:
    """Yield the sources of a light in one batch: for an area light, random directions with equal parts of the points.

    Every batch draws new directions, so the variance over batches includes their effect.
    """
    shot = source.shot
    if shot.border is None:
        yield source
        return
    rng = np.random.default_rng([source.seed, batch, source.light])
    here = np.tan(np.radians(shot.light.field_deg))
    aims = AIM_SIDE if source.side % AIM_SIDE == 0 else 1
    mean = content(shot.border) / solid_angle(mapped(shot.border, np.eye(2), here))
    sampling = spectral_sampling(shot)
    for k, offset in enumerate(_points_within(shot.border, aims * aims, rng)):
        # uniform radiance: weight by solid angle
        share = mean / (1.0 + (here + offset) @ (here + offset)) ** 1.5 / aims**2
        there = moved(shot, here + offset)
        there = replace(there, light=there.light.replace(intensity=shot.light.intensity * share))
        # keep random numbers of directions apart from those of lights
        number = (source.light + 1) * 4096 + k
        yield ray_source(
            there,
            source.seed,
            side=source.side // aims,
            light=number,
            followed=source.followed,
            scatter=source.scatter,
            drawn=source.drawn,
            sampling=sampling,
        )


def _points_within(border: Floats, count: int, rng: np.random.Generator) -> Floats:
    """Draw random points from a shape in proportion to its brightness, shape (count, 2)."""
    low, high = points(border).min(axis=0), points(border).max(axis=0)
    lit = max(abs(content(border)) / float(np.prod(high - low)), 1e-3)
    found = np.empty((0, 2))
    while len(found) < count:
        tried = low + (high - low) * rng.random((int(2.0 * count / lit), 2))
        found = np.concatenate([found, tried[rng.random(len(tried)) < shape_brightness(border, tried)]])
    return found[:count]


def run_batch(
    sources: Sequence[RaySource], batch: int, *, picture: bool, fours: int = 0, cameras: Sequence[CameraSource] = ()
) -> Batch:
    """Trace one batch of every light.

    Parameters
    ----------
    sources : sequence of RaySource
    batch : int
        Number of the batch, which determines its random numbers.
    picture : bool
        Whether to compute pixels, or numbers only.
    fours : int
        Initial number of four-reflection rays per light to record; 0: none are recorded.
    cameras : sequence of CameraSource
        Area lights whose ghosts are traced from the camera; their `sources` are not `drawn`.

    Returns
    -------
    dict of str to ndarray
        "figures", shape (15,): luminous flux by where it ends (`montecarlo.forward`), traced from the lights; then
        BALANCE, and GHOSTS as in the picture; 3 more from STRAY on if surfaces scatter. "paths", shape (2, K, K): flux
        of two-reflection paths in the picture and beside it. With `picture` also "planes", shape (2, 3, H, W), float32:
        flux per pixel after two reflections and after more, plus a third plane of scattered light; and "blocks", shape
        (2, A, B): luminous flux in blocks of 16 x 16 pixels after two reflections and of all ghosts, plus a third of
        scattered light. With `fours` also "fours", shape (N, 2): for each ray the rows of its four reflections as one
        number, and its luminous flux.
    """
    width, height = sources[0].shot.size_px
    rows = len(sources[0].shot.packed.curvature)
    planes = np.zeros((2, 3, height if picture else 0, width if picture else 0), dtype=np.float32)
    figures, paths = np.zeros(TALLIES + 2), np.zeros((2, rows, rows))
    strays, plane = np.zeros(STRAYS), np.zeros(planes.shape[1:], dtype=np.float32)
    records = []
    nowhere, ghosts = np.zeros((2, 3, 0, 0), dtype=np.float32), 0.0
    for source in (aimed for each in sources for aimed in _aimed(each, batch)):
        room, ghosts_before = np.empty((fours, 2)), figures[IN_PICTURE + 1 : BESIDE].sum()
        sums = LightSums(planes if source.drawn else nowhere, figures[:TALLIES], paths)
        recorded = _trace(source, batch, sums, room, strays, plane)
        ghosts += (figures[IN_PICTURE + 1 : BESIDE].sum() - ghosts_before) * source.drawn
        if 0 < fours < recorded:
            # trace the same rays again with room for all records
            room = np.empty((recorded, 2))
            aside = LightSums(nowhere, np.zeros(TALLIES), np.zeros_like(paths))
            _trace(source, batch, aside, room, np.zeros(STRAYS), nowhere[0])
        records.append(room[:recorded])
    for camera in cameras:
        ghosts += run_camera(camera, batch, planes, np.zeros_like(paths))[1:].sum()
    figures[BALANCE] = figures[ENTERED + 1 : TALLIES].sum() + strays.sum() - figures[ENTERED]
    figures[GHOSTS] = ghosts
    scatters = sources[0].scatter is not None
    result: Batch = {"figures": np.concatenate([figures, strays]) if scatters else figures, "paths": paths}
    if fours:
        result["fours"] = np.concatenate(records)
    if picture:
        if scatters:
            planes = np.concatenate([planes, plane[None]])
        light = np.tensordot(luminance_weights(sources[0].shot.colorspace), planes, (0, 1))
        two, more, *stray = (_in_blocks(plane) for plane in light)
        result |= {"planes": planes, "blocks": np.stack([two, two + more, *stray])}
    return result


def _trace(source: RaySource, batch: int, sums: LightSums, fours: Floats, strays: Floats, plane: Pixels) -> int:
    """Trace a batch of one light; return the number of rays after four reflections."""
    table, (lens, stop, frame) = source.scatter, shot_arrays(source.shot)
    scatter = None if table is None else Scattering(table.tables, table.amounts, strays, plane)
    recorded: int = trace_batch(
        lens, source.samples, source.points, source.chances, batch, source.light, stop, frame, sums, fours, scatter
    )
    return recorded


def _in_blocks(plane: Floats) -> Floats:
    """Sum a picture in blocks of 16 x 16 pixels; blocks at the right and lower edge can be smaller."""
    height, width = plane.shape
    rows = np.add.reduceat(plane, np.arange(0, height, BLOCK), axis=0)
    return np.add.reduceat(rows, np.arange(0, width, BLOCK), axis=1)


class Sums:
    """Sums of batches and of their squares, updated in place."""

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
        """Return the mean over batches."""
        return self.sums[name] / self.batches

    def variance(self, name: str) -> Floats:
        """Return the unbiased variance of the mean; 0 before the second batch."""
        n = self.batches
        if n < 2:
            return np.zeros(self.sums[name].shape)
        spread = self.squares[name] - self.sums[name] ** 2 / n
        # rounding can give small negative values if all batches are equal
        return np.maximum(spread, 0.0) / (n * (n - 1.0))


def batches_in_order(work: Callable[[int], Batch], first: int, threads: int) -> Generator[Batch, None, None]:
    """Run batches in threads and yield their results in the order of their numbers, without end.

    Parameters
    ----------
    work : callable
        Computes the batch of a given number.
    first : int
    threads : int
        Number of batches in work at once.

    Yields
    ------
    dict of str to ndarray
        The result of `work`.
    """
    waiting: deque[Future[Batch]] = deque()
    stopped = Event()

    def unless_stopped(number: int) -> Batch:
        return {} if stopped.is_set() else work(number)

    with ThreadPoolExecutor(threads) as pool:
        try:
            while True:
                while len(waiting) < threads:
                    waiting.append(pool.submit(unless_stopped, first))
                    first += 1
                yield waiting.popleft().result()
        finally:
            stopped.set()
            for future in waiting:
                future.cancel()
