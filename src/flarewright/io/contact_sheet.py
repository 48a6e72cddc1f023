"""Contact sheets: many small pictures with their names on one page (HTML) and in one picture (PNG)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .atomic import write_atomically
from .png import write_png

COLUMNS = 4
_LABEL_PX = 26
_PAPER, _INK = (18, 18, 20), (210, 210, 214)

_STYLE = """
body { background: #121214; color: #d2d2d6; font: 15px/1.45 system-ui, sans-serif; margin: 2rem auto; max-width: 110rem;
  padding: 0 1.5rem; }
h1, h2 { font-weight: 600; }
.sheet { display: grid; grid-template-columns: repeat(auto-fill, minmax(20rem, 1fr)); gap: 1.5rem; }
figure { margin: 0; }
img { width: 100%; display: block; border-radius: 4px; background: #000; }
figcaption { padding: .5rem 0; }
small { color: #96969c; display: block; }
code { display: block; margin-top: .4rem; padding: .4rem .6rem; background: #1e1e22; border-radius: 4px;
  overflow-x: auto; white-space: nowrap; font-size: 12px; user-select: all; }
"""


@dataclass(frozen=True)
class Figure:
    """A picture of a contact sheet.

    Attributes
    ----------
    section : str
        The heading that it stands under.
    title, caption, command : str
    file : str
        The picture's file beside the page.
    pixels : ndarray, shape (H, W, 3), uint8
        Of the same size for all figures.
    """

    section: str
    title: str
    caption: str
    command: str
    file: str
    pixels: NDArray[np.uint8]


def write_contact_sheet(folder: Path, title: str, figures: Sequence[Figure]) -> tuple[Path, Path]:
    """Write `index.html` and `contact-sheet.png` into a folder that has the figures' files.

    Parameters
    ----------
    folder : Path
        Exists.
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
    write_atomically(page, lambda temporary: _write(temporary, text))
    return page, picture


def sheet_page(title: str, figures: Sequence[Figure]) -> str:
    """Return the page of a contact sheet, all words escaped."""
    out = [
        "<!doctype html>",
        '<html lang="en">',
        f'<head><meta charset="utf-8"><title>{escape(title)}</title><style>{_STYLE}</style></head>',
        f"<body><h1>{escape(title)}</h1>",
    ]
    for section in dict.fromkeys(figure.section for figure in figures):
        out.append(f'<h2>{escape(section)}</h2><div class="sheet">')
        for figure in figures:
            if figure.section == section:
                out.append(
                    f'<figure><img src="{escape(figure.file)}" alt="{escape(figure.title)}" loading="lazy">'
                    f"<figcaption>{escape(figure.title)}<small>{escape(figure.caption)}</small>"
                    f"<code>{escape(figure.command)}</code></figcaption></figure>"
                )
        out.append("</div>")
    return "\n".join([*out, "</body></html>", ""])


def sheet_picture(figures: Sequence[Figure], columns: int = COLUMNS) -> NDArray[np.uint8]:
    """Return all figures as one picture, each above its title.

    Parameters
    ----------
    figures : sequence of Figure
    columns : int

    Returns
    -------
    ndarray, shape (rows * (H + label), columns * W, 3), uint8
    """
    from PIL import Image, ImageDraw, ImageFont

    height, width = figures[0].pixels.shape[:2]
    rows = -(-len(figures) // columns)
    sheet = Image.new("RGB", (columns * width, rows * (height + _LABEL_PX)), _PAPER)
    pen, font = ImageDraw.Draw(sheet), ImageFont.load_default(size=15)
    for k, figure in enumerate(figures):
        x, y = (k % columns) * width, (k // columns) * (height + _LABEL_PX)
        sheet.paste(Image.fromarray(figure.pixels), (x, y))
        pen.text((x + 8, y + height + 4), figure.title, fill=_INK, font=font)
    return np.asarray(sheet)


def _write(path: Path, text: str) -> None:
    path.write_text(text, "utf-8")
