"""The ghosts of a picture in final quality: searched, sorted, without those too faint to show, and drawn in groups."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from time import thread_time
from typing import TYPE_CHECKING

import numpy as np

from ...optics.lens.paths import LightPath
from ...typing import Floats, Mask
from ..image.canvas import Canvas, Plane, blank
from ..image.partial_picture import PartialPicture, Steps, steps_of
from ..image.sheet import Sheet
from ..scene.shot import Shot
from .cost import CostMeter
from .final_pass import FinalPass
from .ghost_sums import MOST_CHUNKS, GhostPass, GhostWork, sum_ghosts
from .pupil_search import ghost_search, group_by_mirror
from .traced_ghosts import SCREEN, STEP_CONTRAST, coarser_detail, detail_of, draw_alone, draw_final, edge_contrast

if TYPE_CHECKING:
    from .background_level import Surroundings

# from this number of lights on, the faintest ghosts are left out, up to this part of all ghost light
MANY_LIGHTS, MANY_CULL = 8, 5e-4


def draw_finals(
    work: GhostWork, *, level: float, faintest: float, costs: CostMeter | None, kept: PartialPicture | None
) -> GhostPass:
    """Draw the ghosts of a picture from traced ray bundles; parameters as of `ghost_pass.render_ghosts`."""
    shots, paths, quality = work.shots, work.paths, work.quality
    if kept is not None:
        order_name = f"order{len(paths[0].mirrors) if paths else 0}"
        kept.begin(order_name, shots, paths, quality, work.singles, work.art, (level, faintest))
    found = _found(work, costs)
    # light beside the picture does not count
    flux = np.array([sum(item.region.seen_flux * item.gain for item in items) for items in found])
    own = _level(found)
    # reference levels for the visibility of a ghost
    rough = coarser_detail(quality)
    seen_level = (own + level) * (SCREEN * rough if quality.screen else 1.0)
    keep = _worth_drawing(flux, quality.cull)
    if faintest > 0.0:
        keep &= np.array([_level([items], plain=True) > faintest for items in found], dtype=np.bool_)
    order = [int(k) for k in np.argsort(-flux, kind="stable") if keep[k]]

    alone = work.alone(order)
    named = [found[k][0].path for k in order]
    found, faint, faint_share = _without_faint(found, alone)
    around = _around([item for k in order for item in found[k]], (own + level) * rough, work.pool)
    names = {k: path.name for k, path in zip(order, named, strict=True)}
    drawing = _Drawing(work, found, names, alone, around, seen_level, costs, kept)
    wide = _alike([item for k in order if k not in alone for item in found[k]], seen_level)
    jobs = [
        partial(_draw_spread, drawing, wide[number::MOST_CHUNKS], number)
        for number in range(min(len(wide), MOST_CHUNKS))
    ]
    total, layers = sum_ghosts(work, order, named, partial(_draw_group, drawing), jobs, len(shots))
    share = float(flux[~keep].sum() / flux.sum()) if flux.sum() > 0.0 else 0.0
    return GhostPass(
        total, layers, len(order), len(paths) - len(found), int((~keep).sum()), share, 0,
        tuple(names.values()), own, faint, faint_share,
    )  # fmt: skip


@dataclass(frozen=True)
class _Drawing:
    """What all groups of ghosts share."""

    work: GhostWork
    # the ghosts of each path
    found: Sequence[Sequence[FinalPass]]
    # of the paths that are drawn
    names: Mapping[int, str]
    # paths that are drawn separately
    alone: set[int]
    # against these the visibility of rings and of ghosts is judged
    around: Surroundings | None
    level: float
    costs: CostMeter | None
    kept: PartialPicture | None

    def steps(self, name: str, canvas: Canvas) -> Steps:
        """Return the steps in which a group is drawn, those that `kept` holds done."""
        return steps_of(self.kept, name, canvas, self.work.meter.cancelled)


def _found(work: GhostWork, costs: CostMeter | None) -> list[list[FinalPass]]:
    """Search the accepted pupil of all paths and lights; paths that pass no light are left out."""
    # separate layers need every ghost
    look = ghost_search(work.shots, work.paths, work.art, work.quality.screen and work.singles == 0)

    def find(group: list[LightPath]) -> list[list[FinalPass]]:
        if work.meter.cancelled.is_set():
            return []
        started = thread_time()
        found = look(group)
        if costs is not None:
            costs.searched(thread_time() - started)
        for _ in group:
            work.meter.step("searching ghosts")
        return found

    return [items for group in work.pool.map(find, group_by_mirror(work.paths)) for items in group if items]


def _draw_group(drawing: _Drawing, group: list[int]) -> list[Plane | None]:
    """Draw the ghosts of the paths of these numbers, but those of area lights that are spread with other paths'."""
    meter, quality, costs = drawing.work.meter, drawing.work.quality, drawing.costs
    canvas = blank(drawing.work.shots[0].size_px)
    steps = drawing.steps(f"ghosts-{group[0]}", canvas)
    # blurring is linear, so ghosts with the same blur or spread are blurred together
    alike: dict[object, list[FinalPass]] = {}
    # rings in a separate layer are judged without the other ghosts
    around = drawing.around if drawing.alone.isdisjoint(group) else None
    apart = partial(draw_alone, quality=quality, canvas=canvas, sheet=Sheet(), around=around, costs=costs)
    for k in group:
        if meter.cancelled.is_set():
            break
        for item in drawing.found[k]:
            if item.source is not None and k not in drawing.alone:
                continue
            if item.region.seen_flux > 0.0 and item.art.ramps:
                steps.step(partial(apart, [item]), whole=False)
            elif item.region.seen_flux > 0.0 and item.alone:
                alike.setdefault(item.alone, []).append(item)
            elif item.region.seen_flux > 0.0:
                # a separate layer can be brightened later, so it is drawn in full detail
                visibility = float("inf") if k in drawing.alone else edge_contrast(item, drawing.level)
                steps.step(partial(draw_final, item, quality, canvas, visibility, around=around, costs=costs))
        meter.step(f"ghost {drawing.names[k]}")
    for together in alike.values():
        steps.step(partial(apart, together), whole=False)
    steps.end()
    return canvas.planes


def _draw_spread(drawing: _Drawing, groups: Sequence[list[FinalPass]], number: int) -> list[Plane | None]:
    """Draw the ghosts of area lights, each group spread together."""
    canvas, sheet = blank(drawing.work.shots[0].size_px), Sheet()
    steps = drawing.steps(f"spread-{number}", canvas)
    apart = partial(
        draw_alone, quality=drawing.work.quality, canvas=canvas, sheet=sheet, around=drawing.around,
        level=drawing.level, costs=drawing.costs,
    )  # fmt: skip
    for group in groups:
        steps.step(partial(apart, group), whole=False)
    steps.end()
    return canvas.planes


def plain_level(shots: Sequence[Shot], paths: Sequence[LightPath], threads: int | None = None) -> float:
    """Return the level (`GhostPass.level`) of the ghosts without art direction.

    Parameters
    ----------
    shots : sequence of Shot
    paths : sequence of LightPath
    threads : int, optional
        None: all cores.
    """
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        groups = pool.map(ghost_search(shots, paths, {}), group_by_mirror(paths))
        return _level([items for group in groups for items in group])


def _level(found: Sequence[Sequence[FinalPass]], *, plain: bool = False) -> float:
    """Mean irradiance of all ghosts over the circle around the picture, with or without art gains."""
    items = [item for group in found for item in group]
    if not items:
        return 0.0
    seen = sum(item.region.seen_flux * (item.plain_gain if plain else item.gain) for item in items)
    return float(seen / (np.pi * items[0].shot.view_radius ** 2))


def _around(items: Sequence[FinalPass], level: float, pool: ThreadPoolExecutor) -> Surroundings | None:
    """Sketch the ghosts against which the visibility of rings is judged; None if the project has no rings."""
    bright = [item for item in items if item.region.seen_flux > 0.0 and edge_contrast(item, level) >= STEP_CONTRAST]
    if not any(item.shot.ringing is not None for item in bright):
        return None
    # imported only where there are rings
    from .background_level import surroundings

    return surroundings(bright, pool.map)


def _alike(items: list[FinalPass], level: float) -> list[list[FinalPass]]:
    """Group the ghosts of area lights that can be spread together, over all paths and parts of lights."""
    groups: dict[object, list[FinalPass]] = {}
    for number, item in enumerate(items):
        if item.source is not None and item.region.seen_flux > 0.0:
            # faint ghosts lose as much detail as those of a point light
            seen = replace(item, detail=max(item.detail, detail_of(edge_contrast(item, level))))
            groups.setdefault((seen.alone, number if item.art.ramps else None), []).append(seen)
    return list(groups.values())


def _worth_drawing(flux: Floats, cull: float) -> Mask:
    """Select the brightest paths so that the others carry at most `cull` of all flux."""
    keep = np.ones(len(flux), dtype=np.bool_)
    if cull > 0.0:
        order = np.argsort(flux, kind="stable")
        keep[order[np.cumsum(flux[order]) <= cull * flux.sum()]] = False
    return keep


def _without_faint(found: Sequence[list[FinalPass]], alone: set[int]) -> tuple[list[list[FinalPass]], int, float]:
    """Remove the faintest ghosts of single lights among many, except those of paths with a separate layer.

    Returns the remaining ghosts, the number of removed ones, and their part of the flux.
    """
    lights = {item.shot.number for items in found for item in items}
    if len(lights) < MANY_LIGHTS:
        return list(found), 0, 0.0
    places = [(k, m) for k, items in enumerate(found) for m in range(len(items))]
    flux = np.array([found[k][m].region.seen_flux * found[k][m].gain for k, m in places])
    open_to = np.array([k not in alone for k, _ in places])
    dim = ~_worth_drawing(flux, MANY_CULL) & open_to & (flux > 0.0)
    left = [list(items) for items in found]
    for number in np.flatnonzero(dim)[::-1]:
        k, m = places[number]
        del left[k][m]
    return left, int(dim.sum()), float(flux[dim].sum() / flux.sum()) if dim.any() else 0.0
