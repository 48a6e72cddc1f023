"""What the ghost passes of both qualities share: their work, their result, and the sum of pictures in a fixed order."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from ...kernels.raster.plane_memory import black_picture
from ...model import Layer, Quality
from ...optics.colour.rgb import luminance_weights
from ...optics.lens.paths import LightPath
from ...typing import Progress
from ..image.canvas import DETAILS, Patch, Plane, lit_window, merge, to_layer
from ..image.ghost_ranking import GhostRanking, luminance_of
from ..scene.art_rules import PathArt
from ..scene.memory_check import check_memory, spare_bytes
from ..scene.shot import Shot

# (pixels, pictures): how many pictures are drawn in parallel, by picture size alone, so that sums round reproducibly
_CHUNKS = ((1_100_000, 8), (2_500_000, 4))
_GHOSTS_A_CHUNK = 16
# groups of ghosts that are drawn or spread together
MOST_CHUNKS = 8
# ghosts with a separate picture that are drawn ahead of their turn, by the memory of their canvases
_AHEAD_BYTES, _CANVAS_BYTES = 400_000_000, 30


# what is drawn together: planes at all resolutions, or for one ghost its part of a picture
Drawn = list[Plane | None] | Patch


@dataclass(frozen=True)
class GhostPass:
    """Result of the ghost pass.

    Attributes
    ----------
    total : Layer
        All ghosts.
    singles : tuple of Layer
        One layer per path, brightest first, if requested.
    drawn : int
        Paths drawn.
    dark : int or None
        Paths that pass no light; None in draft quality, which does not count them.
    culled : int
        Paths left out by `Quality.cull`.
    culled_share : float
        Their part of the flux, estimated by the pre-pass.
    muted : int
        Paths disabled by art direction.
    names : tuple of str
        Names of the drawn paths.
    faint, faint_share : int, float
        Ghosts of single lights among many that were left out as too faint; their part of the flux.
    level : float
        Mean irradiance of the ghosts over the circle around the picture, estimated by the pre-pass, per unit irradiance
        of the light; 0 in draft quality.
    """

    total: Layer
    singles: tuple[Layer, ...]
    drawn: int
    dark: int | None
    culled: int
    culled_share: float
    muted: int
    names: tuple[str, ...] = ()
    level: float = 0.0
    faint: int = 0
    faint_share: float = 0.0


class ProgressMeter:
    """Counts finished paths over threads, reports them, and holds the cancel flag."""

    def __init__(self, steps: int, progress: Progress | None) -> None:
        self._steps, self._done, self._progress = max(steps, 1), 0, progress
        self._lock = threading.Lock()
        self.cancelled = threading.Event()

    def step(self, what: str) -> None:
        """Count a path as finished."""
        with self._lock:
            self._done += 1
            if self._progress is not None:
                self._progress(self._done / self._steps, what)


@dataclass(frozen=True)
class GhostWork:
    """The ghosts of a picture that a pass draws.

    Attributes
    ----------
    shots : sequence of Shot
    paths : sequence of LightPath
        Those that art direction does not disable.
    quality : Quality
    layers : int or None
        How many of the brightest paths become layers; None: all.
    art : mapping of str to PathArt
        Overrides by path name.
    pool : executor
    meter : ProgressMeter
    ranking : GhostRanking or None
        Gets the luminance of each ghost.
    """

    shots: Sequence[Shot]
    paths: Sequence[LightPath]
    quality: Quality
    layers: int | None
    art: Mapping[str, PathArt]
    pool: ThreadPoolExecutor
    meter: ProgressMeter
    ranking: GhostRanking | None = None

    @property
    def singles(self) -> int | None:
        """How many of the brightest paths are drawn separately; None: all."""
        return self.layers if self.ranking is None else None

    def alone(self, order: Sequence[int]) -> set[int]:
        """Return those of the paths, brightest first, that are drawn separately."""
        return set(order if self.singles is None else order[: self.singles])


def sum_ghosts(
    work: GhostWork,
    items: list[int],
    named: Sequence[LightPath],
    draw: Callable[[list[int]], Drawn],
    jobs: Sequence[Callable[[], Drawn]] = (),
    ghosts_each: int = 1,
    most_chunks: int = MOST_CHUNKS,
    is_irradiance: bool = False,
) -> tuple[Layer, tuple[Layer, ...]]:
    """Draw the first items separately, the others in a fixed number of groups, then run `jobs`; add in this order.

    Each item stands for `ghosts_each` ghosts. The first `work.layers` of the separate ones become layers. What is drawn
    is flux per pixel unless `is_irradiance`.
    """
    shot, pool = work.shots[0], work.pool
    divisor = 1.0 if is_irradiance else shot.pixel_area
    luminance = luminance_weights(shot.colorspace)
    alone = len(work.alone(items))
    kept_layers = alone if work.layers is None else min(work.layers, alone)
    chunks = chunks_of(shot, (len(items) - alone) * ghosts_each, most_chunks)
    rest = [items[alone + c :: chunks] for c in range(chunks)]
    totals: list[Plane | None] = [None] * DETAILS
    layers: list[Layer] = []
    spare, held = spare_bytes() if alone else 0.0, 0.0
    ahead = max(2, _AHEAD_BYTES // (_CANVAS_BYTES * shot.size_px[0] * shot.size_px[1]))
    for k, drawn in enumerate(_in_turn(pool, draw, [[k] for k in items[:alone]], ahead)):
        path, patch = named[k], drawn if isinstance(drawn, Patch) else Patch(merge(drawn, shot.size_px))
        pixels, (left, top) = patch.pixels, patch.corner
        if work.ranking is not None:
            x0, y0, x1, y1 = lit_window(pixels)
            light = luminance_of(pixels[y0:y1, x0:x1], shot.colorspace) / np.float32(divisor)
            work.ranking.add(path.name, light, (left + x0, top + y0, x1 - x0, y1 - y0))
        if k >= kept_layers:
            totals = _added(totals, drawn, shot.size_px)
            continue
        about: dict[str, str | float] = {
            "path": path.name,
            # sum down the columns first: along a row the three channels alternate
            "flux_mm2": float(luminance @ pixels.sum(axis=0, dtype=np.float64).sum(axis=0)) * shot.pixel_area / divisor,
        }
        if path.name in work.art:
            about["art"] = work.art[path.name].text()
        layers.append(to_layer(f"ghost.{path.name}", patch, divisor, about))
        held += layers[-1].pixels.nbytes
        check_memory(held, spare)
        # the layer holds a copy, so the planes can be added in place
        totals = _added(totals, drawn, shot.size_px)
    # a single group is drawn in this thread: it may use the pool for its bands
    for drawn in (map if chunks == 1 else pool.map)(draw, [group for group in rest if group]):
        totals = _added(totals, drawn, shot.size_px)
    for drawn in pool.map(lambda job: job(), jobs):
        totals = _added(totals, drawn, shot.size_px)
    total = merge(totals, shot.size_px)
    return to_layer("ghosts", Patch(total), divisor, {}, reuse=True), tuple(layers)


def _in_turn(
    pool: ThreadPoolExecutor, work: Callable[[list[int]], Drawn], items: Sequence[list[int]], ahead: int
) -> Iterator[Drawn]:
    """Work in parallel and return the results in order; at most `ahead` of them are in memory or in the making."""
    waiting: deque[Future[Drawn]] = deque()
    for item in items:
        if len(waiting) == ahead:
            yield waiting.popleft().result()
        waiting.append(pool.submit(work, item))
    while waiting:
        yield waiting.popleft().result()


def chunks_of(shot: Shot, ghosts: int, most_chunks: int) -> int:
    """Return in how many parallel pictures this number of ghosts is drawn."""
    width, height = shot.size_px
    most_chunks = min(most_chunks, next((n for size, n in _CHUNKS if width * height <= size), 2))
    return max(1, min(most_chunks, ghosts // _GHOSTS_A_CHUNK))


def _added(totals: Sequence[Plane | None], drawn: Drawn, size_px: tuple[int, int]) -> list[Plane | None]:
    """Add pictures resolution by resolution; the arrays of `totals` are overwritten.

    A patch is added to a picture in full resolution, shape (H, W, 3).
    """
    sums = list(totals)
    if isinstance(drawn, Patch):
        whole = sums[0] if sums[0] is not None else black_picture(*size_px)
        (x, y), (height, width) = drawn.corner, drawn.pixels.shape[:2]
        whole[y : y + height, x : x + width] += drawn.pixels
        return [whole, *sums[1:]]
    for k, plane in enumerate(drawn):
        held = sums[k]
        if plane is not None:
            sums[k] = plane if held is None else np.add(held, plane, out=held)
    return sums
