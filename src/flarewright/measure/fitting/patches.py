"""Patches: windows of the views around one ghost, with its residuals and normal equations there."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from math import inf

import numpy as np

from ...kernels.ghost_model.ghost_mesh import window_of
from ...kernels.ghost_model.patches import miss_patches, weigh_changes
from ...typing import Floats, Indices
from ..core.parallel import dealt_out
from ..core.parameters import Shape
from ..core.scratch import ScratchBuffer
from ..core.views import View, halved_pixels
from .settings import FitSettings

# below this number of pixels, drawing takes less time than starting threads
_THREADED_PIXELS = 30_000
_ROOM = ScratchBuffer()


@dataclass(frozen=True)
class Patch:
    """The part of one view that a fit uses, in halved pixels; `view` is its index, `weight` the inverse variance."""

    view: int
    sigma: float
    frame: Floats
    left: int
    top: int
    pixels: Floats
    weight: Floats


def scaled(frame: Floats, times: int) -> Floats:
    """Return the frame of a picture that is halved `times` times."""
    factor = 0.5**times
    return np.array([frame[0] * factor, frame[1] * factor, frame[2], frame[3], frame[4] * factor])


def patches_of(
    shape: Shape, views: Sequence[View], channel: int, beside: Shape | None = None, area: int | None = None,
    settings: FitSettings = FitSettings(),
) -> list[Patch]:  # fmt: skip
    """Cut the window of a ghost and a margin from every view.

    Parameters
    ----------
    shape : Shape
    views : sequence of View
        Their pixels hold this ghost alone: all other known ghosts are subtracted.
    channel : int
    beside : Shape, optional
        Another shape that the window must include.
    area : int, optional
        Number of pixels of a window, to which pictures are halved; default: that of `settings`.
    settings : FitSettings

    Returns
    -------
    list of Patch
        One for each view that the ghost reaches.
    """
    windows = [_window(shape, beside, view) for view in views]
    areas = [window[2] * window[3] for window in windows if window[2]]
    if not areas:
        return []
    times = max(0, int(np.ceil(0.5 * np.log2(max(float(np.median(areas)) / (area or settings.area_px), 1.0)))))
    found = []
    for k, (view, (left, top, width, height)) in enumerate(zip(views, windows, strict=True)):
        if not width:
            continue
        margin, side = 4 + int(0.12 * max(width, height)), 2**times
        x0, y0 = max(left - margin, 0) // side, max(top - margin, 0) // side
        x1 = min(left + width + margin, view.size_px[0]) // side
        y1 = min(top + height + margin, view.size_px[1]) // side
        if x1 - x0 < 3 or y1 - y0 < 3:
            continue
        part = np.s_[y0 * side : y1 * side, x0 * side : x1 * side]
        pixels = halved_pixels(view.pixels[part][..., channel], times)
        variance = halved_pixels(view.variance[part][..., channel], times, variance=True)
        frame = scaled(view.frame, times)
        found.append(Patch(k, view.sigma, frame, x0, y0, pixels.astype(float), 1.0 / variance.astype(float)))
    return found


def _window(shape: Shape, beside: Shape | None, view: View) -> tuple[int, int, int, int]:
    """Return left, top, width and height of the window of one shape, or of two shapes together, in a view."""
    left, top, width, height = window_of(shape.numbers, shape.discs, view.sigma, view.frame, *view.size_px)
    if beside is None:
        return left, top, width, height
    x, y, w, h = _window(beside, None, view)
    if not (width and w):
        return (left, top, width, height) if width else (x, y, w, h)
    right, bottom = max(left + width, x + w), max(top + height, y + h)
    return min(left, x), min(top, y), right - min(left, x), bottom - min(top, y)


def shows(shape: Shape, views: Sequence[View]) -> bool:
    """Return whether a shape reaches into any view."""
    return any(_window(shape, None, view)[2] for view in views)


def coarser_patches(patch: Patch) -> Patch:
    """Return a patch at half the resolution."""
    # start at whole pixels of the halved picture
    part = np.s_[patch.top % 2 :, patch.left % 2 :]
    with np.errstate(divide="ignore"):
        variance = (1.0 / patch.weight[part]).astype(np.float32)
    pixels, variance = (
        halved_pixels(patch.pixels[part].astype(np.float32), 1),
        halved_pixels(variance, 1, variance=True),
    )
    return replace(
        patch, frame=scaled(patch.frame, 1), left=(patch.left + 1) // 2, top=(patch.top + 1) // 2,
        pixels=pixels.astype(float), weight=1.0 / variance.astype(float),
    )  # fmt: skip


@dataclass(frozen=True)
class Patches:
    """Patches in contiguous memory, for kernels that process all of them.

    Attributes
    ----------
    table : ndarray, shape (P, 5)
        One row per patch: offset of its pixels, height, width, left, top.
    sigmas : ndarray, shape (P,)
    frames : ndarray, shape (P, 5)
    pixels, known : ndarray, shape (S,)
        Measured pixels of all patches, and their inverse variances.
    """

    table: Indices
    sigmas: Floats
    frames: Floats
    pixels: Floats
    known: Floats

    @property
    def largest(self) -> int:
        """Numbers of working memory that drawing the largest patch takes."""
        return int((self.table[:, 1] * (self.table[:, 2] + 1)).max(initial=0))


def laid_out(patches: Sequence[Patch]) -> Patches:
    """Copy patches into contiguous memory."""
    table = np.zeros((len(patches), 5), np.int64)
    start = 0
    for k, patch in enumerate(patches):
        table[k] = start, *patch.pixels.shape, patch.left, patch.top
        start += patch.pixels.size
    none = np.zeros(0)
    return Patches(
        table, np.array([patch.sigma for patch in patches]),
        np.array([patch.frame for patch in patches]).reshape(-1, 5),
        np.concatenate([none, *(patch.pixels.ravel() for patch in patches)]),
        np.concatenate([none, *(patch.weight.ravel() for patch in patches)]),
    )  # fmt: skip


@dataclass(frozen=True)
class PatchResidual:
    """Residual of a shape in patches.

    Attributes
    ----------
    sums : ndarray, shape (P, 3)
        One row per patch: weighted squares, sum of the weights, number of pixels with weight.
    weight, residual : ndarray, shape (S,)
        Pixels of all patches.
    """

    sums: Floats
    weight: Floats
    residual: Floats

    @property
    def costs(self) -> Floats:
        """Weighted squares of each patch, shape (P,)."""
        return self.sums[:, 0]

    @property
    def cost(self) -> float:
        """Weighted squares of all patches."""
        return float(self.costs.sum())

    @property
    def count(self) -> int:
        """Number of pixels with weight."""
        return int(self.sums[:, 2].sum())


def residual_in(
    shape: Shape, patches: Patches, *, offset: bool = True, error: float, tails: bool = True,
    pool: ThreadPoolExecutor | None = None, settings: FitSettings = FitSettings(),
) -> PatchResidual:  # fmt: skip
    """Draw a shape in patches and weigh the residual; see `ghost_fit.refine`."""
    sums = np.zeros((len(patches.table), 3))
    weight, residual = np.empty(patches.pixels.size), np.empty(patches.pixels.size)
    # outliers may belong to unknown ghosts
    outlier = settings.outlier if error > 0.0 and tails else inf

    def some(first: int, every: int) -> None:
        miss_patches(
            shape.numbers, shape.discs, patches.table, patches.sigmas, patches.frames, patches.pixels, patches.known,
            max(error, 0.0), outlier, offset, first, every, _ROOM.some(patches.largest), weight, residual, sums,
        )  # fmt: skip

    dealt_out(some, len(patches.table), pool=pool if patches.pixels.size > _THREADED_PIXELS else None)
    return PatchResidual(sums, weight, residual)


def equations(
    shape: Shape,
    free: Indices,
    patches: Patches,
    miss: PatchResidual,
    *,
    offset: bool = True,
    pool: ThreadPoolExecutor | None = None,
) -> tuple[Floats, Floats]:
    """Return normal matrix and right-hand side of each patch, shapes (P, Q, Q) and (P, Q)."""
    count, size = len(patches.table), free.size
    matrices, sides = np.zeros((count, size, size)), np.zeros((count, size))

    def some(first: int, every: int) -> None:
        weigh_changes(
            shape.numbers, shape.discs, free, patches.table, patches.sigmas, patches.frames, miss.weight, miss.residual,
            miss.sums, offset, first, every, _ROOM.some(patches.largest * (size + 1)), matrices, sides,
        )  # fmt: skip

    dealt_out(some, count, pool=pool)
    return matrices, sides
