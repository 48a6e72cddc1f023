"""Backgrounds of training pairs: crops of a folder's pictures, or synthetic pictures."""

from __future__ import annotations

import os
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import FlarewrightError, ProjectError
from ...io.images.photo import PHOTO_SUFFIXES
from ...io.images.picture import SCREEN, read_picture
from ...model.project.dataset import DatasetSpec
from ...optics.colour.rgb import luminance_weights
from ...typing import Floats, Pixels
from .draw import BACKGROUND, draw_number, stream

SUFFIXES = (*SCREEN, *PHOTO_SUFFIXES)
"""Files of a folder that are used; others are ignored."""

# a black background has no mean to which lights could be compared
_LEAST_MEAN = 1e-6
# sides of the random grids of a synthetic picture, coarse to fine, pixels
_OCTAVES = (3, 7, 17, 41, 97)


def list_backgrounds(spec: DatasetSpec) -> tuple[str, ...]:
    """Return the pictures of the specification's folder, as sorted paths relative to it.

    Returns
    -------
    tuple of str
        With "/" on every system; empty without a folder.

    Raises
    ------
    ProjectError
        There is no such folder, it holds no pictures, or a link in it leads to no file.
    """
    if spec.background.folder is None:
        return ()
    folder = Path(spec.background.folder)
    if not folder.is_dir():
        raise ProjectError(f"background.folder: there is no folder {folder}; check the path and the spelling")
    found = []
    for base, folders, names in os.walk(folder):
        folders.sort()
        found += [
            (Path(base) / name).relative_to(folder).as_posix()
            for name in names
            if Path(name).suffix.lower() in SUFFIXES and not name.startswith(".")
        ]
    if not found:
        raise ProjectError(f"background.folder: {folder} holds no pictures ({', '.join(SUFFIXES)}); choose another one")
    lost = next((name for name in found if not os.path.isfile(folder / name)), None)
    if lost is not None:
        raise ProjectError(f"background.folder: {lost[:120]} is a link that leads to no file; mend or remove it")
    return tuple(sorted(found))


def background_of(spec: DatasetSpec, index: int, names: Sequence[str]) -> tuple[Pixels, dict[str, Any]]:
    """Return the background of an item.

    Parameters
    ----------
    spec : DatasetSpec
    index : int
    names : sequence of str
        From `list_backgrounds`.

    Returns
    -------
    pixels : ndarray, shape (height, width, 3), float32
        Linear Rec.709, not negative; white of an 8-bit picture is 1.
    facts : dict
        Which picture and which crop, as JSON data.

    Raises
    ------
    FlarewrightError
        The picture cannot be read.
    """
    rng = stream(spec, index, BACKGROUND)
    if not names:
        return _synthetic(spec.size_px, rng), {"synthetic": True}
    name = names[int(rng.integers(len(names)))]
    assert spec.background.folder is not None
    path = Path(spec.background.folder) / name
    try:
        whole = _read(path, path.stat().st_mtime_ns if path.exists() else 0)
    except FlarewrightError as error:
        raise ProjectError(f"background {name}: {error}") from None
    box = _crop_box(whole.shape[:2], spec.size_px, draw_number(spec.background.crop, rng), rng)
    flipped = bool(spec.background.flip and rng.random() < 0.5)
    pixels = _resized(whole, box, spec.size_px)
    if flipped:
        pixels = np.ascontiguousarray(pixels[:, ::-1])
    return pixels, {"file": name, "crop": [round(edge, 3) for edge in box], "flipped": flipped}


@lru_cache(maxsize=8)
def _read(path: Path, _: int) -> Pixels:
    """Read a picture; a few are kept, since a small folder serves many items."""
    pixels = np.maximum(read_picture(path), np.float32(0.0))
    pixels.flags.writeable = False
    return pixels


def _crop_box(
    shape: tuple[int, int], size_px: tuple[int, int], part: float, rng: np.random.Generator
) -> tuple[float, float, float, float]:
    """Return the left, upper, right and lower edge of a random crop with the item's proportions."""
    high, wide = shape
    scale = part * min(wide / size_px[0], high / size_px[1])
    # rounding must not leave the picture
    across, down = min(wide, scale * size_px[0]), min(high, scale * size_px[1])
    left, top = rng.random() * (wide - across), rng.random() * (high - down)
    return float(left), float(top), float(left + across), float(top + down)


def _resized(whole: Pixels, box: tuple[float, float, float, float], size_px: tuple[int, int]) -> Pixels:
    """Resample a crop with Pillow's antialiased triangle filter, in linear light."""
    from PIL import Image

    out = np.empty((size_px[1], size_px[0], 3), np.float32)
    for channel in range(3):
        plane = Image.fromarray(np.ascontiguousarray(whole[:, :, channel]))
        out[:, :, channel] = np.asarray(plane.resize(size_px, Image.Resampling.BILINEAR, box=box))
    return out


def _synthetic(size_px: tuple[int, int], rng: np.random.Generator) -> Pixels:
    """Draw a picture with the large and small contrasts of a photograph: sky, ground, blocks and texture.

    The amplitudes of the texture fall as 1 / frequency, as those of natural pictures do (Field 1987).
    """
    wide, high = size_px
    texture = np.zeros((1, 1), np.float32)
    # from octave to octave: a smooth texture needs no large picture
    for side in _OCTAVES:
        grid = rng.standard_normal((side, side), dtype=np.float32) * np.float32(_OCTAVES[0] / side)
        texture = grid + _enlarged(texture, (side, side))
    texture = _enlarged(texture, size_px)
    y = np.linspace(0.0, 1.0, high, dtype=np.float32)[:, None, None]
    horizon = float(rng.uniform(0.3, 0.7))
    sky, top, ground = (_colour(rng, *limits) for limits in ((0.15, 1.0), (0.05, 0.8), (0.02, 0.4)))
    picture = np.where(y < horizon, top + (sky - top) * (y / horizon), ground * (0.5 + 0.5 * y))
    picture = np.broadcast_to(picture, (high, wide, 3)).astype(np.float32)
    for _ in range(int(rng.integers(3, 12))):
        width, height = (int(size * rng.uniform(0.03, 0.25)) + 1 for size in size_px)
        left = int(rng.integers(0, max(1, wide - width)))
        base = int(high * rng.uniform(horizon, 1.0))
        picture[max(0, base - height) : base, left : left + width] = _colour(rng, 0.01, 0.6)
    picture *= np.exp(np.float32(rng.uniform(0.1, 0.5)) * texture)[:, :, None]
    return picture


def _enlarged(plane: Pixels, size_px: tuple[int, int]) -> Pixels:
    from PIL import Image

    return np.asarray(Image.fromarray(plane).resize(size_px, Image.Resampling.BICUBIC))


def _colour(rng: np.random.Generator, least: float, largest: float) -> Floats:
    """Return a desaturated colour with a log-uniform luminance."""
    level = np.exp(rng.uniform(np.log(least), np.log(largest)))
    tint = np.exp(rng.normal(0.0, 0.2, 3))
    colour: Floats = level * tint / (tint @ luminance_weights("rec709"))
    return colour


def mean_luminance(pixels: Pixels) -> float:
    """Return the mean luminance of a picture in linear Rec.709, at least 1e-6."""
    # sum down the columns first: along a row the three channels alternate
    means = pixels.sum(axis=0, dtype=np.float64).sum(axis=0) / (pixels.size / 3)
    return max(_LEAST_MEAN, float(means @ luminance_weights("rec709")))
