"""The ghost pass: distribute paths over threads and add their light in a fixed order, independent of the threads."""

from __future__ import annotations

import os
import threading
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise, product
from time import thread_time
from typing import TYPE_CHECKING

import numpy as np

from ...kernels.paraxial.ghosts import RIM
from ...kernels.raster.polygons import sum_rows
from ...model import Layer, Quality
from ...optics.colour.rgb import luminance_weights
from ...optics.lens.paths import LightPath
from ...typing import Floats, Mask, Pixels, Progress
from ..image.canvas import DETAILS, Plane, blank, lit_window, merge, to_layer
from ..image.ghost_ranking import GhostRanking, luminance_of
from ..image.partial_picture import PartialPicture, steps_of
from ..image.sheet import Sheet
from ..scene.area_lights import DRAFT_ROUNDING, halvings, motion, spread_border
from ..scene.art_rules import PLAIN, PathArt
from ..scene.memory_check import check_memory, spare_bytes
from ..scene.shot import Shot
from .cost import CostMeter
from .final_pass import FinalPass
from .paraxial_ghosts import (
    downsampled,
    draft_alone,
    draft_colors,
    draft_details,
    draw_draft,
    draw_draft_by_detail,
    draw_overridden_draft,
    mark_spread,
    matrix_fluxes,
    spread_light,
)
from .pupil_search import ghost_search, group_by_mirror
from .traced_ghosts import SCREEN, STEP_CONTRAST, coarser_detail, detail_of, draw_alone, draw_final, edge_contrast

if TYPE_CHECKING:
    from .background_level import Surroundings


# (pixels, pictures): how many pictures are drawn in parallel, by picture size alone, so that sums round reproducibly
_CHUNKS = ((1_100_000, 8), (2_500_000, 4))
_GHOSTS_A_CHUNK = 16
# of drafts, whose ghosts are drawn faster than another picture is added
_DRAFT_CHUNKS = 2
# large drafts with one group of ghosts are drawn in parallel bands, their number set by size alone
_BANDS, _BAND_PX = 2, 300_000
# groups of ghosts that are spread together
_MOST_CHUNKS = 8
# ghosts with a separate picture that are drawn ahead of their turn, by the memory of their canvases
_AHEAD_BYTES, _CANVAS_BYTES = 400_000_000, 30
# from this number of ghosts on, drafts draw each ghost with no more detail than is visible among the others
CROWDED_GHOSTS = 200
# from this number of lights on, the faintest ghosts are left out, up to this part of all ghost light
MANY_LIGHTS, MANY_CULL = 8, 5e-4


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


class _ProgressMeter:
    """Counts finished paths over threads, reports them, and holds the cancel flag."""

    def __init__(self, steps: int, progress: Progress | None) -> None:
        self._steps, self._done, self._progress = max(steps, 1), 0, progress
        self._lock = threading.Lock()
        self.cancelled = threading.Event()

    def step(self, what: str) -> None:
        with self._lock:
            self._done += 1
            if self._progress is not None:
                self._progress(self._done / self._steps, what)


def render_ghosts(
    shots: Sequence[Shot],
    paths: Sequence[LightPath],
    quality: Quality,
    *,
    singles: int | None = 0,
    art: Mapping[str, PathArt] | None = None,
    level: float = 0.0,
    faintest: float = 0.0,
    threads: int | None = None,
    progress: Progress | None = None,
    costs: CostMeter | None = None,
    kept: PartialPicture | None = None,
    ranking: GhostRanking | None = None,
) -> GhostPass:
    """Draw the ghosts of all paths and lights.

    Parameters
    ----------
    shots : sequence of Shot
    paths : sequence of LightPath
    quality : Quality
    singles : int or None
        How many of the brightest paths also get a separate layer; None: all.
    art : mapping of str to PathArt, optional
        Overrides by path name.
    level : float
        Final quality: `GhostPass.level` of other ghosts in the same picture; these ghosts are drawn with no more detail
        than is visible among them.
    faintest : float
        Final quality: paths with a lower level are left out; art gains do not count.
    threads : int, optional
        None: all cores. The pixels do not depend on it.
    progress : callable, optional
        Called with the finished part (0 to 1) and the name of the step.
    costs : CostMeter, optional
        Final quality: gets the time and the work of each ghost.
    kept : PartialPicture, optional
        Final quality: keeps the drawn ghosts in files.
    ranking : GhostRanking, optional
        Gets the luminance of each ghost; all are drawn separately then, as for layers of single ghosts.
    """
    art = art or {}
    muted = {name for name, changed in art.items() if not changed.enabled}
    paths, given = [path for path in paths if path.name not in muted], paths
    meter = _ProgressMeter(len(paths) * (2 if quality.mode == "final" else 1), progress)
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        try:
            if quality.mode == "draft":
                done = _draft(shots, paths, singles, art, pool, meter, ranking)
            else:
                done = _final(shots, paths, quality, singles, art, (level, faintest), pool, meter, costs, kept, ranking)
            return replace(done, muted=len(given) - len(paths))
        except BaseException:
            # Ctrl-C arrives here: workers stop at their next wavelength
            meter.cancelled.set()
            pool.shutdown(wait=True, cancel_futures=True)
            raise


def _final(
    shots: Sequence[Shot],
    paths: Sequence[LightPath],
    quality: Quality,
    singles: int | None,
    art: Mapping[str, PathArt],
    levels: tuple[float, float],
    pool: ThreadPoolExecutor,
    meter: _ProgressMeter,
    costs: CostMeter | None = None,
    kept: PartialPicture | None = None,
    ranking: GhostRanking | None = None,
) -> GhostPass:
    others, faintest = levels
    layers_of, singles = singles, singles if ranking is None else None
    if kept is not None:
        kept.begin(f"order{len(paths[0].mirrors) if paths else 0}", shots, paths, quality, singles, art, levels)
    # separate layers need every ghost
    look = ghost_search(shots, paths, art, quality.screen and singles == 0)

    def find(group: list[LightPath]) -> list[list[FinalPass]]:
        if meter.cancelled.is_set():
            return []
        started = thread_time()
        found = look(group)
        if costs is not None:
            costs.searched(thread_time() - started)
        for _ in group:
            meter.step("searching ghosts")
        return found

    found = [items for group in pool.map(find, group_by_mirror(paths)) for items in group if items]
    # light beside the picture does not count
    flux = np.array([sum(item.region.seen_flux * item.gain for item in items) for items in found])
    own = _level(found)
    level = own + others
    # reference levels for the visibility of a ghost
    rough = coarser_detail(quality)
    seen_level = level * (SCREEN * rough if quality.screen else 1.0)
    keep = _worth_drawing(flux, quality.cull)
    if faintest > 0.0:
        keep &= np.array([_level([items], plain=True) > faintest for items in found], dtype=np.bool_)
    order = [int(k) for k in np.argsort(-flux, kind="stable") if keep[k]]

    alone = set(order if singles is None else order[:singles])
    named = [found[k][0].path for k in order]
    name_of = {k: path.name for k, path in zip(order, named, strict=True)}
    found, faint, faint_share = _without_faint(found, alone)
    around = _around([item for k in order for item in found[k]], level * rough, pool)

    def draw(group: list[int]) -> list[Plane | None]:
        canvas = blank(shots[0].size_px)
        steps = steps_of(kept, f"ghosts-{group[0]}", canvas, meter.cancelled)
        # blurring is linear, so ghosts with the same blur or spread are blurred together
        alike: dict[object, list[FinalPass]] = {}
        # rings in a separate layer are judged without the other ghosts
        seen_in = around if alone.isdisjoint(group) else None
        apart = partial(draw_alone, quality=quality, canvas=canvas, sheet=Sheet(), around=seen_in, costs=costs)
        for k in group:
            if meter.cancelled.is_set():
                break
            for item in found[k]:
                if item.source is not None and k not in alone:
                    continue
                if item.region.seen_flux > 0.0 and item.art.ramps:
                    steps.step(partial(apart, [item]), whole=False)
                elif item.region.seen_flux > 0.0 and item.alone:
                    alike.setdefault(item.alone, []).append(item)
                elif item.region.seen_flux > 0.0:
                    # a separate layer can be brightened later, so it is drawn in full detail
                    visibility = float("inf") if k in alone else edge_contrast(item, seen_level)
                    steps.step(partial(draw_final, item, quality, canvas, visibility, around=seen_in, costs=costs))
            meter.step(f"ghost {name_of[k]}")
        for together in alike.values():
            steps.step(partial(apart, together), whole=False)
        steps.end()
        return canvas.planes

    def draw_spread(number: int) -> list[Plane | None]:
        canvas, sheet = blank(shots[0].size_px), Sheet()
        steps = steps_of(kept, f"spread-{number}", canvas, meter.cancelled)
        for group in wide[number::_MOST_CHUNKS]:
            work = partial(draw_alone, group, quality, canvas, sheet, around=around, level=seen_level, costs=costs)
            steps.step(work, whole=False)
        steps.end()
        return canvas.planes

    wide = _alike([item for k in order if k not in alone for item in found[k]], seen_level)
    jobs = [partial(draw_spread, number) for number in range(min(len(wide), _MOST_CHUNKS))]
    total, layers = _collect(
        shots, order, named, singles, art, draw, pool, jobs, len(shots), layers_of=layers_of, ranking=ranking
    )
    share = float(flux[~keep].sum() / flux.sum()) if flux.sum() > 0.0 else 0.0
    names = tuple(path.name for path in named)
    culled = int((~keep).sum())
    return GhostPass(
        total, layers, len(order), len(paths) - len(found), culled, share, 0, names, own, faint, faint_share
    )


def _draft(
    shots: Sequence[Shot],
    paths: Sequence[LightPath],
    singles: int | None,
    art: Mapping[str, PathArt],
    pool: ThreadPoolExecutor,
    meter: _ProgressMeter,
    ranking: GhostRanking | None = None,
) -> GhostPass:
    layers_of, singles = singles, singles if ranking is None else None
    points, wide = ([s for s in shots if (s.border is None) == point] for point in (True, False))
    order = _rank_draft(shots, paths, art) if singles != 0 and paths else list(range(len(paths)))
    alone = set(order if singles is None else order[:singles])
    changes = [art.get(path.name, PLAIN) for path in paths]
    # paths with only a colour gain are drawn with the unchanged ones
    plain = [k for k, change in enumerate(changes) if not (change.alone or change.framed or any(change.offset))]
    rgb = np.reshape([change.rgb for change in changes], (-1, 3))
    crowded = len(points) * len(plain) >= CROWDED_GHOSTS
    own = [paths[k] for k in plain]
    colors = [draft_colors(shot, own) * rgb[plain, None] for shot in points]
    coarse = draft_details(points, own, colors) if crowded else None
    place = {k: number for number, k in enumerate(plain)}
    width, height = shots[0].size_px
    lone = not alone and _chunks(shots[0], len(order), _DRAFT_CHUNKS) == 1
    # a single group is drawn by the calling thread, which leaves the workers free for bands
    in_bands = partial(_in_bands, pool.map if lone and width * height >= _BANDS * _BAND_PX else None)

    def draw(group: list[int]) -> list[Plane | None]:
        differences: list[Floats | None] = [None] * DETAILS
        differences[0] = picture = np.zeros((height, width, 3))
        mine = sorted(k for k in group if k in place)
        ghosts, places = [paths[k] for k in mine], [place[k] for k in mine]
        overridden = [(paths[k], changes[k]) for k in group if k not in place]
        # ghosts with the same offset and no ramp, blur or scale are drawn together
        shifted: dict[object, list[tuple[LightPath, PathArt]]] = {}
        for path, changed in overridden:
            if not changed.alone and not changed.framed:
                shifted.setdefault(changed.offset, []).append((path, changed))
        for number, shot in enumerate(points):
            if coarse is None or not alone.isdisjoint(group):
                in_bands(height, partial(_mark_band, shot, ghosts, colors[number][places], picture))
            else:
                draw_draft_by_detail(shot, ghosts, coarse[number, places], differences, colors[number][places])
            for together in shifted.values():
                placed = together[0][1].place(shot.to_pixels, None)
                alike_placed = [path for path, _ in together]
                elsewhere = replace(shot, to_pixels=placed)
                grades = np.array([changed.rgb for _, changed in together])[:, None]
                draw_draft(elsewhere, alike_placed, picture, draft_colors(elsewhere, alike_placed) * grades)
            for path, changed in overridden:
                if changed.framed and not changed.alone:
                    draw_overridden_draft(shot, path, changed, picture)
        planes: list[Plane | None] = [None if marks is None else _summed(marks, in_bands) for marks in differences]
        # blurring is linear, so ghosts with the same blur are blurred together
        alike: dict[object, list[tuple[Shot, LightPath, PathArt]]] = {}
        for number, (shot, (path, changed)) in enumerate(product(points, overridden)):
            if changed.alone:
                key = ("ramp", number) if changed.ramps else changed.blur
                alike.setdefault(key, []).append((shot, path, changed))
        for blurred in alike.values():
            _add_to(planes, 0, draft_alone([(shot, path) for shot, path, _ in blurred], [art for *_, art in blurred]))
        _add_spread_drafts(wide, [paths[k] for k in group], art, planes)
        for k in group:
            meter.step(f"ghost {paths[k].name}")
        return planes

    named = [paths[k] for k in order]
    total, layers = _collect(
        shots, order, named, singles, art, draw, pool, most_chunks=_DRAFT_CHUNKS, layers_of=layers_of, ranking=ranking
    )
    return GhostPass(total, layers, len(paths), None, 0, 0.0, 0)


def _add_spread_drafts(
    shots: Sequence[Shot], paths: Sequence[LightPath], art: Mapping[str, PathArt],
    planes: list[Plane | None],
) -> None:  # fmt: skip
    """Add paraxial ghosts of area lights to one picture per resolution, those with the same spread together."""
    marked: list[Floats | None] = [None] * DETAILS
    scratch: Floats | None = None
    for shot in shots:
        alike: dict[object, list[tuple[LightPath, PathArt, Floats]]] = {}
        for path in paths:
            changed, moved = art.get(path.name, PLAIN), motion(shot, path, draft=True)
            if moved is not None:
                place = shot.to_pixels * [1.0, 1.0, changed.scale, changed.scale]
                border = spread_border(shot, moved[0], place, DRAFT_ROUNDING)
                key = (path.name if changed.ramps else None, changed.blur, border.tobytes())
                alike.setdefault(key, []).append((path, changed, border))
        for together in alike.values():
            source = together[0][2]
            halved = halvings(source, float("inf"), DETAILS - 1)
            ghosts, changes = [(shot, path) for path, *_ in together], [changed for _, changed, _ in together]
            if changes[0].alone:
                _add_to(planes, 0, draft_alone(ghosts, changes, source, halved))
            else:
                scratch = mark_spread(ghosts, changes, source, halved, marked, scratch)
    for detail, marks in enumerate(marked):
        if marks is not None:
            _add_to(planes, detail, spread_light(marks))


def _in_bands(beside: Callable[..., Iterator[None]] | None, height: int, work: Callable[[slice], None]) -> None:
    """Apply a function to the rows of a picture: at once, or to bands in parallel."""
    if beside is None:
        work(slice(0, height))
        return
    edges = [height * k // _BANDS for k in range(_BANDS + 1)]
    for _ in beside(work, [slice(*ends) for ends in pairwise(edges)]):
        pass


def _mark_band(shot: Shot, paths: Sequence[LightPath], colors: Floats, picture: Floats, band: slice) -> None:
    draw_draft(shot, paths, picture[band], colors, band.start)


def _summed(marks: Floats, in_bands: Callable[[int, Callable[[slice], None]], None]) -> Pixels:
    pixels = np.empty(marks.shape, dtype=np.float32)
    in_bands(len(marks), lambda band: sum_rows(marks[band], pixels[band]))
    return pixels


def _add_to(planes: list[Plane | None], detail: int, light: Floats) -> None:
    held = planes[detail]
    planes[detail] = light if held is None else np.add(held, light, out=held, casting="same_kind")


def _rank_draft(shots: Sequence[Shot], paths: Sequence[LightPath], art: Mapping[str, PathArt]) -> list[int]:
    """Sort paths by their flux in the picture: from matrices if nothing changes them, else drawn 1/16 as large."""
    flux = np.zeros(len(paths))
    for shot in shots:
        luminance = luminance_weights(shot.colorspace)
        small = downsampled(shot, 16)
        # a mask and an area light change how much light falls into the picture
        plain = shot.opening.mask is None and shot.border is None
        colors = draft_colors(shot, paths)
        waves = len(shot.packed.n_gap)
        found = matrix_fluxes(shot, paths, shot.packed.n_gap, shot.packed.reflectance, sides=RIM)[0]
        # those that are dark at all traced wavelengths have weights beyond them
        known = plain & ~colors[:, waves:].any(axis=(1, 2)) & np.array([path.name not in art for path in paths])
        flux += np.where(known, shot.gain * (found[:, :, None] * colors[:, :waves]).sum(axis=1) @ luminance, 0.0)
        for k in np.flatnonzero(~known).tolist():
            picture = np.zeros((small.size_px[1], small.size_px[0], 3))
            # ramps and blurs hardly change the order, so they are ignored
            draw_overridden_draft(small, paths[k], art.get(paths[k].name, PLAIN), picture)
            sum_rows(picture, picture)
            flux[k] += luminance @ picture.sum(axis=(0, 1))
    return [int(k) for k in np.argsort(-flux, kind="stable")]


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
    seen = sum(item.region.seen_flux * (item.shot.light.intensity if plain else item.gain) for item in items)
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


def _collect(
    shots: Sequence[Shot],
    items: list[int],
    named: Sequence[LightPath],
    singles: int | None,
    art: Mapping[str, PathArt],
    draw: Callable[[list[int]], list[Plane | None]],
    pool: ThreadPoolExecutor,
    jobs: Sequence[Callable[[], list[Plane | None]]] = (),
    ghosts_each: int = 1,
    most_chunks: int = _MOST_CHUNKS,
    *,
    layers_of: int | None,
    ranking: GhostRanking | None,
) -> tuple[Layer, tuple[Layer, ...]]:
    """Draw the first `singles` items separately, the others in a fixed number of groups, then run `jobs`; add in order.

    Each item stands for `ghosts_each` ghosts. The first `layers_of` separate ones become layers.
    """
    shot = shots[0]
    pixel_area = 1.0 / float(shot.to_pixels[2] * shot.to_pixels[3])
    luminance = luminance_weights(shot.colorspace)
    alone = len(items) if singles is None else min(singles, len(items))
    kept_layers = alone if layers_of is None else min(layers_of, alone)
    chunks = _chunks(shot, (len(items) - alone) * ghosts_each, most_chunks)
    rest = [items[alone + c :: chunks] for c in range(chunks)]
    totals: list[Plane | None] = [None] * DETAILS
    layers: list[Layer] = []
    spare, held = spare_bytes() if alone else 0.0, 0.0
    ahead = max(2, _AHEAD_BYTES // (_CANVAS_BYTES * shot.size_px[0] * shot.size_px[1]))
    for k, planes in enumerate(_in_turn(pool, draw, [[k] for k in items[:alone]], ahead)):
        path, pixels = named[k], merge(planes, shot.size_px)
        if ranking is not None:
            x0, y0, x1, y1 = lit_window(pixels)
            light = luminance_of(pixels[y0:y1, x0:x1], shot.colorspace) / np.float32(pixel_area)
            ranking.add(path.name, light, (x0, y0, x1 - x0, y1 - y0))
        if k >= kept_layers:
            totals = _added(totals, planes)
            continue
        about: dict[str, str | float] = {
            "path": path.name,
            # sum down the columns first: along a row the three channels alternate
            "flux_mm2": float(luminance @ pixels.sum(axis=0, dtype=np.float64).sum(axis=0)),
        }
        if path.name in art:
            about["art"] = art[path.name].text()
        layers.append(to_layer(f"ghost.{path.name}", pixels, pixel_area, about))
        held += layers[-1].pixels.nbytes
        check_memory(held, spare)
        # the layer holds a copy, so the planes can be added in place
        totals = _added(totals, planes)
    # a single group is drawn in this thread: it may use the pool for its bands
    for planes in (map if chunks == 1 else pool.map)(draw, [group for group in rest if group]):
        totals = _added(totals, planes)
    for planes in pool.map(lambda job: job(), jobs):
        totals = _added(totals, planes)
    total = merge(totals, shot.size_px)
    return to_layer("ghosts", total, pixel_area, {}, reuse=True), tuple(layers)


def _in_turn(
    pool: ThreadPoolExecutor, work: Callable[[list[int]], list[Plane | None]], items: Sequence[list[int]], ahead: int
) -> Iterator[list[Plane | None]]:
    """Work in parallel and return the results in order; at most `ahead` of them are in memory or in the making."""
    waiting: deque[Future[list[Plane | None]]] = deque()
    for item in items:
        if len(waiting) == ahead:
            yield waiting.popleft().result()
        waiting.append(pool.submit(work, item))
    while waiting:
        yield waiting.popleft().result()


def _chunks(shot: Shot, ghosts: int, most_chunks: int) -> int:
    """Return in how many parallel pictures this number of ghosts is drawn."""
    width, height = shot.size_px
    most_chunks = min(most_chunks, next((n for size, n in _CHUNKS if width * height <= size), 2))
    return max(1, min(most_chunks, ghosts // _GHOSTS_A_CHUNK))


def _added(totals: Sequence[Plane | None], planes: Sequence[Plane | None]) -> list[Plane | None]:
    """Add pictures resolution by resolution; the arrays of `totals` are overwritten."""
    sums = list(totals)
    for k, plane in enumerate(planes):
        held = sums[k]
        if plane is not None:
            sums[k] = plane if held is None else np.add(held, plane, out=held)
    return sums
