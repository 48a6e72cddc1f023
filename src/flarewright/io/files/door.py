"""The one way to a file of the user: its size, its header's claim and every exception of a library are checked here.

A reader opens its file in `with outside(path, "a lens file") as file:` and reads or parses inside the block. What the
file would need in memory is compared with one limit before anything is allocated; any exception of a library inside
the block becomes one sentence. `tests/contracts/test_one_door.py` finds readers that open a file otherwise.
"""

from __future__ import annotations

import os
import re
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from math import prod
from pathlib import Path
from typing import Any, BinaryIO, NoReturn

from ...errors import FileError, FlarewrightError

LIMIT_VARIABLE = "FLAREWRIGHT_READ_LIMIT_MB"
"""Environment variable that sets the limit on what one file may need in memory, MB of 1e6 bytes."""
LIMIT_MB = 2000.0
"""The limit without it: a photograph of 150 megapixels at 16 bits, or a plate of 16384 x 12288 pixels, is below."""
QUOTED = 120
"""Largest number of characters of a library's message in a sentence."""

# archives of ours: pictures with black areas pack well, zeros of a damaged or hostile file a thousandfold
_MOST_PACKED, _ALWAYS_BYTES = 100, 64_000_000
_EXR, _NPY, _ZIP = b"v/1\x01", b"\x93NUMPY", b"PK"
_LONGEST_NAME = 255
_OPEN_FILE = re.compile(r" ?<_io\..*>")
# largest header of a picture or array that is parsed, bytes
_HEADER = 4_000_000
_EXR_SAMPLE = {0: 4, 1: 2, 2: 4}


def read_limit_bytes() -> float:
    """Return the limit on what one file may need in memory, bytes.

    Raises
    ------
    FileError
        The environment variable is no number above 0.
    """
    text = os.environ.get(LIMIT_VARIABLE, "").strip()
    try:
        limit = float(text) if text else LIMIT_MB
    except ValueError:
        limit = 0.0
    if not limit > 0.0:
        raise FileError(f"{LIMIT_VARIABLE} is {text[:QUOTED]!r}: give a number of megabytes above 0, or remove it")
    return limit * 1e6


@contextmanager
def outside(
    path: str | os.PathLike[str],
    what: str,
    *,
    largest: int | None = None,
    pixel_bytes: int | None = None,
    remedy: str = "is it the right file?",
) -> Iterator[BinaryIO]:
    """Open a file of the user for reading.

    Parameters
    ----------
    path : path
    what : str
        Expected kind of file, "a lens file", for messages.
    largest : int, optional
        Largest size of the file, bytes.
    pixel_bytes : int, optional
        Bytes that the reader allocates for a pixel; given by readers of images.
    remedy : str
        End of the message about a file that cannot be read.

    Yields
    ------
    binary file
        At its start. Readers of libraries that accept only a path open it again inside the block.

    Raises
    ------
    FileError
        The file is missing, a folder, not readable, too large, claims too much memory, or a library raised any
        exception inside the block; the message is one sentence. Other FlarewrightErrors of the block stay.
    """
    place = _regular(Path(path), what, largest)
    with sentences_for(place, what, remedy), place.open("rb") as file:
        _check_claim(file, place, what, pixel_bytes)
        file.seek(0)
        yield file


@contextmanager
def outside_arrays(path: str | os.PathLike[str], what: str, remedy: str) -> Iterator[Any]:
    """Open an `.npz` archive of arrays, which load one by one by their names; parameters and errors as `outside`."""
    import numpy as np

    with outside(path, what, remedy=remedy) as file:
        if file.read(len(_ZIP)) != _ZIP:
            raise ValueError("it is no archive of arrays")
        file.seek(0)
        with np.load(file, allow_pickle=False) as archive:
            yield archive


@contextmanager
def sentences_for(path: str | os.PathLike[str], what: str, remedy: str = "is it the right file?") -> Iterator[None]:
    """Turn any exception of the block into one sentence about a file; parameters and errors as `outside`."""
    try:
        yield
    except FlarewrightError:
        raise
    except Exception as error:
        if isinstance(error, OSError) and error.errno is not None:
            reason = (error.strerror or str(error)).lower()
            raise FileError(f"{shown(path)} cannot be read ({reason}): check its permissions") from None
        raise FileError(f"{shown(path)} cannot be read as {what} ({reason_of(error)}): {remedy}") from error


def reason_of(error: BaseException) -> str:
    """Return the reason of a library's exception in one line of at most 120 characters."""
    if isinstance(error, RecursionError):
        return "its parts are nested too deeply"
    if isinstance(error, UnicodeEncodeError):
        return "its name is not UTF-8"
    if isinstance(error, MemoryError):
        return "there is not enough memory"
    text = error.args[0] if error.args else ""
    words = text.decode("ascii", "replace") if isinstance(text, bytes) else str(text)
    # Pillow names the open file as Python shows it
    line = " ".join(_OPEN_FILE.sub("", words).split())[:QUOTED].rstrip(".:")
    return line or type(error).__name__


def shown(path: str | os.PathLike[str]) -> str:
    """Return a path as text that every output accepts: bytes of the name that are not UTF-8 become question marks."""
    return printable(str(path))


def printable(text: str) -> str:
    """Return a text in which bytes of file names that are not UTF-8 are question marks."""
    return text.encode("utf-8", "replace").decode("utf-8")


def expanded(text: str | os.PathLike[str]) -> Path:
    """Return a path with `~` resolved; unchanged, and then missing, if there is no such user.

    Raises
    ------
    FileError
        A part of the path is longer than any file system accepts, which `Path.exists` does not survive.
    """
    path = Path(text)
    if max(map(len, map(os.fsencode, path.parts)), default=0) > _LONGEST_NAME:
        raise FileError(f"{str(path)!r} is longer than a file name can be: check it")
    try:
        return path.expanduser()
    except RuntimeError:
        return path


def no_file(path: str | os.PathLike[str]) -> str:
    """Return why a path is no file, the predicate of a sentence that begins with its name; "" for a file."""
    place = Path(path)
    if place.is_file():
        return ""
    if place.is_dir():
        return "is a folder"
    if place.exists():
        return "is not a regular file"
    return "is a broken link" if place.is_symlink() else "does not exist"


def refuse_claim(path: str | os.PathLike[str], claim: str, needed: float) -> None:
    """Raise if a file would need more memory than the limit.

    Parameters
    ----------
    path : path
    claim : str
        What the header states, "30000 x 30000 pixels".
    needed : float
        Bytes to allocate.

    Raises
    ------
    FileError
    """
    allowed = read_limit_bytes()
    if needed > allowed:
        raise FileError(
            f"{shown(path)} states {claim}, {needed / 1e6:.0f} MB in memory, above the limit of {allowed / 1e6:g} MB: "
            f"give a smaller file, or set {LIMIT_VARIABLE}={needed / 1e6 + 1:.0f}"
        )


def _regular(file: Path, what: str, largest: int | None) -> Path:
    """Return the path of a regular file that is not too large."""
    name = shown(file)
    remedies = {
        "is a folder": f", not {what}: give the path of a file",
        "is a broken link": ": give the path of the file itself",
        "does not exist": ": check the path and the spelling",
        "is not a regular file": f": give the path of {what}",
    }
    try:
        if (reason := no_file(file)) != "":
            raise FileError(f"{name} {reason}{remedies[reason]}")
        size = file.stat().st_size
    except (OSError, ValueError) as error:
        if isinstance(error, FileError):
            raise
        # a name that is too long or holds a zero byte
        reason = (getattr(error, "strerror", None) or str(error)).lower()
        raise FileError(f"{name[:QUOTED]} cannot be read ({reason}): check its permissions") from None
    if largest is not None and size > largest:
        raise FileError(f"{name} has {size / 1e6:.1f} MB, too large for {what}: is it the right file?")
    return file


def _check_claim(file: BinaryIO, path: Path, what: str, pixel_bytes: int | None) -> None:
    """Compare what a file's header states with the limit, before anything is allocated."""
    start = file.read(8)
    file.seek(0)
    if start.startswith(_ZIP):
        _check_archive(file, path)
    elif start.startswith(_NPY):
        size = path.stat().st_size
        shape, needed = _array_claim(file)
        if needed > size:
            raise FileError(f"{shown(path)} is cut short: its header states an array of {shape}, {needed} bytes")
    elif start.startswith(_EXR):
        _check_exr(file, path, what, pixel_bytes or 0)
    elif pixel_bytes is not None:
        from PIL import Image

        if Image.MAX_IMAGE_PIXELS is not None:
            # our limit applies; Pillow's is lower than a plate that is allowed here
            Image.MAX_IMAGE_PIXELS = max(Image.MAX_IMAGE_PIXELS, int(read_limit_bytes()))
        with Image.open(file) as image:
            width, height = image.size
        refuse_claim(path, f"{width} x {height} pixels", width * height * pixel_bytes)


def _check_archive(file: BinaryIO, path: Path) -> None:
    """Check the sizes that a zip archive states, and those of its arrays."""
    # its import takes as long as reading a lens
    from zipfile import ZipFile

    size = path.stat().st_size
    with ZipFile(file) as archive:
        members = archive.infolist()
        needed = sum(one.file_size for one in members)
        refuse_claim(path, f"{len(members)} parts", needed)
        if needed > max(_ALWAYS_BYTES, _MOST_PACKED * size):
            raise FileError(
                f"{shown(path)} has {size / 1e6:.1f} MB and would unpack to {needed / 1e6:.0f} MB, more than "
                f"{_MOST_PACKED} times its size: it is damaged"
            )
        for one in members:
            with archive.open(one) as part:
                if part.read(len(_NPY)) != _NPY:
                    continue
            with archive.open(one) as part:
                shape, bytes_needed = _array_claim(part)
            if bytes_needed > one.file_size:
                raise FileError(f"{shown(path)} is damaged: its part {one.filename[:40]} states an array of {shape}")


def _array_claim(file: Any) -> tuple[str, int]:
    """Return the shape that an NPY header states, as text, and the bytes of the array."""
    from numpy.lib import format as npy

    version = npy.read_magic(file)
    read = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
    shape, _, dtype = read(file)
    if dtype.hasobject:
        raise ValueError("it holds Python objects")
    return " x ".join(map(str, shape)) or "1", prod(shape) * dtype.itemsize


def _check_exr(file: BinaryIO, path: Path, what: str, pixel_bytes: int) -> None:
    """Check the windows and channels that the header of each part of an EXR file states."""
    data = file.read(_HEADER)
    version = struct.unpack_from("<I", data, 4)[0]
    at, needed = 8, 0
    windows: list[int] = []
    while True:
        area, channels, at = _exr_part(data, at, path, what)
        if not area:
            break
        needed += max(area) * max(channels, pixel_bytes)
        windows += area
        if not version & 0x1000:
            break
    refuse_claim(path, f"windows of {max(windows, default=0)} pixels", needed)


def _exr_part(data: bytes, at: int, path: Path, what: str) -> tuple[list[int], int, int]:
    """Return the areas of a part's windows, its bytes a pixel and the header's end; no areas behind the last part."""
    areas: list[int] = []
    pixel = 0
    while data[at : at + 1] != b"\0":
        name_end = data.find(b"\0", at, at + 256)
        type_end = data.find(b"\0", name_end + 1, name_end + 257)
        if min(name_end, type_end) < 0 or type_end + 5 > len(data):
            _cut_short(path, what)
        name, (size,) = data[at:name_end], struct.unpack_from("<i", data, type_end + 1)
        at = type_end + 5
        if size < 0 or at + size > len(data):
            _cut_short(path, what)
        if name in (b"dataWindow", b"displayWindow") and size == 16:
            left, top, right, bottom = struct.unpack_from("<4i", data, at)
            if right < left or bottom < top:
                raise FileError(f"{shown(path)} cannot be read as {what}: its header states an empty window")
            areas.append((right - left + 1) * (bottom - top + 1))
        elif name == b"channels":
            pixel = _channel_bytes(data[at : at + size])
        at += size
    return areas, pixel, at + 1


def _channel_bytes(data: bytes) -> int:
    """Return the bytes a pixel of an EXR channel list."""
    total, at = 0, 0
    while (end := data.find(b"\0", at)) > at and end + 17 <= len(data):
        total += _EXR_SAMPLE.get(struct.unpack_from("<i", data, end + 1)[0], 4)
        at = end + 17
    return total


def _cut_short(path: Path, what: str) -> NoReturn:
    raise FileError(f"{shown(path)} cannot be read as {what}: its header is cut short")
