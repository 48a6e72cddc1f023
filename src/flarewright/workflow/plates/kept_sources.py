"""The file with the sources of a plate's finished frames, from which an interrupted search resumes."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import FileError, FlarewrightError
from ...io.files.atomic_write import write_atomically
from ...io.files.door import outside_arrays
from ...io.render_state.damaged_archive import is_rest_of_archive
from ...typing import Floats, Report

_PARTS = ("made_of", "counts", "sources")
_NAME = re.compile(rb"made_of\.npy")


def read_sources(path: Path, announce: Report) -> dict[str, Floats]:
    """Read what `write_sources` wrote.

    Parameters
    ----------
    path : Path
    announce : callable
        Called with a sentence if the file is damaged.

    Returns
    -------
    dict of str to ndarray, shape (N, 10)
        `plates.detection.Sources.table` by the digest of what determines it; empty without a file, or if it is damaged.

    Raises
    ------
    FlarewrightError
        The file is of another program, which new sources would replace.
    """
    if not path.exists():
        return {}
    found: dict[str, Floats] | None = None
    try:
        with outside_arrays(path, "the sources of a plate", "delete it") as arrays:
            ours = set(_PARTS) <= set(arrays.files)
            if ours:
                found = _by_digest(*(arrays[name] for name in _PARTS))
    except FileError:
        ours = path.is_file() and is_rest_of_archive(path, _NAME)
    if not ours:
        raise FlarewrightError(f"{path} is no file of sources of a plate; move it, or choose another output name")
    if found is None:
        announce(f"{path} is damaged; its frames are searched again")
    return found or {}


def _by_digest(names: NDArray[Any], counts: NDArray[Any], tables: NDArray[Any]) -> dict[str, Floats] | None:
    """Return the tables by their digests; None if the arrays do not fit together."""
    whole = (
        names.ndim == counts.ndim == 1
        and len(names) == len(counts) > 0
        and counts.dtype.kind == "i"
        and names.dtype.kind == "U"
        and tables.ndim == 2
        and tables.shape == (counts.sum(), 10)
        and tables.dtype == np.float64
        and (counts >= 0).all()
        and np.isfinite(tables).all()
    )
    if not whole:
        return None
    return dict(zip((str(name) for name in names), np.split(tables, np.cumsum(counts)[:-1]), strict=True))


def write_sources(path: Path, found: Mapping[str, Floats]) -> None:
    """Write the sources of frames atomically.

    Parameters
    ----------
    path : Path
    found : mapping of str to ndarray, shape (N, 10)
        As from `read_sources`.

    Raises
    ------
    OutputError
        The file cannot be written.
    """
    tables = list(found.values())
    arrays = (
        np.array(list(found), dtype="U64"),
        np.array([len(table) for table in tables], dtype=np.int64),
        np.concatenate(tables) if tables else np.zeros((0, 10)),
    )

    def write(temporary: Path) -> None:
        np.savez(temporary, **dict(zip(_PARTS, arrays, strict=True)))  # type: ignore[arg-type]

    write_atomically(path, write)
