"""Pictures during a drag of a light or while a path plays, at a resolution that keeps up."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import FlarewrightError
from ...measure.replay.measured_project import is_measured
from ...model import Project
from ...render.image.display import view_sum
from ...render.preview.drag_preview import DragPicture, StarburstCanvas, moving_picture
from ..commands.design_targets import target_project
from ..commands.shot import move_light
from ..session.view_settings import View
from . import render_picture
from .display_image import jpeg
from .draft_calibration import levels_at
from .picture import DrawnPicture
from .queries import packed_target
from .viewport import Screen, pixels_of_picture

# sides of a picture as fractions of the viewport's, and time limits of one picture
SCALES = (1.0, 2.0 / 3.0, 0.5)
SLOW_S, FAST_S = 0.04, 0.024
# number of consecutive slow or fast pictures before the size changes, to ignore single delays
STREAK = 4
QUALITY = 80
# from this number of lights on, a drag draws only the one that moves
FEW_LIGHTS = 3
# the target picture is secondary: most of the time is for the picture itself
TARGET_SCALE = SCALES[2]


@dataclass(frozen=True)
class Moved:
    """A picture of a project state during a drag, which is not in the history.

    Attributes
    ----------
    project : Project
    jpeg : bytes
    seconds : float
        Render time.
    """

    project: Project
    jpeg: bytes
    seconds: float


def _by_matrices(project: Project, view: View) -> bool:
    """Return whether pictures of a drag can share buffers: lenses in the plain view."""
    return not (view.grey or view.unclipped or is_measured(project))


class Drag:
    """Draws the pictures of a drag, one after the other.

    Parameters
    ----------
    screen : Screen
    """

    def __init__(self, screen: Screen) -> None:
        self.screen = screen
        self._one = threading.Lock()
        # latest request
        self._newest: object = None
        self._scale = 0
        self._streak = 0
        self._sheets: tuple[StarburstCanvas, ...] = ()
        self._target_sheets: tuple[StarburstCanvas, ...] = ()
        # the light of all lights but the dragged one, with what determines it
        self._others: tuple[Any, DrawnPicture] | None = None
        # the light of the last such drag, which is likely to be dragged again
        self._dragged = 0

    def picture(self, moved: Callable[[Project], Project], revision: int) -> Moved | None:
        """Draw the project in the state of the drag.

        Parameters
        ----------
        moved : callable
            Applies the drag to the project.
        revision : int
            Revision of the session that the page shows.

        Returns
        -------
        Moved or None
            None if the drag has ended already.
        """
        session = self.screen.session
        ticket = self._newest = object()
        # stop the final picture of an earlier state
        if not self.screen.interrupt(revision):
            return None
        with self._one:
            if revision != session.revision:
                return None
            started = time.perf_counter()
            project = moved(session.project)
            one = self._one_moved(session.project, project, session.view)
            drawn = one or self._drawn(project, session.view)
            # the other lights are drawn once, which says nothing of the next picture
            self._adapt_size(one.seconds if one is not None else time.perf_counter() - started)
            if revision != session.revision:
                # the drag has ended meanwhile; leave all time to the final picture
                return None
            self.screen.moved = project
            # only the latest request of a drag may start the traced picture
            if ticket is self._newest:
                self.screen.hold(project, revision)
        # encode outside the lock, so that the next picture can start
        data = jpeg(self._pixels(drawn), QUALITY)
        return Moved(project, data, time.perf_counter() - started)

    def target(self, moved: Callable[[Project], Project], revision: int, *, held: bool = False) -> bytes | None:
        """Draw the target picture in the state of the drag, without interrupting the picture itself.

        Parameters
        ----------
        moved, revision
            As of `picture`.
        held : bool
            Whether the drag pauses and its picture is traced; then the target has the same size.

        Returns
        -------
        bytes or None
            JPEG; None if the drag has ended already.
        """
        session = self.screen.session
        with self._one:
            if revision != session.revision:
                return None
            project = moved(session.project)
            view, scale = session.view, 1.0 if held else TARGET_SCALE
            bare = target_project(project)
            still, levels = None, levels_at(self.screen.match, project)
            if _by_matrices(project, view):
                stage = render_picture.moving_stage(bare, scale, levels)
                still = moving_picture(stage, (*self._target_sheets, *self._sheets))
            if still is None:
                drawn = render_picture.take(bare, "moving", view, scale=scale, levels=levels)
            else:
                self._target_sheets = still.sheets
                drawn = DrawnPicture(bare, "moving", still.ghosts, still.rest, 0.0)
        return packed_target(self.screen, project, drawn)

    def prepare(self) -> None:
        """Draw the data that all pictures of a drag share, before it starts."""
        project = self.screen.session.project
        if project.iris is not None and project.iris.mask is not None:
            # a mask takes seconds, which would delay other requests for a drag that may never come
            return
        with self._one, suppress(FlarewrightError):
            k = min(self._dragged, len(project.lights) - 1)
            x, y = project.lights[k].field_deg
            nudged = move_light(project, k, x + 1e-3, y)
            if self._one_moved(project, nudged, self.screen.session.view) is None:
                self._drawn(project, self.screen.session.view)

    def _one_moved(self, before: Project, project: Project, view: View) -> DrawnPicture | None:
        """Draw the one light of many that moves, and add the others, which are drawn once; None if it is no such drag.

        Light adds up, so the sum is the picture of all.
        """
        if len(project.lights) < FEW_LIGHTS or not _by_matrices(project, view):
            return None
        pairs = zip(before.lights, project.lights, strict=True)
        moving = [k for k, (old, new) in enumerate(pairs) if old != new]
        if len(moving) != 1:
            return None
        (k,) = moving
        self._dragged = k
        scale, levels = SCALES[self._scale], levels_at(self.screen.match, project)
        quick = render_picture.pointlike(project)
        others = project.replace(lights=(*quick.lights[:k], *quick.lights[k + 1 :]))
        key = (render_picture.pictured(others), scale, levels)
        if self._others is None or self._others[0] != key:
            self._others = key, render_picture.take(others, "moving", view, scale=scale, levels=levels)
        rest = self._others[1]
        started = time.perf_counter()
        alone = project.replace(lights=(quick.lights[k],))
        still = moving_picture(render_picture.moving_stage(alone, scale, levels), self._sheets)
        if still is None:
            one = render_picture.take(alone, "moving", view, scale=scale, levels=levels)
        else:
            self._sheets = still.sheets
            one = DrawnPicture(alone, "moving", still.ghosts, still.rest, 0.0)
        haze = [each.haze for each in (one, rest) if each.haze is not None]
        whole = sum(haze[1:], haze[0]) if haze else None
        ghosts, light = one.ghosts + rest.ghosts, one.rest + rest.rest
        return DrawnPicture(project, "moving", ghosts, light, time.perf_counter() - started, one.remarks, haze=whole)

    def _drawn(self, project: Project, view: View) -> DrawnPicture | DragPicture:
        scale, levels = SCALES[self._scale], levels_at(self.screen.match, project)
        if _by_matrices(project, view):
            still = moving_picture(render_picture.moving_stage(project, scale, levels), self._sheets)
            if still is not None:
                self._sheets = still.sheets
                return still
        return render_picture.take(project, "moving", view, scale=scale, levels=levels)

    def _pixels(self, drawn: DrawnPicture | DragPicture) -> NDArray[np.uint8]:
        screen = self.screen
        view = screen.session.view
        if isinstance(drawn, DrawnPicture):
            return pixels_of_picture(screen, drawn)
        if view.plain and screen.session.project.plate is None and len(drawn.stars) == 1:
            # use the buffer directly instead of copying it into a picture
            (star,) = drawn.stars
            return view_sum(
                drawn.ghosts, star.sheet.pixels, screen.exposure_stops,
                ghost_gain=screen.match.gain, rest_gain=star.gain, corner=star.corner, transform=view.look,
            )  # fmt: skip
        return pixels_of_picture(screen, DrawnPicture(screen.session.project, "moving", drawn.ghosts, drawn.rest, 0.0))

    def _adapt_size(self, seconds: float) -> None:
        """Reduce the size if pictures are repeatedly slow, enlarge it if they are fast."""
        slow, fast = seconds > SLOW_S, seconds < FAST_S
        if seconds > 3.0 * SLOW_S:
            self._streak = STREAK
        self._streak = max(self._streak, 0) + 1 if slow else min(self._streak, 0) - 1 if fast else 0
        if self._streak >= STREAK and self._scale + 1 < len(SCALES):
            self._scale, self._streak = self._scale + 1, 0
        elif self._streak <= -STREAK and self._scale > 0:
            self._scale, self._streak = self._scale - 1, 0
