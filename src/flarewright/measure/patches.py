"""The parts of views that one fit looks at: cut out, and what a ghost misses in them."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from math import inf

import numpy as np

from ..kernels.measure_mesh import window_of
from ..kernels.measure_patches import miss_patches, weigh_changes
from .numbers import Floats
from .room import Room
from .shape import Indices, Shape
from .shared_out import dealt_out
from .views import View, halved

# a ghost is fitted on pictures halved until its window has about so many pixels, if nobody says otherwise
AREA = 7000
# standard deviations beyond which a pixel counts less and less
OUTLIER = 4.0
# a ghost is drawn in so many pixels before other threads have heard of it
_FEW = 30_000
_ROOM = Room()


@dataclass(frozen=True)
class Patch:
    """The part of a view, told by its number, that one fit looks at, at its resolution."""

    view: int
    sigma: float
    frame: Floats
    left: int
    top: int
    pixels: Floats
    weight: Floats


def scaled(frame: Floats, times: int) -> Floats:
    """Return the frame of a picture halved so often."""
    factor = 0.5**times
    return np.array([frame[0] * factor, frame[1] * factor, frame[2], frame[3], frame[4] * factor])


def patches_of(
    shape: Shape,
    views: Sequence[View],
    channel: int,
    beside: Shape | None = None,
    area: int = AREA,
) -> list[Patch]:
    """Cut out what a ghost touches, and a margin, from every view.

    Parameters
    ----------
    shape : Shape
    views : sequence of View
        Their pixels hold this ghost alone, as far as it is known.
    channel : int
    beside : Shape, optional
        What this one touches is cut out with it.
    area : int
        Pictures are halved until the window has about so many pixels.

    Returns
    -------
    list of Patch
        Of the views that show it.
    """
    windows = [_window(shape, beside, view) for view in views]
    areas = [window[2] * window[3] for window in windows if window[2]]
    if not areas:
        return []
    times = max(0, int(np.ceil(0.5 * np.log2(max(float(np.median(areas)) / area, 1.0)))))
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
        pixels = halved(view.pixels[part][..., channel], times)
        variance = halved(view.variance[part][..., channel], times, variance=True)
        frame = scaled(view.frame, times)
        found.append(Patch(k, view.sigma, frame, x0, y0, pixels.astype(float), 1.0 / variance.astype(float)))
    return found


def _window(shape: Shape, beside: Shape | None, view: View) -> tuple[int, int, int, int]:
    """Return left, top, width and height of what one shape, or either of two, touches in a view."""
    left, top, width, height = window_of(shape.numbers, shape.discs, view.sigma, view.frame, *view.size_px)
    if beside is None:
        return left, top, width, height
    x, y, w, h = _window(beside, None, view)
    if not (width and w):
        return (left, top, width, height) if width else (x, y, w, h)
    right, bottom = max(left + width, x + w), max(top + height, y + h)
    return min(left, x), min(top, y), right - min(left, x), bottom - min(top, y)


def shows(shape: Shape, views: Sequence[View]) -> bool:
    """Tell whether any view reaches a shape."""
    return any(_window(shape, None, view)[2] for view in views)


def coarser(patch: Patch) -> Patch:
    """Return a patch in a picture of half the resolution."""
    # whole pixels of that picture
    part = np.s_[patch.top % 2 :, patch.left % 2 :]
    with np.errstate(divide="ignore"):
        variance = (1.0 / patch.weight[part]).astype(np.float32)
    pixels, variance = halved(patch.pixels[part].astype(np.float32), 1), halved(variance, 1, variance=True)
    return replace(
        patch, frame=scaled(patch.frame, 1), left=(patch.left + 1) // 2, top=(patch.top + 1) // 2,
        pixels=pixels.astype(float), weight=1.0 / variance.astype(float),
    )  # fmt: skip


@dataclass(frozen=True)
class Patches:
    """Patches one after the other in memory, for kernels that look at all of them.

    Attributes
    ----------
    table : ndarray, shape (P, 5)
        Of each: where its pixels begin, height, width, left, top.
    sigmas : ndarray, shape (P,)
    frames : ndarray, shape (P, 5)
    pixels, known : ndarray, shape (S,)
        What was photographed, and its inverse variances.
    """

    table: Indices
    sigmas: Floats
    frames: Floats
    pixels: Floats
    known: Floats

    @property
    def largest(self) -> int:
        """How many numbers the drawing of its largest patch takes."""
        return int((self.table[:, 1] * (self.table[:, 2] + 1)).max(initial=0))


def laid_out(patches: Sequence[Patch]) -> Patches:
    """Return patches one after the other."""
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
class Missed:
    """How a shape misses patches.

    Attributes
    ----------
    told : ndarray, shape (P, 3)
        Of each: weighted squares, sum of the weights, how many pixels have weight.
    weight, residual : ndarray, shape (S,)
        Of all pixels.
    """

    told: Floats
    weight: Floats
    residual: Floats

    @property
    def costs(self) -> Floats:
        """Weighted squares of each patch, shape (P,)."""
        return self.told[:, 0]

    @property
    def cost(self) -> float:
        """Weighted squares of all."""
        return float(self.costs.sum())

    @property
    def count(self) -> int:
        """Pixels that have weight."""
        return int(self.told[:, 2].sum())


def missed(
    shape: Shape,
    patches: Patches,
    *,
    offset: bool = True,
    error: float,
    tails: bool = True,
    pool: ThreadPoolExecutor | None = None,
) -> Missed:
    """Draw a shape in patches and weigh what it misses; see `fit.refine`."""
    told = np.zeros((len(patches.table), 3))
    weight, residual = np.empty(patches.pixels.size), np.empty(patches.pixels.size)
    # heavy tails: other ghosts that are not known yet
    outlier = OUTLIER if error > 0.0 and tails else inf

    def some(first: int, every: int) -> None:
        miss_patches(
            shape.numbers, shape.discs, patches.table, patches.sigmas, patches.frames, patches.pixels, patches.known,
            max(error, 0.0), outlier, offset, first, every, _ROOM.some(patches.largest), weight, residual, told,
        )  # fmt: skip

    dealt_out(some, len(patches.table), pool=pool if patches.pixels.size > _FEW else None)
    return Missed(told, weight, residual)


def equations(
    shape: Shape,
    free: Indices,
    patches: Patches,
    miss: Missed,
    *,
    offset: bool = True,
    pool: ThreadPoolExecutor | None = None,
) -> tuple[Floats, Floats]:
    """Return normal matrix and right side of each patch by what it misses, shapes (P, Q, Q) and (P, Q)."""
    count, size = len(patches.table), free.size
    matrices, sides = np.zeros((count, size, size)), np.zeros((count, size))

    def some(first: int, every: int) -> None:
        weigh_changes(
            shape.numbers, shape.discs, free, patches.table, patches.sigmas, patches.frames, miss.weight, miss.residual,
            miss.told, offset, first, every, _ROOM.some(patches.largest * (size + 1)), matrices, sides,
        )  # fmt: skip

    dealt_out(some, count, pool=pool)
    return matrices, sides
