"""One frame of a film, as a plate."""

from __future__ import annotations

import atexit
import os
from collections.abc import Generator, Iterator
from functools import lru_cache
from threading import Lock
from typing import Any

import numpy as np

from ...errors import FileError, FlarewrightError
from ...model.project.backplate import Transfer
from ..files.door import shown
from ..images.plate_picture import PlatePicture
from ..images.transfer import white_of
from .decoder import av_module, exact_flags, opened, video_of
from .film_colour import linear_pixels
from .film_file import Film, open_film
from .film_time_code import time_code_after

# key frames that are tried, before decoding begins at the first frame
_TRIES = 2
_BITS = 8
_ONE_AT_A_TIME = Lock()


def read_film_frame(path: str | os.PathLike[str], index: int, *, transfer: Transfer | None = None) -> PlatePicture:
    """Read a frame of a film with linear values.

    The film stays open: following frames are decoded one after the other, and only one is in memory.

    Parameters
    ----------
    path : path
    index : int
        Counted from 0, in the order in which frames are shown.
    transfer : str, optional
        What the codes mean (`io.images.transfer`); None: what the film states, or else a video camera.

    Raises
    ------
    FileError
        As of `open_film`; or there is no such frame, it cannot be decoded, or has another size than the first one.

    Examples
    --------
    >>> read_film_frame("drive.mp4", 12).size_px                                # doctest: +SKIP
    (1920, 1080)
    """
    film = open_film(path)
    if not 0 <= index < film.frames:
        raise FileError(f"{shown(path)} has no frame {index + 1}: it has {film.frames}")
    with _ONE_AT_A_TIME:
        try:
            frame = _decoder(film.path, film.digest).send(index)
        except FlarewrightError as error:
            # it has ended
            _decoder.cache_clear()
            raise FileError(f"frame {index + 1} of {error}") from error
    if (frame.height, frame.width) != (film.size_px if film.rotation_deg % 180 else film.size_px[::-1]):
        raise FileError(f"{shown(path)} changes its size to {frame.width}x{frame.height}: give a film of one size")
    kind: Transfer = transfer or film.coding.transfer
    pixels = linear_pixels(_codes(frame, film), film.coding, kind)
    if film.rotation_deg:
        pixels = np.ascontiguousarray(np.rot90(pixels, film.rotation_deg // 90))
    code = time_code_after(film.time_code, index, film.fps) if film.time_code else None
    return PlatePicture(
        pixels,
        white_of(kind),
        kind,
        "rec709",
        film.pixel_aspect,
        film.fps,
        None if code is None else {"timeCode": code},
        film.remarks if transfer is not None else (*film.remarks, _read_as(film)),
    )


def _read_as(film: Film) -> str:
    """Return the remark on the transfer function of a film."""
    name = {
        "rec709": "a video camera (BT.709)", "srgb": "sRGB", "linear": "linear light", "gamma22": "a gamma of 2.2",
        "gamma28": "a gamma of 2.8", "pq": "PQ (HDR10), in which white paper becomes 1",
        "hlg": "HLG, in which white paper becomes 1",
    }[film.coding.transfer]  # fmt: skip
    words = "has" if film.stated else "states no transfer function and counts as having"
    return f"the film {words} codes of {name}; --plate-transfer sets another one"


def _codes(frame: Any, film: Film) -> np.ndarray:
    """Return the codes of a frame with 16 bits, as of `film_colour.signal_of`; FFmpeg unpacks them."""
    av = av_module(film.path)
    ranges = av.video.reformatter.ColorRange
    # the same range on both sides: nothing is scaled
    same = ranges.JPEG if film.coding.full_range else ranges.MPEG
    how = {
        "src_color_range": same, "dst_color_range": same, "src_colorspace": 1, "dst_colorspace": 1, "threads": 1,
        "interpolation": exact_flags(av),
    }  # fmt: skip
    if film.coding.matrix is None:
        # to these two FFmpeg only moves values; to others it goes by way of Y'CbCr
        if film.coding.bits == _BITS:
            return np.asarray(frame.reformat(format="rgb24", **how).to_ndarray()).astype(np.uint16) * np.uint16(257)
        return np.asarray(frame.reformat(format="rgb48le", **how).to_ndarray())
    if frame.format.name.startswith("gray"):
        (luma,) = _planes(frame.reformat(format="gray16le", **how))
        if not film.coding.full_range:
            # the largest code has become 65535
            most = (1 << film.coding.bits) - 1
            luma = np.rint(luma.astype(np.float64) * (most / 65535.0) * (1 << (16 - film.coding.bits))).astype(
                np.uint16
            )
        grey = np.full_like(luma, 1 << 15)
        return np.stack((luma, grey, grey), axis=-1)
    return np.stack(_planes(frame.reformat(format="yuv444p16le", **how)), axis=-1)


def _planes(frame: Any) -> list[np.ndarray]:
    return [
        np.frombuffer(plane, "<u2").reshape(plane.height, plane.line_size // 2)[:, : plane.width]
        for plane in frame.planes
    ]


@lru_cache(maxsize=1)
def _decoder(path: str, _: str) -> Generator[Any, int, None]:
    """Return the open decoder of a film, which is sent indexes and yields frames; `_` is the film's digest."""
    found = _decoding(open_film(path))
    next(found)
    return found


# an open film must not outlive the modules that close it
atexit.register(_decoder.cache_clear)


def _decoding(film: Film) -> Generator[Any, int, None]:
    """Decode the frames whose indexes are sent."""
    seeks = len(film.times) > 0
    wanted = yield None
    while True:
        with opened(film.path) as container:
            stream = video_of(container, film.path)
            following, at, from_start = _numbered(container.decode(stream), film), -1, True
            while True:
                if wanted <= at or (seeks and _key_between(film, at, wanted)):
                    frame = None
                    if seeks:
                        following, at, frame = _sought(container, stream, film, wanted)
                        from_start = False
                else:
                    at, frame = _reached(following, wanted)
                    if frame is None and from_start:
                        raise FileError(f"{shown(film.path)} cannot be decoded: is it damaged?")
                if frame is None:
                    # some containers find no key frames: begin again, and decode all frames in between
                    seeks = False
                    break
                wanted = yield frame


def _sought(container: Any, stream: Any, film: Film, wanted: int) -> tuple[Iterator[tuple[int, Any]], int, Any]:
    """Return the frames after a wanted one, its index, and itself, or None if no key frame leads to it."""
    before = film.keys[film.keys <= film.times[wanted]]
    following: Iterator[tuple[int, Any]] = iter(())
    at, frame = -1, None
    # what follows a key frame may need the one before
    for start in before[::-1][:_TRIES]:
        container.seek(int(start), stream=stream, backward=True)
        following = _numbered(container.decode(stream), film)
        at, frame = _reached(following, wanted)
        if frame is not None:
            break
    return following, at, frame


def _numbered(frames: Iterator[Any], film: Film) -> Iterator[tuple[int, Any]]:
    """Yield frames with their indexes; without those whose time is that of no frame."""
    for count, frame in enumerate(frames):
        if not len(film.times):
            yield count, frame
        elif frame.pts is not None:
            index = int(np.searchsorted(film.times, frame.pts))
            if index < len(film.times) and film.times[index] == frame.pts:
                yield index, frame


def _reached(following: Iterator[tuple[int, Any]], wanted: int) -> tuple[int, Any]:
    """Return the index of the last decoded frame, and the wanted one, or None if it did not come undamaged."""
    at = -1
    for at, frame in following:
        if at == wanted and not frame.is_corrupt:
            return at, frame
        if at >= wanted:
            break
    return at, None


def _key_between(film: Film, at: int, wanted: int) -> bool:
    """Return whether decoding may begin later than at the next frame; the film has times."""
    first, last = np.searchsorted(film.keys, (film.times[max(at, 0)], film.times[wanted]), side="right")
    # to seek costs more than the next frame
    return bool(last > first and wanted - at > 1)
