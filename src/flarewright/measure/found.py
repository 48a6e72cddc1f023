"""A ghost that was found, and what the views show beside it."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from ..kernels.measure_pupil import FIRST_DISC, FIRST_I
from .evenly import evenly
from .fit import Fit, light_of
from .numbers import Floats
from .shape import Shape
from .shared_out import shared_out
from .views import Pixels, View

CHANNELS = 3


@dataclass(frozen=True, eq=False)
class Found:
    """A ghost that was found.

    Attributes
    ----------
    shapes : tuple of Shape
        Red, green, blue.
    first, last : int
        Views in which it is there.
    fits : tuple of Fit or None
        Of each colour, when fitted.
    unwanted : bool
        A person says that it is none: it accounts for its light beside the others, but no model has it.
    """

    shapes: tuple[Shape, Shape, Shape]
    first: int
    last: int
    fits: tuple[Fit | None, Fit | None, Fit | None] = (None, None, None)
    unwanted: bool = False


def by_light(ghosts: Sequence[Found]) -> list[int]:
    """Return the ghosts' places, the most light first."""
    return sorted(range(len(ghosts)), key=lambda k: -float(ghosts[k].shapes[1].numbers[FIRST_I]))


def noise_of(views: Sequence[View]) -> Floats:
    """Return the noise of red, green and blue where views are known, shape (3,)."""
    known = [view.variance[np.isfinite(view.variance).all(axis=2)] for view in views]
    medians = [np.median(each, axis=0) for each in known if each.size]
    return np.sqrt(np.median(medians, axis=0)) if medians else np.ones(CHANNELS)


def leading(ghost: Found, noise: Floats) -> int:
    """Return the colour that tells most of a ghost: the one whose light stands out most of the noise."""
    light = [max(float(shape.numbers[FIRST_I]), 0.0) for shape in ghost.shapes]
    # green, where none does
    return int(np.argmax(np.array(light) / noise)) if max(light) > 0.0 else 1


def rest_of(
    ghosts: Sequence[Found], views: Sequence[View], channel: int, pool: ThreadPoolExecutor | None = None
) -> list[Pixels]:
    """Return what the views show of a channel beside all ghosts, shape (H, W) each."""
    return left_beside([view.pixels[..., channel] for view in views], ghosts, views, channel, pool)


def left_beside(
    pixels: Sequence[Pixels],
    ghosts: Sequence[Found],
    views: Sequence[View],
    channel: int,
    pool: ThreadPoolExecutor | None = None,
) -> list[Pixels]:
    """Return pictures of a channel, shape (H, W) each, without the ghosts that their views show."""

    def one(k: int) -> Pixels:
        left = pixels[k].astype(float)
        for ghost in ghosts:
            if ghost.first <= k <= ghost.last:
                add_light(ghost.shapes[channel], views[k], left, -1.0)
        return left.astype(np.float32)

    return shared_out(one, range(len(views)), pool=pool)


def alone(
    ghost: Found,
    channel: int,
    views: Sequence[View],
    rest: Sequence[Pixels],
    most: int,
    pool: ThreadPoolExecutor | None = None,
) -> list[View]:
    """Return at most so many of a ghost's views, holding it alone: the rest and its own light.

    Parameters
    ----------
    ghost : Found
    channel : int
    views : sequence of View
    rest : sequence of ndarray, shape (H, W)
        Of the channel.
    most : int
    pool : executor, optional
    """

    def one(k: int) -> View:
        own = rest[k].copy()
        add_light(ghost.shapes[channel], views[k], own, 1.0)
        return views[k].showing_one(own)

    return shared_out(one, evenly(range(ghost.first, ghost.last + 1), most), pool=pool)


def exchange(
    old: Shape, new: Shape, ghost: Found, views: Sequence[View], rest: Sequence[Pixels], pool: ThreadPoolExecutor | None
) -> None:
    """Put a ghost's new light in the place of the old in the rest, in place."""
    lay_over(old, ghost, views, rest, 1.0, pool)
    lay_over(new, ghost, views, rest, -1.0, pool)


def lay_over(
    shape: Shape,
    ghost: Found,
    views: Sequence[View],
    pixels: Sequence[Pixels],
    sign: float,
    pool: ThreadPoolExecutor | None,
) -> None:
    """Add a shape's light to a channel's pixels of the views in which a ghost is there, or take it off, in place."""
    shared_out(lambda k: add_light(shape, views[k], pixels[k], sign), range(ghost.first, ghost.last + 1), pool=pool)


def add_light(shape: Shape, view: View, pixels: Pixels | Floats, sign: float) -> None:
    """Add a shape's light to a view's pixels of one channel, or take it off, in place."""
    part, light = light_of(shape, view)
    pixels[part] += sign * light


def formed(form: Shape, own: Shape) -> Shape:
    """Return another colour's form with a colour's own light."""
    numbers = form.numbers.copy()
    numbers[FIRST_I:FIRST_DISC] = own.numbers[FIRST_I:FIRST_DISC]
    return replace(form, numbers=numbers)


def darkened(shape: Shape) -> Shape:
    """Return a shape without light."""
    numbers = shape.numbers.copy()
    numbers[FIRST_I:FIRST_DISC] = 0.0
    return Shape(numbers, shape.discs)
