"""The token that opens the editor: a chosen one, or a random one that is kept for the user's account."""

from __future__ import annotations

import os
import secrets
import stat
import sys
from contextlib import suppress
from pathlib import Path

from ...errors import FileError, ProjectError
from ...io.files.door import expanded
from ...io.files.state_folder import state_folder
from ...io.files.text_file import read_text

VARIABLE = "FLAREWRIGHT_TOKEN"
NAME = "editor-token"
# a longer file is no token
MOST_BYTES = 4096


def token_of(file: Path | None) -> str:
    """Return the token of a file, of the environment, or the random one of this account.

    The random one stays the same when the editor starts again, so that open pages reconnect.

    Raises
    ------
    ProjectError
        When the file cannot be read, or holds no single line.
    """
    if file is not None:
        return _read(file)
    return os.environ.get(VARIABLE) or _kept(state_folder() / NAME)


def _read(file: Path) -> str:
    try:
        text = read_text(expanded(file), "a token", MOST_BYTES).strip()
    except FileError as error:
        raise ProjectError(f"--token-file: {error}") from None
    if not text.isprintable():
        raise ProjectError(f"--token-file {file}: it must hold one line with the token")
    return text


def _kept(path: Path) -> str:
    """Return the random token of this account; a file that others may have read or written is replaced."""
    fresh = secrets.token_urlsafe(24)
    with suppress(OSError, ValueError):
        if _private(path.lstat()) and len(known := path.read_text("ascii").strip()) >= len(fresh):
            return known
    # in a folder that cannot be written, the token lasts as long as the editor
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        path.unlink(missing_ok=True)
        with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w", encoding="ascii") as target:
            target.write(f"{fresh}\n")
    return fresh


def _private(found: os.stat_result) -> bool:
    """Return whether a file is this account's alone."""
    if sys.platform == "win32":
        # the folder belongs to the account, which modes do not show
        return True
    return stat.S_ISREG(found.st_mode) and found.st_uid == os.getuid() and not found.st_mode & 0o077
