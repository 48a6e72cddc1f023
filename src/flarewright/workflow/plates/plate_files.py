"""The pictures of a plate: a picture, a sequence of files, or a film. Later code does not know which."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from hashlib import sha256
from pathlib import Path

from ...errors import ProjectError
from ...io.files.door import no_file
from ...io.files.text_file import digest_of
from ...io.films.film_file import open_film
from ...io.films.film_frame import read_film_frame
from ...io.films.film_kind import is_film
from ...io.images.plate_image import read_matte
from ...io.images.plate_picture import PlatePicture, read_plate
from ...jobs.frame_list import FramePattern, frames_text
from ...model import Backplate
from ...model.project.backplate import Transfer
from ...plates.settings import PlateSettings
from ...typing import Pixels

FRAME = 1
"""Frame of a single plate."""


def is_picture(settings: PlateSettings) -> bool:
    """Return whether all frames have the same picture and matte."""
    names = [settings.files, *([] if settings.matte is None else [settings.matte])]
    return not is_film(settings.files) and not any(FramePattern(name).numbered for name in names)


def plate_frames(settings: PlateSettings, frames: Sequence[int] | None) -> tuple[int, ...]:
    """Return the frames of a plate.

    Parameters
    ----------
    settings : PlateSettings
    frames : sequence of int, optional
        Wanted ones; None: all that there are.

    Raises
    ------
    ProjectError
        A frame is missing; the sentence names the first ones.
    FileError
        The plate is a film that cannot be read.
    """
    pattern = FramePattern(settings.files)
    if is_film(settings.files):
        _check_one_film(pattern)
        wanted = _film_frames(settings, frames)
    elif pattern.numbered:
        found = pattern.found()
        wanted = tuple(range(found[0], found[-1] + 1)) if frames is None else tuple(frames)
        _check_all_there(pattern, wanted, "the plate")
    else:
        wanted = (settings.first,) if frames is None else tuple(frames)
        _check_all_there(pattern, wanted, "the plate")
    if settings.matte is not None:
        _check_all_there(FramePattern(settings.matte), wanted, "the matte")
    return wanted


def _film_frames(settings: PlateSettings, frames: Sequence[int] | None) -> tuple[int, ...]:
    """Return the numbers of a film's frames, or the wanted ones among them."""
    last = settings.first + open_film(settings.files).frames - 1
    if frames is None:
        return tuple(range(settings.first, last + 1))
    missing = [frame for frame in frames if not settings.first <= frame <= last]
    if missing:
        raise ProjectError(
            f"the film {settings.files} lacks frame{'s'[: len(missing) > 1]} {frames_text(missing)[:80]}; it has "
            f"{settings.first}-{last}, the first one at 0 s: give --frames that exist"
        )
    return tuple(frames)


def _check_one_film(pattern: FramePattern) -> None:
    if pattern.numbered:
        raise ProjectError(
            f"the plate {pattern.text} is a film, which has all frames in one file; rename it without the number "
            "(####, %04d, $F4)"
        )


def _check_all_there(pattern: FramePattern, frames: Sequence[int], what: str) -> None:
    """Raise ProjectError with the missing frames of a sequence."""
    have = set(pattern.on_disk()) if pattern.numbered else None
    if have is None and Path(pattern.text).is_dir():
        raise ProjectError(
            f"{what} {pattern.text} is a folder; give a picture, a film, or a sequence such as p.####.exr"
        )
    if have is None and (reason := no_file(pattern.text)):
        raise ProjectError(f"{what} {pattern.text} {reason}; check the path and the spelling")
    missing = [] if have is None else [frame for frame in frames if frame not in have]
    if missing:
        there = f"there are {frames_text(sorted(have))[:80]}" if have else "there is none"
        raise ProjectError(
            f"{what} {pattern.text} lacks frame{'s'[: len(missing) > 1]} {frames_text(missing)[:80]}; {there}: give "
            "--frames that exist"
        )


def first_picture(settings: PlateSettings, frames: Sequence[int] | None) -> PlatePicture:
    """Read the first picture of a plate, which states its size and rate; parameters and errors as of `plate_frames`.

    That of a film does not depend on the number that its first frame gets.
    """
    if is_film(settings.files):
        _check_one_film(FramePattern(settings.files))
        return plate_picture(settings, settings.first)
    return plate_picture(settings, plate_frames(settings, frames)[0])


def plate_picture(settings: PlateSettings, frame: int) -> PlatePicture:
    """Read the plate of a frame; the last one is kept in memory.

    Raises
    ------
    FileError
        It cannot be read.
    """
    if is_film(settings.files):
        index = frame - settings.first
        _refuse_layer(settings)
        return _picture(settings.files, index, open_film(settings.files).digest, None, settings.transfer)
    path = FramePattern(settings.files).path(frame)
    changed_ns = path.stat().st_mtime_ns if path.is_file() else 0
    return _picture(str(path), None, changed_ns, settings.layer, settings.transfer)


def _refuse_layer(settings: PlateSettings) -> None:
    if settings.layer is not None:
        raise ProjectError(
            f"{settings.files} has no layers, so there is no {settings.layer!r}: omit the layer, or give an EXR file"
        )


@lru_cache(maxsize=1)
def _picture(path: str, index: int | None, _: int | str, layer: str | None, transfer: Transfer | None) -> PlatePicture:
    if index is not None:
        picture = read_film_frame(path, index, transfer=transfer)
    else:
        picture = read_plate(path, layer=layer, transfer=transfer)
    picture.pixels.flags.writeable = False
    return picture


def plate_name(settings: PlateSettings, frame: int) -> str:
    """Return what a message calls the plate of a frame."""
    if is_film(settings.files):
        return f"frame {frame} of {settings.files}"
    return str(FramePattern(settings.files).path(frame))


def plate_digest(settings: PlateSettings, frame: int) -> str | None:
    """Return a digest of what the plate of a frame shows; None if there is no file to read."""
    if not is_film(settings.files):
        return digest_of(FramePattern(settings.files).path(frame))
    # a compressed frame depends on others
    return sha256(f"{open_film(settings.files).digest} {frame - settings.first}".encode()).hexdigest()


def plate_matte(settings: PlateSettings, frame: int, size_px: tuple[int, int]) -> Pixels | None:
    """Read the matte of a frame; raises ProjectError if its size differs from the plate's."""
    if settings.matte is None:
        return None
    path = FramePattern(settings.matte).path(frame)
    matte = read_matte(path)
    if matte.shape != size_px[::-1]:
        raise ProjectError(
            f"{path}: the matte is {matte.shape[1]}x{matte.shape[0]} and the plate {size_px[0]}x{size_px[1]}; give a "
            "matte of the plate's size"
        )
    return matte


def check_single(plate: Backplate) -> None:
    """Raise a ProjectError if the name of a single plate stands for a sequence."""
    if FramePattern(plate.image).numbered:
        raise ProjectError(f"{plate.image} stands for a sequence; give the file of one frame")


def backplate_picture(plate: Backplate) -> PlatePicture:
    """Read the plate of a project; the last one is kept, for the search and the comp too.

    Raises
    ------
    FlarewrightError
        It cannot be read, or its name stands for a sequence.
    """
    check_single(plate)
    return plate_picture(PlateSettings(plate.image, layer=plate.layer, transfer=plate.transfer), FRAME)
