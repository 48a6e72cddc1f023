"""Pictures of flares that were drawn for a prediction, kept in a file between runs.

An `.npz` of float32 pictures, shape (H, W), each named FINGERPRINT/CONSTELLATION/ROLL: the fingerprint of what draws it
and two angles in degrees.
"""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import FlarewrightError
from .atomic import write_atomically

Pictures = dict[str, dict[tuple[float, float], NDArray[np.float32]]]

__all__ = ["read_cache", "write_cache"]


def read_cache(path: Path) -> Pictures:
    """Read what `write_cache` wrote.

    Parameters
    ----------
    path : Path

    Returns
    -------
    dict
        By fingerprint, then by (constellation, roll).

    Raises
    ------
    FlarewrightError
        When the file is something else or damaged.
    """
    found: Pictures = {}
    try:
        with np.load(path, allow_pickle=False) as data:
            for name in data.files:
                fingerprint, constellation, roll = name.split("/")
                picture = data[name]
                if picture.ndim != 2 or picture.dtype != np.float32 or not np.isfinite(picture).all():
                    raise ValueError(name)
                found.setdefault(fingerprint, {})[float(constellation), float(roll)] = picture
    except (OSError, ValueError, EOFError, zipfile.BadZipFile, TypeError, AttributeError) as error:
        raise FlarewrightError(
            f"{path} holds no flares of a prediction, or is damaged ({type(error).__name__}); delete it or give "
            "another --cache"
        ) from None
    return found


def write_cache(path: Path, pictures: Pictures) -> None:
    """Write pictures, whole or not at all.

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
