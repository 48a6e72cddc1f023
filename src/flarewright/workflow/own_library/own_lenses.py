"""The user's library of lenses: what is known of each, from an index that is made again where it is old or damaged."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import IO

from ...errors import FlarewrightError, LensError, OutputError
from ...io.files.door import sentences_for, shown
from ...io.files.file_lock import locked
from ...io.files.text_file import read_text
from ...io.lens.library import library_names
from ...io.lens.own.folder import key_of, library_folder, own_lenses, spoken, writable_folder
from ...io.lens.own.index import Entry, read_index, write_index
from ...io.lens.own.record import LensRecord, record_in
from ...typing import Progress, Report

_PICTURE = re.compile(r"\.\./images/([0-9a-f]{16}(?:\.\w{1,8})?)(?=\")")


@dataclass(frozen=True)
class Library:
    """The lenses of the user's library.

    Attributes
    ----------
    records : tuple of LensRecord
        In the order of their names.
    remarks : tuple of str
        Files that cannot be used, a damaged index, and lenses whose name a shipped lens has.
    """

    records: tuple[LensRecord, ...]
    remarks: tuple[str, ...] = ()


def own_library(progress: Progress | None = None) -> Library:
    """Return what is known of every lens of the user's library.

    Records come from the index. The index is brought up to date with the lens files: those that were added, removed
    or edited since it was written, and all of them if it is damaged.

    Parameters
    ----------
    progress : callable, optional
        Reports the reading of lens files without a record, which takes longer than the rest.
    """
    index = read_index()
    remarks = [index.damaged] if index.damaged else []
    files = own_lenses()
    entries: dict[str, Entry] = {}
    shipped = {key_of(name) for name in library_names()}
    for k, (name, path) in enumerate(files.items()):
        try:
            record = kept_record(name, path, index.entries)
            if record is None:
                if progress is not None:
                    progress(k / len(files), name)
                record = _made_again(name, path)
            state = path.stat()
        except (FlarewrightError, OSError) as error:
            remarks.append(f"{name} cannot be used: {error}")
            continue
        entries[name] = Entry(state.st_size, state.st_mtime_ns, record)
        if key_of(name) in shipped:
            remarks.append(
                f"{name} is the name of a shipped lens, which commands use; give your lens as the file {shown(path)}"
            )
    if entries != index.entries:
        # a library that cannot be written can be read
        with suppress(OutputError):
            write_index(entries)
    return Library(tuple(entry.record for entry in entries.values()), tuple(remarks))


def _made_again(name: str, path: Path) -> LensRecord:
    """Make the record of a lens file that was edited or put into the folder by hand."""
    # most lists need no lens, and what opens one takes longer to import than an index to read
    from ...render.scene.resolve import open_lens
    from .lens_record import record_of_lens

    before, _ = record_in(read_text(path, "a lens file"), name)
    with sentences_for(path, "a lens"):
        made = record_of_lens(open_lens(path), name)
    return made if before is None else replace(made, file=before.file, digest=before.digest, maker=before.maker)


def kept_record(name: str, path: Path, entries: dict[str, Entry]) -> LensRecord | None:
    """Return the record of a lens file, from the index or from its first line; None if it has none that is current."""
    try:
        state = path.stat()
    except OSError:
        return None
    entry = entries.get(name)
    if entry is not None and (entry.size, entry.changed_ns) == (state.st_size, state.st_mtime_ns):
        return entry.record
    with suppress(FlarewrightError):
        record, current = record_in(read_text(path, "a lens file"), name)
        return record if current else None
    return None


@contextmanager
def library_lock(folder: Path) -> Iterator[IO[bytes]]:
    """Hold the lock of the library during the block.

    Parameters
    ----------
    folder : Path
        Of the library; it exists.

    Yields
    ------
    file
        Each change of the library appends a byte, so its size shows other processes that there was one: the time of a
        folder is too coarse for that.

    Raises
    ------
    OutputError
        The lock file cannot be written.
    """
    try:
        with locked(folder / "library.lock") as file:
            yield file
            file.flush()
    except OSError as error:
        raise OutputError(
            f"the lens library {folder} cannot be written ({(error.strerror or str(error)).lower()}): check its "
            "permissions and the free space, or set FLAREWRIGHT_STATE to another folder"
        ) from None


def find_own(name: str) -> tuple[str, Path]:
    """Return the name and the file of a lens of the user's library.

    Parameters
    ----------
    name : str
        Case, spaces and underscores do not matter.

    Raises
    ------
    LensError
        The user's library has no such lens; the message suggests near names.
    """
    found = next(((one, path) for one, path in own_lenses().items() if key_of(one) == key_of(name)), None)
    if found is None:
        if key_of(name) in map(key_of, library_names()):
            raise LensError(f"{name} is a shipped lens; your lenses are in {library_folder()}")
        near = _near(name)
        raise LensError(f"your library has no lens {name!r}{near or ': flarewright library list shows your lenses'}")
    return found


def remove_lens(name: str, said: Report | None = None) -> LensRecord | None:
    """Remove a lens from the user's library, with its thumbnail and pictures that no other lens uses.

    Parameters
    ----------
    name : str
        Case, spaces and underscores do not matter.
    said : callable, optional
        Gets a remark on what could not be deleted.

    Returns
    -------
    LensRecord or None
        Of the removed lens; None if it had none.

    Raises
    ------
    LensError
        The user's library has no such lens.
    OutputError
        Its file cannot be deleted.
    """
    own_name, path = find_own(name)
    folder = writable_folder()
    with library_lock(folder) as lock:
        record = kept_record(own_name, path, {})
        pictures = _pictures_in(path)
        try:
            path.unlink()
            lock.write(b"-")
        except OSError as error:
            raise OutputError(f"cannot remove {path}: {(error.strerror or str(error)).lower()}") from None
        used = {picture for other in own_lenses().values() for picture in _pictures_in(other)} if pictures else set()
        for one in (folder / "thumbnails" / f"{own_name}.jpg", *(folder / "images" / each for each in pictures - used)):
            try:
                one.unlink(missing_ok=True)
            except OSError as error:
                if said is not None:
                    said(f"{one} stays: {(error.strerror or str(error)).lower()}")
    own_library()
    return record


def _near(name: str) -> str:
    near = difflib.get_close_matches(spoken(name), own_lenses(), n=3, cutoff=0.5)
    return f": did you mean {' or '.join(near)}?" if near else ""


def _pictures_in(path: Path) -> set[str]:
    """Return the names of the pictures of the library that a lens file names."""
    try:
        text = read_text(path, "a lens file")
    except FlarewrightError:
        return set()
    # any text of a lens can hold such a path: only names that the library gives are files of it
    return set(_PICTURE.findall(text))
