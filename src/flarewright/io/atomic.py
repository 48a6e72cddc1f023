"""Write files whole or not at all."""

from __future__ import annotations

import contextlib
import os
import secrets
from collections.abc import Callable
from pathlib import Path

from flarewright.errors import OutputError


def write_atomically(
    path: str | Path, write: Callable[[Path], None], *, look: Callable[[], object] | None = None, replace: bool = True
) -> None:
    """Write a file under a temporary name in the same folder, then rename it.

    Parameters
    ----------
    path : str or Path
        Where the file shall lie; one already there is replaced only when the new one is complete.
    write : callable
        Gets the temporary path (same folder, same suffix) and writes the whole file there.
    look : callable, optional
        Called when all is written, right before the file takes its place: the last moment in which somebody else's
        file can be noticed there. What it raises leaves that one as it is.
    replace : bool
        False: only where no file lies; one that comes up to the very last is left as it is, wherever the file system
        knows hard links.

    Raises
    ------
    FileExistsError
        When one lies there that may not be replaced.
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
        if look is not None:
            look()
        _place(temporary, target, replace)
    except OSError as error:
        if isinstance(error, FileExistsError) and not replace:
            raise
        reason = error.strerror or str(error) or type(error).__name__
        raise OutputError(
            f"cannot write {target}: {reason.lower()}; check the free space and the permissions"
        ) from error
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)


def _place(temporary: Path, target: Path, replace: bool) -> None:
    if not replace:
        try:
            # unlike a rename, a link never takes the place of a file
            os.link(temporary, target)
            return
        except FileExistsError:
            raise
        except OSError:
            if target.exists():
                raise FileExistsError(target) from None
    os.replace(temporary, target)
