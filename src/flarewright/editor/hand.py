"""Pictures of a hand that moves a light, or of a path that is played: as sharp as there is time for."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import FlarewrightError
from ..measure.rendering import is_measured
from ..model import Project
from ..render.display import view_sum
from ..render.moving import Sheet, Still, moving_picture
from . import studio
from .edit_wishes import target_project
from .ladder import levels_at
from .picture import Picture
from .screen import Screen, pixels_of_picture
from .shown import jpeg
from .view import View
from .viewing import packed_target

# sides of a picture as parts of the viewport's, and the time that one may take
SCALES = (1.0, 2.0 / 3.0, 0.5)
SLOW_S, FAST_S = 0.04, 0.024
# so many in a row decide: one that another program delayed does not
STEADY = 4
QUALITY = 80
# the target is a draft beside the picture, and most of the time is the picture's
TARGET_SCALE = SCALES[2]


@dataclass(frozen=True)
class Moved:
    """A picture of a project that nobody has kept yet.

    Attributes
    ----------
    project : Project
    jpeg : bytes
    seconds : float
        It took.
    """

    project: Project
    jpeg: bytes
    seconds: float


def _by_matrices(project: Project, view: View) -> bool:
    """Tell whether pictures of a moving hand share sheets: of a lens, as it is."""
    return not (view.grey or view.unclipped or is_measured(project))


class Hand:
    """Draws what the hand does, one picture after the other.

    Parameters
    ----------
    screen : Screen
    """

    def __init__(self, screen: Screen) -> None:
        self.screen = screen
        self._one = threading.Lock()
        # what was asked for last
        self._newest: object = None
        self._scale = 0
        self._leaning = 0
        self._sheets: tuple[Sheet, ...] = ()
        self._target_sheets: tuple[Sheet, ...] = ()

    def picture(self, moved: Callable[[Project], Project], revision: int) -> Moved | None:
        """Draw the project as the hand has it.

        Parameters
        ----------
        moved : callable
            What the hand does to the project.
        revision : int
            Of the session that the hand sees.

        Returns
        -------
        Moved or None
            None where the hand has let go already.
        """
        session = self.screen.session
        ticket = self._newest = object()
        # the final picture of a place that the hand has left is of no use
        if not self.screen.interrupt(revision):
            return None
        with self._one:
            if revision != session.revision:
                return None
            begun = time.perf_counter()
            project = moved(session.project)
            drawn = self._drawn(project, session.view)
            self._lean(time.perf_counter() - begun)
            if revision != session.revision:
                # the hand has let go meanwhile, and the final picture needs all the time there is
                return None
            self.screen.moved = project
            # a hand that asks for more moves on
            if ticket is self._newest:
                self.screen.hold(project, revision)
        # the next one is drawn while this one is packed
        data = jpeg(self._pixels(drawn), QUALITY)
        return Moved(project, data, time.perf_counter() - begun)

    def target(self, moved: Callable[[Project], Project], revision: int, *, held: bool = False) -> bytes | None:
        """Draw the fictional target as the hand has it; what is drawn of the picture itself goes on.

        Parameters
        ----------
        moved, revision
            As of `picture`.
        held : bool
            The hand holds still and its picture is traced: as large as that one.

        Returns
        -------
        bytes or None
            JPEG; None where the hand has let go already.
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
                stage = studio.moving_stage(bare, scale, levels)
                still = moving_picture(stage, (*self._target_sheets, *self._sheets))
            if still is None:
                drawn = studio.take(bare, "moving", view, scale=scale, levels=levels)
            else:
                self._target_sheets = still.sheets
                drawn = Picture(bare, "moving", still.ghosts, still.rest, 0.0)
        return packed_target(self.screen, project, drawn, QUALITY)

    def prepare(self) -> None:
        """Draw once what all pictures of a hand share, before it moves."""
        project = self.screen.session.project
        if project.iris is not None and project.iris.mask is not None:
            # that takes seconds, which nobody may have to wait for in vain
            return
        with self._one, suppress(FlarewrightError):
            self._drawn(project, self.screen.session.view)

    def _drawn(self, project: Project, view: View) -> Picture | Still:
        scale, levels = SCALES[self._scale], levels_at(self.screen.match, project)
        if _by_matrices(project, view):
            still = moving_picture(studio.moving_stage(project, scale, levels), self._sheets)
            if still is not None:
                self._sheets = still.sheets
                return still
        return studio.take(project, "moving", view, scale=scale, levels=levels)

    def _pixels(self, drawn: Picture | Still) -> NDArray[np.uint8]:
        screen = self.screen
        view = screen.session.view
        if isinstance(drawn, Picture):
            return pixels_of_picture(screen, drawn)
        if view.plain and len(drawn.stars) == 1:
            # the sheet as it lies, not moved onto a picture of its own first
            (star,) = drawn.stars
            return view_sum(
                drawn.ghosts, star.sheet.pixels, screen.exposure_stops,
                ghost_gain=screen.match.gain, rest_gain=star.gain, corner=star.corner, transform=view.look,
            )  # fmt: skip
        return pixels_of_picture(screen, Picture(screen.session.project, "moving", drawn.ghosts, drawn.rest, 0.0))

    def _lean(self, seconds: float) -> None:
        """Draw smaller where pictures take too long again and again, larger where there is time."""
        slow, fast = seconds > SLOW_S, seconds < FAST_S
        if seconds > 3.0 * SLOW_S:
            self._leaning = STEADY
        self._leaning = max(self._leaning, 0) + 1 if slow else min(self._leaning, 0) - 1 if fast else 0
        if self._leaning >= STEADY and self._scale + 1 < len(SCALES):
            self._scale, self._leaning = self._scale + 1, 0
        elif self._leaning <= -STEADY and self._scale > 0:
            self._scale, self._leaning = self._scale - 1, 0
