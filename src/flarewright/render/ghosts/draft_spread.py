"""Ghosts in draft quality that are spread, ramped or blurred: those of area lights, and of art direction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...kernels.raster.edge_blur import spread_marks
from ...kernels.raster.polygons import sum_rows
from ...optics.lens.paths import LightPath
from ...typing import Floats
from ..image.canvas import DETAILS, Plane, merge
from ..scene.art_rules import PathArt
from ..scene.paraxial_place import ghost_frame
from ..scene.shot import Shot
from .art_filters import coarseness, filtered_ghost
from .draft_colors import draft_colors
from .extent_blur import shape_kernel, spread_within
from .paraxial_ghosts import draw_draft

# rounding error of sums of differences, relative to the largest value
ROUNDING = 1e-12


def draft_alone(
    ghosts: Sequence[tuple[Shot, LightPath]], art: Sequence[PathArt], source: Floats | None = None, halved: int = 0
) -> Floats:
    """Draw ghosts on a separate plane, then spread, ramp and blur it.

    Parameters
    ----------
    ghosts : sequence of (Shot, LightPath)
        One ghost with a ramp, or any number without that share a blur and a source, since both are linear.
    art : sequence of PathArt
        One per ghost.
    source : ndarray, shape (N, 5), or None
        The shape over which an area light spreads them: columns and rows (`optics.pupil.polygon`).
    halved : int
        How often the resolution can be halved because they are spread.

    Returns
    -------
    ndarray, shape (H, W, 3)
        Flux per pixel times `Shot.scale`.
    """
    shot, first = ghosts[0][0], art[0]
    detail = max(halved, coarseness(first, shot.to_pixels) if first.blur > 0.0 else 0)
    own = shot.to_pixels / 2.0**detail
    width, height = (-(-side // 2**detail) for side in shot.size_px)
    mx, my = first.margin(own)
    kernel = None if source is None else shape_kernel(source, 0.5**detail)
    if kernel is not None:
        mx, my = mx + kernel.shape[1] // 2, my + kernel.shape[0] // 2
    marks = np.zeros((height + 2 * my, width + 2 * mx, 3))
    frames = [ghost_frame(shot, path) if each.framed else None for (shot, path), each in zip(ghosts, art, strict=True)]
    places = [each.place(shot.to_pixels, frame) / 2.0**detail for each, frame in zip(art, frames, strict=True)]
    for (lit, path), each, placed in zip(ghosts, art, places, strict=True):
        moved = replace(lit, to_pixels=placed + np.array([mx, my, 0.0, 0.0]))
        draw_draft(moved, [path], marks, draft_colors(replace(lit, to_pixels=placed * 2.0**detail), [path]) * each.rgb)
    sum_rows(marks, marks)
    if kernel is not None:
        marks = spread_within(marks, kernel)
    planes: list[Plane | None] = [None] * DETAILS
    planes[detail] = filtered_ghost(marks, first, frames[0], places[0], own)
    return np.asarray(merge(planes, shot.size_px), dtype=np.float64)


def mark_spread(
    ghosts: Sequence[tuple[Shot, LightPath]], art: Sequence[PathArt], source: Floats, halved: int,
    pyramid: list[Floats | None], scratch: Floats | None = None,
) -> Floats:  # fmt: skip
    """Mark paraxial ghosts of an area light that share a spread and have no ramp or blur.

    Parameters
    ----------
    ghosts, art, source, halved
        As in `draft_alone`, without ramps and blurs.
    pyramid : list of ndarray or None
        One per resolution; missing ones are created. Two calls of `kernels.raster.polygons.sum_rows` turn them into
        the light of `draft_alone`.
    scratch : ndarray of float64, optional
        Zeros returned by the previous call, reused if large enough.

    Returns
    -------
    ndarray of float64
        Scratch memory for the next call.
    """
    shot = ghosts[0][0]
    width, height = (-(-side // 2**halved) for side in shot.size_px)
    kernel = shape_kernel(source, 0.5**halved)
    my, mx = (side // 2 for side in kernel.shape)
    sides = height + 2 * my, width + 2 * mx, 3
    if scratch is None or scratch.size < np.prod(sides):
        scratch = np.zeros(sides).ravel()
    marks = scratch[: np.prod(sides)].reshape(sides)
    for (lit, path), each in zip(ghosts, art, strict=True):
        placed = each.place(shot.to_pixels, ghost_frame(lit, path) if each.framed else None)
        moved = replace(lit, to_pixels=placed / 2.0**halved + np.array([mx, my, 0.0, 0.0]))
        draw_draft(moved, [path], marks, draft_colors(replace(lit, to_pixels=placed), [path]) * each.rgb)
    held = pyramid[halved]
    if held is None:
        held = pyramid[halved] = np.zeros((height, width, 3))
    steps = np.diff(kernel, axis=1, prepend=0.0, append=0.0)
    steps[np.abs(steps) < ROUNDING * kernel.max()] = 0.0
    rows, columns = np.nonzero(steps)
    spread_marks(marks, rows, columns, steps[rows, columns], np.array([my, mx]), held)
    return scratch


def spread_light(marks: Floats) -> Floats:
    """Turn a picture marked by `mark_spread` into light, in place."""
    sum_rows(marks, marks)
    sum_rows(marks, marks)
    # remove rounding errors of the sums
    marks[np.abs(marks) < ROUNDING * np.abs(marks).max()] = 0.0
    return marks
