"""Ghost models, ghost tracks, corrections and replay cameras as JSON files."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import TypeVar

from ...errors import FlarewrightError
from ...model.base import Frozen
from ...model.measurement.corrections import Corrections
from ...model.measurement.ghost_model import GhostModel
from ...model.measurement.ghost_tracks import Tracks
from ...model.measurement.replay_camera import ReplayCamera
from ...sentences import summary
from ..files.atomic_write import write_text_atomically
from ..files.text_file import LARGEST, check_version, read_json
from ..files.type_slips import record_of

Record = TypeVar("Record", bound=Frozen)

_NEWEST = 1
# bytes; most of it are the pictures of a model's sprites
LARGEST_MODEL = 64_000_000
"""Largest size of a ghost model, bytes."""
_NUMBERS = re.compile(r"\[([-+.eE\d,\s]+)\]")


def _read(path: str | Path, what: str, record: type[Record], largest: int = LARGEST) -> Record:
    data = read_json(path, what, largest)
    if not isinstance(data, dict):
        raise FlarewrightError(f"{path} is not {what}: a JSON object was expected")
    check_version(data, _NEWEST, str(path))
    found, problems = record_of(record.model_validate, data)
    if found is None:
        raise FlarewrightError(summary(str(path), problems), tuple(problems))
    return found


def read_ghost_model(path: str | Path) -> GhostModel:
    """Read a measured flare.

    Raises
    ------
    FlarewrightError
        When the file cannot be read, is not JSON, or is no ghost model; the message is one sentence.
    """
    return _read(path, "a ghost model", GhostModel, LARGEST_MODEL)


def read_replay_camera(path: str | Path) -> ReplayCamera:
    """Read the camera of `measure replay --camera`; raises as `read_ghost_model`."""
    return _read(path, "a replay camera", ReplayCamera)


def read_corrections(path: str | Path) -> Corrections:
    """Read the user's corrections of the ghost search; raises as `read_ghost_model`."""
    return _read(path, "corrections of found ghosts", Corrections)


def write_ghost_model(path: str | Path, model: GhostModel) -> None:
    """Write a measured flare as JSON, atomically.

    Raises
    ------
    OutputError
        When the file cannot be written.
    """
    _write(path, model)


def write_ghost_tracks(path: str | Path, tracks: Tracks) -> None:
    """Write ghost tracks as JSON, atomically; raises as `write_ghost_model`."""
    _write(path, tracks)


def read_ghost_tracks(path: str | Path) -> Tracks:
    """Read ghost tracks; raises as `read_ghost_model`."""
    return _read(path, "tracks of ghosts", Tracks)


def _write(path: str | Path, record: Frozen) -> None:
    text = json.dumps(record.model_dump(mode="json", exclude_none=True), indent=1)
    # arrays of numbers on one line each
    text = _NUMBERS.sub(lambda found: f"[{', '.join(found[1].replace(',', ' ').split())}]", text)

    write_text_atomically(path, text + "\n")
