"""Write a film of pictures for a screen, H.264 or ProRes; long ones in parts, which are joined without a change."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ...errors import FileError, OutputError, optional
from ..files.atomic_write import check_replaceable, write_atomically
from .decoder import exact_flags, opened

# quality of H.264: a difference of about one code of 255; more bits for dark gradients, which a flare consists of. With
# x264's macroblock tree the bytes of pictures below some 100 px differ from run to run
_QUALITY = (("crf", "14"), ("aq-mode", "3"), ("mbtree", "0"), ("preset", "medium"))
# numbers of ITU-T H.273: BT.709 colours in the limited range, and what the codes are
_BT709, _LIMITED = 1, 1
_CURVES = {"srgb": 13, "rec709": 1}


@dataclass(frozen=True)
class FilmCodec:
    """How a kind of film is encoded.

    Attributes
    ----------
    words : str
        Its name for people.
    encoder, pixels : str
        FFmpeg's names.
    options : tuple of (str, str)
        Of the encoder.
    multiple_px : tuple of int
        Width and height are multiples of it.
    deep : bool
        Whether more than 8 bits of a picture matter.
    """

    words: str
    encoder: str
    pixels: str
    options: tuple[tuple[str, str], ...]
    multiple_px: tuple[int, int]
    deep: bool = False


FILM_CODECS = {
    # one thread: the bytes must not depend on the machine
    ".mp4": FilmCodec("H.264, 8 bits", "libx264", "yuv420p", (*_QUALITY, ("threads", "1")), (2, 2)),
    ".mov": FilmCodec(
        "ProRes 422 HQ, 10 bits", "prores_ks", "yuv422p10le", (("profile", "hq"), ("vendor", "apl0")), (2, 1), deep=True
    ),
}
"""Films that are written, by their suffix."""


def check_film_name(path: str | os.PathLike[str]) -> FilmCodec:
    """Return how a film is encoded, before the work.

    Raises
    ------
    OutputError
        The name has no known suffix, its folder does not exist, or PyAV or its encoder is missing.

    Examples
    --------
    >>> check_film_name("flare.mp4").words                                      # doctest: +SKIP
    'H.264, 8 bits'
    """
    place = Path(path)
    codec = FILM_CODECS.get(place.suffix.lower())
    if codec is None:
        raise OutputError(f"the film {place} must be named *.mp4 (H.264) or *.mov (ProRes 422 HQ)")
    check_replaceable(place)
    if not place.parent.is_dir():
        raise OutputError(f"cannot write {place}: the folder {place.parent} does not exist; create it first")
    av = _module(place)
    if codec.encoder not in av.codecs_available:
        other = next(suffix for suffix in FILM_CODECS if suffix != place.suffix.lower())
        raise OutputError(f"this PyAV has no encoder {codec.encoder}; write a *{other}, or install PyAV's wheel")
    return codec


def _module(path: Path) -> Any:
    av = optional("av", "video", f"writing {path}", kind=OutputError)
    av.logging.set_level(None)
    return av


def padded_size(size_px: tuple[int, int], codec: FilmCodec) -> tuple[int, int]:
    """Return the size of the film of a picture.

    Examples
    --------
    >>> padded_size((65, 49), FILM_CODECS[".mp4"])
    (66, 50)
    """
    width, height = (-(-side // least) * least for side, least in zip(size_px, codec.multiple_px, strict=True))
    return width, height


def write_film(
    path: str | os.PathLike[str],
    pictures: Iterable[tuple[int, NDArray[Any]]],
    size_px: tuple[int, int],
    fps: Fraction,
    *,
    transfer: Literal["srgb", "rec709"] = "srgb",
    pixel_aspect: float = 1.0,
    comment: str = "",
) -> None:
    """Write a film; the file is complete or absent.

    Parameters
    ----------
    path : path
        ".mp4": H.264, yuv420p. ".mov": ProRes 422 HQ, 10 bits.
    pictures : iterable of (int, ndarray of shape (H, W, 3), uint8 or uint16)
        Moments in frames from the first one, ascending, and codes, whose largest one is white.
    size_px : tuple of int
        Of the pictures. Odd ones are extended by their last column and row.
    fps : Fraction
    transfer : {"srgb", "rec709"}
        What the codes are; the film states it.
    pixel_aspect : float
    comment : str
        Stored in the file.

    Raises
    ------
    OutputError
        As of `check_film_name`; or the file cannot be written, or the pictures differ in size.

    Examples
    --------
    >>> black = np.zeros((36, 64, 3), np.uint8)
    >>> write_film("black.mp4", ((k, black) for k in range(48)), (64, 36), Fraction(24))    # doctest: +SKIP
    """
    codec = check_film_name(path)
    av = _module(Path(path))

    def write(temporary: Path) -> None:
        with _errors_of_the_disk(av), av.open(str(temporary), "w") as container:
            # no names of versions, so that the bytes depend on the pictures only
            container.flags |= av.container.Flags.bitexact.value
            container.metadata["comment"] = comment
            stream = _stream(container, codec, padded_size(size_px, codec), fps, _CURVES[transfer], pixel_aspect)
            for moment, picture in pictures:
                _check_size(path, picture, size_px)
                frame = _frame(av, _padded(picture, codec), codec, _CURVES[transfer])
                frame.pts, frame.time_base = moment, 1 / fps
                container.mux(stream.encode(frame))
            container.mux(stream.encode())

    write_atomically(Path(path), write)


def join_films(
    path: str | os.PathLike[str], parts: Sequence[tuple[int, Path]], fps: Fraction, *, time_code: str = "",
    comment: str = "",
) -> None:  # fmt: skip
    """Join films that `write_film` has written, without decoding them.

    Parameters
    ----------
    path : path
    parts : sequence of (int, Path)
        The first moment of each part, in frames, and its file.
    fps : Fraction
    time_code : str
        Of the first frame: "10:00:00:00".
    comment : str
        Stored in the file.

    Raises
    ------
    FlarewrightError
        A part cannot be read, or the file not be written.
    """
    av = _module(Path(path))

    def write(temporary: Path) -> None:
        # players begin before they have loaded all of it
        options = {"movflags": "+faststart"}
        with _errors_of_the_disk(av), av.open(str(temporary), "w", options=options) as container:
            container.flags |= av.container.Flags.bitexact.value
            container.metadata["comment"] = comment
            joined, last = None, None
            for moment, part in parts:
                for packet in _packets(part):
                    if joined is None:
                        joined = container.add_stream_from_template(packet.stream)
                        joined.codec_context.framerate = fps
                        if time_code:
                            joined.metadata["timecode"] = time_code
                    ticks = int(moment / fps / packet.time_base)
                    packet.pts, packet.dts = packet.pts + ticks, packet.dts + ticks
                    # where frames lie farther apart, a part begins to decode before the previous one has ended
                    packet.dts = last = packet.dts if last is None else max(packet.dts, last + 1)
                    packet.stream = joined
                    container.mux(packet)

    write_atomically(Path(path), write)


def _packets(part: Path) -> Iterator[Any]:
    """Yield the packets of a film; an error while they are written is not one of this film."""
    with opened(str(part)) as source:
        for packet in source.demux(source.streams.video[0]):
            if packet.dts is not None:
                yield packet


def comment_of(path: Path) -> str:
    """Return the comment in a film; empty if it cannot be read."""
    try:
        with opened(str(path)) as container:
            return str(container.metadata.get("comment", ""))
    except FileError:
        return ""


@contextmanager
def _errors_of_the_disk(av: Any) -> Iterator[None]:
    """Turn FFmpeg's errors, such as that of a full disk, into those of the operating system."""
    try:
        yield
    except av.error.FFmpegError as error:
        raise OSError(error.errno, error.strerror or "unknown error") from None


def _stream(
    container: Any, codec: FilmCodec, size_px: tuple[int, int], fps: Fraction, curve: int, pixel_aspect: float
) -> Any:
    stream = container.add_stream(codec.encoder, rate=fps, options=dict(codec.options))
    stream.width, stream.height = size_px
    stream.pix_fmt = codec.pixels
    context = stream.codec_context
    context.time_base = 1 / fps
    # a second between key frames: players jump to them
    context.gop_size = max(1, round(fps))
    context.colorspace = context.color_primaries = _BT709
    context.color_trc, context.color_range = curve, _LIMITED
    if pixel_aspect != 1.0:
        context.sample_aspect_ratio = Fraction(pixel_aspect).limit_denominator(1000)
    return stream


def _check_size(path: Any, picture: NDArray[Any], size_px: tuple[int, int]) -> None:
    if picture.shape != (size_px[1], size_px[0], 3):
        raise OutputError(
            f"cannot write {path}: a frame has {picture.shape[1]}x{picture.shape[0]} pixels, the first one "
            f"{size_px[0]}x{size_px[1]}; give frames of one size"
        )


def _padded(picture: NDArray[Any], codec: FilmCodec) -> NDArray[Any]:
    """Return a picture with its last row and column again where the codec needs them."""
    height, width = picture.shape[:2]
    wide, high = padded_size((width, height), codec)
    return np.pad(picture, ((0, high - height), (0, wide - width), (0, 0)), mode="edge")


def _frame(av: Any, picture: NDArray[Any], codec: FilmCodec, curve: int) -> Any:
    """Return a frame in the colours of the codec; FFmpeg converts with rounding to the nearest code."""
    names = av.video.reformatter
    kind = "rgb24" if picture.dtype == np.uint8 else "rgb48le"
    frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(picture), format=kind).reformat(
        format=codec.pixels,
        src_color_range=names.ColorRange.JPEG,
        dst_color_range=names.ColorRange.MPEG,
        dst_colorspace=names.Colorspace.ITU709,
        interpolation=exact_flags(av),
        threads=1,
    )
    frame.colorspace = frame.color_primaries = _BT709
    frame.color_trc, frame.color_range = curve, _LIMITED
    return frame
