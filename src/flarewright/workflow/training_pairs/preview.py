"""A contact sheet of items: flared and clean picture, flare alone, and masks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ...errors import FlarewrightError
from ...io.images.contact_sheet import Figure, sheet_picture
from ...model.project.dataset import DatasetSpec
from ...sentences import count
from .background import list_backgrounds
from .draw import check_lenses
from .pictures import Pictures, draw_pictures
from .sensor import codes

# a row of the sheet
_COLUMNS = ("flared", "clean", "flare", "masks")
_SIDE_PX = 320
# hues of neighbouring identifiers differ by the golden ratio, so that no two are alike
_GOLDEN = 0.618034


Row = list[Figure]
"""The pictures of one item."""


def preview_picture(
    spec: DatasetSpec,
    items: int,
    *,
    threads: int | None = None,
    report: Callable[[int, int], None] | None = None,
    step: Callable[[Callable[[], Row]], Row] = lambda draw: draw(),
) -> NDArray[np.uint8]:
    """Return a contact sheet of the first items of a data set, one in each row.

    Parameters
    ----------
    spec : DatasetSpec
    items : int
    threads : int, optional
        None: all cores.
    report : callable, optional
        Called after each item with the number of finished items and the number of all.
    step : callable, optional
        Takes what draws the next item, and returns its row; it can return that of an interrupted preview instead.

    Returns
    -------
    ndarray, shape (H, W, 3), uint8

    Raises
    ------
    FlarewrightError
        As `run.dataset`.
    """
    check_lenses(spec)
    backgrounds = list_backgrounds(spec)
    figures: list[Figure] = []
    for index in range(items):
        try:
            figures += step(partial(_row, spec, index, backgrounds, threads))
        except FlarewrightError as error:
            raise type(error)(f"item {index}: {error}", error.problems) from None
        if report is not None:
            report(index + 1, items)
    return sheet_picture(figures)


def _row(spec: DatasetSpec, index: int, backgrounds: Sequence[str], threads: int | None) -> Row:
    """Draw an item."""
    drawn = draw_pictures(spec, index, backgrounds, threads)
    light, tone = drawn.linear, drawn.sensor.tone
    flare = light["starburst"] + light["ghosts"] + light["veil"]
    pictures = (
        *(codes(picture, tone, 8) for picture in (light["flared"], light["clean"], flare)),
        _coloured(drawn),
    )
    record = drawn.record
    titles = (
        f"{index} {drawn.split}: flared",
        f"f/{record['f_number']:.3g}, {record['coating']}",
        str(record["lens"])[-34:],
        f"{count(len(record['ghosts']), 'ghost')}, {count(len(record['lights']), 'light')}",
    )
    return [
        Figure("", title, "", "", f"{index}-{column}.png", _small(picture))
        for picture, title, column in zip(pictures, titles, _COLUMNS, strict=True)
    ]


def _coloured(drawn: Pictures) -> NDArray[np.uint8]:
    """Return the masks in colours: lights white, each ghost another hue."""
    from colorsys import hsv_to_rgb

    identifiers = range(int(drawn.ghost_mask.max()))
    hues = [hsv_to_rgb(k * _GOLDEN % 1.0, 0.8, 0.9) for k in identifiers]
    table = (np.array([(0.0, 0.0, 0.0), *hues]) * 255.0).astype(np.uint8)
    picture = table[drawn.ghost_mask]
    picture[drawn.light_mask > 0] = 255
    return picture


def _small(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    from PIL import Image

    high, wide = picture.shape[:2]
    part = min(1.0, _SIDE_PX / max(high, wide))
    size = max(1, round(wide * part)), max(1, round(high * part))
    return np.asarray(Image.fromarray(picture).resize(size, Image.Resampling.BOX))
