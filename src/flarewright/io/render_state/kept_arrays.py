"""Arrays of an unfinished computation in a file: an `.npz` with the digest of what determines them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..files.atomic_write import write_atomically
from ..files.door import outside_arrays

_DIGEST = "digest"


def write_arrays(path: Path, digest: str, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write arrays atomically.

    Parameters
    ----------
    path : Path
        Ends in `.npz`.
    digest : str
        Of everything that determines the arrays.
    arrays : mapping of str to ndarray
        By any name but "digest".

    Raises
    ------
    OutputError
        When the file cannot be written.
    """

    def write(temporary: Path) -> None:
        # a file object keeps NumPy from adding its own suffix
        with temporary.open("wb") as file:
            np.savez(file, **{_DIGEST: np.array(digest), **arrays})  # type: ignore[arg-type]

    write_atomically(path, write)


def read_arrays(path: Path, what: str, remedy: str) -> tuple[str, dict[str, NDArray[Any]]]:
    """Read what `write_arrays` wrote.

    Parameters
    ----------
    path : Path
    what, remedy : str
        For the message about a damaged file, as of `io.files.door.outside`.

    Returns
    -------
    digest : str
    arrays : dict of str to ndarray

    Raises
    ------
    FileError
        When the file is missing or damaged.
    """
    with outside_arrays(path, what, remedy) as archive:
        arrays = {name: archive[name] for name in archive.files}
        return str(arrays.pop(_DIGEST)), arrays
