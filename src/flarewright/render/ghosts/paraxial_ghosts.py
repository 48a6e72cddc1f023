"""Ghosts in draft quality: paraxial matrices (Lee and Eisemann 2013; Van Acoleyen 2025, chapter 4).

Drafts use the paths, wavelengths, iris and units of final quality, but take milliseconds: every ghost is the uniformly
lit image of the entrance, cut by the iris, with the colour of one ray. A toroid has one matrix per meridian, so its
ghosts are ovals. Decentre, tilt, aspheric terms and figure errors are of higher order and ignored.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...kernels.paraxial.arguments import SensorFrame
from ...kernels.paraxial.ghosts import draw_matrix_ghosts
from ...optics.lens.paths import LightPath
from ...typing import Floats, Indices
from ..image.canvas import DETAIL_CONTRAST, DETAILS
from ..scene.art_rules import PathArt
from ..scene.paraxial_place import ghost_frame
from ..scene.shot import Shot, at_fine_wavelengths
from .draft_colors import draft_colors
from .matrix_flux import joined_paths, matrix_arguments, stop_outline, weigh_drafts


def draw_draft(
    shot: Shot, paths: Sequence[LightPath], differences: Floats, colors: Floats | None = None, first_row: int = 0
) -> None:
    """Mark the paraxial ghosts of paths in a picture of differences.

    Parameters
    ----------
    shot : Shot
    paths : sequence of LightPath
    differences : ndarray, shape (H, W, 3), float64
        Added to; `kernels.raster.polygons.sum_rows` turns it into flux per pixel.
    colors : ndarray, shape (P, W, 3), optional
        From `draft_colors`, possibly changed by art rules, with or without `Between.fine_nm`; None: computed.
    first_row : int
        First row of the picture that `differences` holds, if it is a band.
    """
    if not paths:
        return
    packed, opening = shot.packed, shot.opening
    bent, light, axes = matrix_arguments(shot)
    colors = draft_colors(shot, paths) if colors is None else colors
    colors, more = colors[:, : len(packed.n_gap)], colors[:, len(packed.n_gap) :]
    hidden = np.flatnonzero(more.any(axis=(1, 2)))
    if hidden.size > 0:
        lit = np.flatnonzero(more.any(axis=(0, 2)))
        waves, fine = slice(lit[0], lit[-1] + 1), at_fine_wavelengths(shot)
        few = replace(fine.packed, n_gap=fine.packed.n_gap[waves], reflectance=fine.packed.reflectance[waves])
        own = [paths[int(k)] for k in hidden]
        draw_draft(replace(fine, packed=few), own, differences, more[hidden, waves], first_row)
    # each other memory layout would compile another kernel
    colors = np.ascontiguousarray(colors)
    frame = SensorFrame(axes, shot.to_pixels - [0.0, first_row, 0.0, 0.0], shot.gain)
    draw_matrix_ghosts(
        joined_paths(tuple(paths)), bent, packed.curvature_x, light, stop_outline(shot), opening.levels, frame, colors,
        differences,
    )  # fmt: skip


def downsampled(shot: Shot, times: int) -> Shot:
    """Return a shot whose resolution is `times` times smaller."""
    size = (-(-shot.size_px[0] // times), -(-shot.size_px[1] // times))
    return replace(shot, to_pixels=shot.to_pixels / times, size_px=size)


def draft_details(shots: Sequence[Shot], paths: Sequence[LightPath], colors: Sequence[Floats]) -> Indices:
    """Return how often the resolution can be halved for each ghost among many.

    Parameters
    ----------
    shots : sequence of Shot
    paths : sequence of LightPath
    colors : sequence of ndarray, shape (len(paths), W, 3)
        One per shot, as `draw_draft` takes them.

    Returns
    -------
    ndarray, shape (len(shots), len(paths))

    Notes
    -----
    As in final quality (docs/adr/0003), except that each path's irradiance is computed once, for the light with the
    median field angle at the middle wavelength, and scaled by the irradiance of each light.
    """
    middle = sorted(range(len(shots)), key=lambda k: shots[k].incidence.tilt)[len(shots) // 2]
    shot = shots[middle]
    seen = weigh_drafts(shot, paths, colors[middle])
    width, height = shot.size_px
    # relative to the weighed light; if that is dark, every contrast stays infinite
    power = np.array([each.gain for each in shots]) / (shot.gain or 1.0)
    level = power.sum() * seen[:, 0].sum() / (width * height)
    contrast = np.full((len(shots), len(paths)), np.inf)
    # ghosts that are dark at the middle wavelength keep infinite contrast
    known = seen[:, 1] > 0.0
    if level > 0.0:
        contrast[:, known] = power[:, None] * seen[known, 1] / level
    details: Indices = np.sum([contrast < limit for limit in DETAIL_CONTRAST], axis=0)
    return details


def draw_draft_by_detail(
    shot: Shot, paths: Sequence[LightPath], details: Indices, pyramid: list[Floats | None], colors: Floats
) -> None:
    """Mark paraxial ghosts, each at its own resolution.

    Parameters
    ----------
    shot : Shot
    paths : sequence of LightPath
    details : ndarray, shape (len(paths),)
        How often the resolution of each ghost is halved.
    pyramid : list of ndarray or None
        One per resolution, as `draw_draft` takes them; missing ones are created.
    colors : ndarray, shape (len(paths), W, 3)
        As in `draw_draft`.
    """
    for detail in range(DETAILS):
        chosen = np.flatnonzero(details == detail)
        if chosen.size:
            small = downsampled(shot, 2**detail)
            held = pyramid[detail]
            if held is None:
                held = pyramid[detail] = np.zeros((small.size_px[1], small.size_px[0], 3))
            draw_draft(small, [paths[int(k)] for k in chosen], held, colors[chosen])


def draw_overridden_draft(shot: Shot, path: LightPath, art: PathArt, differences: Floats) -> None:
    """Mark one path with a gain, an offset or a scale; ramps and blurs need `draft_alone`.

    Parameters
    ----------
    shot : Shot
    path : LightPath
    art : PathArt
    differences : ndarray, shape (H, W, 3), float64
        As in `draw_draft`.
    """
    moved = replace(shot, to_pixels=art.place(shot.to_pixels, ghost_frame(shot, path) if art.framed else None))
    draw_draft(moved, [path], differences, draft_colors(moved, [path]) * art.rgb)
