"""Contact sheets: small pictures with captions as a page (HTML) and as one picture (PNG)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..files.atomic_write import write_text_atomically
from .html_page import html_page
from .png import write_png

COLUMNS = 4
_LABEL_PX = 26
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

    Returns
    -------
    ndarray, shape (rows * (H + label), COLUMNS * W, 3), uint8
    """
    from PIL import Image, ImageDraw, ImageFont

    height, width = figures[0].pixels.shape[:2]
    rows = -(-len(figures) // COLUMNS)
    sheet = Image.new("RGB", (COLUMNS * width, rows * (height + _LABEL_PX)), _PAPER)
    pen, font = ImageDraw.Draw(sheet), ImageFont.load_default(size=15)
    for k, figure in enumerate(figures):
        x, y = (k % COLUMNS) * width, (k // COLUMNS) * (height + _LABEL_PX)
        sheet.paste(Image.fromarray(figure.pixels), (x, y))
        pen.text((x + 8, y + height + 4), figure.title, fill=_INK, font=font)
    return np.asarray(sheet)
