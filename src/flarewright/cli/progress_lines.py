"""Progress of a list of items as lines of JSON on stderr, for programs that read them."""

from __future__ import annotations

import json
import sys
import time
from typing import Any


class ProgressLines:
    """Prints one JSON object for each finished item, with an estimate of the time that is left.

    The first drawn item also waits for kernels and processes, and kept ones take no time: neither predicts the others.
    """

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """Count the time from now on."""
        self._started, self._first_s, self._later = time.monotonic(), 0.0, -1

    def finished(self, item: dict[str, Any], *, drawn: bool, done: int, of: int) -> None:
        """Print the line of an item that was drawn, or kept because it was there."""
        seconds = time.monotonic() - self._started
        self._later += drawn
        if self._later == 0 and drawn:
            self._first_s = seconds
        left_s = round((seconds - self._first_s) / self._later * (of - done), 3) if self._later > 0 else None
        state = "drawn" if drawn else "kept"
        print_line({**item, "state": state, "done": done, "of": of, "seconds": round(seconds, 3), "left_s": left_s})


def print_line(data: dict[str, Any]) -> None:
    """Print a JSON object in one line to stderr."""
    print(json.dumps(data), file=sys.stderr, flush=True)
