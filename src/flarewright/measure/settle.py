"""Fit all found ghosts together, colour by colour, and keep those that explain light that no other does."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from ..io.sentences import count
from ..kernels.measure_pupil import FIRST_DISC, FIRST_I
from ..model.ghost_model import AberrationGhost, Blades
from .find import rims_of
from .fit import Fit, cost_of, fitted_numbers, improve, refine
from .found import CHANNELS, Found, alone, by_light, exchange, formed, leading, noise_of, rest_of
from .grow import RIM_PAYS, Growth, grow
from .joint import lit
from .jointly import fitted_jointly
from .journal import Journal
from .numbers import Floats, blades_of, channel_of, with_blades
from .patches import patches_of
from .presence import usual_amplitude
from .shape import Shape, free_numbers, without_discs
from .shared_out import side_by_side
from .spans import respanned
from .views import Pixels, View

# views by which the best rim is chosen
_FEW = 8
# steps of all ghosts at once
_STEPS = 10


@dataclass(frozen=True)
class Settling:
    """How thoroughly.

    Attributes
    ----------
    rounds : int
        How often every ghost is fitted anew against the rest.
    most : Growth
        How far a ghost may grow.
    views : int
        Constellations that one fit looks at, at most.
    """

    rounds: int = 2
    most: Growth = field(default_factory=lambda: Growth(order=2, discs=2, area=3500))
    views: int = 32


def settle(
    found: Sequence[Found],
    views: Sequence[View],
    *,
    how: Settling = Settling(),
    iris: Blades | None = None,
    pool: ThreadPoolExecutor | None = None,
    tell: Callable[[str], None] = lambda _: None,
    progress: Callable[[float, str], None] = lambda _part, _words: None,
    journal: Journal | None = None,
) -> list[Found]:
    """Fit every ghost against all others until they agree.

    Parameters
    ----------
    found : sequence of Found
    views : sequence of View
        Glow taken off; what shall not count has infinite variance.
    how : Settling
    iris : Blades, optional
        Rims that a ghost may have when it is fitted for the first time, beside a round one.
    pool : executor, optional
    tell : callable
        Gets a line for each round.
    progress : callable
        Gets the finished part and words.
    journal : Journal, optional
        Of the dear steps.

    Returns
    -------
    list of Found
        Those that are needed, brightest first.
    """
    ghosts, noise = list(found), noise_of(views)
    steps = journal or Journal()
    for turn in range(how.rounds):
        ghosts = lit(ghosts, views, pool=pool)
        # in small pictures, and every ghost in its own after that: what is told of its errors is of these
        ghosts = _jointly(ghosts, views, noise, pool, steps)
        rest = [rest_of(ghosts, views, m, pool) for m in range(CHANNELS)]
        ghosts, rest = respanned(ghosts, views, rest, [leading(ghost, noise) for ghost in ghosts], pool)
        for done, k in enumerate(by_light(ghosts)):
            old = ghosts[k]
            ghosts[k] = steps.step(partial(_again, old, views, rest, leading(old, noise), how, iris, pool))
            for m in range(CHANNELS):
                exchange(old.shapes[m], ghosts[k].shapes[m], old, views, rest[m], pool)
            progress((turn + (done + 1) / len(ghosts)) / how.rounds, f"ghost {done + 1} of {len(ghosts)}")
        before = len(ghosts)
        ghosts = lit(ghosts, views, pool=pool)
        needed = "is needed" if len(ghosts) == 1 else "are needed"
        tell(f"round {turn + 1}: {len(ghosts)} of {count(before, 'ghost')} {needed}")
    return [ghosts[k] for k in by_light(ghosts)]


def _jointly(
    ghosts: Sequence[Found], views: Sequence[View], noise: Floats, pool: ThreadPoolExecutor | None, steps: Journal
) -> list[Found]:
    """Fit all ghosts at once; before any was fitted the colour that tells most of most speaks for the form of all."""
    out = list(ghosts)
    first = all(ghost.fits[1] is None for ghost in ghosts)
    if not out:
        return out
    spokesman = Counter(leading(ghost, noise) for ghost in out).most_common(1)[0][0]
    for m in (spokesman,) if first else (1, 0, 2):
        pixels = [view.pixels[..., m] for view in views]
        likes = [None if (lead := leading(ghost, noise)) == m else ghost.shapes[lead] for ghost in out]
        fitted = partial(fitted_jointly, out, views, pixels, m, steps=_STEPS, likes=[] if first else likes, pool=pool)
        for k, shape in enumerate(steps.step(fitted)):
            shapes = [formed(shape, old) if first else old for old in out[k].shapes]
            shapes[m] = shape
            out[k] = replace(out[k], shapes=(shapes[0], shapes[1], shapes[2]))
    return out


def _again(
    ghost: Found,
    views: Sequence[View],
    rest: list[list[Pixels]],
    lead: int,
    how: Settling,
    iris: Blades | None,
    pool: ThreadPoolExecutor | None,
) -> Found:
    """Fit one ghost anew: first in the colour that tells most of it, then in the others, which are like that one."""
    fits: list[Fit | None] = list(ghost.fits)
    shapes = list(ghost.shapes)

    def leader() -> Fit | None:
        shown = alone(ghost, lead, views, rest[lead], how.views, pool)
        if ghost.fits[lead] is None:
            # all that is known of the others is taken off: an even background would be light that nobody gets
            most = replace(how.most, offset=False)
            return _grown(_rimmed(shapes[lead], shown, lead, iris, pool), shown, lead, most, pool)
        return _refined(shapes[lead], shown, lead, ghost.fits[lead], pool)

    def like_leader(m: int) -> Fit | None:
        shown = alone(ghost, m, views, rest[m], how.views, pool)
        start = shapes[m] if ghost.fits[m] is not None else _like(shapes[lead], shapes[m], shown, m)
        return _refined(start, shown, m, fits[lead], pool, shapes[lead])

    def keep(m: int, fit: Fit | None) -> None:
        if fit is not None:
            fits[m], shapes[m] = fit, fit.shape

    keep(lead, leader())
    others = [m for m in range(CHANNELS) if m != lead]
    for m, fit in zip(others, side_by_side(*(partial(like_leader, m) for m in others), pool=pool), strict=True):
        keep(m, fit)
    return replace(ghost, shapes=(shapes[0], shapes[1], shapes[2]), fits=(fits[0], fits[1], fits[2]))


def _grown(
    start: Shape, shown: Sequence[View], channel: int, most: Growth, pool: ThreadPoolExecutor | None
) -> Fit | None:
    """Fit a ghost for the first time, with the rims that a search gave it and without: others were not known then."""

    def grown(shape: Shape) -> Fit | None:
        return grow(shape, shown, channel, most=most, pool=pool)

    if not start.discs:
        return grown(start)
    fit, bare = side_by_side(partial(grown, start), partial(grown, without_discs(start)), pool=pool)
    if fit is None or bare is None:
        return fit
    patches = patches_of(fit.shape, shown, channel, beside=bare.shape)
    costs = [cost_of(each.shape, patches, offset=most.offset, error=most.error) for each in (fit, bare)]
    return bare if costs[1] * (1.0 - RIM_PAYS) ** (fit.shape.discs - bare.shape.discs) <= costs[0] else fit


def _rimmed(
    shape: Shape, shown: Sequence[View], channel: int, iris: Blades | None, pool: ThreadPoolExecutor | None
) -> Shape:
    """Return a shape with the rim, round or of blades, that fits best before anything else is freed."""
    patches = patches_of(shape, shown, channel)
    if iris is None or not patches:
        return shape
    few = patches[:: max(1, len(patches) // _FEW)]
    best, least = shape, np.inf
    for start in kinds_of(shape, iris):
        free = free_numbers(1, start.discs, 1)
        trial, cost = improve(start, few, free, width=shown[0].size_px[0], steps=4, offset=False, pool=pool)
        cost /= (1.0 - RIM_PAYS) ** start.discs
        if cost < least:
            best, least = trial, cost
    return best


def kinds_of(shape: Shape, iris: Blades | None) -> list[Shape]:
    """Return a shape with every kind of rim that an iris may give it, its own first.

    Parameters
    ----------
    shape : Shape
    iris : Blades or None

    Returns
    -------
    list of Shape
        A disc that bites into the rim may have stood for a blade: with another rim the shape comes without discs too.
    """
    own = blades_of(shape.numbers)
    found = [shape]
    for kind in rims_of(iris):
        if kind != own:
            numbers = with_blades(shape.numbers, kind)
            found.append(replace(shape, numbers=numbers))
            if shape.discs:
                found.append(without_discs(replace(shape, numbers=numbers)))
    return found


def _like(lead: Shape, own: Shape, alone: Sequence[View], channel: int) -> Shape:
    """Return the shape of the colour that leads as bright as another colour is."""
    amplitude = usual_amplitude(lead, alone, channel)
    if amplitude is None:
        return own
    numbers = lead.numbers.copy()
    numbers[FIRST_I:FIRST_DISC] *= amplitude
    return replace(lead, numbers=numbers)


def _refined(
    start: Shape,
    alone: Sequence[View],
    channel: int,
    known: Fit | None,
    pool: ThreadPoolExecutor | None,
    like: Shape | None = None,
) -> Fit | None:
    """Fit the numbers that were free in another fit; `like` is the ghost in a colour that tells more of it."""
    patches = patches_of(start, alone, channel)
    if not patches:
        return None
    free = fitted_numbers(known, start)
    return refine(start, patches, free, width=alone[0].size_px[0], steps=8, offset=False, like=like, pool=pool)


def to_model(ghosts: Sequence[Found], views: Sequence[View]) -> tuple[AberrationGhost, ...]:
    """Return found ghosts as a model's, named by number."""
    angles = [view.constellation_deg for view in views]
    out = []
    for number, ghost in enumerate(ghosts, 1):
        channels = [
            channel_of(shape.numbers, shape.discs, None if fit is None else fit.uncertainty)
            for shape, fit in zip(ghost.shapes, ghost.fits, strict=True)
        ]
        # what one view shows and the next does not comes or goes from the one to the other, for all one knows
        before, after = max(ghost.first - 1, 0), min(ghost.last + 1, len(angles) - 1)
        born = 0.5 * (angles[before] + angles[ghost.first])
        died = 0.5 * (angles[ghost.last] + angles[after])
        out.append(
            AberrationGhost(
                name=str(number),
                red=channels[0],
                green=channels[1],
                blue=channels[2],
                blades=blades_of(ghost.shapes[1].numbers),
                visible_deg=(born, died),
                fade_deg=(angles[ghost.first] - angles[before], angles[after] - angles[ghost.last]),
            )
        )
    return tuple(out)


def numbers_of(ghost: Found) -> int:
    """Return how many numbers describe a ghost's green."""
    fit = ghost.fits[1]
    return int(np.count_nonzero(ghost.shapes[1].numbers)) if fit is None else int(fit.free.size)
