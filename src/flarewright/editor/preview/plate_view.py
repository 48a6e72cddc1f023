"""The plate under the flare, at the size of the picture, and the comp of both."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from ...errors import FileError, ProjectError
from ...io.files.door import shown
from ...io.images.plate_picture import PlatePicture
from ...model import Backplate, PlateSearch
from ...typing import Pixels
from ...workflow.plates.plate_files import backplate_picture
from .picture import DrawnPicture


@dataclass(frozen=True)
class ShownPlate:
    """A plate, cropped and scaled to fill a picture.

    Attributes
    ----------
    pixels : ndarray, shape (H, W, 3)
        Linear Rec.709.
    lamps : ndarray, shape (H, W), or None
        1 where the plate shows the lights of the project already, with a soft edge; None: nowhere.
    too_dark : bool
        Whether it shows its lights darker than they are.
    """

    pixels: Pixels
    lamps: Pixels | None = None
    too_dark: bool = False


def plate_for(plate: Backplate | None, size_px: tuple[int, int]) -> ShownPlate | None:
    """Return the plate of a project for a picture of a size; None where there is none.

    Raises
    ------
    ProjectError
        The file is gone or no picture.
    """
    if plate is None:
        return None
    try:
        changed = Path(plate.image).stat().st_mtime_ns
    except (OSError, ValueError):
        raise ProjectError(f"the plate {plate.image} is gone; choose another") from None
    # of the search only what the comp shows: a moved slider must not make the mask again
    gain = 2.0 if plate.search.brightened else 1.0
    kept = plate.replace(search=PlateSearch(gain=gain, highlights=plate.search.highlights))
    return _shown(kept, changed, size_px)


@lru_cache(maxsize=6)
def _shown(plate: Backplate, changed_ns: int, size_px: tuple[int, int]) -> ShownPlate:
    del changed_ns
    picture = _read(plate)
    from ...plates.measured_plate import converted

    pixels = _filled(converted(picture, "rec709"), size_px)
    if plate.lights_above is None:
        return ShownPlate(pixels)
    from ...plates.comp import source_mask
    from ...plates.measured_plate import measured_pixels

    lamps = source_mask(measured_pixels(picture, plate.search.highlights), plate.lights_above)
    too_dark = picture.white is not None or plate.search.brightened
    return ShownPlate(pixels, _filled(lamps[..., None], size_px)[..., 0], too_dark)


def _read(plate: Backplate) -> PlatePicture:
    try:
        return backplate_picture(plate)
    except FileError as error:
        raise ProjectError(str(error).replace(shown(Path(plate.image)), Path(plate.image).name)) from None


def _filled(linear: Pixels, size_px: tuple[int, int]) -> Pixels:
    """Return a picture cropped and scaled to fill a size, its centre in the centre."""
    width, height = size_px
    high, wide, channels = linear.shape
    zoom = max(width / wide, height / high)
    left, top = (wide - width / zoom) / 2.0, (high - height / zoom) / 2.0
    box = (max(left, 0.0), max(top, 0.0), min(wide - left, wide), min(high - top, high))
    # average over the covered area, to avoid aliasing of fine detail
    return np.stack([_scaled(linear[..., channel], size_px, box) for channel in range(channels)], axis=-1)


def _scaled(plane: Pixels, size_px: tuple[int, int], box: tuple[float, float, float, float]) -> Pixels:
    from PIL import Image

    scaled = Image.fromarray(np.ascontiguousarray(plane)).resize(size_px, Image.Resampling.BILINEAR, box=box)
    return np.asarray(scaled, dtype=np.float32)


def is_lit(plate: Backplate | None) -> bool:
    """Return whether lights of a project are those of its plate, so that flare and plate have one unit."""
    return plate is not None and plate.lit


def plate_under(picture: DrawnPicture, present: Backplate | None) -> Backplate | None:
    """Return the plate to show under a picture: the present one, unless the picture has lights in another unit.

    After a search, or its undo, the earlier picture stays for a moment as it was.
    """
    own = picture.project.plate
    return present if is_lit(own) == is_lit(present) else own


def comp_of(picture: DrawnPicture, ghosts: Pixels, plate: ShownPlate) -> Pixels:
    """Add a flare in the unit of a plate to it, as `plates.comp.composed` does.

    Parameters
    ----------
    picture : DrawnPicture
    ghosts : ndarray, shape (H, W, 3)
        Of the picture, matched to final ones.
    plate : ShownPlate
        Of the size of the picture.

    Returns
    -------
    ndarray, shape (H, W, 3)
    """
    total = np.asarray(plate.pixels + ghosts + picture.rest)
    if plate.lamps is None:
        return total
    star = picture.rest if picture.haze is None else picture.rest - picture.haze
    inside = plate.lamps[..., None]
    total -= star * inside
    if plate.too_dark:
        total += inside * np.maximum(star - plate.pixels, 0.0)
    return total
