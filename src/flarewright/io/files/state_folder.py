"""Folder for data that outlives a run: editor sessions, imported files, the gallery."""

from __future__ import annotations

import os
import sys
from pathlib import Path


def state_folder() -> Path:
    """Return FLAREWRIGHT_STATE, or the operating system's folder for application state."""
    if given := os.environ.get("FLAREWRIGHT_STATE"):
        return Path(given)
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", str(Path.home()))) / "flarewright"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Application Support" / "flarewright"
    return Path(os.environ.get("XDG_STATE_HOME", str(Path.home() / ".local" / "state"))) / "flarewright"
