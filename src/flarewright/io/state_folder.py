"""Where the program keeps what outlives a run: the editor's sessions, imported files, the gallery."""

from __future__ import annotations

import os
import sys
from pathlib import Path


def state_folder() -> Path:
    """Return where the program keeps its state: FLAREWRIGHT_STATE, or the system's place for such things."""
    if given := os.environ.get("FLAREWRIGHT_STATE"):
        return Path(given)
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", str(Path.home()))) / "flarewright"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Application Support" / "flarewright"
    return Path(os.environ.get("XDG_STATE_HOME", str(Path.home() / ".local" / "state"))) / "flarewright"
