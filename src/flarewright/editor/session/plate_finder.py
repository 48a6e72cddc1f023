"""Find the lights of the project's plate in the background, and what a search would find, for outlines."""

from __future__ import annotations

import re
import time
from dataclasses import dataclass
from typing import Any

from pydantic import ValidationError

from ...errors import FlarewrightError, ProjectError
from ...model import Backplate, Project
from ...typing import Progress
from ..commands.design_targets import with_lights_at
from ..common.latest_job import Check, Lane
from .image_files import in_short
from .session import Session

# work shorter than this reports no progress, seconds
PROGRESS_AFTER_S = 0.6
# more area lights make full pictures slow
FEW_WIDE_LIGHTS = 4
# what the command line calls the page's settings
_PAGE_WORDS = {
    "; --threshold sets another value": "",
    "; --plate-transfer linear reads them as is": "",
    "lower --threshold or --stops": "lower Threshold",
    "give --threshold": "choose another plate",
    "(--least-pixels 4)": "(Smallest)",
    "--plate-gain or --highlights says so": "raise Brighter by",
    "--most-lights allows more": "Most lights allows more",
    "--highlights has": "White stands for has",
    "give --white, the plate value of white paper in the sun, such as 0.9": "fill in White paper, such as 0.9",
    "--source": "Lamp",
    "omit the layer": "leave the layer empty",
}
# clauses that the panel shows by its controls
_SHOWN = ("the plate has display codes",)


@dataclass(frozen=True)
class Finding:
    """Progress of a search for lights.

    Attributes
    ----------
    running : bool
    part : float
        Finished part of the work.
    words : str
        What is done.
    """

    running: bool = False
    part: float = 0.0
    words: str = ""


class PlateFinder:
    """Runs one search for lights at a time; the newest one counts.

    Parameters
    ----------
    session : Session
    """

    def __init__(self, session: Session) -> None:
        self.session = session
        self.state = Finding()
        self._lane: Lane | None = None

    def start(self) -> None:
        """Find the lights of the present plate, and make them those of the project, as one step of the history.

        Raises
        ------
        ProjectError
            There is no plate.
        """
        plate = _plate_of(self.session.project)
        # a thread only where a plate is searched
        self._lane = self._lane or Lane("lights")
        self._set(Finding(True, 0.0, "reading the plate"))
        self._lane.submit(lambda check: self._work(plate, check))

    def stop(self) -> None:
        """Cancel the search; the project stays as it is."""
        if self._lane is not None:
            self._lane.cancel()
        self._set(Finding())

    def close(self) -> None:
        """End the thread."""
        if self._lane is not None:
            self._lane.close()

    def wait(self, timeout_s: float) -> bool:
        """Wait until no search runs; return False after the timeout."""
        return self._lane is None or self._lane.wait(timeout_s)

    def _work(self, plate: Backplate, check: Check) -> None:
        try:
            remarks = self._found(plate, check)
        except (FlarewrightError, ValidationError) as error:
            check()
            self._end(page_words(str(error), self.session), "warning")
        except MemoryError:
            self._end("there is not enough memory to search this plate; give a smaller one", "warning")
        except Exception:
            check()
            self._end("The lights were not found: an internal error, printed in the terminal", "warning")
            raise
        else:
            self._end("; ".join(remarks), "info")

    def _found(self, plate: Backplate, check: Check) -> tuple[str, ...]:
        # imports SciPy, which the editor does not need without a plate
        from ...workflow.plates.found_lights import search_plate, with_found_lights

        started = time.perf_counter()

        def report(part: float, words: str) -> None:
            check()
            if time.perf_counter() - started > PROGRESS_AFTER_S:
                self._set(Finding(True, part, words))

        found = search_plate(plate, lambda part, words: report(0.7 * part, words))
        report(0.7, "placing lights")
        # traces the lens, before the session is locked
        with_found_lights(self.session.project, found)
        with self.session.lock:
            check()
            if self.session.project.plate != plate:
                raise ProjectError("the plate was changed during the search, so no lights were placed; find them again")
            before = self.session.project
            project, remarks = with_found_lights(before, found)
            # lights that stay have other numbers among the found ones
            numbers = {light: k for k, light in enumerate(project.lights)}
            project = with_lights_at(project, lambda k: numbers.get(before.lights[k]))
            self.session.put(project, "Find lights", placed=True)
        wide = sum(light.extended for light in project.lights)
        if wide > FEW_WIDE_LIGHTS:
            remarks += (
                f"{wide} of them are area lights, whose ghosts take long: Points below makes small ones points",
            )
        return tuple(page_words(words, self.session) for words in remarks if not words.startswith(_SHOWN))

    def _end(self, words: str, kind: str) -> None:
        self._set(Finding())
        self.session.tell({"type": "message", "kind": kind, "text": words})

    def _set(self, state: Finding) -> None:
        self.state = state
        self.session.tell({"type": "finding"})


def outlined(session: Session, progress: Progress) -> dict[str, Any]:
    """Return what a search of the present plate would find.

    Parameters
    ----------
    session : Session
    progress : callable
        As of `workflow.plates.found_lights.search_plate`.

    Returns
    -------
    dict
        "size" of the plate in pixels, its "lights" (`FoundLights.rows`), "above", the threshold, and "words" on it; or
        "words" alone if nothing would be found.

    Raises
    ------
    FlarewrightError
        There is no plate.
    """
    from ...workflow.plates.found_lights import search_plate

    plate = _plate_of(session.project)
    try:
        found = search_plate(plate, progress)
    except (FlarewrightError, ValidationError) as error:
        return {"lights": [], "words": page_words(str(error), session)}
    words = [page_words(each, session) for each in found.shot.remarks if not each.startswith(_SHOWN)]
    return {
        "size": list(found.shot.size_px),
        "lights": found.rows,
        "above": found.shot.threshold,
        "words": "; ".join(words),
    }


def _plate_of(project: Project) -> Backplate:
    if project.plate is None:
        raise ProjectError("there is no plate; drop a photograph on the page, or choose one")
    return project.plate


def page_words(words: str, session: Session) -> str:
    """Return a message of the command line in the words of the page."""
    for option, label in _PAGE_WORDS.items():
        words = words.replace(option, label)
    return in_short(re.sub(r"\s+", " ", words), session.project, session.file)
