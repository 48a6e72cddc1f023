"""The ghost pass: distributes paths over workers and collects their light, in an order that threads cannot change."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise, product
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..kernels.raster import sum_rows
from ..model import Layer, Quality
from ..optics.color import luminance_weights
from ..optics.paths import LightPath
from .art import PLAIN, PathArt
from .canvas import DETAILS, Plane, blank, merge, to_layer
from .final_pass import FinalPass
from .ghosts_draft import (
    draft_alone,
    draft_colors,
    draft_details,
    draw_draft,
    draw_draft_by_hand,
    draw_draft_coarsely,
    mark_spread,
    seen_small,
    spread_light,
)
from .ghosts_final import (
    SCREEN,
    STEP_CONTRAST,
    coarser,
    contrast,
    detail_of,
    draw_alone,
    draw_final,
)
from .looking import kindred, looking
from .room import need, spare_bytes
from .shot import Shot
from .sources import DRAFT_ROUNDING, halvings, motion, spread_border

if TYPE_CHECKING:
    from .surroundings import Surroundings

Progress = Callable[[float, str], None]

# pictures drawn side by side before they are added: fixed by size, never by threads, so sums round alike everywhere
_CHUNKS = ((1_100_000, 8), (2_500_000, 4))
_GHOSTS_A_CHUNK = 16
# of drafts, whose ghosts are drawn in less time than a picture more is added in
_DRAFT_CHUNKS = 2
# drafts of so many pixels whose ghosts are drawn in one go are drawn in bands side by side: fixed by size, never by
# threads
_BANDS, _BAND_PX = 2, 300_000
# and of ghosts that are spread together
_MOST_CHUNKS = 8
# so many ghosts of a draft are drawn in no more detail than can be seen among the others
CROWD = 200
# of so many lights, the faintest ghosts are left out that carry together no more than this part of all ghost light
MANY_LIGHTS, MANY_CULL = 8, 5e-4


@dataclass(frozen=True)
class GhostPass:
    """What the ghost pass made.

    Attributes
    ----------
    total : Layer
        All ghosts.
    singles : tuple of Layer
        One layer a path, brightest first, when asked for.
    drawn : int
        Paths drawn.
    dark : int or None
        Paths that pass no light; draft quality does not look.
    culled : int
        Paths left out on purpose.
    culled_share : float
        Their part of the flux, by the pre-pass.
    muted : int
        Paths left out by hand.
    names : tuple of str
        Of the paths drawn.
    faint, faint_share : int, float
        Ghosts of single lights among many that were left out as too faint, and their part of the flux.
    level : float
        Mean irradiance of the ghosts over the circle around the picture, by the pre-pass, per unit irradiance of the
        light; 0 in draft quality.
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


class _Meter:
    """Counts finished paths over threads, reports them, and carries the wish to stop."""

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
) -> GhostPass:
    """Draw every path of every light.

    Parameters
    ----------
    shots : sequence of Shot
    paths : sequence of LightPath
    quality : Quality
    singles : int or None
        How many of the brightest paths also get a layer of their own; None: all.
    art : mapping of str to PathArt, optional
        What is changed by hand, by path name.
    level : float
        `GhostPass.level` of other ghosts of the same picture, so that these are drawn in no more detail than can be
        seen among them (final).
    faintest : float
        Paths of no more than this level by themselves, whatever `art` makes of them, are left out (final).
    threads : int, optional
        None: all cores. The pixels do not depend on it.
    progress : callable, optional
        Called with the finished part and what was finished.

    Returns
    -------
    GhostPass
    """
    art = art or {}
    muted = {name for name, changed in art.items() if not changed.enabled}
    paths, given = [path for path in paths if path.name not in muted], paths
    meter = _Meter(len(paths) * (2 if quality.mode == "final" else 1), progress)
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        try:
            if quality.mode == "draft":
                done = _draft(shots, paths, singles, art, pool, meter)
            else:
                done = _final(shots, paths, quality, singles, art, (level, faintest), pool, meter)
            return replace(done, muted=len(given) - len(paths))
        except BaseException:
            # Ctrl-C arrives here: let the workers end at their next wavelength
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
    meter: _Meter,
) -> GhostPass:
    others, faintest = levels
    # where ghosts get layers of their own none may be missing
    look = looking(shots, paths, art, quality.screen and singles == 0)

    def find(group: list[LightPath]) -> list[list[FinalPass]]:
        if meter.cancelled.is_set():
            return []
        found = look(group)
        for _ in group:
            meter.step("looking for ghosts")
        return found

    found = [items for group in pool.map(find, kindred(paths)) for items in group if items]
    # what lands beside the picture is neither bright nor worth keeping
    flux = np.array([sum(item.region.seen_flux * item.gain for item in items) for items in found])
    own = _level(found)
    level = own + others
    # against which it is judged how much of a ghost can be seen
    rough = coarser(quality)
    seen_level = level * (SCREEN * rough if quality.screen else 1.0)
    keep = _worth_drawing(flux, quality.cull)
    if faintest > 0.0:
        keep &= np.array([_level([items], plain=True) > faintest for items in found], dtype=np.bool_)
    order = [int(k) for k in np.argsort(-flux, kind="stable") if keep[k]]

    alone = set(order if singles is None else order[:singles])
    named = [found[k][0].path for k in order]
    called = {k: path.name for k, path in zip(order, named, strict=True)}
    found, faint, faint_share = _without_faint(found, alone)
    around = _around([item for k in order for item in found[k]], level * rough, pool)

    def draw(group: list[int]) -> list[Plane | None]:
        canvas = blank(shots[0].size_px)
        # blurring is linear, so ghosts of one blur or one spread are blurred together
        alike: dict[object, list[FinalPass]] = {}
        # rings of a layer of its own are looked at by themselves
        seen_in = around if alone.isdisjoint(group) else None
        for k in group:
            if meter.cancelled.is_set():
                break
            for item in found[k]:
                if item.source is not None and k not in alone:
                    continue
                if item.region.seen_flux > 0.0 and item.art.ramps:
                    draw_alone([item], quality, canvas, meter.cancelled, seen_in)
                elif item.region.seen_flux > 0.0 and item.alone:
                    alike.setdefault(item.alone, []).append(item)
                elif item.region.seen_flux > 0.0:
                    # a layer of its own may be graded up, so it is drawn in full
                    visibility = float("inf") if k in alone else contrast(item, seen_level)
                    draw_final(item, quality, canvas, visibility, meter.cancelled, seen_in)
            meter.step(f"ghost {called[k]}")
        for together in alike.values():
            draw_alone(together, quality, canvas, meter.cancelled, seen_in)
        return canvas.planes

    def draw_spread(groups: list[list[FinalPass]]) -> list[Plane | None]:
        canvas = blank(shots[0].size_px)
        for group in groups:
            if not meter.cancelled.is_set():
                draw_alone(group, quality, canvas, meter.cancelled, around)
        return canvas.planes

    wide = _alike([item for k in order if k not in alone for item in found[k]], seen_level)
    jobs = [partial(draw_spread, wide[k::_MOST_CHUNKS]) for k in range(min(len(wide), _MOST_CHUNKS))]
    total, layers = _collect(shots, order, named, singles, art, draw, pool, jobs, len(shots))
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
    meter: _Meter,
) -> GhostPass:
    points, wide = ([s for s in shots if (s.border is None) == point] for point in (True, False))
    order = list(range(len(paths))) if singles == 0 else _rank_draft(shots, paths, art)
    alone = set(order if singles is None else order[:singles])
    changes = [art.get(path.name, PLAIN) for path in paths]
    # what is only graded is drawn like what is not changed at all
    plain = [k for k, change in enumerate(changes) if not (change.alone or change.framed or any(change.offset))]
    rgb = np.reshape([change.rgb for change in changes], (-1, 3))
    crowded = len(points) * len(plain) >= CROWD
    own = [paths[k] for k in plain]
    colors = [draft_colors(shot, own) * rgb[plain, None] for shot in points]
    coarse = draft_details(points, own, colors) if crowded else None
    place = {k: number for number, k in enumerate(plain)}
    width, height = shots[0].size_px
    lone = not alone and _chunks(shots[0], len(order), _DRAFT_CHUNKS) == 1
    # a single group is drawn by the caller, and the pool's workers are free to help
    in_bands = partial(_in_bands, pool.map if lone and width * height >= _BANDS * _BAND_PX else None)

    def draw(group: list[int]) -> list[Plane | None]:
        sheets: list[NDArray[np.float64] | None] = [None] * DETAILS
        sheets[0] = picture = np.zeros((height, width, 3))
        mine = sorted(k for k in group if k in place)
        ghosts, places = [paths[k] for k in mine], [place[k] for k in mine]
        by_hand = [(paths[k], changes[k]) for k in group if k not in place]
        # those that are only graded and moved alike are drawn together
        shifted: dict[object, list[tuple[LightPath, PathArt]]] = {}
        for path, changed in by_hand:
            if not changed.alone and not changed.framed:
                shifted.setdefault(changed.offset, []).append((path, changed))
        for number, shot in enumerate(points):
            if coarse is None or not alone.isdisjoint(group):
                in_bands(height, partial(_mark_band, shot, ghosts, colors[number][places], picture))
            else:
                draw_draft_coarsely(shot, ghosts, coarse[number, places], sheets, colors[number][places])
            for together in shifted.values():
                placed = together[0][1].place(shot.to_pixels, None)
                alike_placed = [path for path, _ in together]
                elsewhere = replace(shot, to_pixels=placed)
                grades = np.array([changed.rgb for _, changed in together])[:, None]
                draw_draft(elsewhere, alike_placed, picture, draft_colors(elsewhere, alike_placed) * grades)
            for path, changed in by_hand:
                if changed.framed and not changed.alone:
                    draw_draft_by_hand(shot, path, changed, picture)
        planes: list[Plane | None] = [None if sheet is None else _summed(sheet, in_bands) for sheet in sheets]
        # blurring is linear, so ghosts of one blur are blurred together
        alike: dict[object, list[tuple[Shot, LightPath, PathArt]]] = {}
        for number, (shot, (path, changed)) in enumerate(product(points, by_hand)):
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
    total, layers = _collect(shots, order, named, singles, art, draw, pool, most=_DRAFT_CHUNKS)
    return GhostPass(total, layers, len(paths), None, 0, 0.0, 0)


def _add_spread_drafts(
    shots: Sequence[Shot], paths: Sequence[LightPath], art: Mapping[str, PathArt],
    planes: list[Plane | None],
) -> None:  # fmt: skip
    """Add paraxial ghosts of area lights, those of one spread together, to a picture of each resolution."""
    marked: list[NDArray[np.float64] | None] = [None] * DETAILS
    scratch: NDArray[np.float64] | None = None
    for shot in shots:
        alike: dict[object, list[tuple[LightPath, PathArt, NDArray[np.float64]]]] = {}
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
    """Do something to a picture's rows: at once, or band by band side by side."""
    if beside is None:
        work(slice(0, height))
        return
    edges = [height * k // _BANDS for k in range(_BANDS + 1)]
    for _ in beside(work, [slice(*ends) for ends in pairwise(edges)]):
        pass


def _mark_band(
    shot: Shot, paths: Sequence[LightPath], colors: NDArray[np.float64], picture: NDArray[np.float64], band: slice
) -> None:
    draw_draft(shot, paths, picture[band], colors, band.start)


def _summed(
    sheet: NDArray[np.float64], in_bands: Callable[[int, Callable[[slice], None]], None]
) -> NDArray[np.float32]:
    pixels = np.empty(sheet.shape, dtype=np.float32)
    in_bands(len(sheet), lambda band: sum_rows(sheet[band], pixels[band]))
    return pixels


def _add_to(planes: list[Plane | None], detail: int, light: NDArray[np.float64]) -> None:
    held = planes[detail]
    planes[detail] = light if held is None else np.add(held, light, out=held, casting="same_kind")


def _rank_draft(shots: Sequence[Shot], paths: Sequence[LightPath], art: Mapping[str, PathArt]) -> list[int]:
    """Order paths by their flux in the picture, seen at a sixteenth of the resolution."""
    small = [seen_small(shot, 16) for shot in shots]
    flux = np.zeros(len(paths))
    for k, path in enumerate(paths):
        for shot in small:
            picture = np.zeros((shot.size_px[1], shot.size_px[0], 3))
            # a ramp and a blur hardly change the order
            draw_draft_by_hand(shot, path, art.get(path.name, PLAIN), picture)
            sum_rows(picture, picture)
            flux[k] += luminance_weights(shot.colorspace) @ picture.sum(axis=(0, 1))
    return [int(k) for k in np.argsort(-flux, kind="stable")]


def plain_level(shots: Sequence[Shot], paths: Sequence[LightPath], threads: int | None = None) -> float:
    """Tell the level (`GhostPass.level`) of ghosts as they are without art direction.

    Parameters
    ----------
    shots : sequence of Shot
    paths : sequence of LightPath
    threads : int, optional
        None: all cores.

    Returns
    -------
    float
    """
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        groups = pool.map(looking(shots, paths, {}), kindred(paths))
        return _level([items for group in groups for items in group])


def _level(found: Sequence[Sequence[FinalPass]], *, plain: bool = False) -> float:
    """Mean irradiance of all ghosts over the circle around the picture, with art's gains or without."""
    items = [item for group in found for item in group]
    if not items:
        return 0.0
    seen = sum(item.region.seen_flux * (item.shot.light.intensity if plain else item.gain) for item in items)
    return float(seen / (np.pi * items[0].shot.view_radius ** 2))


def _around(items: Sequence[FinalPass], level: float, pool: ThreadPoolExecutor) -> Surroundings | None:
    """Sketch what rings may be too faint to be seen in; None where there are no rings."""
    bright = [item for item in items if item.region.seen_flux > 0.0 and contrast(item, level) >= STEP_CONTRAST]
    if not any(item.shot.ringing is not None for item in bright):
        return None
    # only here: what has no rings need not know of them
    from .surroundings import surroundings

    return surroundings(bright, pool.map)


def _alike(items: list[FinalPass], level: float) -> list[list[FinalPass]]:
    """Collect the ghosts of area lights that can be spread together, of all paths and of all parts."""
    groups: dict[object, list[FinalPass]] = {}
    for number, item in enumerate(items):
        if item.source is not None and item.region.seen_flux > 0.0:
            # what is faint may lose as much detail as a point's ghost does
            seen = replace(item, detail=max(item.detail, detail_of(contrast(item, level))))
            groups.setdefault((seen.alone, number if item.art.ramps else None), []).append(seen)
    return list(groups.values())


def _worth_drawing(flux: NDArray[np.float64], cull: float) -> NDArray[np.bool_]:
    """Keep the brightest paths so that those left out carry no more than `cull` of all flux."""
    keep = np.ones(len(flux), dtype=np.bool_)
    if cull > 0.0:
        order = np.argsort(flux, kind="stable")
        keep[order[np.cumsum(flux[order]) <= cull * flux.sum()]] = False
    return keep


def _without_faint(found: Sequence[list[FinalPass]], alone: set[int]) -> tuple[list[list[FinalPass]], int, float]:
    """Leave out the faintest ghosts of single lights among many, but none of a path that gets a layer of its own.

    Returns what is left, how many were left out, and their part of the flux.
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
    most: int = _MOST_CHUNKS,
) -> tuple[Layer, tuple[Layer, ...]]:
    """Draw the first `singles` items by themselves, the others in a fixed number of groups, then jobs; add in order.

    An item is so many ghosts' work.
    """
    shot = shots[0]
    pixel_area = 1.0 / float(shot.to_pixels[2] * shot.to_pixels[3])
    luminance = luminance_weights(shot.colorspace)
    alone = len(items) if singles is None else min(singles, len(items))
    chunks = _chunks(shot, (len(items) - alone) * ghosts_each, most)
    rest = [items[alone + c :: chunks] for c in range(chunks)]
    totals: list[Plane | None] = [None] * DETAILS
    layers: list[Layer] = []
    spare, held = spare_bytes() if alone else 0.0, 0.0
    for k, planes in enumerate(pool.map(draw, [[k] for k in items[:alone]])):
        path, pixels = named[k], merge(planes, shot.size_px)
        about: dict[str, str | float] = {
            "path": path.name,
            # first down the columns: along a row the three channels stand in each other's way
            "flux_mm2": float(luminance @ pixels.sum(axis=0, dtype=np.float64).sum(axis=0)),
        }
        if path.name in art:
            about["art"] = art[path.name].text()
        layers.append(to_layer(f"ghost.{path.name}", pixels, pixel_area, about))
        held += layers[-1].pixels.nbytes
        need(held, spare)
        # the layer has its own copy by now
        totals = _added(totals, planes)
    # a single group is drawn here: it may have parts for the pool's workers
    for planes in (map if chunks == 1 else pool.map)(draw, [group for group in rest if group]):
        totals = _added(totals, planes)
    for planes in pool.map(lambda job: job(), jobs):
        totals = _added(totals, planes)
    total = merge(totals, shot.size_px)
    return to_layer("ghosts", total, pixel_area, {}, reuse=True), tuple(layers)


def _chunks(shot: Shot, ghosts: int, most: int) -> int:
    """Return into how many pictures so many ghosts are drawn side by side."""
    width, height = shot.size_px
    most = min(most, next((n for size, n in _CHUNKS if width * height <= size), 2))
    return max(1, min(most, ghosts // _GHOSTS_A_CHUNK))


def _added(totals: Sequence[Plane | None], planes: Sequence[Plane | None]) -> list[Plane | None]:
    """Add pictures resolution by resolution; the memory of `totals`, which nobody else holds, is used again."""
    sums = list(totals)
    for k, plane in enumerate(planes):
        held = sums[k]
        if plane is not None:
            sums[k] = plane if held is None else np.add(held, plane, out=held)
    return sums
