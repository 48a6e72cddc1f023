"""A film of finished frames, all with one exposure."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from ..._version import __version__
from ...errors import OutputError, ProjectError
from ...io.files.atomic_write import delete_written
from ...io.files.text_file import digest_of
from ...io.films.film_kind import is_film
from ...io.films.film_time_code import code_text
from ...io.films.film_writer import (
    FILM_CODECS,
    FilmCodec,
    check_film_name,
    comment_of,
    join_films,
    padded_size,
    write_film,
)
from ...io.images.plate_picture import read_plate
from ...jobs.frame_list import FramePattern, frames_text, parse_frames
from ..keyframes import frame_rate
from .look import FilmLook, film_look, shown

if TYPE_CHECKING:
    from .look import FilmView

_FPS = 24.0
# frames that are encoded again after an interruption, at most
_PART_FRAMES = 120
_OURS = "Flarewright "


@dataclass(frozen=True)
class FilmResult:
    """A film that was written.

    Attributes
    ----------
    file : str
    frames : tuple of int
    fps : Fraction
    size_px : tuple of int
    codec, view : str
        For people.
    exposure_stops : float
    remarks : tuple of str
    """

    file: str
    frames: tuple[int, ...]
    fps: Fraction
    size_px: tuple[int, int]
    codec: str
    view: str
    exposure_stops: float
    remarks: tuple[str, ...]


def assemble_film(
    files: str | os.PathLike[str],
    output: str | os.PathLike[str],
    *,
    frames: str | Sequence[int] | None = None,
    fps: float | None = None,
    layer: str | None = None,
    view: FilmView | None = None,
    exposure_stops: float | None = None,
    report: Callable[[int, int, int], None] | None = None,
) -> FilmResult:
    """Make a film of finished frames.

    It is encoded in parts in the folder FILM.parts, which a repeated call keeps after an interruption.

    Parameters
    ----------
    files : path
        "flare.####.exr", a comp, or pictures of other programs; EXR, TIFF, PNG or JPEG.
    output : path
        ".mp4" (H.264) or ".mov" (ProRes 422 HQ).
    frames : str or sequence of int, optional
        None: all files; their numbers must be evenly spaced. A frame stays until the next one.
    fps : float, optional
        None: as the files state, or else 24.
    layer : str, optional
        Of EXR files; None: the beauty of a flare, or the plain colours.
    view : {"filmic", "srgb", "aces", "rec709"}, optional
    exposure_stops : float, optional
        One for all frames. None: as of `look.film_look`.
    report : callable, optional
        Called with the frame, the number of finished frames and that of all.

    Raises
    ------
    FlarewrightError
        A frame is missing, damaged or of another size, or the film cannot be written.

    Examples
    --------
    >>> assemble_film("flare.####.exr", "flare.mp4").fps                        # doctest: +SKIP
    Fraction(24, 1)
    """
    pattern = FramePattern(os.fspath(files))
    codec = check_film_name(output)
    numbers = _frames(pattern, frames)
    if pattern.path(numbers[0]).resolve() == Path(output).resolve():
        raise ProjectError(f"{output} would replace a frame; choose another name")
    first = read_plate(pattern.path(numbers[0]), layer=layer)
    remarks = []
    if fps is None and first.fps is None:
        remarks.append(f"the frames state no rate; the film has {_FPS:g} frames per second; --fps sets another one")
    stated = fps if fps is not None or first.fps is None else float(first.fps)
    # some programs state 2997/125
    rate = frame_rate(_FPS if stated is None else stated)
    look = film_look([pattern.path(frame) for frame in numbers], first, layer, view, exposure_stops)
    remarks += [*look.remarks, *_padding(first.size_px, codec)]
    code = (first.header or {}).get("timeCode")
    film = _Film(Path(output), pattern, numbers, rate, layer, look, first.size_px, first.pixel_aspect)
    _encode(film, "" if code is None else code_text(code), f"{_OURS}{__version__}; {look.words}", report)
    return FilmResult(
        os.fspath(output), numbers, rate, padded_size(first.size_px, codec), codec.words, look.words, look.stops,
        tuple(remarks),
    )  # fmt: skip


def check_film(output: str | os.PathLike[str]) -> None:
    """Raise an error before the work if a film cannot be written, or would replace one of another program."""
    check_film_name(output)
    place = Path(output)
    if FramePattern(os.fspath(output)).numbered:
        raise ProjectError(f"the film {place} is one file; name it without a number (####, %04d, $F4)")
    if place.exists() and not comment_of(place).startswith(_OURS):
        raise OutputError(f"{place} exists, and is no film of Flarewright; move it, or choose another name")


@dataclass(frozen=True)
class _Film:
    """What all parts of a film share."""

    output: Path
    pattern: FramePattern
    frames: tuple[int, ...]
    fps: Fraction
    layer: str | None
    look: FilmLook
    size_px: tuple[int, int]
    pixel_aspect: float


def _encode(film: _Film, code: str, comment: str, report: Callable[[int, int, int], None] | None) -> None:
    """Encode the parts of a film, of which an interrupted call has kept some, and join them."""
    folder = film.output.with_name(f"{film.output.name}.parts")
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise OutputError(f"cannot write {folder}: {reason}; check the free space and the permissions") from None
    try:
        _join_parts(film, folder, code, comment, report)
    finally:
        # with parts of an interrupted call, or files of another program, it stays
        with suppress(OSError):
            folder.rmdir()


def _join_parts(
    film: _Film, folder: Path, code: str, comment: str, report: Callable[[int, int, int], None] | None
) -> None:
    """Encode parts in a folder, join them, and delete them."""
    parts = []
    transfer: Literal["srgb", "rec709"] = "rec709" if film.look.view == "rec709" else "srgb"
    for at in range(0, len(film.frames), _PART_FRAMES):
        some = film.frames[at : at + _PART_FRAMES]
        part = folder / f"{at // _PART_FRAMES:05d}{film.output.suffix}"
        digest = _digest(film, some)
        if not part.exists() or comment_of(part) != digest:
            write_film(
                part, _pictures(film, some, at, report), film.size_px, film.fps, transfer=transfer,
                pixel_aspect=film.pixel_aspect, comment=digest,
            )  # fmt: skip
        elif report is not None:
            report(some[-1], at + len(some), len(film.frames))
        parts.append((some[0] - film.frames[0], part))
    join_films(film.output, parts, film.fps, time_code=code, comment=comment)
    # also parts that a killed call made of a longer film
    for left in folder.iterdir():
        if re.fullmatch(r"\d{5}", left.stem) and left.suffix in FILM_CODECS:
            delete_written(left)


def _pictures(
    film: _Film, frames: Sequence[int], before: int, report: Callable[[int, int, int], None] | None
) -> Iterator[tuple[int, NDArray[Any]]]:
    """Yield the moments and the codes of frames, of which some come before them."""
    deep = FILM_CODECS[film.output.suffix.lower()].deep
    for k, frame in enumerate(frames):
        path = film.pattern.path(frame)
        picture = read_plate(path, layer=film.layer)
        if (size := picture.size_px) != film.size_px:
            raise ProjectError(
                f"{path} has {size[0]}x{size[1]} pixels, the first frame {film.size_px[0]}x{film.size_px[1]}; give "
                "frames of one size"
            )
        yield frame - frames[0], shown(picture, film.look, deep=deep)
        if report is not None:
            report(frame, before + k + 1, len(film.frames))


def _digest(film: _Film, frames: Sequence[int]) -> str:
    """Return a digest of all that determines a part of a film."""
    files = [digest_of(film.pattern.path(frame)) for frame in frames]
    moments = [frame - frames[0] for frame in frames]
    about = (__version__, film.fps, film.layer, film.look.view, film.look.stops, film.size_px, film.pixel_aspect)
    return sha256(repr((about, moments, files)).encode()).hexdigest()


def _frames(pattern: FramePattern, frames: str | Sequence[int] | None) -> tuple[int, ...]:
    """Return the numbers of the frames; all of them exist."""
    if is_film(pattern.text):
        raise ProjectError(f"{pattern.text} is a film already; give the frames of one, such as flare.####.exr")
    if not pattern.numbered:
        path = Path(pattern.text)
        raise ProjectError(
            f"{path} is one picture, a film has many; write {path.stem}.####{path.suffix} (or %04d, $F4)"
        )
    there = pattern.found()
    if frames is None:
        gaps = np.diff(there)
        if len(there) > 2 and gaps.max() > gaps.min():
            raise ProjectError(
                f"the frames of {pattern.text}, {frames_text(there)[:80]}, have gaps; draw what is missing, or give "
                "--frames: a frame stays until the next one"
            )
        return there
    wanted = parse_frames(frames) if isinstance(frames, str) else tuple(sorted(set(frames)))
    missing = sorted(set(wanted) - set(there))
    if missing or not wanted:
        raise ProjectError(
            f"{pattern.text} lacks frame{'s'[: len(missing) > 1]} {frames_text(missing)[:80]}; there are "
            f"{frames_text(there)[:80]}: give frames that exist"
        )
    return wanted


def _padding(size_px: tuple[int, int], codec: FilmCodec) -> list[str]:
    wide, high = padded_size(size_px, codec)
    if (wide, high) == size_px:
        return []
    return [
        f"the film has {wide}x{high} pixels, since {codec.words.split(',')[0]} needs even sides: the last column or "
        "row of the frames is there twice"
    ]
