"""Planes of an unfinished picture in a file: an `.npz` of arrays, and how many steps they hold."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ...typing import Floats, Pixels
from ..files.door import sentences_for
from .kept_arrays import read_arrays, write_arrays

Planes = list[Pixels | Floats | None]

WHAT, REMEDY = "part of a picture", "it is drawn again"
"""For messages about a damaged file."""


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
    arrays = {f"plane.{k}": plane for k, plane in enumerate(planes) if plane is not None}
    write_arrays(path, digest, arrays, steps=steps, planes=len(planes))


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
    about, arrays = read_arrays(path, WHAT, REMEDY)
    with sentences_for(path, WHAT, REMEDY):
        return int(about["steps"]), [arrays.get(f"plane.{k}") for k in range(about["planes"])]
