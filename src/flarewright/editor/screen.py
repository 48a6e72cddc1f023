"""What the viewport shows, and the work that makes it: latest wins, sharper as it waits, last good one kept."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import FlarewrightError, ProjectError
from ..model import Project
from ..render.display import view_sum
from . import studio
from .draft_match import Match
from .jobs import Check, Lane, Overtaken
from .picture import Picture
from .pictures import in_short
from .seen import Seen
from .session import Session
from .shown import jpeg, pixels_of, plate_for
from .view import View

# of a picture that rests
QUALITY = 92
# exposures of lenses that were shown before
MOST_EXPOSURES = 30
# a hand that has not moved for so long is looking, and sees no draft any more
HOLD_S = 0.15
# a page that has not fetched a new picture by then is gone, or has other things to do
FETCH_S = 0.08


Sharpen = Callable[["Screen", Project, View, Check], None]


class Screen:
    """The pictures of a session.

    Parameters
    ----------
    session : Session
    sharpen : callable
        Draws a project for this screen, step by step (`sharpening.sharpen`).
    """

    def __init__(self, session: Session, sharpen: Sharpen) -> None:
        self.session, self._sharpen = session, sharpen
        self.picture: Picture | None = None
        self.seen: Seen | None = None
        self.match = Match()
        # what lenses were shown with when others took their place: whoever leads back to one sees it as it was
        self.exposures: list[tuple[Project, float]] = []
        # False while the lens has shown no ghost that its exposure could be found for
        self.exposed = True
        self.problem = ""
        self.number = 0
        # the picture as it is sent, of this number
        self.packed: tuple[int, bytes] = (-1, b"")
        # pixels that the page has for a picture
        self.room = (studio.WIDEST, studio.HIGHEST)
        # what a hand was shown last, until a picture of the screen's own takes its place
        self.moved: Project | None = None
        # called when all is drawn and measured
        self.idle: Callable[[], None] | None = None
        # how long the last final picture took; none has yet
        self.final_s = math.inf
        self._lane = Lane("pictures")
        self._busy: tuple[Project, View] | None = None
        # set when a hand has let go of what it held still, or moved on
        self._let_go = threading.Event()
        # set when a page has the picture that is shown
        self.fetched = threading.Event()
        session.listeners.append(self._heard)

    def start(self) -> None:
        """Begin with the first picture."""
        self._heard({"type": "changed"})

    def wait(self, timeout_s: float) -> bool:
        """Wait until the picture rests."""
        return self._lane.wait(timeout_s)

    def _heard(self, event: dict[str, Any]) -> None:
        if event["type"] != "changed":
            return
        project, view = self.session.project, self.session.view
        wanted = _wanted(project, view)
        held = not self._let_go.is_set()
        self._let_go.set()
        if wanted == self._busy and not self.problem:
            # only the way it is shown has changed; what a hand was shown is newer than the last picture
            if self.moved is None:
                self._publish()
            if held:
                # what was seen while a hand held it is the project's from now on
                self.session.tell({"type": "ghosts"})
            return
        self._busy = wanted
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
            # a mistake of ours: the person shall know that the picture is old
            self.problem = "the picture could not be drawn, and the terminal tells why"
            self._publish()
            raise

    def show(self, picture: Picture) -> None:
        """Show another picture."""
        packed = self.packed
        # a background may be gone: whoever asks for the picture is told
        with suppress(FlarewrightError):
            # packed before anybody asks, while nothing else is drawn; outdated where the view changes meanwhile
            packed = (self.number + 1, jpeg(pixels_of_picture(self, picture), QUALITY))
        # no state may be told of the new picture with the old number
        self.picture, self.problem, self.moved, self.packed = picture, "", None, packed
        self._publish()

    def let_through(self) -> None:
        """Wait a moment until a page has the picture: what sends it shares the interpreter with what is drawn next."""
        self.fetched.wait(FETCH_S)

    def _publish(self) -> None:
        self.fetched.clear()
        self.number += 1
        self.session.tell({"type": "picture"})

    @property
    def exposure_stops(self) -> float:
        """What the picture is shown with."""
        own = self.session.view.exposure_stops
        return self.match.exposure_stops if own is None else own

    def leave(self, project: Project) -> None:
        """Keep the exposure of a lens that another one takes the place of."""
        kept = [each for each in self.exposures if each[0] != project][1 - MOST_EXPOSURES :]
        self.exposures = [*kept, (project, self.match.exposure_stops)]

    def known_exposure(self, project: Project) -> float | None:
        """Return what a project was shown with when another lens took the place of its own; None where none did."""
        return next((stops for each, stops in self.exposures if each == project), None)

    def expose(self) -> None:
        """Find the exposure anew, by what is shown now.

        Raises
        ------
        ProjectError
            Nothing is seen that could be exposed for; the exposure stays.
        """
        if self.picture is not None and studio.is_dark(self.picture):
            raise ProjectError("there is no ghost to expose for; move the light until one is seen, and try again")
        if self.picture is not None:
            self.exposed = True
            self.match = replace(self.match, exposure_stops=studio.exposure_of(self.picture, self.match))
            self.session.remember(self.match.exposure_stops)
        self.session.set_view({"exposure_stops": None})

    def interrupt(self, revision: int) -> bool:
        """Stop drawing for a hand that sees this revision of the session; False when it is not the newest."""
        with self.session.lock:
            if revision != self.session.revision:
                return False
            self._lane.cancel()
            self._busy = None
            self._let_go.set()
            return True

    def hold(self, project: Project, revision: int) -> None:
        """Draw what a hand holds as if it had let go, unless it moves on soon.

        Parameters
        ----------
        project : Project
            As the hand has it.
        revision : int
            Of the session that the hand sees.
        """
        with self.session.lock:
            if revision != self.session.revision:
                return
            view, let_go = self.session.view, threading.Event()
            self._let_go.set()
            self._busy, self._let_go = _wanted(project, view), let_go

            def work(check: Check) -> None:
                let_go.wait(HOLD_S)
                check()
                self._work(project, view, check)

            self._lane.submit(work)

    def make_room(self, room: tuple[int, int]) -> None:
        """Draw pictures that rest as large as the page shows them; one that is larger already stays."""
        with self.session.lock:
            self.room = room
            # what a hand lets go of is drawn anew as it is
            if self.picture is not None and self.moved is None and not studio.is_as_large(self.picture, room):
                self._busy = None
                self._heard({"type": "changed"})

    def rest(self) -> None:
        """Go on with the final picture after a drag that changed nothing."""
        if self._busy != _wanted(self.session.project, self.session.view):
            self._heard({"type": "changed"})


def _wanted(project: Project, view: View) -> tuple[Project, View]:
    """Return what of a project and a view decides what is drawn."""
    return (
        studio.pictured(project),
        view.replace(exposure_stops=None, found_stops=None, look="srgb", plate=None, plate_stops=0.0),
    )


def packed(screen: Screen) -> bytes:
    """Return the picture that is shown as JPEG; black before there is one."""
    number, data = screen.packed
    return data if number == screen.number else jpeg(shown_pixels(screen), QUALITY)


def shown_pixels(screen: Screen) -> NDArray[np.uint8]:
    """Return the picture that is shown as sRGB pixels; black before there is one."""
    picture = screen.picture
    if picture is None:
        width, height = studio.view_size(screen.session.project)
        return np.zeros((height, width, 3), dtype=np.uint8)
    return pixels_of_picture(screen, picture)


def pixels_of_picture(screen: Screen, picture: Picture) -> NDArray[np.uint8]:
    """Return sRGB pixels of a picture as the session's view has it."""
    view = screen.session.view
    if view.plain:
        gain = studio.ghost_gain(picture, screen.match)
        return view_sum(picture.ghosts, picture.rest, screen.exposure_stops, ghost_gain=gain, transform=view.look)
    light = studio.light_of(picture, screen.match)
    plate = plate_for(view, (light.shape[1], light.shape[0]))
    return pixels_of(light, screen.exposure_stops, view, plate)
