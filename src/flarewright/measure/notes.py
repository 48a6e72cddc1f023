"""What a run's stages were made from, so that a run that is taken up again repeats only what has changed."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path

from pydantic import ValidationError

from ..errors import FlarewrightError
from ..io.atomic import write_atomically
from ..model.capture import OF_LIGHT, MergedRun
from ..model.corrections import Corrections

NOTES = "stages.json"
_CORRECTIONS = "corrections"
# raise when the same frames give other ghosts
_VERSION = 1


def run_digest(folder: Path, run: MergedRun, settings: Mapping[str, object]) -> str:
    """Return a digest of merged frames and of what a stage is told about them.

    Parameters
    ----------
    folder : Path
        Of the run.
    run : MergedRun
    settings : mapping
        Anything that JSON or `str` can write.

    Returns
    -------
    str
        Frames are told apart by size and time, not by their pixels; how bright the light was changes nothing.
    """
    digest = hashlib.sha256(json.dumps([_VERSION, dict(settings)], sort_keys=True, default=str).encode())
    digest.update(f"{run.model_dump_json(indent=1, exclude={'camera': OF_LIGHT})}\n".encode())
    for info in run.frames:
        path = folder / info.file
        stamp = path.stat() if path.is_file() else None
        digest.update(f"{info.file} {None if stamp is None else (stamp.st_size, stamp.st_mtime_ns)}".encode())
    return digest.hexdigest()


def is_current(folder: Path, stage: str, digest: str, made: Path) -> bool:
    """Tell whether a stage's file is there and was made from what it would be made from now."""
    return made.is_file() and noted(folder, stage) == digest


def note(folder: Path, stage: str, digest: str) -> None:
    """Note what a stage was made from.

    Raises
    ------
    OutputError
        The note cannot be written.
    """
    text = json.dumps({**_noted(folder), stage: digest}, indent=1) + "\n"

    def write(temporary: Path) -> None:
        temporary.write_text(text, "utf-8")

    write_atomically(folder / NOTES, write)


def noted(folder: Path, key: str) -> str | None:
    """Return what is noted under a key, as what a stage was made from under the stage's name; None: nothing."""
    return _noted(folder).get(key)


def note_corrections(folder: Path, corrections: Corrections | None) -> None:
    """Note what a person told the search, so that it is told again; raises as `note`."""
    note(folder, _CORRECTIONS, "" if corrections is None else corrections.model_dump_json())


def noted_corrections(folder: Path) -> Corrections | None:
    """Return what a person has told the search in a run's folder, None when nothing.

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
            f"{folder / NOTES} tells corrections that cannot be read: give them again with --corrections"
        ) from None


def _noted(folder: Path) -> dict[str, str]:
    try:
        data = json.loads((folder / NOTES).read_text("utf-8"))
    except (OSError, ValueError):
        return {}
    return {str(key): str(value) for key, value in data.items()} if isinstance(data, dict) else {}
