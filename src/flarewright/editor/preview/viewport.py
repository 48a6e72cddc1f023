"""The shown picture, and the scheduling of its rendering: the latest project wins, the last good picture stays."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import FlarewrightError, ProjectError
from ...model import Project
from ...render.image.display import view_sum
from ..common.free_memory import release
from ..common.latest_job import Check, Lane, Overtaken
from ..session.image_files import in_short
from ..session.session import Session
from ..session.view_settings import View
from . import render_picture
from .display_image import jpeg, pixels_of
from .draft_match import Match
from .ghost_picking import PickableGhosts
from .picture import DrawnPicture
from .plate_view import comp_of, is_lit, plate_for, plate_under

# JPEG quality of a picture at rest
QUALITY = 92
# number of exposures kept of earlier lenses and looks
MOST_EXPOSURES = 30
# a drag that pauses for so long gets a traced picture, seconds
HOLD_S = 0.15
# time for a page to fetch a new picture, seconds; a page that takes longer is closed or busy
FETCH_S = 0.08


Sharpen = Callable[["Screen", Project, View, Check], None]


class Screen:
    """The pictures of a session.

    Parameters
    ----------
    session : Session
    sharpen : callable
        Renders a project for this screen in steps (`progressive_render.sharpen`).
    """

    def __init__(self, session: Session, sharpen: Sharpen) -> None:
        self.session, self._sharpen = session, sharpen
        self.picture: DrawnPicture | None = None
        self.seen: PickableGhosts | None = None
        self.match = Match()
        # exposures of earlier lenses and looks, restored when undo returns to them
        self.exposures: list[tuple[Project, float]] = []
        # value of `session.exposures` for which the exposure of the shown picture was determined
        self.exposures_at = session.exposures
        # False until the lens has shown a ghost for determining its exposure
        self.exposed = True
        self.problem = ""
        self.number = 0
        # number of the encoded picture, and its bytes
        self.packed: tuple[int, bytes] = (-1, b"")
        # size of the frame on the page, px
        self.room = (render_picture.WIDEST, render_picture.HIGHEST)
        # last project shown during a drag, until the screen has a newer picture
        self.moved: Project | None = None
        # called when everything is drawn and measured
        self.idle: Callable[[], None] | None = None
        # render time of the last final picture; infinite before the first
        self.final_s = math.inf
        self._lane = Lane("pictures")
        self._busy: tuple[Project, View] | None = None
        # set when a paused drag has ended or moves again
        self._drag_ended = threading.Event()
        # set when a page has fetched the shown picture
        self.fetched = threading.Event()
        session.listeners.append(self._on_event)

    def start(self) -> None:
        """Start the first picture."""
        self._on_event({"type": "changed"})

    def wait(self, timeout_s: float) -> bool:
        """Wait until the picture is final."""
        return self._lane.wait(timeout_s)

    def close(self) -> None:
        """Ask the picture in progress to end, and draw no further one."""
        self._drag_ended.set()
        self._lane.close()

    def _on_event(self, event: dict[str, Any]) -> None:
        if event["type"] != "changed":
            return
        project, view = self.session.project, self.session.view
        inputs = _render_inputs(project, view)
        held = not self._drag_ended.is_set()
        self._drag_ended.set()
        if inputs == self._busy and not self.problem:
            # only display settings have changed; a drag's picture is newer than the last one of the screen
            if self.moved is None:
                self._publish()
            if held:
                # results measured during the pause of the drag now belong to the project
                self.session.tell({"type": "ghosts"})
            return
        self._busy = inputs
        self._lane.submit(lambda check: self._work(project, view, check))

    def _work(self, project: Project, view: View, check: Check) -> None:
        try:
            self._sharpen(self, project, view, check)
        except FlarewrightError as error:
            check()
            self.problem = in_short(str(error), project, self.session.file)
            self._publish()
        except MemoryError:
            self.problem = "there is not enough memory for this picture; choose a smaller one"
            self._publish()
        except Overtaken:
            raise
        except Exception:
            # a bug: report that the picture is outdated
            self.problem = "the picture could not be drawn: an internal error, printed in the terminal"
            self._publish()
            raise
        finally:
            # overtaken pictures leave as much as finished ones
            release()

    def show(self, picture: DrawnPicture) -> None:
        """Show another picture."""
        packed = self.packed
        # a missing background file raises again when the picture is requested
        with suppress(FlarewrightError):
            # encode now, while nothing else is drawn; invalid if the view changes meanwhile
            packed = (self.number + 1, jpeg(pixels_of_picture(self, picture), QUALITY))
        # update the picture and its number together
        self.picture, self.problem, self.moved, self.packed = picture, "", None, packed
        self._publish()

    def let_through(self) -> None:
        """Wait a moment until a page has fetched the picture, as encoding and rendering share the interpreter."""
        self.fetched.wait(FETCH_S)

    def _publish(self) -> None:
        self.fetched.clear()
        self.number += 1
        self.session.tell({"type": "picture"})

    @property
    def exposure_stops(self) -> float:
        """Exposure of the shown picture."""
        own = self.session.view.exposure_stops
        return self.match.exposure_stops if own is None else own

    def leave(self, project: Project) -> None:
        """Store the exposure of a lens or look that is replaced by another."""
        kept = [each for each in self.exposures if each[0] != project][1 - MOST_EXPOSURES :]
        self.exposures = [*kept, (project, self.match.exposure_stops)]

    def exposures_of(self, project: Project) -> int:
        """Return the session's count of exposures for its present project; that of the shown picture for others."""
        # the session may have moved on, or a drag shows a project that it does not have yet
        with self.session.lock:
            return self.session.exposures if self.session.project == project else self.exposures_at

    def known_exposure(self, project: Project) -> float | None:
        """Return the stored exposure of an earlier project; None if there is none."""
        return next((stops for each, stops in self.exposures if each == project), None)

    def expose(self) -> None:
        """Determine the exposure from the shown picture.

        Raises
        ------
        ProjectError
            When no ghost is visible; the exposure is unchanged.
        """
        if self.picture is not None and render_picture.has_no_ghosts(self.picture):
            raise ProjectError("no ghost is visible to expose for; move the light until one appears, and try again")
        if self.picture is not None:
            self.exposed = True
            self.match = replace(self.match, exposure_stops=render_picture.exposure_of(self.picture, self.match))
            self.session.remember(self.match.exposure_stops)
        self.session.set_view({"exposure_stops": None})

    def interrupt(self, revision: int) -> bool:
        """Stop rendering for a drag on this revision of the session; return False if the revision is outdated."""
        with self.session.lock:
            if revision != self.session.revision:
                return False
            self._lane.cancel()
            self._busy = None
            self._drag_ended.set()
            return True

    def hold(self, project: Project, revision: int) -> None:
        """Render the state of a drag as if it had ended, unless it moves again soon.

        Parameters
        ----------
        project : Project
            State of the drag.
        revision : int
            Revision of the session that the page shows.
        """
        with self.session.lock:
            if revision != self.session.revision:
                return
            view, drag_ended = self.session.view, threading.Event()
            self._drag_ended.set()
            self._busy, self._drag_ended = _render_inputs(project, view), drag_ended

            def work(check: Check) -> None:
                drag_ended.wait(HOLD_S)
                check()
                self._work(project, view, check)

            self._lane.submit(work)

    def make_room(self, room: tuple[int, int]) -> None:
        """Render pictures at rest at the size of the page's frame; a larger picture is kept."""
        with self.session.lock:
            self.room = room
            # the picture after a drag has the new size anyway
            if self.picture is not None and self.moved is None and not render_picture.is_as_large(self.picture, room):
                self._busy = None
                self._on_event({"type": "changed"})

    def rest(self) -> None:
        """Resume the final picture after a drag without a change."""
        # a change meanwhile would be drawn before the project of before it
        with self.session.lock:
            if self._busy != _render_inputs(self.session.project, self.session.view):
                self._on_event({"type": "changed"})


def _render_inputs(project: Project, view: View) -> tuple[Project, View]:
    """Return the parts of a project and a view that determine the rendered light."""
    return (
        render_picture.pictured(project),
        view.replace(exposure_stops=None, found_stops=None, look="srgb", plate_stops=0.0, plate_shown=True),
    )


def packed_pixels(screen: Screen) -> bytes:
    """Return the shown picture as JPEG; black before the first one."""
    number, data = screen.packed
    return data if number == screen.number else jpeg(shown_pixels(screen), QUALITY)


def shown_pixels(screen: Screen) -> NDArray[np.uint8]:
    """Return the shown picture as sRGB pixels; black before the first one."""
    picture = screen.picture
    if picture is None:
        width, height = render_picture.view_size(screen.session.project)
        return np.zeros((height, width, 3), dtype=np.uint8)
    return pixels_of_picture(screen, picture)


def pixels_of_picture(screen: Screen, picture: DrawnPicture) -> NDArray[np.uint8]:
    """Return sRGB pixels of a picture with the session's view settings."""
    view = screen.session.view
    under = plate_under(picture, screen.session.project.plate)
    if view.plain and under is None:
        gain = render_picture.ghost_gain(picture, screen.match)
        return view_sum(picture.ghosts, picture.rest, screen.exposure_stops, ghost_gain=gain, transform=view.look)
    light = render_picture.chosen_light(picture, screen.match)
    if is_lit(under) and not picture.grey:
        # flare and plate have one unit, and so one exposure
        if view.plate_shown:
            plate = plate_for(under, (light.shape[1], light.shape[0]))
            assert plate is not None
            light = comp_of(picture, render_picture.ghosts_of(picture, screen.match), plate)
        return pixels_of(light, view.plate_stops, view)
    plate = plate_for(under, (light.shape[1], light.shape[0])) if view.plate_shown else None
    return pixels_of(light, screen.exposure_stops, view, None if plate is None else plate.pixels)
