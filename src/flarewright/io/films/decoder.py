"""Open a film for reading, safe from what other files it names and from how large its header says that it is."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, BinaryIO

from ...errors import FileError, optional
from ..files.door import outside, read_limit_bytes, refuse_claim, shown

READS = "give MP4, MOV, MKV, WebM, AVI or MXF, or an image sequence"
"""End of the message about a film that cannot be read."""

# lists of other files, such as HLS, are no films: they open files and addresses that the user did not name
_CONTAINERS = "mov,mp4,matroska,webm,avi,mxf,mpeg,mpegts,asf,ogg"
# the decoder's pictures, the codes, and linear values on the way
_PIXEL_BYTES = 50
_LARGEST_SIDE = 16384
_BUFFER_BYTES = 1 << 18


def av_module(path: Any) -> Any:
    """Return PyAV; raises FileError with the remedy where it is missing."""
    av = optional("av", "video", f"the film {shown(path)}", kind=FileError, hint=", or give an image sequence")
    # our sentence is the only one about a damaged film
    av.logging.set_level(None)
    return av


def exact_flags(av: Any) -> Any:
    """Return the flags with which FFmpeg rounds to the nearest code; a sharper filter would ring around lights."""
    flags = av.video.reformatter.Interpolation
    return flags.BILINEAR | flags.ACCURATE_RND | flags.FULL_CHR_H_INT | flags.FULL_CHR_H_INP | flags.BITEXACT


@contextmanager
def opened(path: str) -> Iterator[Any]:
    """Open a film; its errors become one sentence.

    Yields
    ------
    av.container.InputContainer

    Raises
    ------
    FileError
        PyAV or the file is missing, or the file is damaged, no film, or too large; also while the block reads it.
    """
    av = av_module(path)
    options = {"format_whitelist": _CONTAINERS, "protocol_whitelist": "none", "max_pixels": str(_most_pixels())}
    with outside(path, "a film", remedy=READS) as file, _plain(av):
        if not file.read(1):
            raise FileError(f"{shown(path)} is empty: a film was expected")
        file.seek(0)
        how = {"options": options, "metadata_errors": "replace", "buffer_size": _BUFFER_BYTES}
        with av.open(_Bytes(file), "r", **how) as container:
            yield container


@contextmanager
def _plain(av: Any) -> Iterator[None]:
    """Turn errors of FFmpeg, which count as errors of the operating system, into those of the file's contents."""
    failure = (av.error.FFmpegError, OSError)
    try:
        yield
    except failure as error:
        raise ValueError((error.strerror or "unknown error").lower()) from None


class _Bytes:
    """The bytes of a file for PyAV, which prints exceptions: a damaged film seeks before its start."""

    def __init__(self, file: BinaryIO) -> None:
        self.read, self.tell = file.read, file.tell
        self._file = file

    def seek(self, offset: int, origin: int = 0) -> int:
        """Return the new place, or -1, FFmpeg's answer for an error."""
        try:
            return self._file.seek(offset, origin)
        except (OSError, ValueError, OverflowError):
            return -1

    def readable(self) -> bool:
        """Return True."""
        return True

    def seekable(self) -> bool:
        """Return True."""
        return True


def _most_pixels() -> int:
    """Return the largest number of pixels of a frame that the limit on memory allows."""
    return max(1, int(read_limit_bytes() / _PIXEL_BYTES))


def video_of(container: Any, path: str) -> Any:
    """Return the first stream of pictures of a film, decoded by one thread.

    Raises
    ------
    FileError
        There is none, its codec is unknown, or its frames need too much memory.
    """
    found = [stream for stream in container.streams.video if not _is_cover(stream)]
    if not found:
        raise FileError(f"{shown(path)} has no pictures: {READS}")
    stream = found[0]
    codec = stream.codec_context
    if codec is None:
        raise FileError(f"{shown(path)} has pictures of an unknown codec: {READS}")
    width, height = codec.width, codec.height
    if width < 1 or height < 1:
        raise FileError(f"{shown(path)} states no size of its pictures: {READS}")
    refuse_claim(path, f"{width} x {height} pixels", width * height * _PIXEL_BYTES)
    if max(width, height) > _LARGEST_SIDE:
        raise FileError(f"{shown(path)} states {width} x {height} pixels: give at most {_LARGEST_SIDE} a side")
    # the bytes of a frame do not depend on threads; processes share the frames
    codec.thread_count = 1
    # a later frame can be larger than the first
    codec.options = {"max_pixels": str(_most_pixels())}
    return stream


def _is_cover(stream: Any) -> bool:
    """Return whether a stream is the picture on the cover of a piece of music."""
    return "attached_pic" in str(getattr(stream, "disposition", "")).lower()
