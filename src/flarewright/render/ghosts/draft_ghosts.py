"""The ghosts of a picture in draft quality: paraxial ghosts of all paths and lights, drawn in groups."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise, product

import numpy as np

from ...kernels.paraxial.ghosts import RIM
from ...kernels.raster.plane_memory import black_differences, unset_picture
from ...kernels.raster.polygons import sum_rows
from ...optics.colour.rgb import luminance_weights
from ...optics.lens.paths import LightPath
from ...typing import Floats, Indices, Pixels
from ..image.canvas import DETAILS, Patch, Plane
from ..scene.area_lights import DRAFT_ROUNDING, halvings, motion, spread_border
from ..scene.art_rules import PLAIN, PathArt
from ..scene.shot import Shot
from .draft_colors import draft_colors
from .draft_spread import draft_alone, mark_spread, spread_light
from .ghost_sums import Drawn, GhostPass, GhostWork, chunks_of, sum_ghosts
from .matrix_flux import draft_window, matrix_fluxes
from .paraxial_ghosts import downsampled, draft_details, draw_draft, draw_draft_by_detail, draw_overridden_draft

# groups of ghosts: they are drawn faster than another picture is added
_MOST_CHUNKS = 2
# large pictures with one group of ghosts are drawn in parallel bands, their number set by size alone
_BANDS, _BAND_PX = 2, 300_000
# from this number of ghosts on, each is drawn with no more detail than is visible among the others
CROWDED_GHOSTS = 200


def draw_drafts(work: GhostWork) -> GhostPass:
    """Draw the ghosts of a picture from paraxial matrices."""
    # converting the sum to irradiance would take a twentieth of a draft
    shots = [replace(shot, scale=1.0 / shot.pixel_area) for shot in work.shots]
    paths, art = work.paths, work.art
    points, wide = ([s for s in shots if (s.border is None) == point] for point in (True, False))
    order, known = list(range(len(paths))), None
    if work.singles != 0 and paths:
        order, colors = _rank_draft(shots, paths, art)
        known = [of_shot for shot, of_shot in zip(shots, colors, strict=True) if shot.border is None]
    drawing = _drawing(work, points, wide, order, known)
    named = [paths[k] for k in order]
    total, layers = sum_ghosts(
        work, order, named, partial(_draw_group, drawing), most_chunks=_MOST_CHUNKS, is_irradiance=True
    )
    return GhostPass(total, layers, len(paths), None, 0, 0.0, 0)


@dataclass(frozen=True)
class _Drawing:
    """What all groups of ghosts share."""

    work: GhostWork
    # lights that are points, and the others
    points: Sequence[Shot]
    wide: Sequence[Shot]
    # paths that are drawn separately
    alone: set[int]
    # of each path
    changes: Sequence[PathArt]
    # numbers, in `colors` and `coarse`, of paths that art direction leaves in their place
    place: Mapping[int, int]
    # of each light that is a point
    colors: Sequence[Floats]
    # how often the resolution of each ghost is halved, where many are drawn
    coarse: Indices | None
    in_bands: Callable[[int, Callable[[slice], None]], None]


def _drawing(
    work: GhostWork, points: Sequence[Shot], wide: Sequence[Shot], order: Sequence[int], known: list[Floats] | None
) -> _Drawing:
    """Prepare the drawing of the paths in their order; `known` has the colours of all paths for each of the points."""
    alone = work.alone(order)
    changes = [work.art.get(path.name, PLAIN) for path in work.paths]
    # paths with only a colour gain are drawn with the unchanged ones
    plain = [k for k, change in enumerate(changes) if not (change.alone or change.framed or any(change.offset))]
    rgb = np.reshape([change.rgb for change in changes], (-1, 3))
    own = [work.paths[k] for k in plain]
    if known is None or len(own) < len(work.paths):
        known = [draft_colors(shot, own) for shot in points]
    colors = [of_shot * rgb[plain, None] for of_shot in known]
    crowded = len(points) * len(plain) >= CROWDED_GHOSTS
    coarse = draft_details(points, own, colors) if crowded else None
    width, height = work.shots[0].size_px
    lone = not alone and chunks_of(work.shots[0], len(order), _MOST_CHUNKS) == 1
    # a single group is drawn by the calling thread, which leaves the workers free for bands
    in_bands = partial(_in_bands, work.pool.map if lone and width * height >= _BANDS * _BAND_PX else None)
    place = {k: number for number, k in enumerate(plain)}
    return _Drawing(work, points, wide, alone, changes, place, colors, coarse, in_bands)


def _draw_group(drawing: _Drawing, group: list[int]) -> Drawn:
    """Draw the paths of these numbers together."""
    work, in_bands = drawing.work, drawing.in_bands
    if len(group) == 1 and not drawing.alone.isdisjoint(group):
        patch = _draw_alone(drawing, group[0])
        if patch is not None:
            work.meter.step(f"ghost {work.paths[group[0]].name}")
            return patch
    overridden = [(work.paths[k], drawing.changes[k]) for k in group if k not in drawing.place]
    differences = _marked_points(drawing, group, overridden)
    planes: list[Plane | None] = [None if marks is None else _summed(marks, in_bands) for marks in differences]
    # blurring is linear, so ghosts with the same blur are blurred together
    alike: dict[object, list[tuple[Shot, LightPath, PathArt]]] = {}
    for number, (shot, (path, changed)) in enumerate(product(drawing.points, overridden)):
        if changed.alone:
            key = ("ramp", number) if changed.ramps else changed.blur
            alike.setdefault(key, []).append((shot, path, changed))
    for blurred in alike.values():
        _add_to(planes, 0, draft_alone([(shot, path) for shot, path, _ in blurred], [art for *_, art in blurred]))
    _add_spread_drafts(drawing.wide, [work.paths[k] for k in group], work.art, planes)
    for k in group:
        work.meter.step(f"ghost {work.paths[k].name}")
    return planes


def _draw_alone(drawing: _Drawing, k: int) -> Patch | None:
    """Draw one path's ghosts of points in the part of the picture that they cover; None if more is to be drawn."""
    if k not in drawing.place or drawing.wide:
        return None
    path, place = drawing.work.paths[k], drawing.place[k]
    # a ghost with light beyond the traced wavelengths has other bounds there
    lit = zip(drawing.points, drawing.colors, strict=True)
    if any(colors[place, len(shot.packed.n_gap) :].any() for shot, colors in lit):
        return None
    left, top, right, bottom = draft_window(drawing.points, path)
    # an empty window too has a pixel
    marks = black_differences(max(right - left, 1), max(bottom - top, 1))
    for shot, colors in zip(drawing.points, drawing.colors, strict=True):
        moved = replace(shot, to_pixels=shot.to_pixels - [left, 0.0, 0.0, 0.0])
        draw_draft(moved, [path], marks, colors[[place]], top)
    return Patch(_summed(marks, drawing.in_bands), (left, top))


def _marked_points(
    drawing: _Drawing, group: list[int], overridden: Sequence[tuple[LightPath, PathArt]]
) -> list[Floats | None]:
    """Mark the ghosts of points, but those that are blurred or ramped, in one picture per resolution."""
    width, height = drawing.work.shots[0].size_px
    differences: list[Floats | None] = [None] * DETAILS
    differences[0] = picture = black_differences(width, height)
    mine = sorted(k for k in group if k in drawing.place)
    ghosts, places = [drawing.work.paths[k] for k in mine], [drawing.place[k] for k in mine]
    # ghosts with the same offset and no ramp, blur or scale are drawn together
    shifted: dict[object, list[tuple[LightPath, PathArt]]] = {}
    for path, changed in overridden:
        if not changed.alone and not changed.framed:
            shifted.setdefault(changed.offset, []).append((path, changed))
    for number, shot in enumerate(drawing.points):
        colors = drawing.colors[number][places]
        if drawing.coarse is None or not drawing.alone.isdisjoint(group):
            drawing.in_bands(height, partial(_mark_band, shot, ghosts, colors, picture))
        else:
            draw_draft_by_detail(shot, ghosts, drawing.coarse[number, places], differences, colors)
        for together in shifted.values():
            elsewhere = replace(shot, to_pixels=together[0][1].place(shot.to_pixels, None))
            alike_placed = [path for path, _ in together]
            grades = np.array([changed.rgb for _, changed in together])[:, None]
            draw_draft(elsewhere, alike_placed, picture, draft_colors(elsewhere, alike_placed) * grades)
        for path, changed in overridden:
            if changed.framed and not changed.alone:
                draw_overridden_draft(shot, path, changed, picture)
    return differences


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
    pixels = unset_picture(marks.shape[1], marks.shape[0])
    in_bands(len(marks), lambda band: sum_rows(marks[band], pixels[band]))
    return pixels


def _add_to(planes: list[Plane | None], detail: int, light: Floats) -> None:
    held = planes[detail]
    planes[detail] = light if held is None else np.add(held, light, out=held, casting="same_kind")


def _rank_draft(
    shots: Sequence[Shot], paths: Sequence[LightPath], art: Mapping[str, PathArt]
) -> tuple[list[int], list[Floats]]:
    """Sort paths by their flux in the picture: from matrices if nothing changes them, else drawn 1/16 as large.

    Returns also the colours of all paths for each shot.
    """
    flux = np.zeros(len(paths))
    found_colors = [draft_colors(shot, paths) for shot in shots]
    for shot, colors in zip(shots, found_colors, strict=True):
        luminance = luminance_weights(shot.colorspace)
        small = downsampled(shot, 16)
        # a mask and an area light change how much light falls into the picture
        plain = shot.opening.mask is None and shot.border is None
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
    return [int(k) for k in np.argsort(-flux, kind="stable")], found_colors
