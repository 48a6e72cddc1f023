"""The stages after merging: find ghosts in a run's frames, and fit them."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import FlarewrightError
from ..io.merged import read_frame
from ..kernels.measure_pupil import BELOW, FIRST_DISC, FIRST_I, LATERAL, SOFT
from ..model.capture import FrameInfo, MergedRun
from ..model.corrections import Corrections
from ..model.ghost_model import AberrationGhost, Blades, GhostModel, Halo, Reference, Star
from .detail_fit import with_detail
from .evenly import evenly
from .fit import light_of
from .found import CHANNELS, Found, rest_of
from .fragments import joined
from .glow import halo_at, offsets, star_at
from .glow_fit import fit_halo, fit_star, followed, iris_of, register
from .joint import lit
from .journal import Journal
from .mixed import mixed, mixture, shares
from .moves_fit import with_moves
from .numbers import Floats, channel_numbers
from .packed import pack
from .pointing import candidate, kept, tell_pointed
from .pursuit import pursue
from .reach import with_reaches
from .replay import draw, light_px
from .settle import Settling, settle, to_model
from .shape import Shape
from .shared_out import shared_out
from .speck_sprites import all_hidden, covered, speck_sprites, specks_of
from .specks_drawn import draw_specks
from .spike_fit import spike_sprites
from .sprite_fit import axis_sprite, beside_sprites, light_sprites
from .views import Pixels, View, all_known, halved, views_of

Tell = Callable[[str], None]
Progress = Callable[[float, str], None]

# nothing is looked for nearer to the light than this, in pixels of a picture 720 wide
AROUND_LIGHT = 40.0 / 720.0
# and nothing but what goes with the light is learned nearer to it than this
NEXT_TO_LIGHT = 24.0 / 720.0
# part of the glow that may stay behind where it was taken off
LEFT_BEHIND = 0.1
# tangent of the constellation from which the light's distance from the axis tells the focal length
_OFF_AXIS = 0.02
# rounds in which stray places lose their weight, and how well a light's place is known at best
_LAW_ROUNDS, _LIGHT_PX = 20, 0.05
# part of the width by which a light's place may differ from the law of all places
_NEAR_LAW = 0.01
# ghosts are looked for in pictures halved until they are no wider, of no more constellations than this: with more of
# them a vote costs more and tells no more, and `pursuit.SCORE` is what chance reaches with so many
SEARCH_WIDTH, SEARCHED = 400, 50


def read_views(
    folder: Path, run: MergedRun, every: int = 1, pool: ThreadPoolExecutor | None = None
) -> tuple[View, ...]:
    """Read every n-th frame of each roll of a run, by rising constellation; the others are never opened.

    Raises
    ------
    FlarewrightError
        When frames cannot be read or are too few.
    """
    largest = max((abs(each.constellation_deg) for each in run.frames), default=0.0)
    rolls: dict[float, list[FrameInfo]] = {}
    for each in sorted(run.frames, key=lambda one: (one.nominal_deg, one.constellation_deg)):
        rolls.setdefault(each.nominal_roll_deg, []).append(each)
    frames = [each for turned in rolls.values() for each in turned[::every]]
    if len(frames) < 3 <= len(run.frames):
        raise FlarewrightError(
            f"{folder}: --every {every} leaves {len(frames)} of {len(run.frames)} constellations, too few to follow a "
            f"ghost; use at most --every {max(1, (len(run.frames) - 1) // 2)}"
        )
    frames.sort(key=lambda each: (each.constellation_deg, each.roll_deg))
    return views_of(shared_out(partial(read_frame, folder), frames, pool=pool), largest)


def masks_of(views: Sequence[View], pool: ThreadPoolExecutor | None = None) -> list[NDArray[np.bool_]]:
    """Return where ghosts are looked for: where all colours were measured, away from the light."""

    def one(view: View) -> NDArray[np.bool_]:
        far = _off_light(view) > AROUND_LIGHT * view.size_px[0]
        return np.asarray(far & all_known(view.variance))

    return shared_out(one, views, pool=pool)


def _off_light(view: View) -> NDArray[np.float64]:
    """Return how far each pixel is from the light, pixels, shape (H, W)."""
    x, y = offsets(view.light_px, view.size_px, 1.0)
    return np.asarray(np.hypot(x, y))


def coarse(view: View, times: int) -> View:
    """Return a view at a lower resolution, with its own pixels as the unit."""
    factor = 0.5**times
    x, y, cosine, sine, _ = view.frame
    return replace(
        view, frame=np.array([x * factor, y * factor, cosine, sine, 1.0]),
        light_px=(view.light_px[0] * factor, view.light_px[1] * factor), pixels=halved(view.pixels, times),
        variance=halved(view.variance, times, variance=True),
    )  # fmt: skip


def enlarged(shape: Shape, factor: float) -> Shape:
    """Return a shape in pixels that are smaller by a factor."""
    numbers = shape.numbers.copy()
    numbers[:FIRST_I] *= factor
    numbers[FIRST_I:FIRST_DISC] *= factor**2
    numbers[SOFT] *= factor**2
    numbers[LATERAL:BELOW] *= factor
    return replace(shape, numbers=numbers)


@dataclass(frozen=True)
class Dimmed:
    """Views without the light around the light, and that light.

    Attributes
    ----------
    views : list of View
        What shall not count has infinite variance; where glow was taken off they are less certain.
    halo : Halo or None
    star : Star or None
    """

    views: list[View]
    halo: Halo | None
    star: Star | None


def _star_of(views: Sequence[View], pool: ThreadPoolExecutor) -> Star | None:
    """Find the star that stays beside the light at every constellation, if there is one."""
    return fit_star(register(views, _measured(views), pool=pool))


def _measured(views: Sequence[View]) -> list[Pixels]:
    """Return what views show; not a number where nothing was measured."""
    return [np.where(np.isfinite(view.variance), view.pixels, np.nan).astype(np.float32) for view in views]


def find_ghosts(
    folder: Path,
    run: MergedRun,
    *,
    every: int = 1,
    corrections: Corrections | None = None,
    most: int = 60,
    threads: int | None = None,
    tell: Tell = lambda _: None,
    progress: Progress = lambda _part, _words: None,
    journal: Journal | None = None,
) -> GhostModel:
    """Find the ghosts of a merged run.

    Parameters
    ----------
    folder : Path
    run : MergedRun
    every : int
        Only every n-th constellation is looked at; the others never enter.
    corrections : Corrections, optional
        What a person knows better.
    most : int
        Ghosts.
    threads : int, optional
    tell : callable
        Gets a line for each ghost.
    progress : callable
        Gets the finished part and words.
    journal : Journal, optional
        Of an earlier run that was stopped; the result is the same with and without.

    Returns
    -------
    GhostModel
        Rough: all colours of a ghost have one shape.

    Raises
    ------
    FlarewrightError
        When frames cannot be read or are too few, or a correction points at nothing.
    """
    known = corrections or Corrections()
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        views = read_views(folder, run, every, pool)
        dim = _dimmed_beside([], views, _star_of(views, pool), pool)
        searched, dimmed = evenly(views, SEARCHED), evenly(dim.views, SEARCHED)
        times, small = _for_search(dimmed)
        seen = _mixed_for_search(searched, dimmed, shares(dimmed), pool)
        iris = iris_of(dim.star)
        pointed = [candidate(each, views, run, looked=len(seen), factor=2.0**times) for each in known.add]
        measured = [all_known(view.variance) for view in small]
        found = pursue(
            seen, measured, most=most, first=pointed, iris=iris, pool=pool, tell=tell, progress=progress,
            journal=journal,
        )  # fmt: skip
        found = lit(joined(lit(found, seen, pool=pool), seen, pool=pool, tell=tell), small, pool=pool)
    tell_pointed(known, pointed, found, tell)
    ghosts = to_model([_sized(ghost, 2.0**times) for ghost in found], searched)
    wanted = kept(known, ghosts, tell)
    rough: GhostModel = _model(run, wanted, dim, views).replace(
        removed=tuple(ghost for ghost in ghosts if ghost not in wanted)
    )
    return rough


def fit_ghosts(
    folder: Path,
    run: MergedRun,
    rough: GhostModel,
    *,
    every: int = 1,
    how: Settling | None = None,
    again: int = 1,
    most: int = 60,
    rest: bool = True,
    threads: int | None = None,
    tell: Tell = lambda _: None,
    progress: Progress = lambda _part, _words: None,
    journal: Journal | None = None,
) -> GhostModel:
    """Fit the ghosts that were found, all colours and all constellations.

    Parameters
    ----------
    folder : Path
    run : MergedRun
    rough : GhostModel
        From `find_ghosts`, perhaps changed by hand.
    every : int
        As for `find_ghosts`.
    how : Settling, optional
    again : int
        How often more ghosts are looked for in what is left.
    most : int
        Ghosts.
    rest : bool
        Also learn what is left beside them; `compress_ghosts` learns it anew.
    threads : int, optional
    tell, progress, journal
        As for `find_ghosts`.

    Returns
    -------
    GhostModel

    Raises
    ------
    FlarewrightError
        When frames cannot be read, or a ghost is none that is fitted here.
    """
    given = (*rough.ghosts, *rough.removed)
    ghosts = [ghost for ghost in given if isinstance(ghost, AberrationGhost)]
    if len(ghosts) < len(given):
        raise FlarewrightError("a Bezier ghost cannot be fitted over all constellations; take it out of the model")
    settling = how or Settling(rounds=1)
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        views = read_views(folder, run, every, pool)
        # without those that were removed the search for more would find them again, and the others would share their
        # light
        found = [
            replace(_found(ghost, views), unwanted=k >= len(rough.ghosts)) for k, ghost in enumerate(ghosts)
        ]  # fmt: skip
        dim = _dimmed_beside(found, views, _star_of(views, pool), pool)
        iris = iris_of(dim.star)
        parts = iter(_parts(2 * again + 1, progress))
        settled = settle(
            found, dim.views, how=settling, iris=iris, pool=pool, tell=tell, progress=next(parts), journal=journal
        )
        for _ in range(again):
            # with more ghosts known, the glow is better known and leaves more to be found
            dim = _dimmed_beside(settled, views, dim.star, pool)
            settled += _more(settled, views, dim.views, most - len(settled), iris, pool, tell, next(parts), journal)
            settled = _whole(settled, dim.views, pool, tell)
            settled = settle(
                settled, dim.views, how=settling, iris=iris, pool=pool, tell=tell, progress=next(parts),
                journal=journal,
            )  # fmt: skip
        dim = _dimmed_beside(settled, views, dim.star, pool)
    wanted = [ghost for ghost in settled if not ghost.unwanted]
    model = _model(run, to_model(wanted, views), dim, views)
    return with_rest(model, views, threads) if rest else model


def with_rest(model: GhostModel, views: Sequence[View], threads: int | None = None) -> GhostModel:
    """Return a model with what views show beside its ghosts, star and halo as sprites, in the place of old ones.

    Parameters
    ----------
    model : GhostModel
    views : sequence of View
        As photographed.
    threads : int, optional
    """
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        placed = [replace(view, light_px=_light_of(model, view, view.roll_deg)) for view in views]
        left = shared_out(partial(_left_by, model), placed, pool=pool)
        specks = specks_of(model, placed)
        # a speck is so much brighter than what is around it that coarse cells would spread its errors over that
        masks = covered(specks, placed, left)
        spikes = spike_sprites(placed, all_hidden(left, masks, pool), model.star)
        left = beside_sprites(left, spikes, placed, pool)
        # coarse pictures overshoot beside the light's image, which finer ones only mend where something is known
        around = shared_out(around_light, placed, all_hidden(left, masks, pool), pool=pool)
        going = light_sprites(placed, around, model.star is not None, pool)
        left = beside_sprites(left, going, placed, pool)
        # next to the light a pixel's error is brighter than all that turns about the axis
        next_to_light = [_off_light(view) < NEXT_TO_LIGHT * view.size_px[0] for view in placed]
        axis = axis_sprite(placed, all_hidden(all_hidden(left, masks, pool), next_to_light, pool), pool)
        left = beside_sprites(left, (axis,), placed, pool)
        small = speck_sprites(specks, placed, left, masks_of(placed))
    moving = with_moves(model.replace(sprites=(*spikes, *going, axis, *small)), threads)
    packed = pack(moving)
    left = [
        each - draw_specks(small, packed, moving, view.constellation_deg, view.frame, view.size_px)
        for each, view in zip(left, placed, strict=True)
    ]
    return with_reaches(with_detail(moving, placed, all_hidden(left, next_to_light), threads), placed, threads)


def _left_by(model: GhostModel, view: View) -> Pixels:
    """Return what a view shows beside a model's ghosts, halo and star; not a number where it was not measured."""
    known = np.where(np.isfinite(view.variance), view.pixels, np.nan)
    ghosts = draw(model, view.constellation_deg, view.roll_deg, view.size_px)
    return np.asarray(known - ghosts - _light(model.halo, model.star, view), dtype=np.float32)


def around_light(view: View, pixels: Pixels) -> Pixels:
    """Fill what is not known near the light with the median of what is known as far from it.

    Parameters
    ----------
    view : View
    pixels : ndarray, shape (H, W, 3)
        Not a number where nothing was measured.

    Returns
    -------
    ndarray, shape (H, W, 3)
        Farther off than where ghosts are looked for, and where nothing at a distance is known, as it was. So is what
        the view itself does not show, its clipped middle above all.
    """
    rings = _off_light(view).astype(np.int64)
    near = rings < AROUND_LIGHT * view.size_px[0]
    ring, light = rings[near], pixels[near]
    known = np.isfinite(light).all(axis=1)
    gaps = np.isnan(light).any(axis=1) & np.isfinite(view.variance[near]).all(axis=1)
    for far in np.unique(ring[gaps]):
        told = light[known & (ring == far)]
        if told.size:
            light[gaps & (ring == far)] = np.median(told, axis=0)
    out = pixels.copy()
    out[near] = light
    return out


def _light_of(model: GhostModel, view: View, roll_deg: float) -> tuple[float, float]:
    """Return where a view's light is: as seen, or where a replay puts it when that is far off or beyond the picture.

    Next to the axis a camera that nods turns the light's direction about: there a roll does not tell the place.
    """
    told = light_px(model, view.constellation_deg, roll_deg)
    off = np.hypot(*np.subtract(view.light_px, told))
    inside = all(0.0 <= at <= side for at, side in zip(view.light_px, view.size_px, strict=True))
    return view.light_px if inside and off < _NEAR_LAW * view.size_px[0] else told


def _dimmed_beside(
    ghosts: Sequence[Found], views: Sequence[View], star: Star | None, pool: ThreadPoolExecutor
) -> Dimmed:
    """Learn the halo, and how strong a star is, from what is left beside known ghosts, and take both off the views."""
    left = shared_out(partial(without, ghosts), views, range(len(views)), pool=pool)
    masks = masks_of(views, pool)
    halo, star = followed(views, left, masks, fit_halo(views, left, pool=pool), star, pool)
    return Dimmed(beside(views, halo, star, pool), halo, star)


def _parts(count: int, progress: Progress) -> list[Progress]:
    """Divide progress evenly among parts of the work that follow each other."""
    return [lambda part, words, k=k: progress((k + part) / count, words) for k in range(count)]  # type: ignore[misc]


def beside(
    views: Sequence[View], halo: Halo | None, star: Star | None, pool: ThreadPoolExecutor | None = None
) -> list[View]:
    """Return what views show beside halo and star, less certain where those are bright; nothing around the light."""

    def one(view: View, mask: NDArray[np.bool_]) -> View:
        light = _light(halo, star, view)
        variance = np.where(mask[..., None], view.variance + (LEFT_BEHIND * light) ** 2, np.inf).astype(np.float32)
        return replace(view, pixels=view.pixels - light, variance=variance)

    return shared_out(one, views, masks_of(views, pool), pool=pool)


def _light(halo: Halo | None, star: Star | None, view: View) -> Pixels:
    """Draw halo and star as a view shows them, shape (H, W, 3)."""
    x, y = offsets(view.light_px, view.size_px, 1.0)
    light = np.zeros(view.pixels.shape, np.float32)
    if halo is not None:
        light += halo_at(halo, view.constellation_deg, x, y).astype(np.float32)
    if star is not None:
        light += star_at(star, view.constellation_deg, x, y).astype(np.float32)
    return light


def _more(
    known: Sequence[Found],
    views: Sequence[View],
    dimmed: Sequence[View],
    most: int,
    iris: Blades | None,
    pool: ThreadPoolExecutor,
    tell: Tell,
    progress: Progress,
    journal: Journal | None,
) -> list[Found]:
    """Look for more ghosts beside the known ones, at the search's resolution."""
    numbers = evenly(range(len(views)), SEARCHED)
    searched = [dimmed[k] for k in numbers]
    share = shares(searched)
    times, small = _for_search(searched)
    seen = _mixed_for_search([views[k] for k in numbers], searched, share, pool)
    measured = [all_known(view.variance) for view in small]
    ghosts = [_among(_sized(ghost, 0.5**times), numbers) for ghost in known]
    left = np.stack([rest_of(ghosts, small, m, pool) for m in range(CHANNELS)], axis=-1)
    found = pursue(
        seen, measured, most=max(most, 0), rest=[mixture(each, share) for each in left], iris=iris, pool=pool,
        tell=tell, progress=progress, journal=journal,
    )  # fmt: skip
    return [replace(_sized(ghost, 2.0**times), first=numbers[ghost.first], last=numbers[ghost.last]) for ghost in found]


def _among(ghost: Found, numbers: Sequence[int]) -> Found:
    """Return a ghost with its life counted among some of the views; it may fall between two of them."""
    first, beyond = np.searchsorted(numbers, (ghost.first, ghost.last + 1))
    return replace(ghost, first=int(first), last=int(beyond) - 1)


def _whole(ghosts: Sequence[Found], views: Sequence[View], pool: ThreadPoolExecutor, tell: Tell) -> list[Found]:
    """Join ghosts that are one, at the search's resolution; a fit shows better than a search what belongs together."""
    times, small = _for_search(views)
    found = joined([_sized(ghost, 0.5**times) for ghost in ghosts], small, pool=pool, tell=tell)
    return [_sized(ghost, 2.0**times) for ghost in found]


def _for_search(views: Sequence[View]) -> tuple[int, list[View]]:
    """Return how often pictures are halved in which ghosts are looked for, and these."""
    times = max(0, int(np.ceil(np.log2(views[0].size_px[0] / SEARCH_WIDTH))))
    return times, [coarse(view, times) for view in views]


def _mixed_for_search(
    views: Sequence[View], dimmed: Sequence[View], share: Floats, pool: ThreadPoolExecutor
) -> list[View]:
    """Return the pictures in which ghosts are looked for, all colours as one."""
    _, seen = _for_search(mixed(views, dimmed, share, LEFT_BEHIND, pool))
    return seen


def _sized(ghost: Found, factor: float) -> Found:
    """Return a ghost in pixels that are smaller by a factor."""
    red, green, blue = (enlarged(shape, factor) for shape in ghost.shapes)
    return replace(ghost, shapes=(red, green, blue))


def without(ghosts: Sequence[Found], view: View, number: int) -> Pixels:
    """Return a view's pixels without the ghosts that it shows, shape (H, W, 3); not a number where not measured."""
    left = np.where(np.isfinite(view.variance), view.pixels, np.nan).astype(np.float64)
    for ghost in ghosts:
        if ghost.first <= number <= ghost.last:
            for m in range(3):
                part, light = light_of(ghost.shapes[m], view)
                left[part][..., m] -= light
    return left.astype(np.float32)


def _found(ghost: AberrationGhost, views: Sequence[View]) -> Found:
    """Return a model's ghost as the fitter takes it."""
    shapes = [
        Shape(channel_numbers(each, ghost.blades), len(each.discs)) for each in (ghost.red, ghost.green, ghost.blue)
    ]
    there = [
        k for k, view in enumerate(views) if ghost.visible_deg[0] <= view.constellation_deg <= ghost.visible_deg[1]
    ]
    first, last = (there[0], there[-1]) if there else (0, len(views) - 1)
    return Found((shapes[0], shapes[1], shapes[2]), first, last)


def light_law(views: Sequence[View], px_per_rad: float) -> tuple[float, float]:
    """Return focal length (pixels) and distortion that tell where the views' lights are; see `GhostModel`.

    Parameters
    ----------
    views : sequence of View
        Those whose light lies in the picture count: places beyond it are foretold, not seen.
    px_per_rad : float
        Taken where fewer than four of them have the light well off the axis.
    """
    t = np.array([np.tan(np.radians(abs(view.constellation_deg))) for view in views])
    away = np.array([np.hypot(*np.subtract(view.light_px, view.frame[:2])) for view in views])
    inside = [all(0.0 <= at <= side for at, side in zip(view.light_px, view.size_px, strict=True)) for view in views]
    seen = np.array(inside) & (t > _OFF_AXIS)
    if np.unique(np.round(t[seen], 4)).size < 4:
        return px_per_rad, 0.0
    basis, away = np.stack([t, t**3], axis=1)[seen], away[seen]
    law = np.array([np.median(away / basis[:, 0]), 0.0])
    for _ in range(_LAW_ROUNDS):
        # a light that was taken for another counts less and less
        off = np.abs(away - basis @ law)
        root = 1.0 / np.hypot(1.0, off / (3.0 * max(1.4826 * float(np.median(off)), _LIGHT_PX)))
        law = np.linalg.lstsq(basis * root[:, None], away * root, rcond=None)[0]
    focal, bent = law
    return float(focal), float(bent / focal)


def _model(run: MergedRun, ghosts: tuple[AberrationGhost, ...], dim: Dimmed, views: Sequence[View]) -> GhostModel:
    angles = [each.constellation_deg for each in run.frames]
    focal, distortion = light_law(views, run.px_per_rad)
    used = [view.constellation_deg for view in views]
    return GhostModel(
        size_px=run.size_px, axis_px=run.axis_px, focal_px=focal, distortion=distortion,
        largest_deg=max(abs(angle) for angle in angles), constellation_deg=(min(used), max(used)), ghosts=ghosts,
        halo=dim.halo, star=dim.star,
        reference=Reference(iso=run.reference_iso, f_number=run.reference_f_number, exposure_s=1.0),
        to_rec709=run.to_rec709,
    )  # fmt: skip
