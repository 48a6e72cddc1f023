"""Files with the partial work of commands that have no output beside which it could lie."""

from __future__ import annotations

import hashlib
import time
from contextlib import suppress
from pathlib import Path

from ...io.files.state_folder import state_folder

FORGOTTEN_S = 30.0 * 86400.0
"""Age at which partial work in the state folder is deleted."""


def unnamed_file(text: str, suffix: str = ".npz") -> Path:
    """Return the file with the partial work of a command without an output; those of forgotten commands are deleted.

    Parameters
    ----------
    text : str
        Identifies the command in its working folder.
    suffix : str
        Of the file.

    Returns
    -------
    Path
        In the state folder's `partial`; the same for the same command in the same folder.
    """
    folder = state_folder() / "partial"
    with suppress(OSError):
        folder.mkdir(parents=True, exist_ok=True)
        for path in folder.iterdir():
            if time.time() - path.stat().st_mtime > FORGOTTEN_S:
                path.unlink()
    return folder / f"{hashlib.sha256(f'{Path.cwd()} {text}'.encode()).hexdigest()[:32]}{suffix}"
