"""Thumbnails of the user's library: drafts, rendered one by one, each kept as soon as it is ready."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ...errors import FileError, FlarewrightError, OutputError
from ...io.files.atomic_write import write_atomically
from ...io.files.door import sentences_for
from ...io.files.text_file import read_bytes
from ...io.images.thumbnails import SIZE_PX
from ...io.lens.library import lens_path, library_names
from ...io.lens.own.folder import key_of, own_lenses, thumbnail_file, writable_folder
from ...render.gallery import card_project, lens_card
from ...render.image.display import layers_exposure, view
from ...render.render import render
from ...typing import Progress

_QUALITY = 85
_GREY = 72


def missing_thumbnails() -> Iterator[str]:
    """Yield the names of the user's lenses that have no thumbnail, or one that is older than the lens."""
    shipped = {key_of(name) for name in library_names()}
    for name, path in own_lenses().items():
        if key_of(name) in shipped:
            # its name is that of another lens
            continue
        picture = thumbnail_file(name)
        try:
            if not picture.exists() or picture.stat().st_mtime_ns < path.stat().st_mtime_ns:
                yield name
        except OSError:
            # removed meanwhile
            continue


def make_thumbnails(
    progress: Progress | None = None, wanted: Sequence[str] | None = None
) -> tuple[int, tuple[tuple[str, str], ...]]:
    """Render the missing thumbnails; a lens that cannot be drawn gets a grey one, so that it is not tried again.

    Parameters
    ----------
    progress : callable, optional
    wanted : sequence of str, optional
        Names of lenses, in this order; None: all.

    Returns
    -------
    made : int
    failed : tuple of (str, str)
        Lenses that cannot be drawn, with the reason.

    Raises
    ------
    OutputError
        The library cannot be written.
    """
    missing, made = list(missing_thumbnails()), 0
    names = missing if wanted is None else [name for name in wanted if name in missing]
    failed: list[tuple[str, str]] = []
    for k, name in enumerate(names):
        if progress is not None:
            progress(k / len(names), name)
        try:
            _make_thumbnail(name)
            made += 1
        except OutputError:
            raise
        except FlarewrightError as error:
            failed.append((name, str(error)))
            _write(name, np.full((SIZE_PX[1], SIZE_PX[0], 3), _GREY, np.uint8))
    return made, tuple(failed)


def read_thumbnail(name: str) -> bytes | None:
    """Return the thumbnail of one of the user's lenses; None if it is not rendered yet, or there is no such lens."""
    # names can come from web requests: read only files of this folder
    if name not in own_lenses():
        return None
    try:
        return read_bytes(thumbnail_file(name), "a thumbnail")
    except FileError:
        return None


def _make_thumbnail(name: str) -> Path:
    """Write the thumbnail of a lens: as its file states it, wide open, with a light up and left of the centre."""
    path = lens_path(name)
    with sentences_for(path, "a lens"):
        project = card_project(lens_card(name), SIZE_PX)
        drawn = render(project.replace(quality=project.quality.replace(mode="draft", ringing="off")))
        pixels = view(drawn.layers[0].pixels, layers_exposure(drawn.layers))
    return _write(name, pixels)


def _write(name: str, pixels: NDArray[np.uint8]) -> Path:
    target = thumbnail_file(name)
    writable_folder()
    write_atomically(target, partial(Image.fromarray(pixels).save, format="JPEG", quality=_QUALITY))
    return target
