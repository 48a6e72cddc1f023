"""What the page asks of a screen: the picture as it stands, the target, and ghosts under the pointer."""

from __future__ import annotations

import numpy as np

from . import studio
from .edit_wishes import new_discs, target_project
from .screen import QUALITY, Screen
from .seen import alone, is_there, outline, under
from .shown import jpeg, pixels_of, plate_for, png

OUTLINE = (240, 176, 84)
# ghosts under the pointer that are looked at closely before one is believed
LOOKED_AT = 6


def target_jpeg(screen: Screen) -> bytes:
    """Draw the fictional target: the picture as the wishes would have it.

    Ghosts that the lens has not are even discs, a little brighter than what lies around them.
    """
    project, view = screen.session.project, screen.session.view
    light = studio.light_of(studio.take(target_project(project), "draft", view), screen.match)
    height, width = light.shape[:2]
    across = width / project.camera.sensor[0]
    level = float(np.percentile(light.max(axis=2), 90.0)) + 0.25 * 2.0**-screen.exposure_stops
    rows, columns = np.mgrid[0:height, 0:width] + 0.5
    for x, y, radius in new_discs(project):
        away = np.hypot(columns - width / 2 - x * across, rows - height / 2 + y * across)
        light[away < radius * across] += np.float32(level)
    plate = plate_for(view, (width, height))
    return jpeg(pixels_of(light, screen.exposure_stops, view, plate), QUALITY)


def picked(screen: Screen, u: float, v: float) -> tuple[str, ...]:
    """Return the ghosts under a place, brightest first; the first of them are looked at in full size.

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
    if seen is None:
        return ()
    found = under(seen, u, v)
    near = [name for name in found[:LOOKED_AT] if is_there(alone(seen.project, name, _grade(screen)), u, v)]
    return (*near, *found[LOOKED_AT:])


def outline_png(screen: Screen, ghost: str) -> bytes:
    """Draw the border of a ghost as PNG, clear elsewhere."""
    return png(outline(alone(screen.session.project, ghost, _grade(screen)), OUTLINE))


def _grade(screen: Screen) -> studio.Grade:
    view = screen.session.view
    return "draft" if view.grey or view.unclipped or screen.picture is None else "final"
