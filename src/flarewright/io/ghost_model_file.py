"""Ghost models, their tracks and replay cameras as JSON files."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any, TypeVar

from ..errors import FlarewrightError
from ..model.base import Frozen
from ..model.corrections import Corrections
from ..model.ghost_model import GhostModel
from ..model.ghost_tracks import Tracks
from ..model.replay_camera import ReplayCamera
from .atomic import write_atomically
from .sentences import summary
from .taken_for import record_of
from .text_file import LARGEST, check_version, lower_first, read_text

Record = TypeVar("Record", bound=Frozen)

_NEWEST = 1
# bytes; the pictures of a model's sprites are most of it
_LARGEST_MODEL = 64_000_000
_NUMBERS = re.compile(r"\[([-+.eE\d,\s]+)\]")


def _read(path: str | Path, what: str, record: type[Record], largest: int = LARGEST) -> Record:
    try:
        data: Any = json.loads(read_text(path, what, largest))
    except json.JSONDecodeError as error:
        raise FlarewrightError(f"{path} is not valid JSON: {lower_first(str(error))}; is it {what}?") from None
    except (ValueError, RecursionError) as error:
        raise FlarewrightError(str(error)) from None
    if not isinstance(data, dict):
        raise FlarewrightError(f"{path} is not {what}: a JSON object was expected")
    try:
        check_version(data, _NEWEST, str(path))
    except ValueError as error:
        raise FlarewrightError(str(error)) from None
    found, problems = record_of(record.model_validate, data)
    if found is None:
        raise FlarewrightError(summary(str(path), problems), tuple(problems))
    return found


def names_ghost_model(what: object) -> bool:
    """Tell whether a word in a lens' place names a measured flare: no lens is read from JSON."""
    return isinstance(what, str) and what.lower().endswith(".json") and Path(what).is_file()


def read_ghost_model(path: str | Path) -> GhostModel:
    """Read a measured flare.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    GhostModel

    Raises
    ------
    FlarewrightError
        The file cannot be read, is not JSON, or is no ghost model; the message is one sentence.
    """
    return _read(path, "a ghost model", GhostModel, _LARGEST_MODEL)


def read_replay_camera(path: str | Path) -> ReplayCamera:
    """Read the camera of `measure replay --camera`; raises as `read_ghost_model`."""
    return _read(path, "a replay camera", ReplayCamera)


def read_corrections(path: str | Path) -> Corrections:
    """Read what a person tells the search for ghosts; raises as `read_ghost_model`."""
    return _read(path, "corrections of found ghosts", Corrections)


def write_ghost_model(path: str | Path, model: GhostModel) -> None:
    """Write a measured flare as JSON, whole or not at all.

    Parameters
    ----------
    path : str or Path
    model : GhostModel

    Raises
    ------
    OutputError
        When the file cannot be written.
    """
    _write(path, model)


def write_tracks(path: str | Path, tracks: Tracks) -> None:
    """Write ghosts' tracks as JSON, whole or not at all; raises as `write_ghost_model`."""
    _write(path, tracks)


def read_tracks(path: str | Path) -> Tracks:
    """Read ghosts' tracks; raises as `read_ghost_model`."""
    return _read(path, "tracks of ghosts", Tracks)


def _write(path: str | Path, record: Frozen) -> None:
    text = json.dumps(record.model_dump(mode="json", exclude_none=True), indent=1)
    # a row of numbers is read as a row
    text = _NUMBERS.sub(lambda found: f"[{', '.join(found[1].replace(',', ' ').split())}]", text)

    def write(part: Path) -> None:
        part.write_text(text + "\n", encoding="utf-8")

    write_atomically(path, write)
