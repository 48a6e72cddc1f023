"""What the viewport shows, and the work that makes it: latest wins, sharper as it waits, last good one kept."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import FlarewrightError
from ..model import Project
from . import studio
from .jobs import Check, Lane, Overtaken
from .seen import Seen, see
from .session import Session
from .shown import pixels_of, plate_for
from .studio import Match, Picture
from .view import View

# a lens whose final picture takes less needs no draft in front of it
SOON_S = 0.35
TELL_S = 0.12


class Screen:
    """The pictures of a session.

    Parameters
    ----------
    session : Session
    """

    def __init__(self, session: Session) -> None:
        self.session = session
        self.picture: Picture | None = None
        self.seen: Seen | None = None
        self.match = Match()
        self.problem = ""
        self.number = 0
        # called when all is drawn and measured
        self.idle: Callable[[], None] | None = None
        self._final_s = 10.0
        self._lane = Lane("pictures")
        self._busy: tuple[Project, View] | None = None
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
        wanted = (
            studio.pictured(project),
            view.replace(exposure_stops=None, found_stops=None, look="srgb", plate=None, plate_stops=0.0),
        )
        if wanted == self._busy and not self.problem:
            # only the way it is shown has changed
            self._publish()
            return
        self._busy = wanted
        self._lane.submit(lambda check: self._work(project, view, check))

    def _work(self, project: Project, view: View, check: Check) -> None:
        try:
            self._draw(project, view, check)
        except FlarewrightError as error:
            check()
            self.problem = str(error)
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

    def _draw(self, project: Project, view: View, check: Check) -> None:
        shown = self.picture
        # another lens has an exposure of its own; while one is worked on it is held, so that brightness can be compared
        if shown is None and view.found_stops is not None:
            self.match = Match(exposure_stops=view.found_stops)
        fresh = (
            view.found_stops is None if shown is None else studio.lens_name(shown.project) != studio.lens_name(project)
        )
        changed = shown is None or not studio.same_scene(shown.project, project)
        working = view.grey or view.unclipped
        draft: Picture | None = None
        if changed or working or self._final_s > SOON_S:
            draft = studio.take(project, "draft", view, levels=() if changed else self.match.levels)
            check()
            if fresh:
                self.match = Match(exposure_stops=studio.exposure_of(draft))
            elif changed:
                self.match = replace(self.match, levels=())
            self._show(draft)
        if not working:
            final = studio.take(project, "final", view, progress=self._progress("final picture", check))
            check()
            self._final_s = final.seconds
            if draft is None:
                draft = studio.take(project, "draft", view, levels=self.match.levels)
            self.match = studio.matched(draft, final, self.match)
            if fresh:
                self.match = replace(self.match, exposure_stops=studio.exposure_of(final))
                self.session.remember(self.match.exposure_stops)
            self._show(final)
        grade: studio.Grade = "draft" if working else "final"
        self.seen = see(project, grade, self._progress("ghosts", check))
        check()
        self.session.tell({"type": "ghosts"})
        if not working:
            self._match_ghosts(project, view, self.seen, check)
        check()
        if self.idle is not None:
            self.idle()

    def _match_ghosts(self, project: Project, view: View, seen: Seen, check: Check) -> None:
        """Learn from the final picture how bright each ghost of the next drafts shall be."""
        drafted = see(project, "draft", lambda *_: check())
        levels = studio.levels_of(*({ghost.name: ghost.flux for ghost in each.ghosts} for each in (drafted, seen)))
        draft = studio.take(project, "draft", view, levels=levels)
        check()
        final = self.picture
        if final is not None:
            self.match = replace(studio.matched(draft, final, self.match), levels=levels)

    def _progress(self, what: str, check: Check) -> Any:
        told = 0.0

        def step(part: float, _: str) -> None:
            nonlocal told
            check()
            now = time.perf_counter()
            if now - told > TELL_S:
                told = now
                self.session.tell({"type": "progress", "part": part, "what": what})

        return step

    def _show(self, picture: Picture) -> None:
        self.picture, self.problem = picture, ""
        self._publish()

    def _publish(self) -> None:
        self.number += 1
        self.session.tell({"type": "picture"})

    @property
    def exposure_stops(self) -> float:
        """What the picture is shown with."""
        own = self.session.view.exposure_stops
        return self.match.exposure_stops if own is None else own

    def expose(self) -> None:
        """Find the exposure anew, by what is shown now."""
        if self.picture is not None:
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
            return True

    def rest(self) -> None:
        """Go on with the final picture after a drag that changed nothing."""
        if self._busy is None:
            self._heard({"type": "changed"})


def pixels_of_picture(screen: Screen, picture: Picture) -> NDArray[np.uint8]:
    """Return sRGB pixels of a picture as the session's view has it."""
    view, light = screen.session.view, studio.light_of(picture, screen.match)
    plate = plate_for(view, (light.shape[1], light.shape[0]))
    return pixels_of(light, screen.exposure_stops, view, plate)
