"""Reader of the `.lens` text table that several flare tools share."""

from __future__ import annotations

from pathlib import Path

from flarewright.errors import LensError
from flarewright.model.raw_lens import RawLens


def read_dotlens(path: str | Path) -> RawLens:
    """Read a `.lens` file as it stands; filled in by the importer."""
    raise LensError(f"{path}: .lens files cannot be read yet")
