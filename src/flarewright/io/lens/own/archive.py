"""The lens files in a folder or a ZIP archive, one after the other."""

from __future__ import annotations

import os
import posixpath
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory
from zipfile import ZipFile, ZipInfo

from ....errors import FileError, FlarewrightError, LensError
from ...files.door import outside, printable, sentences_for, shown
from ...files.file_kind import LENS_SUFFIXES
from ...files.text_file import LARGEST, read_bytes
from .folder import library_folder

MOST_FILES = 200_000
"""Largest number of files in a folder or an archive."""

_ZIP = ".zip"
_PICTURES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".exr", ".npy")
# parts of an archive that a computer adds
_HIDDEN = ("__MACOSX",)


@dataclass(frozen=True)
class LensFile:
    """A file that may hold a lens.

    Attributes
    ----------
    label : str
        For messages: its path, or "ARCHIVE.zip: PATH".
    stem : str
        Name of the file without its suffix.
    """

    label: str
    stem: str
    _path: Path
    _archive: ZipFile | None = field(default=None, repr=False)
    _member: ZipInfo | None = field(default=None, repr=False)

    @property
    def suffix(self) -> str:
        """Suffix of the file's name, in small letters."""
        return PurePosixPath(self._path.name if self._member is None else self._member.filename).suffix.lower()

    def read(self) -> bytes:
        """Return its bytes.

        Raises
        ------
        FileError
            It cannot be read, is too large, or is empty.
        """
        if self._archive is None or self._member is None:
            return read_bytes(self._path, "a lens file")
        with sentences_for(self.label, "a lens file"):
            return _unpacked(self._archive, self._member, self.label)

    @contextmanager
    def as_path(self, data: bytes) -> Iterator[Path]:
        """Give the file a path during the block, for the readers.

        Parameters
        ----------
        data : bytes
            As `read` returns them.

        Raises
        ------
        LensError, FileError
            A lens of an archive names a picture that is not in the archive.
        """
        if self._archive is None or self._member is None:
            yield self._path
            return
        with TemporaryDirectory(prefix="flarewright-") as text:
            inside = PurePosixPath(self._member.filename)
            target = Path(text) / f"lens{inside.suffix}"
            target.write_bytes(data)
            if inside.suffix.lower() == ".toml":
                for picture in _pictures_of(target):
                    _unpack_picture(self._archive, inside, picture, Path(text), self.label)
            yield target


@dataclass(frozen=True)
class Found:
    """The lens files of a place, and the number of its other files by their suffix."""

    files: tuple[LensFile, ...]
    others: dict[str, int]


@contextmanager
def lens_files(place: Path) -> Iterator[Found]:
    """List the lens files of a folder with its folders, a ZIP archive, or one file; they can be read in the block.

    Yields
    ------
    Found
        Sorted by path. Hidden files and the library itself are left out, folders that are links are not entered.

    Raises
    ------
    FileError
        The place does not exist, cannot be read, is no archive, would unpack to too much, or has too many files.
    """
    if place.is_dir():
        yield _sorted_out(_in_folder(place))
    elif place.suffix.lower() == _ZIP:
        # the sum of the sizes that the archive states is checked at the door
        with outside(place, "a ZIP archive of lens files") as file, ZipFile(file) as archive:
            if len(archive.infolist()) > MOST_FILES:
                raise FileError(f"{shown(place)} has more than {MOST_FILES} files: give an archive of lens files only")
        with ZipFile(place) as archive:
            yield _sorted_out(_in_archive(place, archive))
    else:
        with outside(place, "a lens file", largest=LARGEST):
            pass
        yield Found((LensFile(shown(place), place.stem, place),), {})


def _sorted_out(files: list[LensFile]) -> Found:
    others: dict[str, int] = {}
    kept = []
    for file in files:
        if file.suffix in LENS_SUFFIXES:
            kept.append(file)
        else:
            others[file.suffix] = others.get(file.suffix, 0) + 1
    return Found(tuple(kept), dict(sorted(others.items())))


def _in_folder(place: Path) -> list[LensFile]:
    own = library_folder().resolve()
    if place.resolve().is_relative_to(own):
        raise FileError(f"{shown(place)} is the lens library itself: give the folder of other lens files")
    found: list[LensFile] = []

    def refuse(error: OSError) -> None:
        if error.filename == os.fspath(place):
            raise FileError(f"{shown(place)} cannot be read ({(error.strerror or str(error)).lower()}): check it")

    for folder, below, names in os.walk(place, onerror=refuse):
        below[:] = sorted(one for one in below if not one.startswith(".") and (Path(folder) / one).resolve() != own)
        for name in sorted(names):
            if not name.startswith("."):
                path = Path(folder) / name
                found.append(LensFile(shown(path), path.stem, path))
        if len(found) > MOST_FILES:
            raise FileError(f"{shown(place)} has more than {MOST_FILES} files: give a folder of lens files only")
    return found


def _in_archive(place: Path, archive: ZipFile) -> list[LensFile]:
    found = []
    for member in archive.infolist():
        inside = PurePosixPath(member.filename)
        hidden = any((part.startswith(".") and part != "..") or part in _HIDDEN for part in inside.parts)
        if not member.is_dir() and not hidden:
            found.append(LensFile(f"{shown(place)}: {printable(str(inside))}", inside.stem, place, archive, member))
    return sorted(found, key=lambda one: one.label)


def _unpacked(archive: ZipFile, member: ZipInfo, label: str, largest: int = LARGEST) -> bytes:
    """Return the bytes of a part of an archive; never more than a lens file may have, whatever its header states."""
    with archive.open(member) as part:
        data = part.read(largest + 1)
    if len(data) > largest:
        raise FileError(f"{label} has more than {largest / 1e6:g} MB, too large for a lens file: is it the right file?")
    if not data.strip():
        raise FileError(f"{label} is empty: a lens file was expected")
    return data


def _pictures_of(path: Path) -> tuple[str, ...]:
    """Return the pictures that a lens file of ours names, as it writes them."""
    from ...files.text_file import read_toml

    try:
        table = read_toml(path, "a lens file")
    except FlarewrightError:
        # the reader reports it
        return ()
    iris, rows = table.get("iris"), table.get("rows")
    named = [iris.get("mask")] if isinstance(iris, dict) else []
    for row in rows if isinstance(rows, list) else ():
        figure = row.get("figure") if isinstance(row, dict) else None
        named += [figure.get("image")] if isinstance(figure, dict) else []
    return tuple(dict.fromkeys(one for one in named if isinstance(one, str) and one.strip()))


def _unpack_picture(archive: ZipFile, lens: PurePosixPath, picture: str, folder: Path, label: str) -> None:
    """Write a picture of the archive to the place where a lens of it expects it, within a folder."""
    plain = posixpath.normpath(picture.replace("\\", "/"))
    member = posixpath.normpath(posixpath.join(str(lens.parent), plain))
    if posixpath.isabs(plain) or Path(picture).is_absolute() or ".." in PurePosixPath(plain).parts:
        raise LensError(f"{label} names a picture outside its folder ({picture[:80]}): put it beside the lens file")
    if member not in archive.namelist() or PurePosixPath(member).suffix.lower() not in _PICTURES:
        raise LensError(f"{label} names the picture {picture[:80]}, which is not in the archive: add it")
    target = folder / plain
    target.parent.mkdir(parents=True, exist_ok=True)
    # the door has compared the sum of all sizes with its limit
    target.write_bytes(_unpacked(archive, archive.getinfo(member), label, archive.getinfo(member).file_size))
