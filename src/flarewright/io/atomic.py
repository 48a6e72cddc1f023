"""Write files whole or not at all."""

from __future__ import annotations

import contextlib
import os
import secrets
from collections.abc import Callable
from pathlib import Path

from flarewright.errors import OutputError


def write_atomically(path: str | Path, write: Callable[[Path], None]) -> None:
    """Write a file under a temporary name in the same folder, then rename it.

    Parameters
    ----------
    path : str or Path
        Where the file shall lie; one already there is replaced only when the new one is complete.
    write : callable
        Gets the temporary path (same folder, same suffix) and writes the whole file there.

    Raises
    ------
    OutputError
        The folder is missing, may not be written to, is full, or `path` is a folder; nothing is left behind.

    Notes
    -----
    Whatever else `write` raises passes through, after the temporary file is removed.
    """
    target = Path(path)
    if target.is_dir():
        raise OutputError(f"cannot write {target}: it is a folder; give a file name")
    if not target.parent.is_dir():
        raise OutputError(f"cannot write {target}: the folder {target.parent} does not exist; create it first")
    temporary = target.with_name(f".{target.stem[:100]}.{secrets.token_hex(4)}.part{target.suffix}")
    try:
        write(temporary)
        if not temporary.is_file():
            raise OutputError(f"cannot write {target}: nothing was written; check the free space and the permissions")
        os.replace(temporary, target)
    except OSError as error:
        reason = error.strerror or str(error) or type(error).__name__
        raise OutputError(
            f"cannot write {target}: {reason.lower()}; check the free space and the permissions"
        ) from error
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)
