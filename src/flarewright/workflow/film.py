"""A film of finished frames, all with one exposure."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .._version import __version__
from ..errors import FlarewrightError, ProjectError
from ..io.films.film_kind import is_film
from ..io.films.film_time_code import code_text
from ..io.films.film_writer import FilmCodec, check_film_name, padded_size, write_film
from ..io.images.exr import read_exr
from ..io.images.plate_picture import PlatePicture, read_plate
from ..jobs.frame_list import FramePattern, frames_text, parse_frames
from ..render.image.display import auto_exposure, layers_exposure, view, view_text
from .keyframes import frame_rate

if TYPE_CHECKING:
    from ..render.image.display import Transform

__all__ = ["FilmResult", "assemble_film"]

# frames whose flare sets an automatic exposure
_EXPOSED_FRAMES = 24
_FPS = 24.0


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
    transform: Transform | None = None,
    exposure_stops: float | None = None,
    report: Callable[[int, int, int], None] | None = None,
) -> FilmResult:
    """Make a film of finished frames.

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
    transform : {"filmic", "srgb", "aces"}, optional
        As of `render.image.display.view`; None: filmic for a flare, srgb for comps and other pictures.
    exposure_stops : float, optional
        One for all frames. None: the lowest automatic exposure of the flare in 24 frames; 0 for other pictures.
    report : callable, optional
        Called with the frame, the number of finished frames and that of all.

    Returns
    -------
    FilmResult

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
    rate = first.fps if fps is None and first.fps is not None else frame_rate(_FPS if fps is None else fps)
    stops, kind, automatic = _look(pattern, numbers, first, layer, transform, exposure_stops)
    stated = view_text(stops, kind, first.colorspace or "rec709", automatic=automatic)
    remarks += _padding(first.size_px, codec)

    def pictures() -> Iterator[tuple[int, NDArray[np.uint8]]]:
        for done, frame in enumerate(numbers, 1):
            picture = read_plate(pattern.path(frame), layer=layer)
            yield frame - numbers[0], view(picture.pixels, stops, kind, picture.colorspace or "rec709")
            if report is not None:
                report(frame, done, len(numbers))

    code = (first.header or {}).get("timeCode")
    write_film(
        output, pictures(), first.size_px, rate, time_code="" if code is None else code_text(code),
        pixel_aspect=first.pixel_aspect, metadata={"comment": f"Flarewright {__version__}; {stated}"},
    )  # fmt: skip
    return FilmResult(
        os.fspath(output), numbers, rate, padded_size(first.size_px, codec), codec.words, stated, stops, tuple(remarks)
    )


def _frames(pattern: FramePattern, frames: str | Sequence[int] | None) -> tuple[int, ...]:
    """Return the numbers of the frames; all of them exist."""
    if is_film(pattern.text):
        raise ProjectError(f"{pattern.text} is a film already; give the frames of one, such as flare.####.exr")
    if not pattern.numbered:
        path = Path(pattern.text)
        raise ProjectError(
            f"{path} is one picture; a film has many: write {path.stem}.####{path.suffix} (or %04d, $F4)"
        )
    there = pattern.on_disk()
    if not there:
        raise ProjectError(
            f"no file is named {pattern.text}; check the folder, and the number of digits (#### or %04d)"
        )
    if frames is None:
        gaps = np.diff(there)
        if len(there) > 2 and gaps.max() > gaps.min():
            step = int(gaps.min())
            missing = sorted({*range(there[0], there[-1] + 1, step)} - {*there})
            raise ProjectError(
                f"{pattern.text} lacks frame{'s'[: len(missing) > 1]} {frames_text(missing)[:80]}; draw what is "
                "missing, or give --frames: a frame stays until the next one"
            )
        return there
    wanted = parse_frames(frames) if isinstance(frames, str) else tuple(sorted(set(frames)))
    missing = [frame for frame in wanted if frame not in set(there)]
    if missing or not wanted:
        raise ProjectError(
            f"{pattern.text} lacks frame{'s'[: len(missing) > 1]} {frames_text(missing)[:80]}; there are "
            f"{frames_text(there)[:80]}: give frames that exist"
        )
    return wanted


def _look(
    pattern: FramePattern, frames: Sequence[int], first: PlatePicture, layer: str | None, transform: Transform | None,
    exposure_stops: float | None,
) -> tuple[float, Transform, bool]:  # fmt: skip
    """Return the exposure of all frames, the transform, and whether the exposure is automatic."""
    if not _is_flare(pattern.path(frames[0])):
        return exposure_stops or 0.0, transform or "srgb", False
    if exposure_stops is not None:
        return exposure_stops, transform or "filmic", False
    # one for the whole film, so that it does not flicker; at the lowest the brightest frame shows all of its ghosts
    step = max(1, -(-len(frames) // _EXPOSED_FRAMES))
    found = []
    for frame in frames[::step]:
        space = first.colorspace or "rec709"
        if layer is None:
            layers = read_exr(pattern.path(frame)).layers
            if any(each.pixels.any() for each in layers):
                found.append(layers_exposure(layers, space))
        elif (pixels := read_plate(pattern.path(frame), layer=layer).pixels).any():
            found.append(auto_exposure(pixels, space))
    return min(found, default=0.0), transform or "filmic", True


def _is_flare(path: Path) -> bool:
    """Return whether a file is a flare of ours, which needs an exposure; a comp or a photograph has one."""
    if path.suffix.lower() != ".exr":
        return False
    try:
        contents = read_exr(path)
    except (FlarewrightError, KeyError):
        return False
    return "project" in contents.metadata and "plate" not in contents.metadata


def _padding(size_px: tuple[int, int], codec: FilmCodec) -> list[str]:
    wide, high = padded_size(size_px, codec)
    if (wide, high) == size_px:
        return []
    return [
        f"the film has {wide}x{high} pixels, since {codec.words.split(',')[0]} needs even sides: the last column or "
        "row of the frames is there twice"
    ]
