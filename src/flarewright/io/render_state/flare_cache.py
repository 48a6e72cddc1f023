"""Cache file for the flare pictures of a prediction.

An `.npz` of float32 pictures, shape (H, W) or (H, W, 3), each named FINGERPRINT/CONSTELLATION/ROLL: the fingerprint of
the flare's source, and two angles in degrees.
"""

from __future__ import annotations

import io
import re
import zipfile
from pathlib import Path

import numpy as np

from ...errors import FileError, FlarewrightError
from ...typing import Pixels, Report
from ..files.atomic_write import write_atomically
from ..files.door import outside
from .damaged_archive import is_rest_of_archive

Pictures = dict[str, dict[tuple[float, float], Pixels]]

# a picture's name within the archive, by which a damaged file of ours is recognised
_NAME = re.compile(rb"/-?\d[^/]{0,30}/-?\d[^/]{0,30}\.npy")


def read_cache(path: Path, report: Report = lambda _: None) -> Pictures:
    """Read pictures that `write_cache` wrote, without those that are damaged.

    Parameters
    ----------
    path : Path
    report : callable
        Called with a sentence when pictures are damaged; they have to be drawn again.

    Returns
    -------
    dict
        By fingerprint, then by (constellation, roll).

    Raises
    ------
    FlarewrightError
        When the file cannot be opened or is of another kind.
    """
    found: Pictures = {}
    lost = 0
    try:
        with outside(path, "flares of a prediction") as file, zipfile.ZipFile(file) as archive:
            for name in archive.namelist():
                # NumPy and the libraries of archives raise many kinds of exceptions on damaged bytes
                try:
                    _keep(found, name, archive.read(name))
                except Exception:
                    lost += 1
    except FileError:
        if not path.is_file():
            raise
        lost += 1
    if lost and not found and not is_rest_of_archive(path, _NAME):
        raise FlarewrightError(f"{path} holds no flares of a prediction; delete it or give another --cache")
    if lost:
        report(f"{path} is damaged; {'some of its' if found else 'its'} pictures are drawn again")
    return found


def _keep(found: Pictures, name: str, data: bytes) -> None:
    """Put a picture of the archive in its place; raise any exception if it is none."""
    fingerprint, constellation, roll = name.removesuffix(".npy").split("/")
    picture = np.load(io.BytesIO(data), allow_pickle=False)
    if (
        picture.shape[2:] not in ((), (3,))
        or picture.ndim < 2
        or picture.dtype != np.float32
        or not np.isfinite(picture).all()
    ):
        raise ValueError(name)
    found.setdefault(fingerprint, {})[float(constellation), float(roll)] = picture


def write_cache(path: Path, pictures: Pictures) -> None:
    """Write pictures atomically.

    Parameters
    ----------
    path : Path
        Ends in `.npz`.
    pictures : dict
        By fingerprint, then by (constellation, roll).
    """
    named = {
        f"{fingerprint}/{constellation!r}/{roll!r}": picture
        for fingerprint, drawn in pictures.items()
        for (constellation, roll), picture in drawn.items()
    }

    def write(temporary: Path) -> None:
        with temporary.open("wb") as file:
            np.savez_compressed(file, **named)  # type: ignore[arg-type]

    write_atomically(path, write)
