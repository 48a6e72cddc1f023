"""Work beside the interface, a few steps at a time."""

import time
from collections.abc import Generator
from typing import Any

from .errors import FlareError

Work = Generator[str, None, Any]
"""Work in small steps, each with its progress in words; it returns sentences for the user."""


class Job:
    """Work that is done beside the interface, a few steps at a time.

    Parameters
    ----------
    work : generator

    Attributes
    ----------
    words : str
        The progress.
    state : str
        "RUNNING", "FINISHED", "FAILED" or "CANCELLED".
    said : list of str
        Sentences at its end.
    """

    def __init__(self, work: Work) -> None:
        self._work = work
        self._stopped = False
        self.words, self.state = "", "RUNNING"
        self.said: list[str] = []

    def cancel(self) -> None:
        """Stop at the next step; programs that the work has started end."""
        self._stopped = True

    def advance(self, time_s: float) -> bool:
        """Work for a time, and return whether there is more to do."""
        until = time.monotonic() + time_s
        try:
            while True:
                if self._stopped:
                    self._work.close()
                    self._end("CANCELLED", ["Flarewright was cancelled; finished frames are kept"])
                    return False
                words = next(self._work)
                # a program that is waited for reports the same until it has drawn a frame
                waits, self.words = words == self.words, words
                if waits or time.monotonic() >= until:
                    return True
        except StopIteration as end:
            self._end("FINISHED", list(end.value or ()))
        except FlareError as error:
            self._end("FAILED", [str(error)])
        except BaseException:
            self._end("FAILED", [])
            raise
        return False

    def _end(self, state: str, said: list[str]) -> None:
        self.state, self.said = state, said
