"""Diagnostic pictures: ghosts without coatings, or without the edge of the first surface.

Source: Van Acoleyen 2025, section 5.1.2.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...model import Layer, Project, Quality
from ...optics.lens.paths import ghost_paths
from ..ghosts.ghost_pass import render_ghosts
from ..scene.art_rules import resolve_art
from ..scene.opening import make_opening
from ..scene.resolve import resolve_project
from ..scene.shot import Shot
from ..scene.shots import make_shots

# so low that the number of surfaces a path passes makes no difference
GREY_R = 1e-4
# semi-diameter beyond the start of any ghost at the first surface, mm
UNBOUNDED_MM = 1e4


def working_ghosts(project: Project, *, grey: bool = False, unclipped: bool = False) -> Layer:
    """Draw draft ghosts without the coatings, or without the edge of the first surface.

    Parameters
    ----------
    project : Project
    grey : bool
        Every surface reflects equally at every wavelength, so that a ghost's brightness depends on its size alone.
    unclipped : bool
        Only the iris bounds the ghosts, which shows those that the entrance hides at this angle.

    Returns
    -------
    Layer
        "ghosts". A grey picture is multiplied by 1 / `GREY_R` squared, which gives the order of bare glass at R = 1.

    Raises
    ------
    FlarewrightError
        As in `resolve_project`.

    Notes
    -----
    Tested against `render` in tests/editor/test_editor_state.py: the ghosts of an uncoated lens keep their positions,
    and a lens whose entrance clips nothing looks the same without its edge.
    """
    drafted = project.replace(quality=Quality(mode="draft", wavelengths=1 if grey else 3, paths=project.quality.paths))
    settled = resolve_project(drafted)
    art = resolve_art(settled)
    shots = tuple(_simplified(shot, grey, unclipped) for shot in make_shots(settled, make_opening(settled, None)))
    paths = ghost_paths(settled.lens, drafted.quality.paths, sensor=settled.sensor is not None)
    total = render_ghosts(shots, paths, drafted.quality, art=art.paths).total
    if not grey:
        return total
    light = total.pixels.mean(axis=2, keepdims=True) / np.float32(GREY_R**2)
    return replace(total, pixels=np.repeat(light, 3, axis=2))


def _simplified(shot: Shot, grey: bool, unclipped: bool) -> Shot:
    packed = shot.packed
    if grey:
        packed = replace(packed, reflectance=np.full_like(packed.reflectance, GREY_R))
        shot = replace(shot, curves=None)
    if unclipped:
        semi = packed.semi.copy()
        semi[packed.first_surface] = UNBOUNDED_MM
        packed = replace(packed, semi=semi)
    return replace(shot, packed=packed)
