"""Record from which model the files of later stages were made, to detect files of an older fit."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..model.measurement.ghost_model import GhostModel

STAGES = ("find", "fit", "track", "compress")
"""Stages after merging, in order; each needs the earlier ones."""

FOUND, MODEL, TRACKS, COMPACT = "found.json", "model.json", "tracks.json", "compact.json"
# the model file that each stage reads, besides frames
SOURCES = {"fit": FOUND, "track": MODEL, "compress": MODEL}


def as_measured(model: GhostModel) -> str:
    """Return the JSON of the parts of a model that later stages depend on; the light's brightness is excluded."""
    from ..model.measurement.capture import OF_LIGHT

    dark = model.model_copy(update={"reference": model.reference.replace(**dict.fromkeys(OF_LIGHT))})
    return dark.model_dump_json(exclude={"reference": {"clipping"}})


def note_source(folder: Path, stage: str, read: Callable[[str], GhostModel]) -> None:
    """Record from which model a stage's file was just made; raises as `provenance.note`.

    Parameters
    ----------
    folder : Path
    stage : str
    read : callable
        Returns the model of a file of the folder.
    """
    from ..measure.pipeline.provenance import note

    if stage in SOURCES:
        note(folder, _key(stage), _digest(read(SOURCES[stage])))


def is_of_another(folder: Path, stage: str) -> bool:
    """Return whether a stage's file was made from another model than the current one.

    Raises
    ------
    FlarewrightError
        When the current model cannot be read.
    """
    from ..io.measurement.ghost_model_file import read_ghost_model
    from ..measure.pipeline.provenance import noted

    known, source = noted(folder, _key(stage)), folder / SOURCES[stage]
    return known is not None and source.is_file() and known != _digest(read_ghost_model(source))


def _key(stage: str) -> str:
    return f"{stage} was made from"


def _digest(model: GhostModel) -> str:
    """Return a digest of a model's ghosts, halo and star, without the residual, which is optional."""
    return hashlib.sha256(as_measured(model.replace(sprites=())).encode()).hexdigest()
