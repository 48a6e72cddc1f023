"""What the page asks of a screen: the picture as it stands, the target, and ghosts under the pointer."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..model import Project
from . import studio
from .edit_ghosts import is_shown
from .edit_wishes import new_discs, target_project
from .ladder import levels_at
from .picture import Grade, Picture
from .screen import QUALITY, Screen, pixels_of_picture
from .seen import alone, is_there, outline, under
from .shown import jpeg, png
from .studio import same_ghosts

OUTLINE = (240, 176, 84)
# ghosts under the pointer that are looked at closely before one is believed
LOOKED_AT = 6


def target_jpeg(screen: Screen) -> bytes:
    """Draw the fictional target: the picture as the wishes would have it."""
    project = screen.session.project
    # its ghosts are as bright as those of the picture beside it
    levels = levels_at(screen.match, project)
    drawn = studio.take(target_project(project), "draft", screen.session.view, room=screen.room, levels=levels)
    return packed_target(screen, project, drawn, QUALITY)


def packed_target(screen: Screen, project: Project, drawn: Picture, quality: int) -> bytes:
    """Pack a target as the picture is shown.

    Parameters
    ----------
    screen : Screen
    project : Project
        With its wishes. Ghosts that the lens has not are even discs, a little brighter than what lies around them.
    drawn : Picture
        Of its `target_project`.
    quality : int
        Of the JPEG.

    Returns
    -------
    bytes
    """
    discs = new_discs(project)
    if discs:
        light = studio.light_of(drawn, screen.match)
        height, width = light.shape[:2]
        across = width / project.camera.sensor[0]
        level = float(np.percentile(light[::3, ::3].max(axis=2), 90.0)) + 0.25 * 2.0**-screen.exposure_stops
        rows, columns = np.ogrid[0:height, 0:width]
        rest = drawn.rest.copy()
        for x, y, radius in discs:
            right, down = columns + 0.5 - width / 2 - x * across, rows + 0.5 - height / 2 + y * across
            rest[np.hypot(right, down) < radius * across] += np.float32(level)
        drawn = replace(drawn, rest=rest)
    return jpeg(pixels_of_picture(screen, drawn), quality)


def picked(screen: Screen, u: float, v: float) -> tuple[str, ...]:
    """Return the ghosts under a place, brightest first; the first of them are looked at in full size.

    Those that are muted, or dark because others are shown alone, come last: nobody points at what is not there.

    Parameters
    ----------
    screen : Screen
    u, v : float
        Parts of the picture's width and height from the upper left corner.

    Returns
    -------
    tuple of str
    """
    seen = screen.seen
    project = screen.session.project
    if seen is None or not same_ghosts(seen.project, project):
        return ()
    found = sorted(under(seen, u, v), key=lambda name: not is_shown(project.art, name))
    near = [name for name in found[:LOOKED_AT] if is_there(alone(seen.project, name, _grade(screen)), u, v)]
    return (*near, *found[LOOKED_AT:])


def outline_png(screen: Screen, ghost: str) -> bytes:
    """Draw the border of a ghost as PNG, clear elsewhere."""
    return png(outline(alone(screen.session.project, ghost, _grade(screen)), OUTLINE))


def _grade(screen: Screen) -> Grade:
    view = screen.session.view
    return "draft" if view.grey or view.unclipped or screen.picture is None else "final"
