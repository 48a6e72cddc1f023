"""Write one item of a data set, unless it is there already."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...errors import FileError, FlarewrightError, OutputError
from ...io.files.atomic_write import make_folder, write_bytes_atomically
from ...io.files.tar_members import members, tar_member
from ...io.files.text_file import read_bytes
from ...jobs.worker import WRITING
from ...model.project.dataset import DatasetSpec
from .draw import drawn_lens, splits_of
from .layout import item_files, key_of, name_of, read_record
from .pictures import draw_pictures

# a fragment of a tar file has the pictures of an item
_LARGEST_FRAGMENT = 2_000_000_000


@dataclass(frozen=True)
class DatasetPlan:
    """What all items of a data set share; with the number of an item it determines the bytes of its files.

    Attributes
    ----------
    spec : DatasetSpec
    folder : str
    backgrounds : tuple of str
    digest : str
        Of the specification, its lenses and backgrounds, and the version.
    """

    spec: DatasetSpec
    folder: str
    backgrounds: tuple[str, ...]
    digest: str

    @property
    def staging(self) -> Path:
        """Folder of the items of unfinished tar files."""
        return Path(self.folder) / ".items"


@dataclass(frozen=True)
class ItemResult:
    """What became of an item.

    Attributes
    ----------
    index : int
    split : str
    drawn : bool
        False: it was there already, made by the same specification and version.
    """

    index: int
    split: str
    drawn: bool


def write_item(plan: DatasetPlan, index: int, threads: int | None = None) -> ItemResult:
    """Draw and write an item, unless it is there already.

    Parameters
    ----------
    plan : DatasetPlan
    index : int
    threads : int, optional
        None: all cores. The bytes do not depend on it.

    Raises
    ------
    FlarewrightError
        The item cannot be drawn or written; the sentence names it.
    """
    spec = plan.spec
    split = splits_of(spec)[drawn_lens(spec, index)]
    if item_record(plan, index, split) is not None:
        return ItemResult(index, split, False)
    try:
        files, record = item_files(spec, draw_pictures(spec, index, plan.backgrounds, threads), plan.digest)
    except OutputError:
        raise
    except FlarewrightError as error:
        raise type(error)(f"item {index}: {error}", error.problems) from None
    if spec.layout == "webdataset":
        files[name_of(spec, split, index, "parameters")] = record
        _write(fragment(plan, index), b"".join(tar_member(name, data) for name, data in files.items()))
        return ItemResult(index, split, True)
    for name, data in files.items():
        _write(Path(plan.folder) / name, data)
    # last, because it states that the item is complete
    _write(Path(plan.folder) / name_of(spec, split, index, "parameters"), record)
    return ItemResult(index, split, True)


def fragment(plan: DatasetPlan, index: int) -> Path:
    """Return the file of an item of an unfinished tar file."""
    return plan.staging / f"{key_of(index)}.part"


def item_record(plan: DatasetPlan, index: int, split: str) -> bytes | None:
    """Return the record of a finished item, or None.

    Returns
    -------
    bytes or None
        None as well for a damaged item: one of another specification, or with a file that is missing or has another
        size.
    """
    if plan.spec.layout == "webdataset":
        return _fragment_record(plan, index)
    folder = Path(plan.folder)
    line = _read(folder / name_of(plan.spec, split, index, "parameters"))
    if (record := _own_record(plan, line)) is None:
        return None
    return line if all(_has_size(folder, about) for about in record["files"].values()) else None


def _fragment_record(plan: DatasetPlan, index: int) -> bytes | None:
    data = _read(fragment(plan, index))
    if data is None:
        return None
    try:
        found = dict(members(data))
    except ValueError:
        return None
    line = found.pop(name_of(plan.spec, "", index, "parameters"), None)
    if (record := _own_record(plan, line)) is None:
        return None
    sizes = {about["file"]: about["bytes"] for about in record["files"].values()}
    return line if {name: len(content) for name, content in found.items()} == sizes else None


def _own_record(plan: DatasetPlan, line: bytes | None) -> dict[str, Any] | None:
    """Return the record in a line; None without one, or for an item of another specification."""
    record = None if line is None else read_record(line)
    return record if record is not None and record.get("digest") == plan.digest else None


def _read(path: Path) -> bytes | None:
    try:
        return read_bytes(path, "an item", _LARGEST_FRAGMENT)
    except FileError:
        return None


def _has_size(folder: Path, about: dict[str, Any]) -> bool:
    try:
        return bool((folder / about["file"]).stat().st_size == about["bytes"])
    except OSError:
        return False


def _write(path: Path, data: bytes) -> None:
    """Write a file, atomically; see `jobs.worker.WRITING`."""
    make_folder(path.parent)
    with WRITING:
        write_bytes_atomically(path, data)
