"""What a film states, and the times of its frames."""

from __future__ import annotations

import os
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import FileError
from ...model.project.backplate import Transfer
from ..files.door import shown
from .decoder import opened, video_of
from .film_colour import FilmCoding

MOST_FRAMES = 1_000_000
"""Largest number of frames of a film."""

# numbers of ITU-T H.273
_MATRICES = {1: "bt709", 4: "bt601", 5: "bt601", 6: "bt601", 7: "smpte240m", 9: "bt2020"}
_TRANSFERS: dict[int, Transfer] = {
    1: "rec709", 4: "gamma22", 5: "gamma28", 6: "rec709", 8: "linear", 11: "rec709", 12: "rec709", 13: "srgb",
    14: "rec709", 15: "rec709", 16: "pq", 18: "hlg",
}  # fmt: skip
_PRIMARIES = {1: "bt709", 2: "bt709", 5: "bt470bg", 6: "smpte170m", 7: "smpte170m", 9: "bt2020", 11: "p3", 12: "p3"}
_UNKNOWN, _FULL = 2, 2
_LEAST_BITS = 8
# films without a stated matrix: smaller ones are of the time of BT.601
_HD_LINES = 720
# codecs whose packets are not frames one by one
_BY_DECODING = ("vp8",)
# part of a frame by which a time may differ from an even rate; containers round to a millisecond
_UNEVEN = 0.5
_SAME_RATE = 1e-3
# length in a header, which counts microseconds, that is too large for the frames: rounded, or with a slow last one
_MICROSECONDS, _LONGER, _MOST_LATE_S = 1e6, 1.1, 0.25


@dataclass(frozen=True, eq=False)
class Film:
    """A film, with its frames in the order in which they are shown.

    Attributes
    ----------
    path : str
    size_px : tuple of int
        Of a picture as it is shown, after its rotation.
    frames : int
    fps : Fraction or None
        None for a single frame without a stated rate.
    pixel_aspect : float
        Width of a pixel by its height.
    coding : FilmCoding
    rotation_deg : int
        Counter-clockwise, a multiple of 90.
    time_code : str
        Of the first frame; empty if the film has none.
    stated : bool
        Whether the film states the transfer function.
    digest : str
        Of all its pictures, as they are stored.
    times : ndarray, shape (frames,), int64
        Of the frames, in units of the stream; empty if the film states none, and then frames are counted.
    keys : ndarray, int64
        Times at which decoding can begin.
    remarks : tuple of str
    """

    path: str
    size_px: tuple[int, int]
    frames: int
    fps: Fraction | None
    pixel_aspect: float
    coding: FilmCoding
    rotation_deg: int
    time_code: str
    stated: bool
    digest: str
    times: NDArray[np.int64]
    keys: NDArray[np.int64]
    remarks: tuple[str, ...]


def open_film(path: str | os.PathLike[str]) -> Film:
    """Read what a film states, and the times of all its frames; the last films are kept in memory.

    Parameters
    ----------
    path : path

    Raises
    ------
    FileError
        PyAV is missing; or the file is missing, damaged, cut short, too large, no film, or its colours are unknown.

    Notes
    -----
    Reads the whole file once, without decoding it, except for films whose packets are not single frames.

    Examples
    --------
    >>> film = open_film("drive.mp4")                                           # doctest: +SKIP
    >>> film.frames, film.fps                                                   # doctest: +SKIP
    (48, Fraction(24000, 1001))
    """
    place = Path(path)
    try:
        state = place.stat()
        changed = (state.st_mtime_ns, state.st_size)
    except (OSError, ValueError):
        # the door has the sentence
        changed = (0, 0)
    return _film(str(place), changed)


@lru_cache(maxsize=4)
def _film(path: str, _: tuple[int, int]) -> Film:
    with opened(path) as container:
        stream = video_of(container, path)
        first = next(iter(container.decode(stream)), None)
        if first is None:
            raise FileError(f"{shown(path)} has no frame that can be decoded: is it a whole film?")
        coding, remarks = _coding(first, path)
        rotation, turned = _rotation(first)
        aspect = float(stream.sample_aspect_ratio or 1)
        stated, rate = stream.frames, stream.average_rate
        # sound can be longer than the pictures
        long_s = (container.duration or 0) / _MICROSECONDS if len(container.streams) == 1 else 0.0
        code = _time_code(container)
        base = stream.time_base
        interlaced = bool(first.interlaced_frame)
        width, height = first.width, first.height
        known = int(first.color_trc) in _TRANSFERS
        # AVI has no times of frames that are shown in another order than they are stored
        unordered = container.format.name == "avi" and stream.codec_context.has_b_frames
        by_decoding = interlaced or unordered or stream.codec_context.name in _BY_DECODING
    packets = _packets(path)
    if by_decoding or len(np.unique(packets.times)) < packets.shown:
        times, keys, frames = _decoded_times(path)
    else:
        times, keys, frames = np.sort(packets.times), packets.keys, packets.shown
    # a trimmed film stores frames that it does not show, and counts them
    _check_count(path, frames, packets.shown, 0 if packets.trimmed else stated)
    fps, uneven = _rate(times, base, rate, frames)
    _check_length(path, frames, fps, long_s)
    if interlaced:
        remarks = (*remarks, "the film's frames are interlaced, two moments in one picture; deinterlace it first")
    if rotation % 180:
        width, height, aspect = height, width, 1.0 / aspect
    facts = repr((coding, rotation, aspect, (width, height))).encode()
    return Film(
        path, (width, height), frames, fps, aspect if aspect > 0.0 else 1.0, coding, rotation, code,
        known, sha256(packets.digest + facts).hexdigest(), times, keys, (*remarks, *turned, *uneven),
    )  # fmt: skip


@dataclass(frozen=True)
class _Packets:
    """The packets of a film: the times of the shown ones and of key frames, and a digest of all."""

    times: NDArray[np.int64]
    keys: NDArray[np.int64]
    digest: bytes
    # the number of those that are shown, and whether there are others
    shown: int
    trimmed: bool


def _packets(path: str) -> _Packets:
    """Read all packets, without decoding them."""
    digest = sha256()
    times: list[int] = []
    keys: list[int] = []
    number, trimmed = 0, False
    with opened(path) as container:
        for packet in container.demux(video_of(container, path)):
            if packet.size == 0:
                continue
            digest.update(packet)
            if packet.is_discard:
                trimmed = True
                continue
            number += 1
            if number > MOST_FRAMES:
                raise FileError(f"{shown(path)} has more than {MOST_FRAMES} frames: give a shorter film")
            if packet.pts is not None:
                times.append(packet.pts)
                if packet.is_keyframe:
                    keys.append(packet.pts)
    return _Packets(np.array(times, np.int64), np.array(sorted(keys), np.int64), digest.digest(), number, trimmed)


def _decoded_times(path: str) -> tuple[NDArray[np.int64], NDArray[np.int64], int]:
    """Return the times of all frames and of key frames, and the number of frames, by decoding them."""
    times: list[int | None] = []
    keys: list[int] = []
    with opened(path) as container:
        for frame in container.decode(video_of(container, path)):
            times.append(frame.pts)
            if frame.key_frame and frame.pts is not None:
                keys.append(frame.pts)
    whole = [time for time in times if time is not None]
    # frames that come in another order than their times, or without, are counted
    if len(whole) < len(times) or (np.diff(whole) <= 0).any():
        return np.zeros(0, np.int64), np.zeros(0, np.int64), len(times)
    return np.array(whole, np.int64), np.array(keys, np.int64), len(times)


def _check_count(path: str, frames: int, packets: int, stated: int) -> None:
    """Raise FileError for a film without frames, or with fewer than its header states."""
    if frames == 0:
        raise FileError(f"{shown(path)} has no frames: is it a whole film?")
    if packets < stated:
        raise FileError(
            f"{shown(path)} is cut short: its header states {stated} frames, and {packets} are there; copy it again"
        )


def _check_length(path: str, frames: int, fps: Fraction | None, long_s: float) -> None:
    """Raise FileError for a film that is clearly shorter than its header states."""
    if fps is not None and long_s > _LONGER * (frames / fps) + _MOST_LATE_S:
        raise FileError(
            f"{shown(path)} is cut short: its header states {long_s:.2f} s, and its {frames} frames last "
            f"{float(frames / fps):.2f} s; copy it again"
        )


def _rate(times: NDArray[np.int64], base: Any, stated: Any, frames: int) -> tuple[Fraction | None, tuple[str, ...]]:
    """Return the frames per second, and a remark if they are not evenly spaced."""
    given = Fraction(stated) if stated and 0 < stated <= 1000 else None
    if len(times) < 2 or base is None:
        return given, ()
    seconds = (times - times[0]) * float(base)
    measured = (frames - 1) / seconds[-1]
    fps = given
    if fps is None or abs(float(fps) / measured - 1.0) > max(_SAME_RATE, _UNEVEN / frames):
        fps = Fraction(measured).limit_denominator(1001)
    if not 0 < fps <= 1000:
        return None, ("the film's times are not those of a film; --fps gives its rate",)
    off = np.abs(seconds * float(fps) - np.arange(frames)).max()
    if off <= _UNEVEN:
        return fps, ()
    steps = np.diff(seconds) * 1000.0
    return fps, (
        f"the film's frames are not evenly spaced, {steps.min():.4g} to {steps.max():.4g} ms; they count one by one, "
        f"at the mean rate of {float(fps):.4g} frames per second",
    )


def _coding(frame: Any, path: str) -> tuple[FilmCoding, tuple[str, ...]]:
    """Return how a frame codes its colours, and remarks on what the film does not state."""
    kind = frame.format
    bits = max((component.bits for component in kind.components), default=8)
    remarks: list[str] = []
    if "f16" in kind.name or "f32" in kind.name:
        raise FileError(f"{shown(path)} has floating-point pixels ({kind.name}): give its frames as EXR files")
    if kind.name.startswith("bayer"):
        raise FileError(f"{shown(path)} has raw pixels of a sensor ({kind.name}): develop it first")
    if any(component.is_alpha for component in kind.components) and not kind.has_palette:
        remarks.append("the film's alpha is not used")
    if bits < _LEAST_BITS:
        raise FileError(f"{shown(path)} has colours of {bits} bits ({kind.name}): convert it to 8 bits or more")
    matrix: str | None = None
    full = True
    if not (kind.is_rgb or kind.has_palette):
        matrix, words = _matrix(frame, path)
        remarks += words
        grey = kind.name.startswith("gray")
        full = kind.name.startswith("yuvj") or frame.color_range == _FULL or (grey and frame.color_range == 0)
    curve = int(frame.color_trc)
    transfer = _TRANSFERS.get(curve, "rec709" if matrix is not None else "srgb")
    if curve not in (0, _UNKNOWN, *_TRANSFERS):
        remarks.append(f"the film's transfer function (number {curve} of H.273) is not known here")
    primaries = int(frame.color_primaries)
    if primaries not in (0, *_PRIMARIES):
        remarks.append(f"the film's primaries (number {primaries} of H.273) are not known here, and count as Rec.709")
    return FilmCoding(matrix, full, transfer, _PRIMARIES.get(primaries, "bt709"), bits), tuple(remarks)


def _matrix(frame: Any, path: str) -> tuple[str, list[str]]:
    """Return the matrix of a frame, and a remark if it is assumed."""
    number = int(frame.colorspace)
    if number in _MATRICES:
        return _MATRICES[number], []
    if number not in (0, _UNKNOWN):
        raise FileError(
            f"{shown(path)} has colours of an uncommon kind (matrix {number} of H.273): convert it to BT.709, or give "
            "an image sequence"
        )
    matrix = "bt709" if frame.height >= _HD_LINES else "bt601"
    return matrix, [f"the film states no colour matrix; that of BT.{matrix[2:]} is used, for its size"]


def _rotation(frame: Any) -> tuple[int, tuple[str, ...]]:
    """Return how far a picture is turned to be shown, counter-clockwise, and a remark on other angles."""
    angle = int(frame.rotation) % 360
    if angle % 90:
        return 0, (f"the film is shown turned by {angle} degrees, which is not a multiple of 90 and left out",)
    return angle, (f"the film is turned by {angle} degrees, as it is shown",) if angle else ()


def _time_code(container: Any) -> str:
    """Return the time code of the first frame; empty if none is stated."""
    for data in (container.metadata, *(stream.metadata for stream in container.streams)):
        if text := data.get("timecode"):
            return str(text)[:20]
    return ""
