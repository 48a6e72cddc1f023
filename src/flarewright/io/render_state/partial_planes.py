"""Planes of an unfinished picture in a file: an `.npz` of arrays, and how many steps they hold."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...typing import Floats, Pixels
from ..files.atomic_write import write_atomically
from ..files.door import outside_arrays

Planes = list[Pixels | Floats | None]

_WHAT, _REMEDY = "part of a picture", "it is drawn again"


def write_planes(path: Path, digest: str, steps: int, planes: Sequence[Pixels | Floats | None]) -> None:
    """Write planes atomically.

    Parameters
    ----------
    path : Path
        Ends in `.npz`.
    digest : str
        Of everything that determines the planes.
    steps : int
        How many steps of the work they hold.
    planes : sequence of ndarray or None

    Raises
    ------
    OutputError
        When the file cannot be written.
    """
    about = json.dumps({"digest": digest, "steps": steps, "planes": len(planes)})
    arrays: dict[str, Any] = {f"plane.{k}": plane for k, plane in enumerate(planes) if plane is not None}

    def write(temporary: Path) -> None:
        # a file object keeps NumPy from adding its own suffix
        with temporary.open("wb") as file:
            np.savez(file, about=np.array(about), **arrays)

    write_atomically(path, write)


def digest_in(path: Path) -> str:
    """Return the digest of a file.

    Raises
    ------
    FileError
        When the file is damaged.
    """
    with outside_arrays(path, _WHAT, _REMEDY) as archive:
        return str(json.loads(str(archive["about"]))["digest"])


def read_planes(path: Path) -> tuple[int, Planes]:
    """Read what `write_planes` wrote.

    Returns
    -------
    steps : int
    planes : list of ndarray or None

    Raises
    ------
    FileError
        When the file is damaged.
    """
    with outside_arrays(path, _WHAT, _REMEDY) as archive:
        about = json.loads(str(archive["about"]))
        names = [f"plane.{k}" for k in range(about["planes"])]
        planes: Planes = [archive[name] if name in archive.files else None for name in names]
        return int(about["steps"]), planes
