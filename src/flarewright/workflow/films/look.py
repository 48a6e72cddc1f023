"""How the frames of a film are shown: one exposure and one curve for all of them, so that nothing flickers."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ...errors import FlarewrightError, ProjectError
from ...io.images.exr import ExrContents, read_exr
from ...io.images.plate_picture import PlatePicture, read_plate
from ...io.images.transfer import encoded_rec709
from ...plates.measured_plate import converted
from ...render.image.display import Transform, auto_exposure, layers_exposure, view, view_text

FilmView = Literal["filmic", "srgb", "aces", "rec709"]
"""The transforms of PNG files, and rec709: the curve of video cameras, as most films have it."""

# frames whose flare sets an automatic exposure
_EXPOSED_FRAMES = 24
_BRIGHT = ("pq", "hlg")


@dataclass(frozen=True)
class FilmLook:
    """The look of all frames.

    Attributes
    ----------
    view : {"filmic", "srgb", "aces", "rec709"}
    stops : float
    words : str
        For people.
    remarks : tuple of str
    """

    view: FilmView
    stops: float
    words: str
    remarks: tuple[str, ...] = ()


def film_look(
    files: Sequence[Path], first: PlatePicture, layer: str | None, name: FilmView | None, exposure_stops: float | None
) -> FilmLook:
    """Return the look of a film: as asked for, or by what its frames are.

    Parameters
    ----------
    files : sequence of Path
        All frames.
    first : PlatePicture
        The first one.
    layer : str or None
    name, exposure_stops
        None: a flare is filmic with the lowest automatic exposure of up to 24 frames. A comp has the curve of its
        plate, so that the plate looks as before; other pictures are srgb; both with an exposure of 0.
    """
    contents = _ours(files[0])
    if contents is not None and "colorspace" in contents.metadata and first.colorspace is None:
        raise ProjectError(
            f"the frames are in {contents.metadata['colorspace']}, and a film is made of frames in Rec.709 or ACEScg: "
            "draw them with --colorspace rec709"
        )
    space = first.colorspace or "rec709"
    if contents is None or "plate" in contents.metadata or "project" not in contents.metadata:
        plate = None if contents is None else _plate_transfer(contents)
        kind: FilmView = name or ("rec709" if plate == "rec709" else "srgb")
        stops = exposure_stops or 0.0
        remarks: tuple[str, ...] = ()
        if plate in _BRIGHT and exposure_stops is None and kind in ("srgb", "rec709"):
            remarks = (
                "the plate has high dynamic range, of which the film shows what is below white paper; --exposure -2 or "
                "--view filmic shows more",
            )
        return FilmLook(kind, stops, _words(kind, stops, first, automatic=False), remarks)
    kind = name or "filmic"
    if exposure_stops is not None:
        return FilmLook(kind, exposure_stops, _words(kind, exposure_stops, first, automatic=False))
    # at the lowest exposure the brightest frame shows all of its ghosts
    step = max(1, -(-len(files) // _EXPOSED_FRAMES))
    found = []
    for file in files[::step]:
        if layer is None:
            layers = read_exr(file).layers
            if any(each.pixels.any() for each in layers):
                found.append(layers_exposure(layers, space))
        elif (pixels := read_plate(file, layer=layer).pixels).any():
            found.append(auto_exposure(pixels, space))
    stops = min(found, default=0.0)
    return FilmLook(kind, stops, _words(kind, stops, first, automatic=True))


def shown(picture: PlatePicture, look: FilmLook, *, deep: bool = False) -> NDArray[Any]:
    """Return the codes of a frame.

    Parameters
    ----------
    picture : PlatePicture
    look : FilmLook
    deep : bool
        Return 16 bits; the curves of PNG files have 8.

    Returns
    -------
    ndarray, shape (H, W, 3), uint8 or uint16
    """
    if look.view != "rec709":
        return view(picture.pixels, look.stops, look.view, picture.colorspace or "rec709")
    with np.errstate(over="ignore"):
        light = np.clip(converted(picture, "rec709") * np.float32(2.0**look.stops), 0.0, 1.0)
    coded = encoded_rec709(light)
    codes: NDArray[Any] = np.rint(coded * (65535.0 if deep else 255.0)).astype(np.uint16 if deep else np.uint8)
    return codes


def _ours(path: Path) -> ExrContents | None:
    """Return the contents of an EXR file with our metadata; None for another kind of file."""
    if path.suffix.lower() != ".exr":
        return None
    try:
        return read_exr(path)
    except (FlarewrightError, KeyError):
        return None


def _plate_transfer(contents: ExrContents) -> str | None:
    """Return the transfer function of the plate of a comp."""
    try:
        found = json.loads(contents.metadata.get("plate", "{}"))
    except ValueError:
        return None
    return str(found.get("transfer")) if isinstance(found, dict) else None


def _words(kind: FilmView, stops: float, first: PlatePicture, *, automatic: bool) -> str:
    if kind == "rec709":
        how = " (automatic)" if automatic else ""
        return f"exposure {stops:+.2f} stops{how}, curve of video cameras (BT.709), clipped at white"
    known: Transform = kind
    return view_text(stops, known, first.colorspace or "rec709", automatic=automatic)
