"""Draw a data set of training pairs: a list of items that do not depend on each other."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..._version import __version__
from ...errors import FileError, OutputError, ProjectError
from ...io.files.atomic_write import write_atomically, write_bytes_atomically, write_text_atomically
from ...io.files.tar_members import join_parts
from ...io.files.text_file import digest_of, read_bytes, read_json
from ...io.project.dataset_file import contradictions, read_dataset_spec
from ...io.project.named_files import picture_files
from ...jobs.cluster.executor import open_cluster, workers_of
from ...jobs.frame_list import chunk_of, parse_chunk
from ...jobs.processes import fitting, shares, work_off
from ...model import Project
from ...model.project.dataset import SPLITS, DatasetSpec
from ...render.scene.resolve import open_lens
from .background import list_backgrounds
from .draw import check_lenses, draw_item, drawn_lens, splits_of
from .item import DatasetPlan, ItemResult, fragment, item_record
from .layout import read_record

if TYPE_CHECKING:
    from os import PathLike

_WRITE = "flarewright.workflow.training_pairs.item:write_item"
MOST_ITEMS = 10_000_000
# part of every digest; raised by a change of the pixels or files of items within a version
_DRAWN_AS = 2
# memory of a process: that of a tiny picture, and some 40 pictures while one item is drawn and written
_PROCESS_BYTES, _PIXEL_BYTES = 350_000_000, 480
_LARGEST_RECORDS = 2_000_000_000
# items whose kernels are compiled before processes start
_COMPILED = 6


@dataclass(frozen=True)
class DatasetResult:
    """What became of a data set.

    Attributes
    ----------
    folder : str
    items : int
        Of the whole data set.
    drawn, kept : int
        Of this call.
    splits : dict of str to int
        Items of this call by split.
    lenses : dict of str to str
        The split of each lens.
    complete : bool
        Whether all items are there and the manifest is written.
    processes : int
    remarks : tuple of str
    """

    folder: str
    items: int
    drawn: int
    kept: int
    splits: dict[str, int]
    lenses: dict[str, str]
    complete: bool
    processes: int
    remarks: tuple[str, ...]


def dataset(
    spec: DatasetSpec | str | PathLike[str],
    output: str | PathLike[str],
    *,
    items: int = 100,
    chunk: str | None = None,
    processes: int | None = None,
    threads: int | None = None,
    report: Callable[[ItemResult, int, int], None] | None = None,
    prepare: Callable[[Project, int], None] | None = None,
    cluster: str | None = None,
    announce: Callable[[str], None] | None = None,
) -> DatasetResult:
    """Draw training pairs: pictures with and without flare, their layers, masks and parameters.

    Items that the same specification and version have made are kept, so that a repeated call resumes, and a larger
    number of items adds to the set. The bytes of an item depend on the specification and its number alone.

    Parameters
    ----------
    spec : DatasetSpec or path
        A specification, or its TOML file (`flarewright.read_dataset_spec`).
    output : path
        Folder of the data set; it is made if it does not exist.
    items : int
        Number of items.
    chunk : str, optional
        "2/5": draw only the second of five parts.
    processes : int, optional
        None: one a core, as the memory allows.
    threads : int, optional
        Threads of all processes together; None: the cores.
    report : callable, optional
        Called after each item with its result, the number of finished items and the number of all.
    prepare : callable, optional
        Called with projects and the number of threads before processes start: the command line compiles kernels here.
    cluster : str, optional
        Workers of a Dask cluster draw: "local:4", "tcp://HOST:PORT" or "slurm:FILE" (docs/many-machines.md). None:
        processes of this machine.
    announce : callable, optional
        Called with sentences about the cluster as they arise.

    Raises
    ------
    FlarewrightError
        The specification, a lens or a background cannot be used, the folder holds something else, a file cannot be
        written, a process was lost, or there is no such cluster.
    MemoryError
        There is too little memory for an item.

    Examples
    --------
    >>> from flarewright import dataset
    >>> dataset("pairs.toml", "pairs", items=1000).complete                             # doctest: +SKIP
    True
    """
    processes = workers_of(cluster, processes, threads)
    plan = plan_of(spec, output)
    if not 1 <= items <= MOST_ITEMS:
        raise ProjectError(f"{items} items are not possible; give 1 to {MOST_ITEMS}")
    settings = plan.spec
    mine: Sequence[int] = range(items)
    units: Sequence[range] = _units(settings, items)
    if chunk is not None:
        # tar files are units: two machines must not write one
        units = chunk_of(units, *parse_chunk(chunk))
        mine = [index for unit in units for index in unit]
    _claim(plan, items)
    if not mine:
        return _result(plan, items, [], 0, [f"chunk {chunk} of {items} items is empty"])
    packed = [unit for unit in units if settings.layout == "webdataset" and _is_packed(plan, unit)]
    for complete in packed:
        # of a run that was killed between the two
        _remove_fragments(plan, complete)
    done = [ItemResult(index, _split(settings, index), False) for unit in packed for index in unit]
    ready = {one.index for one in done}
    todo = [index for index in mine if index not in ready]
    width, height = settings.size_px
    fit = fitting(_PROCESS_BYTES + width * height * _PIXEL_BYTES, threads)
    number, each = shares(len(todo), processes or fit, threads)
    open_units = {index: unit for unit in units for index in unit} if settings.layout == "webdataset" else {}
    missing = {id(unit): len(unit) for unit in units}
    with open_cluster(cluster if todo else None, plan.folder, announce) as executor:
        # other machines have their own compiled kernels
        if prepare is not None and todo and (executor is None or executor.local):
            for index in todo[:: max(1, len(todo) // _COMPILED)][:_COMPILED]:
                prepare(draw_item(settings, index).project, number * each)
        for one in work_off(_WRITE, plan, todo, processes=number, threads=each, what="item", executor=executor):
            done.append(one.result)
            if (unit := open_units.get(one.item)) is not None:
                missing[id(unit)] -= 1
                if missing[id(unit)] == 0:
                    _pack(plan, unit)
            if report is not None:
                report(one.result, len(done), len(mine))
        if executor is not None:
            number = executor.workers
    remarks = []
    if (many := _write_manifest(plan, items)) > 0:
        remarks.append(f"{many} of {items} items are not drawn yet; the manifest is written when all are")
    else:
        # no process writes an item of a complete data set; the folder is not empty while another machine packs one
        with suppress(OSError):
            plan.staging.rmdir()
    return _result(plan, items, done, number if todo else 0, remarks, complete=many == 0)


def plan_of(spec: DatasetSpec | str | PathLike[str], output: str | PathLike[str]) -> DatasetPlan:
    """Return what all items share; raises an error now for lenses and backgrounds that cannot be used."""
    settings = spec if isinstance(spec, DatasetSpec) else read_dataset_spec(spec)
    # of a record made in Python; a file's are found by its reader
    if problems := contradictions(settings):
        raise ProjectError(problems[0], tuple(problems))
    check_lenses(settings)
    backgrounds = list_backgrounds(settings)
    return DatasetPlan(settings, os.fspath(output), backgrounds, dataset_digest(settings, backgrounds))


def dataset_digest(spec: DatasetSpec, backgrounds: Sequence[str]) -> str:
    """Return a digest of all that determines the items: program, specification, lenses, backgrounds."""
    folder = Path(spec.background.folder or ".")
    lenses: dict[str, str] = {}
    images: set[str] = set()
    for name in spec.lens.names.choice:
        lens = open_lens(name).lens
        lenses[name] = sha256(lens.model_dump_json().encode()).hexdigest()
        images.update(picture_files(lens))
    coatings = [text for text in spec.lens.coating.choice if text.lower().endswith(".toml")]
    made_of = {
        "version": __version__,
        "drawn_as": _DRAWN_AS,
        # the place of the backgrounds does not matter
        "spec": spec.model_dump(mode="json", exclude={"background": {"folder"}}),
        "lenses": lenses,
        "files": {name: digest_of(name) for name in sorted({*images, *coatings})},
        "backgrounds": [[name, (folder / name).stat().st_size] for name in backgrounds],
    }
    return sha256(json.dumps(made_of, sort_keys=True).encode()).hexdigest()


def _split(spec: DatasetSpec, index: int) -> str:
    return splits_of(spec)[drawn_lens(spec, index)]


def _units(spec: DatasetSpec, items: int) -> list[range]:
    """Return the items of each tar file, or single items."""
    step = spec.items_per_shard if spec.layout == "webdataset" else 1
    return [range(first, min(first + step, items)) for first in range(0, items, step)]


def _claim(plan: DatasetPlan, items: int) -> None:
    """Make the folder, or check that it holds a part of the same data set; record what it holds."""
    folder = Path(plan.folder)
    about = folder / "dataset.json"
    if folder.exists() and not folder.is_dir():
        raise OutputError(f"cannot write {folder}: it is a file; give the name of a folder")
    if not folder.parent.is_dir():
        raise OutputError(f"cannot write {folder}: the folder {folder.parent} does not exist; create it first")
    # another machine may be writing the description now; its unfinished file is hidden
    if folder.exists() and any(not path.name.startswith(".") for path in folder.iterdir()):
        held = _held(about)
        if held is None:
            raise OutputError(f"{folder} holds other files; give a new or empty folder for the data set")
        if held.get("digest") != plan.digest:
            why = "" if held.get("version") == __version__ else f", by version {held.get('version')}"
            if not why and held.get("drawn_as") != _DRAWN_AS:
                why = ", or by another build of this version"
            raise OutputError(
                f"{folder} holds a data set of another specification{why}; give another folder, or remove that one"
            )
        if isinstance(count := held.get("items"), int) and count > items:
            raise OutputError(f"{folder} holds a data set of {count} items; give -n {count} or more, or another folder")
    else:
        with suppress(FileExistsError):
            try:
                folder.mkdir()
            except FileExistsError:
                raise
            except (OSError, ValueError) as error:
                # a name with a zero byte is a ValueError
                reason = (getattr(error, "strerror", None) or str(error)).lower()
                raise OutputError(f"cannot make the folder {folder} ({reason}): choose another place") from None
    spec = plan.spec
    data = {
        "schema_version": 1, "version": __version__, "drawn_as": _DRAWN_AS, "digest": plan.digest, "items": items,
        "layout": spec.layout,
        "splits": splits_of(spec), "spec": spec.model_dump(mode="json"),
    }  # fmt: skip
    text = json.dumps(data, indent=2) + "\n"
    write_text_atomically(about, text)


def _held(about: Path) -> dict[str, Any] | None:
    """Return the description in a data set's folder, or None if it is no data set."""
    try:
        data = read_json(about, "the description of a data set")
    except FileError:
        return None
    return data if isinstance(data, dict) and "digest" in data else None


# ---------------------------------------------------------------------------------------------------------------------
# Tar files


def _shard(plan: DatasetPlan, unit: range, split: str, suffix: str) -> Path:
    number = unit.start // plan.spec.items_per_shard
    return Path(plan.folder) / f"{split}-{number:06d}.{suffix}"


def _by_split(spec: DatasetSpec, unit: range) -> dict[str, list[int]]:
    """Return the items of a tar file by split, without empty splits."""
    found: dict[str, list[int]] = {split: [] for split in SPLITS}
    for index in unit:
        found[_split(spec, index)].append(index)
    return {split: indices for split, indices in found.items() if indices}


def _is_packed(plan: DatasetPlan, unit: range) -> bool:
    """Return whether the tar files of these items are complete; they were written after their records."""
    for split, indices in _by_split(plan.spec, unit).items():
        records = list(_records(_shard(plan, unit, split, "jsonl")))
        if [record.get("index") for _, record in records] != indices:
            return False
        if any(record.get("digest") != plan.digest for _, record in records):
            return False
        size = _tar_bytes(records)
        path = _shard(plan, unit, split, "tar")
        if not path.is_file() or path.stat().st_size != size:
            return False
    return True


def _tar_bytes(records: Sequence[tuple[bytes, dict[str, Any]]]) -> int:
    """Return the size of the tar file of some records: a header and whole blocks for each member, and the end."""
    total = 1024
    for line, record in records:
        for size in (*(about["bytes"] for about in record["files"].values()), len(line)):
            total += 512 + -(-size // 512) * 512
    return total


def _pack(plan: DatasetPlan, unit: range) -> None:
    """Join the finished items of a tar file, and remove them."""
    for split, indices in _by_split(plan.spec, unit).items():
        lines = [item_record(plan, index, split) for index in indices]
        kept = b"".join(line for line in lines if line is not None)
        write_bytes_atomically(_shard(plan, unit, split, "jsonl"), kept)
        join_parts(_shard(plan, unit, split, "tar"), [fragment(plan, index) for index in indices])
    _remove_fragments(plan, unit)


def _remove_fragments(plan: DatasetPlan, unit: range) -> None:
    """Remove the items of a complete tar file; their folder stays, because other processes write into it."""
    for index in unit:
        fragment(plan, index).unlink(missing_ok=True)


def _records(path: Path) -> Iterator[tuple[bytes, dict[str, Any]]]:
    """Yield the lines of a file of records that can be read."""
    try:
        data = read_bytes(path, "the records of a tar file", _LARGEST_RECORDS)
    except FileError:
        return
    for line in data.splitlines(keepends=True):
        if (record := read_record(line)) is not None:
            yield line, record


# ---------------------------------------------------------------------------------------------------------------------
# Manifest


def _write_manifest(plan: DatasetPlan, items: int) -> int:
    """Write the records of all items in their order, or return how many are missing."""
    missing = 0

    def write(temporary: Path) -> None:
        nonlocal missing
        with temporary.open("wb") as file:
            for line in _all_records(plan, items):
                if line is None:
                    missing += 1
                else:
                    file.write(line)
        if missing:
            raise _IncompleteError

    with suppress(_IncompleteError):
        write_atomically(Path(plan.folder) / "manifest.jsonl", write)
    return missing


class _IncompleteError(Exception):
    """Items are missing; the manifest is not written."""


def _all_records(plan: DatasetPlan, items: int) -> Iterator[bytes | None]:
    spec = plan.spec
    if spec.layout != "webdataset":
        for index in range(items):
            yield item_record(plan, index, _split(spec, index))
        return
    for unit in _units(spec, items):
        lines = {
            record.get("index"): line
            for split in SPLITS
            for line, record in _records(_shard(plan, unit, split, "jsonl"))
            if record.get("digest") == plan.digest
        }
        yield from (lines.get(index) for index in unit)


def _result(
    plan: DatasetPlan, items: int, done: Sequence[ItemResult], processes: int, remarks: Sequence[str], *,
    complete: bool = False,
) -> DatasetResult:  # fmt: skip
    drawn = sum(one.drawn for one in done)
    return DatasetResult(
        plan.folder,
        items,
        drawn,
        len(done) - drawn,
        {split: sum(one.split == split for one in done) for split in SPLITS if any(one.split == split for one in done)},
        splits_of(plan.spec),
        complete,
        processes,
        tuple(remarks),
    )
