"""Requests of the page to a screen: the target picture, ghosts under the pointer, outlines."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...model import Project
from ..commands.design_targets import new_discs, target_project
from ..commands.ghost_rules import hidden
from . import render_picture
from .display_image import jpeg, png
from .draft_calibration import levels_at
from .ghost_picking import ghost_outline, is_there, single_ghost, under
from .picture import DrawnPicture, Grade
from .render_picture import same_ghosts
from .viewport import QUALITY, Screen, pixels_of_picture

OUTLINE = (240, 176, 84)
# number of ghosts under the pointer to check at full size
LOOKED_AT = 6


def target_jpeg(screen: Screen) -> bytes:
    """Draw the target picture: the picture with all targets met."""
    project = screen.session.project
    # its ghosts are as bright as those of the picture beside it
    levels = levels_at(screen.match, project)
    drawn = render_picture.take(target_project(project), "draft", screen.session.view, room=screen.room, levels=levels)
    return packed_target(screen, project, drawn)


def packed_target(screen: Screen, project: Project, drawn: DrawnPicture) -> bytes:
    """Encode a target picture with the view settings of the screen.

    Parameters
    ----------
    screen : Screen
    project : Project
        With its targets. New ghosts are uniform discs, a little brighter than their surroundings.
    drawn : DrawnPicture
        Picture of its `target_project`.
    """
    discs = new_discs(project)
    if discs:
        light = render_picture.chosen_light(drawn, screen.match)
        height, width = light.shape[:2]
        across = width / project.camera.sensor[0]
        level = float(np.percentile(light[::3, ::3].max(axis=2), 90.0)) + 0.25 * 2.0**-screen.exposure_stops
        rows, columns = np.ogrid[0:height, 0:width]
        rest = drawn.rest.copy()
        for x, y, radius in discs:
            right, down = columns + 0.5 - width / 2 - x * across, rows + 0.5 - height / 2 + y * across
            rest[np.hypot(right, down) < radius * across] += np.float32(level)
        drawn = replace(drawn, rest=rest)
    return jpeg(pixels_of_picture(screen, drawn), QUALITY)


def picked(screen: Screen, u: float, v: float) -> tuple[str, ...]:
    """Return the ghosts under a place, brightest first; the first few are checked at full size.

    Ghosts that are muted or hidden by a solo come last, as they are invisible.

    Parameters
    ----------
    screen : Screen
    u, v : float
        Fractions of the picture's width and height from the upper left corner.
    """
    seen = screen.seen
    project = screen.session.project
    if seen is None or not same_ghosts(seen.project, project):
        return ()
    here = under(seen, u, v)
    unseen = hidden(project, here) if project.art.rules else frozenset()
    found = sorted(here, key=lambda name: name in unseen)
    near = [name for name in found[:LOOKED_AT] if is_there(single_ghost(seen.project, name, _grade(screen)), u, v)]
    return (*near, *found[LOOKED_AT:])


def outline_png(screen: Screen, ghost: str) -> bytes:
    """Draw the border of a ghost as PNG, transparent elsewhere."""
    return png(ghost_outline(single_ghost(screen.session.project, ghost, _grade(screen)), OUTLINE))


def _grade(screen: Screen) -> Grade:
    view = screen.session.view
    return "draft" if view.grey or view.unclipped or screen.picture is None else "final"
