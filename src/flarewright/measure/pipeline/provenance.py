"""Record the inputs of each stage of a run, so that a resumed run repeats only stages whose inputs have changed."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path

from pydantic import ValidationError

from ...errors import FileError, FlarewrightError
from ...io.files.atomic_write import write_text_atomically
from ...io.files.text_file import read_json
from ...model.measurement.capture import OF_LIGHT, MergedRun
from ...model.measurement.corrections import Corrections

NOTES = "stages.json"
# bytes; it can hold corrections and outlines
_LARGEST = 64_000_000
_CORRECTIONS = "corrections"
# increase when the same frames give other ghosts
_VERSION = 2


def run_digest(folder: Path, run: MergedRun, settings: Mapping[str, object]) -> str:
    """Return a digest of the merged frames and of a stage's settings.

    Parameters
    ----------
    folder : Path
        Folder of the run.
    run : MergedRun
    settings : mapping
        Values that JSON or `str` can write.

    Returns
    -------
    str
        Frames enter by size and time, not by their pixels. The luminance of the light does not enter.
    """
    digest = hashlib.sha256(json.dumps([_VERSION, dict(settings)], sort_keys=True, default=str).encode())
    digest.update(f"{run.model_dump_json(indent=1, exclude={'camera': OF_LIGHT})}\n".encode())
    for info in run.frames:
        path = folder / info.file
        stamp = path.stat() if path.is_file() else None
        digest.update(f"{info.file} {None if stamp is None else (stamp.st_size, stamp.st_mtime_ns)}".encode())
    return digest.hexdigest()


def is_current(folder: Path, stage: str, digest: str, made: Path) -> bool:
    """Return whether a stage's file exists and was made from the current inputs."""
    return made.is_file() and noted(folder, stage) == digest


def note(folder: Path, stage: str, digest: str) -> None:
    """Record the digest of a stage's inputs.

    Raises
    ------
    OutputError
        The note cannot be written.
    """
    text = json.dumps({**_read_notes(folder), stage: digest}, indent=1) + "\n"

    write_text_atomically(folder / NOTES, text)


def noted(folder: Path, key: str) -> str | None:
    """Return the recorded value of a key (a stage's digest under the stage's name), or None."""
    return _read_notes(folder).get(key)


def note_corrections(folder: Path, corrections: Corrections | None) -> None:
    """Record the user's corrections for later searches; raises as `note`."""
    note(folder, _CORRECTIONS, "" if corrections is None else corrections.model_dump_json())


def noted_corrections(folder: Path) -> Corrections | None:
    """Return the recorded corrections of a run's folder, or None.

    Raises
    ------
    FlarewrightError
        When the note is damaged.
    """
    text = noted(folder, _CORRECTIONS)
    try:
        return Corrections.model_validate_json(text) if text else None
    except ValidationError:
        raise FlarewrightError(
            f"{folder / NOTES} holds corrections that cannot be read: give them again with --corrections"
        ) from None


def _read_notes(folder: Path) -> dict[str, str]:
    try:
        data = read_json(folder / NOTES, "the notes of a run", _LARGEST)
    except FileError:
        return {}
    return {str(key): str(value) for key, value in data.items()} if isinstance(data, dict) else {}
