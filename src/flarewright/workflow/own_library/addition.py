"""Add the lens files of folders and ZIP archives to the user's library."""

from __future__ import annotations

import os
import tomllib
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from hashlib import sha256
from pathlib import Path
from shutil import copyfile
from typing import IO

from ...errors import FlarewrightError, LensError, OutputError, ProjectError
from ...io.files.atomic_write import write_atomically, write_text_atomically
from ...io.files.door import sentences_for, shown
from ...io.files.text_file import digest_of
from ...io.images.mask_image import read_mask
from ...io.lens.formats.codev import FirstColumn
from ...io.lens.lens_writer import format_lens
from ...io.lens.library import library_names
from ...io.lens.own.archive import LensFile, lens_files
from ...io.lens.own.folder import (
    key_of,
    lenses_folder,
    library_folder,
    own_lenses,
    spoken,
    unused_name,
    writable_folder,
)
from ...io.lens.own.index import Entry, read_index
from ...io.lens.own.record import LensRecord, with_record
from ...io.lens.toml_lens import lens_from_table
from ...model import Lens, Surface
from ...optics.lens_import.patent_repair import Apertures
from ...render.scene.resolve import open_lens
from ...sentences import listed
from ...typing import Progress
from .lens_record import record_of_lens
from .own_lenses import kept_record, library_lock, own_library

_PICTURE_DIGITS = 16
# lenses that a remark names
_LISTED = 5


@dataclass(frozen=True)
class Refused:
    """A file that did not become a lens of the library, and why, in one sentence."""

    file: str
    reason: str


@dataclass(frozen=True)
class Addition:
    """What an addition did.

    Attributes
    ----------
    added : tuple of LensRecord
    known : tuple of (str, str)
        Files that the library had already, by the digest of their bytes, each with the name of its lens.
    refused : tuple of Refused
    others : dict
        Number of files by suffix that no reader of lenses knows.
    remarks : tuple of str
        Names that had to be changed.
    """

    added: tuple[LensRecord, ...] = ()
    known: tuple[tuple[str, str], ...] = ()
    refused: tuple[Refused, ...] = ()
    others: dict[str, int] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()


def add_lenses(
    places: Sequence[Path],
    *,
    name: str | None = None,
    maker: str | None = None,
    apertures: Apertures = "auto",
    first_column: FirstColumn | None = None,
    progress: Progress | None = None,
) -> Addition:
    """Add the lens files of folders and ZIP archives, and single files, to the user's library.

    Each lens becomes one file in Flarewright's format, complete and with its record, as soon as it is read. So an
    interrupted addition resumes when it is repeated, and several processes can add at the same time.

    Parameters
    ----------
    places : sequence of Path
    name : str, optional
        Of the lens, if the places hold only one. None: the name of its file.
    maker : str, optional
        Of all lenses. None: found in the texts of each.
    apertures : {"auto", "diameters", "semi-diameters"}
        As of `open_lens`, for `.lens` tables.
    first_column : {"radii", "curvatures"}, optional
        For `.seq` files that do not state it.
    progress : callable, optional

    Raises
    ------
    FileError
        A place does not exist, is no archive, or is too large.
    ProjectError
        `name` is given for several lens files, or is taken.
    OutputError
        The library cannot be written; lenses that were added before stay.

    Examples
    --------
    >>> from pathlib import Path
    >>> addition = add_lenses([Path("zmx"), Path("old-lenses.zip")])                # doctest: +SKIP
    >>> print([one.name for one in addition.added], addition.refused)             # doctest: +SKIP
    """
    folder = writable_folder()
    reading = _Reading(apertures, first_column, maker)
    one_by_one: list[Addition] = []
    kinds: set[str] = set()
    names = _Names(folder)
    if name is not None and len(places) > 1:
        raise ProjectError(f"--name gives one lens its name, and {len(places)} places are given; add them one by one")
    for k, place in enumerate(places):
        with lens_files(place) as found:
            if name is not None and len(found.files) != 1:
                raise ProjectError(
                    f"--name gives one lens its name, and {shown(place)} holds {len(found.files)} files; omit it, or "
                    "give one file"
                )
            one_by_one.append(Addition(others=dict(found.others)))
            kinds |= {file.suffix for file in found.files}
            for n, file in enumerate(found.files):
                if progress is not None:
                    progress((k + n / len(found.files)) / len(places), file.stem)
                one_by_one.append(_add_file(file, names, reading, name))
    unused = [
        f"--{flag} has no effect: there is no {suffix} file"
        for flag, value, suffix in (("apertures", apertures, ".lens"), ("first-column", first_column or "auto", ".seq"))
        if value != "auto" and suffix not in kinds
    ]
    # the index of what was added, so that the first search need not make it
    library = own_library()
    damaged = [remark for remark in library.remarks if "index" in remark]
    added = _joined(one_by_one)
    makers = {record.name: record.maker for record in library.records}
    return replace(added, remarks=(*damaged, *added.remarks, *unused, *_unread(added, reading, makers)))


def _unread(added: Addition, reading: _Reading, makers: Mapping[str, str]) -> list[str]:
    """Return remarks on options that have no effect on files that the library had before."""
    made = {record.name for record in added.added}
    known = [(file, name) for file, name in added.known if name not in made]
    # an addition that resumes gives the same maker again
    other = [name for _, name in known if reading.maker is not None and makers.get(name) != reading.maker]
    of_kind = {suffix: [name for file, name in known if file.lower().endswith(suffix)] for suffix in (".lens", ".seq")}
    found = []
    for flag, names in (
        ("--maker", other),
        ("--apertures", of_kind[".lens"] if reading.apertures != "auto" else []),
        ("--first-column", of_kind[".seq"] if reading.first_column is not None else []),
    ):
        if names:
            found.append(
                f"{flag} has no effect on lenses that the library has: {listed(names, _LISTED)}; to change them, "
                "flarewright library remove NAME, then add them again"
            )
    return found


def _joined(additions: Sequence[Addition]) -> Addition:
    """Return several additions as one."""
    others: Counter[str] = Counter()
    for each in additions:
        others.update(each.others)
    return Addition(
        tuple(lens for each in additions for lens in each.added),
        tuple(file for each in additions for file in each.known),
        tuple(file for each in additions for file in each.refused),
        dict(sorted(others.items())),
        tuple(remark for each in additions for remark in each.remarks),
    )


def _add_file(file: LensFile, names: _Names, reading: _Reading, name: str | None) -> Addition:
    """Add one file to the library; `name` is that of the lens, or None for the name of the file."""
    try:
        data = file.read()
        digest = sha256(data).hexdigest()
        if (there := names.name_of(digest)) is not None:
            remark = f"--name has no effect: {file.label} is in the library, as {there}"
            return Addition(known=((file.label, there),), remarks=() if name is None else (remark,))
        text, record = _read(file, data, digest, reading)
        made, said = names.put(text, record, name or file.stem, exact=name is not None)
    except (OutputError, ProjectError):
        raise
    except FlarewrightError as error:
        return Addition(refused=(Refused(file.label, str(error)),))
    if made is None:
        return Addition(known=((file.label, said),))
    return Addition(added=(made,), remarks=(said,) if said else ())


@dataclass(frozen=True)
class _Reading:
    """How files are read."""

    apertures: Apertures
    first_column: FirstColumn | None
    maker: str | None


def _read(file: LensFile, data: bytes, digest: str, reading: _Reading) -> tuple[str, LensRecord]:
    """Return the text of the lens of a file, read, repaired and complete, and its record."""
    with file.as_path(data) as path:
        try:
            # a fault of one file never ends the addition of the others
            with sentences_for(path, "a lens"):
                opened = open_lens(
                    path, apertures=reading.apertures if file.suffix == ".lens" else "auto",
                    first_column=reading.first_column if file.suffix == ".seq" else None,
                )  # fmt: skip
                record = record_of_lens(opened, file.stem, file.label, digest)
                lens = _with_own_pictures(opened.lens)
        except FlarewrightError as error:
            # the path of an unpacked file says nothing to the user
            message = str(error).replace(str(path), file.label)
            raise LensError(message) from None
        if lens.name == path.stem != file.stem:
            # a file without a title: the reader has taken the name of the unpacked file
            lens, record = lens.replace(name=file.stem), replace(record, title=file.stem)
        if path.stem != file.stem:
            # readers have written the name of the unpacked file
            unpacked, own = f"from {path.name}", f"from {file.stem}{file.suffix}"
            source, notes = (text.replace(unpacked, own, 1) for text in (lens.source, lens.notes))
            lens = lens.replace(source=source, notes=notes)
            source, notes = (text.replace(unpacked, own, 1) for text in (record.source, record.notes))
            record = replace(record, source=source, notes=notes)
    text = format_lens(lens)
    # what every command will read has to be readable
    lens_from_table(tomllib.loads(text), f"{file.label} in Flarewright's format", folder=lenses_folder())
    return text, record if reading.maker is None else replace(record, maker=reading.maker)


def _with_own_pictures(lens: Lens) -> Lens:
    """Copy the pictures of a lens to the library, and let the lens name the copies."""
    if lens.iris.mask is not None:
        # a lens file can name any file: only pictures are copied
        read_mask(lens.iris.mask)
        lens = lens.replace(iris=lens.iris.replace(mask=_own_picture(lens.iris.mask)))
    rows = []
    for row in lens.rows:
        figure = row.figure if isinstance(row, Surface) else None
        if figure is not None and figure.image is not None:
            rows.append(row.replace(figure=figure.replace(image=_own_picture(figure.image))))
        else:
            rows.append(row)
    return lens.replace(rows=tuple(rows))


def _own_picture(path: str) -> str:
    """Return the path of the copy of a picture, from the folder of the lenses."""
    digest = digest_of(path)
    if digest is None:
        raise LensError(f"the picture {shown(path)} cannot be read: check the path in the lens file")
    suffix = Path(path).suffix.lower()
    name = digest[:_PICTURE_DIGITS] + (suffix if suffix[1:].isalnum() and len(suffix) < 9 else "")
    target = library_folder() / "images" / name
    if not target.exists():
        write_atomically(target, partial(copyfile, path))
    return f"../images/{name}"


class _Names:
    """Names and digests of the library, current while other processes add to it."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._changes = -1
        self._by_digest: dict[str, str] = {}
        self._keys: set[str] = set()
        with library_lock(folder) as lock:
            self._refresh(lock, read_index().entries)

    def name_of(self, digest: str) -> str | None:
        """Return the name of the lens that was made of a file with this digest, as known now; None if there is none."""
        name = self._by_digest.get(digest)
        return name if name is not None and (lenses_folder() / f"{name}.toml").exists() else None

    def put(self, text: str, record: LensRecord, wanted: str, *, exact: bool) -> tuple[LensRecord | None, str]:
        """Write a lens under a name that is free.

        Returns
        -------
        record : LensRecord or None
            None: another process has added the same file meanwhile.
        said : str
            A remark on the name, or the name of that lens.
        """
        base = spoken(wanted)
        with library_lock(self._folder) as lock:
            if lock.seek(0, os.SEEK_END) != self._changes:
                self._refresh(lock, {})
            while True:
                if (there := self.name_of(record.digest)) is not None:
                    return None, there
                if exact and key_of(base) in self._keys:
                    raise ProjectError(f"the name {base} is taken: choose another --name")
                named = replace(record, name=unused_name(wanted, self._keys))
                path = lenses_folder() / f"{named.name}.toml"
                try:
                    write_text_atomically(path, with_record(text, named), newline="\n", replace=False)
                except FileExistsError:
                    # copied there by hand meanwhile
                    self._keys.add(key_of(named.name))
                    continue
                lock.write(b"+")
                break
            self._changes = lock.seek(0, os.SEEK_END)
            self._note(named)
        if named.name != base and key_of(base) in map(key_of, library_names()):
            return named, f"{base} is the name of a shipped lens; {record.file} is added as {named.name}"
        return named, ""

    def _refresh(self, lock: IO[bytes], entries: dict[str, Entry]) -> None:
        """Read the records of all lenses that are not known yet."""
        self._changes = lock.seek(0, os.SEEK_END)
        files = own_lenses()
        known = set(self._by_digest.values())
        self._keys = {key_of(name) for name in (*library_names(), *files)}
        for name, path in files.items():
            if name not in known and (record := kept_record(name, path, entries)) is not None:
                self._note(record)

    def _note(self, record: LensRecord) -> None:
        self._keys.add(key_of(record.name))
        if record.digest:
            self._by_digest[record.digest] = record.name
