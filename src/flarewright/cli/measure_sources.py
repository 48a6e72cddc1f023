"""From which model the files of a run's later stages were made, so that none passes for one of a newer fit."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..model.ghost_model import GhostModel

FOUND, MODEL, TRACKS, COMPACT = "found.json", "model.json", "tracks.json", "compact.json"
# what each stage is made from, besides frames
SOURCES = {"fit": FOUND, "track": MODEL, "compress": MODEL}


def as_measured(model: GhostModel) -> str:
    """Return a model as later stages are told of it: how bright the light was is nothing to them."""
    from ..model.capture import OF_LIGHT

    dark = model.model_copy(update={"reference": model.reference.replace(**dict.fromkeys(OF_LIGHT))})
    return dark.model_dump_json(exclude={"reference": {"clipping"}})


def note_source(folder: Path, stage: str) -> None:
    """Note which model a stage's file was made from just now; raises as `notes.note`."""
    from ..measure.notes import note

    if stage in SOURCES:
        note(folder, _key(stage), _ghosts_of(folder / SOURCES[stage]))


def is_of_another(folder: Path, stage: str) -> bool:
    """Tell whether a stage's file is noted to be made from another model than the one that is there.

    Raises
    ------
    FlarewrightError
        When that one cannot be read.
    """
    from ..measure.notes import noted

    known, source = noted(folder, _key(stage)), folder / SOURCES[stage]
    return known is not None and source.is_file() and known != _ghosts_of(source)


def _key(stage: str) -> str:
    return f"{stage} was made from"


def _ghosts_of(path: Path) -> str:
    """Return a digest of a model's ghosts, halo and star; what is left beside them comes and goes."""
    from ..io.ghost_model_file import read_ghost_model

    return hashlib.sha256(as_measured(read_ghost_model(path).replace(sprites=())).encode()).hexdigest()
