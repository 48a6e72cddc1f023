"""Contact sheets: small pictures with captions as a page (HTML) and as one picture (PNG)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import ceil
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..files.atomic_write import write_text_atomically
from .html_page import html_page
from .png import write_png

COLUMNS = 4
_LABEL_PX, _MARGIN_PX = 26, 8
# largest width that a title gives to a column of smaller pictures
_TITLE_PX = 320
_PAPER, _INK = (18, 18, 20), (210, 210, 214)


@dataclass(frozen=True)
class Figure:
    """One picture of a contact sheet.

    Attributes
    ----------
    section : str
        Heading above it.
    title, caption, command : str
    file : str
        File name of the picture, in the page's folder.
    pixels : ndarray, shape (H, W, 3), uint8
        All figures have the same size.
    """

    section: str
    title: str
    caption: str
    command: str
    file: str
    pixels: NDArray[np.uint8]


def write_contact_sheet(folder: Path, title: str, figures: Sequence[Figure]) -> tuple[Path, Path]:
    """Write `index.html` and `contact-sheet.png` into the folder of the figures' files.

    Parameters
    ----------
    folder : Path
        Must exist.
    title : str
    figures : sequence of Figure
        At least one.

    Returns
    -------
    page, picture : Path

    Raises
    ------
    OutputError
        When a file cannot be written.
    """
    page, picture = folder / "index.html", folder / "contact-sheet.png"
    write_png(picture, sheet_picture(figures), {"Description": title})
    text = sheet_page(title, figures)
    write_text_atomically(page, text)
    return page, picture


def sheet_page(title: str, figures: Sequence[Figure]) -> str:
    """Return the HTML page of a contact sheet, all texts escaped."""
    return html_page("contact-sheet", title=title, figures=figures)


def sheet_picture(figures: Sequence[Figure]) -> NDArray[np.uint8]:
    """Return all figures as one picture, each above its title.

    Columns are wider than small pictures, so that titles fit; a title longer than its column is cut.

    Returns
    -------
    ndarray, shape (rows * (H + label), COLUMNS * column, 3), uint8
    """
    from PIL import Image, ImageDraw, ImageFont

    height, width = figures[0].pixels.shape[:2]
    font = ImageFont.load_default(size=15)
    longest = ceil(max(font.getlength(figure.title) for figure in figures)) + 2 * _MARGIN_PX
    column = max(width, min(longest, _TITLE_PX))
    rows = -(-len(figures) // COLUMNS)
    sheet = Image.new("RGB", (COLUMNS * column, rows * (height + _LABEL_PX)), _PAPER)
    pen = ImageDraw.Draw(sheet)
    for k, figure in enumerate(figures):
        x, y = (k % COLUMNS) * column, (k // COLUMNS) * (height + _LABEL_PX)
        sheet.paste(Image.fromarray(figure.pixels), (x, y))
        title = _fitting(figure.title, font.getlength, column - 2 * _MARGIN_PX)
        pen.text((x + _MARGIN_PX, y + height + 4), title, fill=_INK, font=font)
    return np.asarray(sheet)


def _fitting(title: str, length: Callable[[str], float], room_px: float) -> str:
    """Return a title, cut at its end if it is longer than the room."""
    if length(title) <= room_px:
        return title
    kept = next((end for end in range(len(title) - 1, 0, -1) if length(f"{title[:end]}...") <= room_px), 0)
    return f"{title[:kept].rstrip()}..."
