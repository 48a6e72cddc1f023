"""The stages after merging: find ghosts in a run's frames, and fit them."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..errors import FlarewrightError
from ..model.capture import MergedRun
from ..model.corrections import Corrections
from ..model.ghost_model import AberrationGhost, Blades, GhostModel, Reference, Star
from .anew import begun_anew
from .apart import taken_apart
from .dimmed import LEFT_BEHIND, Dimmed, dimmed_beside
from .evenly import evenly
from .found import CHANNELS, Found, by_light, rest_of
from .fragments import joined
from .glow_fit import fit_star, iris_of, register
from .glow_left import glow_left
from .joint import lit
from .journal import Journal
from .light_law import light_law
from .mixed import mixed, mixture, shares
from .numbers import Floats, channel_numbers
from .pointing import candidate, kept, tell_pointed
from .pursuit import pursue
from .reading import read_views
from .rest_fit import with_rest
from .settle import Settling, settle, to_model
from .shape import Shape, enlarged
from .views import View, all_known, coarse

Tell = Callable[[str], None]
Progress = Callable[[float, str], None]

# ghosts are looked for in pictures halved until they are no wider, of no more constellations than this: with more of
# them a vote costs more and tells no more
SEARCH_WIDTH, SEARCHED = 400, 50


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
        dim = dimmed_beside([], views, _star_of(views, pool), pool)
        searched, dimmed = evenly(views, SEARCHED), evenly(dim.views, SEARCHED)
        times, small = _for_search(dimmed)
        seen = _mixed_for_search(searched, dimmed, shares(dimmed), pool)
        iris = iris_of(dim.star)
        factor = 2.0**times
        pointed = [candidate(each, views, run, looked=len(seen), factor=factor) for each in known.add]
        measured = [all_known(view.variance) for view in small]
        found = pursue(
            seen, measured, most=most, first=pointed, iris=iris, factor=factor, pool=pool, tell=tell,
            progress=progress, journal=journal,
        )  # fmt: skip
        found = joined(lit(found, seen, pool=pool), seen, factor=factor, pool=pool, tell=tell)
        found = lit(begun_anew(found, seen, pool=pool, journal=journal), small, pool=pool)
        found = taken_apart(found, small, iris=iris, factor=factor, pool=pool, tell=tell, journal=journal)
        found = lit(found, small, pool=pool)
    tell_pointed(known, pointed, found, tell)
    whole = [_sized(ghost, factor) for ghost in found]
    ghosts = to_model(whole, searched)
    glow = [ghost.name for ghost, left in zip(ghosts, glow_left(whole, searched), strict=True) if left]
    for name in glow:
        tell(f"ghost {name} is no more than halo and star leave around the light: left out")
    wanted = tuple(ghost for ghost in kept(known, ghosts, tell) if ghost.name not in glow)
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
        # in whatever order they come: sums in another order differ in their last digits, and searches amplify that
        found = [found[k] for k in by_light(found)]
        dim = dimmed_beside(found, views, _star_of(views, pool), pool)
        iris = iris_of(dim.star)
        parts = iter(_parts(2 * again + 1, progress))
        settled = settle(
            found, dim.views, how=settling, iris=iris, pool=pool, tell=tell, progress=next(parts), journal=journal
        )
        for _ in range(again):
            # with more ghosts known, the glow is better known and leaves more to be found
            dim = dimmed_beside(settled, views, dim.star, pool)
            settled += _more(settled, views, dim.views, most - len(settled), iris, pool, tell, next(parts), journal)
            settled = _whole(settled, dim.views, pool, tell)
            settled = taken_apart(settled, dim.views, iris=iris, pool=pool, tell=tell, journal=journal)
            settled = settle(
                settled, dim.views, how=settling, iris=iris, pool=pool, tell=tell, progress=next(parts),
                journal=journal,
            )  # fmt: skip
        dim = dimmed_beside(settled, views, dim.star, pool)
    wanted = [
        ghost for ghost, left in zip(settled, glow_left(settled, views), strict=True) if not (left or ghost.unwanted)
    ]
    model = _model(run, to_model(wanted, views), dim, views)
    return with_rest(model, views, threads, journal) if rest else model


def _star_of(views: Sequence[View], pool: ThreadPoolExecutor) -> Star | None:
    """Find the star that stays beside the light at every constellation, if there is one."""
    return fit_star(register(views, [view.measured for view in views], pool=pool))


def _parts(count: int, progress: Progress) -> list[Progress]:
    """Divide progress evenly among parts of the work that follow each other."""
    return [lambda part, words, k=k: progress((k + part) / count, words) for k in range(count)]  # type: ignore[misc]


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
        seen, measured, most=max(most, 0), rest=[mixture(each, share) for each in left], iris=iris,
        factor=2.0**times, pool=pool, tell=tell, progress=progress, journal=journal,
    )  # fmt: skip
    return [replace(_sized(ghost, 2.0**times), first=numbers[ghost.first], last=numbers[ghost.last]) for ghost in found]


def _among(ghost: Found, numbers: Sequence[int]) -> Found:
    """Return a ghost with its life counted among some of the views; it may fall between two of them."""
    first, beyond = np.searchsorted(numbers, (ghost.first, ghost.last + 1))
    return replace(ghost, first=int(first), last=int(beyond) - 1)


def _whole(ghosts: Sequence[Found], views: Sequence[View], pool: ThreadPoolExecutor, tell: Tell) -> list[Found]:
    """Join ghosts that are one, at the search's resolution; a fit shows better than a search what belongs together."""
    times, small = _for_search(views)
    smaller = [_sized(ghost, 0.5**times) for ghost in ghosts]
    found = joined(smaller, small, factor=2.0**times, pool=pool, tell=tell)
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


def _model(run: MergedRun, ghosts: tuple[AberrationGhost, ...], dim: Dimmed, views: Sequence[View]) -> GhostModel:
    angles = [each.constellation_deg for each in run.frames]
    focal, distortion = light_law(views, run.px_per_rad)
    used = [view.constellation_deg for view in views]
    return GhostModel(
        size_px=run.size_px, axis_px=run.axis_px, focal_px=focal, distortion=distortion,
        largest_deg=max(abs(angle) for angle in angles), constellation_deg=(min(used), max(used)), ghosts=ghosts,
        halo=dim.halo, star=dim.star, reference=reference_of(run), to_rec709=run.to_rec709,
    )  # fmt: skip


def reference_of(run: MergedRun) -> Reference:
    """Return the settings of a run's frames: 1 fills the sensor in a second, but for the white balance."""
    camera = run.camera
    return Reference(
        iso=run.reference_iso, f_number=run.reference_f_number, exposure_s=1.0,
        luminance_cd_m2=camera.luminance_cd_m2, solid_angle_sr=camera.solid_angle_sr,
        # where nothing is known to clip, 1 is the files' own unit
        clipping=None if camera.white_level is None else run.white_balance,
    )  # fmt: skip
