"""Fragments: a path's body and its core, found as two ghosts, become one where one explains the views as well."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np

from ..kernels.measure_pupil import FIRST_G, FIRST_I
from .evenly import evenly
from .fit import MODEL_ERROR, brightens, cost_of, improve, render
from .found import Found, by_light, rest_of
from .numbers import Floats
from .patches import Patch, patches_of
from .shape import Shape, free_numbers, largest_size
from .views import Pixels, View

# part of the squares explained by the smaller of two ghosts that one ghost may lose
_LOST = 0.08
# centres may part by this much of the larger one's size, at the largest field; and the views that both must share
_APART, _SHARED = 0.4, 0.5
# how wide the pupil's middle is drawn where fits of one ghost begin: 1 is even, little is a bright core
_CORES = (1.0, 0.4, -0.2)
# a ghost no larger than this part of the picture's width is a speck
_SPECK = 0.005
# views that a trial looks at, and pixels of a window there
_FEW, _AREA = 10, 2500
# part of the light that a trial's model may miss beyond what its views say: nothing, but a search as rough as others
_KNOWN = 1e-9


def joined(
    ghosts: Sequence[Found],
    views: Sequence[View],
    *,
    factor: float = 1.0,
    pool: ThreadPoolExecutor | None = None,
    tell: Callable[[str], None] = lambda _: None,
) -> list[Found]:
    """Join pairs of ghosts that are one.

    Parameters
    ----------
    ghosts : sequence of Found
    views : sequence of View
        Glow taken off; what shall not count has infinite variance.
    factor : float
        Pixels of the captures in one of these views: what is told is in the captures'.
    pool : executor, optional
    tell : callable
        Gets a line for each pair that became one.

    Returns
    -------
    list of Found
        All colours of a joined one have green's shape.

    Notes
    -----
    A lens of revolution maps the pupil by g(u), u the square of the distance from its middle (`measure_pupil`): a core
    is where g is little in the middle of the pupil, and no fit that began with an even disc gets there by itself.
    Specks stay: a caustic of a pixel or two that outshines its ghost many times is not drawn by a larger one, and is
    learned in pictures finer than a pixel where a ghost of its own goes with it (`speck_sprites`).
    """
    out = list(ghosts)
    rest = rest_of(out, views, 1, pool)
    for ghost in [out[k] for k in reversed(by_light(out))]:
        if _is_speck(ghost, views):
            continue
        for other in _hosts(ghost, out):
            one = _as_one(other, ghost, views, rest, pool)
            if one is None:
                continue
            out = [each for each in out if each is not ghost and each is not other] + [one]
            rest = rest_of(out, views, 1, pool)
            size, speed = abs(other.shapes[1].numbers[FIRST_G]), ghost.shapes[1].numbers[0]
            tell(f"a ghost at speed {factor * speed:.0f} px is a part of one of size {factor * size:.0f} px")
            break
    return out


def _is_speck(ghost: Found, views: Sequence[View]) -> bool:
    """Tell whether a ghost is never larger than a speck."""
    there = views[ghost.first : ghost.last + 1]
    return largest_size(ghost.shapes[1], [view.sigma for view in there]) <= _SPECK * views[0].size_px[0]


def _hosts(ghost: Found, ghosts: Sequence[Found]) -> list[Found]:
    """Return the larger ghosts that one may be a part of, the nearest first."""
    own, size = ghost.shapes[1].numbers, abs(float(ghost.shapes[1].numbers[FIRST_G]))
    hosts = []
    for other in ghosts:
        theirs = other.shapes[1].numbers
        larger = abs(float(theirs[FIRST_G]))
        shared = min(ghost.last, other.last) - max(ghost.first, other.first) + 1
        apart = abs(float(own[0] - theirs[0])) / max(larger, 1e-9)
        if ghost.unwanted or other.unwanted or other is ghost:
            continue
        if larger >= size and apart < _APART and shared > _SHARED * (ghost.last - ghost.first):
            hosts.append((apart, other))
    return [other for _, other in sorted(hosts, key=lambda pair: pair[0])[:2]]


def _as_one(
    host: Found, part: Found, views: Sequence[View], rest: Sequence[Pixels], pool: ThreadPoolExecutor | None
) -> Found | None:
    """Fit one ghost to the light of two; None when it explains the views worse."""
    both = Found(host.shapes, min(host.first, part.first), max(host.last, part.last))
    few = evenly(range(both.first, both.last + 1), _FEW)
    shape, core = host.shapes[1], part.shapes[1]
    as_two, as_one = [], []
    for k in few:
        alone = render(shape, views[k])
        light = render(core, views[k]) if part.first <= k <= part.last else np.zeros_like(alone)
        there = rest[k] + (alone if host.first <= k <= host.last else 0.0) + light
        # both are judged by the same weights, or what is brighter would be missed for less
        level = np.maximum(np.abs(there), np.abs(alone + light))
        as_two.append(_green(views[k], rest[k] + alone, level))
        as_one.append(_green(views[k], there, level))
    # what the smaller one has beside the larger is lost as well
    patches = patches_of(shape, as_one, 1, beside=core, area=_AREA)
    if not patches:
        return None
    width = views[0].size_px[0]

    def fitted(light: Floats, look: Sequence[Patch]) -> Shape:
        # what one ghost misses shall not pass for an outlier
        starts = [_improved(start, look, 1, 5, width, pool) for start in _starts(shape, light)]
        return _improved(min(starts, key=lambda trial: _cost(trial, look)), look, 2, 8, width, pool)

    best = fitted(core.numbers, patches)
    # the larger one alone is as free as one for both, or what it gains by itself would be taken for a fragment's light
    apart = patches_of(shape, as_two, 1, beside=core, area=_AREA)
    if _lost(best, fitted(np.zeros_like(core.numbers), apart), patches, apart) > _LOST or not brightens(best, as_one):
        return None
    # and may begin where the one for both ended: what this found is not for want of light to be found without it
    if _lost(best, _improved(best, apart, 2, 8, width, pool), patches, apart) > _LOST:
        return None
    return replace(both, shapes=(best, best, best))


def _lost(one: Shape, larger: Shape, whole: Sequence[Patch], apart: Sequence[Patch]) -> float:
    """Return what one ghost for two loses, as a part of what the smaller one explains beside the larger."""
    two = _cost(larger, apart)
    return (_cost(one, whole) - two) / max(_cost(larger, whole) - two, 1e-300)


def _improved(
    start: Shape, look: Sequence[Patch], order: int, steps: int, width: int, pool: ThreadPoolExecutor | None
) -> Shape:
    free = free_numbers(order, start.discs, 1)
    return improve(start, look, free, width=width, steps=steps, error=_KNOWN, tails=False, pool=pool)[0]


def _cost(shape: Shape, look: Sequence[Patch]) -> float:
    return cost_of(shape, look, error=_KNOWN, tails=False)


def _green(view: View, pixels: Floats, level: Floats) -> View:
    """Return a view that shows some light in all colours, less certain by what a model may miss of a level."""
    variance = (view.variance[..., 1] + (MODEL_ERROR * level) ** 2).astype(np.float32)
    shape = view.pixels.shape
    return replace(
        view, pixels=np.broadcast_to(pixels.astype(np.float32)[..., None], shape),
        variance=np.broadcast_to(variance[..., None], shape),
    )  # fmt: skip


def _starts(shape: Shape, light: Floats) -> list[Shape]:
    """Return where fits of one ghost begin: as large as the larger one, with light added, more or less in its core."""
    starts = []
    for part in _CORES:
        numbers = shape.numbers.copy()
        size = float(numbers[FIRST_G])
        numbers[FIRST_G], numbers[FIRST_G + 1] = part * size, numbers[FIRST_G + 1] + (1.0 - part) * size
        numbers[FIRST_I] += max(float(light[FIRST_I]), 0.0)
        starts.append(replace(shape, numbers=numbers))
    return starts
