"""Atomic file writing: a file is complete or absent."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable
from pathlib import Path

from ...errors import OutputError
from .door import no_file
from .temporary_file import remove_abandoned, temporary_beside


def write_atomically(
    path: str | Path, write: Callable[[Path], None], *, look: Callable[[], object] | None = None, replace: bool = True
) -> None:
    """Write a file under a temporary name in the same folder, then rename it.

    Parameters
    ----------
    path : str or Path
        Target path; an existing file is replaced only when the new one is complete. A symbolic link stays, and the
        file that it leads to is written, beside which the temporary file lies.
    write : callable
        Gets the temporary path (same folder, same suffix) and writes the whole file there.
    look : callable, optional
        Called after `write`, right before the rename: the last chance to detect a file of another process at `path`.
        An exception that it raises leaves that file unchanged.
    replace : bool
        False: write only if no file exists at `path`. A file that another process creates meanwhile is kept if the
        file system supports hard links.

    Raises
    ------
    FileExistsError
        When a file exists that must not be replaced.
    OutputError
        When the folder is missing, read-only or full, or `path` is a folder, a pipe or a device; no partial file
        remains.

    Notes
    -----
    All other exceptions of `write` propagate after the temporary file is removed. What killed processes left of the
    same file is removed first.
    """
    target = Path(path)
    check_replaceable(target)
    if not target.parent.is_dir():
        raise OutputError(f"cannot write {target}: the folder {target.parent} does not exist; create it first")
    if replace:
        target = _behind_links(target)
    # writers choose the format by the suffix that the user gave
    named = target.with_name(Path(path).name)
    remove_abandoned(named)
    temporary = temporary_beside(named)
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
    except UnicodeEncodeError as error:
        raise OutputError(f"cannot write {target}: the name of a file in it is not UTF-8; rename that file") from error
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)


def check_replaceable(path: Path) -> None:
    """Raise an OutputError if an output would replace a folder, a pipe or a device."""
    reason = no_file(path)
    if reason in ("is a folder", "is not a regular file"):
        raise OutputError(f"cannot write {path}: it {reason}; give a file name")


def _behind_links(path: Path) -> Path:
    """Return the path of the file that a symbolic link leads to; any other path as it is."""
    if not path.is_symlink():
        return path
    try:
        target = path.resolve()
    except (OSError, RuntimeError):
        raise OutputError(f"cannot write {path}: it is a link that leads to itself; remove it") from None
    if not target.parent.is_dir():
        raise OutputError(f"cannot write {path}: it is a link into the missing folder {target.parent}; create it first")
    return target


def delete_written(path: Path) -> None:
    """Delete a file, if it exists, and what killed processes left of it; a file that cannot be deleted stays."""
    with contextlib.suppress(OSError):
        path.unlink(missing_ok=True)
    remove_abandoned(path)


def make_folder(folder: Path) -> None:
    """Make a folder, and those above it, if there is none; raises OutputError."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"cannot make the folder {folder}: {(error.strerror or str(error)).lower()}") from None


def write_text_atomically(path: str | Path, text: str, *, newline: str | None = None, replace: bool = True) -> None:
    """Write a text file in UTF-8; `newline` as of `Path.write_text`, `replace` and errors as of `write_atomically`."""

    def write(temporary: Path) -> None:
        temporary.write_text(text, encoding="utf-8", newline=newline)

    write_atomically(path, write, replace=replace)


def write_bytes_atomically(
    path: str | Path, data: bytes, *, look: Callable[[], object] | None = None, replace: bool = True
) -> None:
    """Write a file of bytes; `look`, `replace` and errors as of `write_atomically`."""

    def write(temporary: Path) -> None:
        temporary.write_bytes(data)

    write_atomically(path, write, look=look, replace=replace)


def _place(temporary: Path, target: Path, replace: bool) -> None:
    if not replace:
        try:
            # unlike a rename, a link never replaces a file
            os.link(temporary, target)
            return
        except FileExistsError:
            raise
        except OSError:
            if target.exists():
                raise FileExistsError(target) from None
    os.replace(temporary, target)
