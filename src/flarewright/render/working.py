"""Pictures to work by: what coatings or the first rim hide is made visible (Van Acoleyen 2025, section 5.1.2)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..model import Layer, Project, Quality
from ..optics.paths import ghost_paths
from .art import resolve_art
from .ghosts import render_ghosts
from .opening import make_opening
from .prepare import settle
from .shot import Shot
from .shots import make_shots

# every surface reflects so little that how many surfaces a path passes makes no difference
GREY_R = 1e-4
# no ghost of any lens starts farther out at its first surface, mm
NO_RIM = 1e4


def working_ghosts(project: Project, *, grey: bool = False, unclipped: bool = False) -> Layer:
    """Draw the ghosts by matrices without their coatings, or without the rim of the first surface.

    Parameters
    ----------
    project : Project
    grey : bool
        Every surface reflects alike at every wavelength: how bright a ghost is depends on its size alone.
    unclipped : bool
        The iris alone bounds the ghosts, so that those are seen which the entrance hides at this angle.

    Returns
    -------
    Layer
        "ghosts"; a grey picture is 1 / `GREY_R` squared times as bright, to be of the order of bare glass at R = 1.

    Raises
    ------
    FlarewrightError
        As `settle`.

    Notes
    -----
    Tested against `render` in tests/editor/test_working.py: an uncoated lens' ghosts keep their places, and a lens
    whose entrance clips nothing looks the same without its rim.
    """
    drafted = project.replace(quality=Quality(mode="draft", wavelengths=1 if grey else 3, paths=project.quality.paths))
    settled = settle(drafted)
    art = resolve_art(settled)
    shots = tuple(_bared(shot, grey, unclipped) for shot in make_shots(settled, make_opening(settled, None)))
    paths = ghost_paths(settled.lens, drafted.quality.paths, sensor=settled.sensor is not None)
    total = render_ghosts(shots, paths, drafted.quality, art=art.paths).total
    if not grey:
        return total
    light = total.pixels.mean(axis=2, keepdims=True) / np.float32(GREY_R**2)
    return replace(total, pixels=np.repeat(light, 3, axis=2))


def _bared(shot: Shot, grey: bool, unclipped: bool) -> Shot:
    packed = shot.packed
    if grey:
        packed = replace(packed, reflectance=np.full_like(packed.reflectance, GREY_R))
        shot = replace(shot, curves=None)
    if unclipped:
        semi = packed.semi.copy()
        semi[packed.first_surface] = NO_RIM
        packed = replace(packed, semi=semi)
    return replace(shot, packed=packed)


__all__ = ["working_ghosts"]
