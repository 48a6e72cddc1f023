"""A detected ghost, and pictures with detected ghosts added or subtracted."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from ...kernels.ghost_model.pupil_mesh import FIRST_DISC, FIRST_I
from ...typing import Floats, Pixels
from ..core.checkpoint import recorded
from ..core.parallel import map_batched
from ..core.parameters import Shape
from ..core.sampling import evenly_spaced
from ..core.views import View
from .ghost_fit import Fit, light_of

CHANNELS = 3


@recorded
@dataclass(frozen=True, eq=False)
class DetectedGhost:
    """A detected ghost.

    Attributes
    ----------
    shapes : tuple of Shape
        Red, green, blue.
    first, last : int
        First and last view in which it is visible.
    fits : tuple of Fit or None
        Fit of each colour; None before the first fit.
    unwanted : bool
        Rejected by the user or as residual glow: the fit keeps it to explain its light, but the model omits it.
    glow : bool
        Rejected as residual glow; what the user rejects is light of the lens.
    """

    shapes: tuple[Shape, Shape, Shape]
    first: int
    last: int
    fits: tuple[Fit | None, Fit | None, Fit | None] = (None, None, None)
    unwanted: bool = False
    glow: bool = False


def by_brightness(ghosts: Sequence[DetectedGhost]) -> list[int]:
    """Return the indices of the ghosts, brightest first."""
    return sorted(range(len(ghosts)), key=lambda k: -float(ghosts[k].shapes[1].numbers[FIRST_I]))


def channel_noise(views: Sequence[View]) -> Floats:
    """Return the median noise of red, green and blue over the measured pixels, shape (3,)."""
    known = [view.variance[np.isfinite(view.variance).all(axis=2)] for view in views]
    medians = [np.median(each, axis=0) for each in known if each.size]
    return np.sqrt(np.median(medians, axis=0)) if medians else np.ones(CHANNELS)


def leading(ghost: DetectedGhost, noise: Floats) -> int:
    """Return the leading colour of a ghost: the one with the highest ratio of light to noise; green when dark."""
    light = [max(float(shape.numbers[FIRST_I]), 0.0) for shape in ghost.shapes]
    return int(np.argmax(np.array(light) / noise)) if max(light) > 0.0 else 1


def residual_of(
    ghosts: Sequence[DetectedGhost], views: Sequence[View], channel: int, pool: ThreadPoolExecutor | None = None
) -> list[Pixels]:
    """Return the residual of one channel in each view, all ghosts subtracted, shape (H, W) each."""
    return subtract_ghosts([view.pixels[..., channel] for view in views], ghosts, views, channel, pool)


def subtract_ghosts(
    pixels: Sequence[Pixels],
    ghosts: Sequence[DetectedGhost],
    views: Sequence[View],
    channel: int,
    pool: ThreadPoolExecutor | None = None,
) -> list[Pixels]:
    """Return pictures of one channel, shape (H, W) each, with the ghosts visible in each view subtracted."""

    def one(k: int) -> Pixels:
        left = pixels[k].astype(float)
        for ghost in ghosts:
            if ghost.first <= k <= ghost.last:
                add_to_residual(ghost.shapes[channel], views[k], left, -1.0)
        return left.astype(np.float32)

    return map_batched(one, range(len(views)), pool=pool)


def isolated_views(
    ghost: DetectedGhost,
    channel: int,
    views: Sequence[View],
    rest: Sequence[Pixels],
    most: int,
    pool: ThreadPoolExecutor | None = None,
) -> list[View]:
    """Return views that hold one ghost alone: the residual plus the light of the ghost.

    Parameters
    ----------
    ghost : DetectedGhost
    channel : int
    views : sequence of View
    rest : sequence of ndarray, shape (H, W)
        Residual of the channel in each view, all ghosts subtracted.
    most : int
        Maximum number of views; they are evenly spaced over those in which the ghost is visible.
    pool : executor, optional
    """

    def one(k: int) -> View:
        own = rest[k].copy()
        add_to_residual(ghost.shapes[channel], views[k], own, 1.0)
        return views[k].showing_one(own)

    return map_batched(one, evenly_spaced(range(ghost.first, ghost.last + 1), most), pool=pool)


def exchange(
    old: Shape,
    new: Shape,
    ghost: DetectedGhost,
    views: Sequence[View],
    rest: Sequence[Pixels],
    pool: ThreadPoolExecutor | None,
) -> None:
    """Update the residual in place after a ghost changed: add its old shape, subtract its new one."""
    lay_over(old, ghost, views, rest, 1.0, pool)
    lay_over(new, ghost, views, rest, -1.0, pool)


def lay_over(
    shape: Shape,
    ghost: DetectedGhost,
    views: Sequence[View],
    pixels: Sequence[Pixels],
    sign: float,
    pool: ThreadPoolExecutor | None,
) -> None:
    """Add (sign 1) or subtract (sign -1) a shape in place, in one channel of the views in which a ghost is visible."""
    map_batched(
        lambda k: add_to_residual(shape, views[k], pixels[k], sign), range(ghost.first, ghost.last + 1), pool=pool
    )


def add_to_residual(shape: Shape, view: View, pixels: Pixels | Floats, sign: float) -> None:
    """Add (sign 1) or subtract (sign -1) a shape in place, in one channel of one view."""
    part, light = light_of(shape, view)
    pixels[part] += sign * light


def formed(form: Shape, own: Shape) -> Shape:
    """Return the geometry of shape `form` with the brightness of shape `own`."""
    numbers = form.numbers.copy()
    numbers[FIRST_I:FIRST_DISC] = own.numbers[FIRST_I:FIRST_DISC]
    return replace(form, numbers=numbers)


def darkened(shape: Shape) -> Shape:
    """Return a shape without light."""
    numbers = shape.numbers.copy()
    numbers[FIRST_I:FIRST_DISC] = 0.0
    return Shape(numbers, shape.discs)
