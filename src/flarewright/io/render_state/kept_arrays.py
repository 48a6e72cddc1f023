"""Arrays of an unfinished computation in a file: an `.npz` with the digest of what determines them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..files.atomic_write import write_atomically
from ..files.door import outside_arrays

Arrays = dict[str, NDArray[Any]]

_ABOUT = "about"


def write_arrays(path: Path, digest: str, arrays: Mapping[str, NDArray[Any]], **facts: int) -> None:
    """Write arrays atomically.

    Parameters
    ----------
    path : Path
        Ends in `.npz`.
    digest : str
        Of everything that determines the arrays.
    arrays : mapping of str to ndarray
        By any name but "about".
    **facts : int
        Numbers about them.

    Raises
    ------
    OutputError
        When the file cannot be written.
    """
    about = json.dumps({"digest": digest, **facts})

    def write(temporary: Path) -> None:
        # a file object keeps NumPy from adding its own suffix
        with temporary.open("wb") as file:
            np.savez(file, **{_ABOUT: np.array(about), **arrays})  # type: ignore[arg-type]

    write_atomically(path, write)


def digest_in(path: Path, what: str, remedy: str) -> str:
    """Return the digest of a file; parameters and errors as of `read_arrays`."""
    with outside_arrays(path, what, remedy) as archive:
        return str(json.loads(str(archive[_ABOUT]))["digest"])


def read_arrays(path: Path, what: str, remedy: str) -> tuple[dict[str, Any], Arrays]:
    """Read what `write_arrays` wrote.

    Parameters
    ----------
    path : Path
    what, remedy : str
        For the message about a damaged file, as of `io.files.door.outside`.

    Returns
    -------
    about : dict
        "digest", and the facts.
    arrays : dict of str to ndarray

    Raises
    ------
    FileError
        When the file is missing or damaged.
    """
    with outside_arrays(path, what, remedy) as archive:
        about = json.loads(str(archive[_ABOUT]))
        return {**about, "digest": str(about["digest"])}, {
            name: archive[name] for name in archive.files if name != _ABOUT
        }
