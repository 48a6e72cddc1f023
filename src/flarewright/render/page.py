"""Pieces of a report: HTML that needs nothing but itself, no script and no request."""

from __future__ import annotations

import html
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from .figure import Figure, png_address, to_svg

__all__ = ["figures", "folded", "image", "page", "paragraph", "remark_list", "section", "table"]

# pixels that words below a narrow picture may take
_CAPTION = 240
_STYLE = (
    "body{font:15px/1.45 Helvetica,Arial,sans-serif;max-width:66em;margin:2em auto;padding:0 1em;color:#22313f;"
    "background:#fff}h1{font-size:1.6em;margin-bottom:.2em}h2{font-size:1.2em;margin-top:2em;border-bottom:1px solid "
    "#d5dde4}h3{font-size:1em;margin-bottom:.3em}table{border-collapse:collapse;font-size:.9em;margin:.6em 0}"
    "td,th{padding:.15em .7em;text-align:right;border-bottom:1px solid #edf1f4}td:first-child,th:first-child"
    "{text-align:left}td{white-space:nowrap}"
    "th{color:#5d6b78;font-weight:600;vertical-align:bottom}figure{display:inline-block;margin:0 .5em "
    ".6em 0;vertical-align:top}figcaption{font-size:.8em;color:#5d6b78}img{display:block;max-width:100%}"
    "svg{max-width:100%;height:auto}.scroll{overflow-x:auto}.good{color:#1d7a4b}.bad{color:#b3372e}"
    "ul{padding-left:1.2em;color:#5d6b78;font-size:.9em}"
)


def page(title: str, lead: str, sections: Iterable[str]) -> str:
    """Return a whole HTML page.

    Parameters
    ----------
    title, lead : str
        Plain text.
    sections : iterable of str
        HTML.
    """
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{html.escape(title)}</title>'
        f'<meta name="viewport" content="width=device-width"><style>{_STYLE}</style></head><body>'
        f"<h1>{html.escape(title)}</h1><p>{html.escape(lead)}</p>{''.join(sections)}</body></html>\n"
    )


def section(title: str, *parts: str) -> str:
    """Return a headline and HTML below it."""
    return f"<h2>{html.escape(title)}</h2>{''.join(parts)}"


def folded(title: str, *parts: str) -> str:
    """Return HTML that is seen once its title is clicked."""
    return f"<details><summary>{html.escape(title)}</summary>{''.join(parts)}</details>"


def paragraph(words: str) -> str:
    """Return plain text as a paragraph."""
    return f"<p>{html.escape(words)}</p>"


def remark_list(remarks: Sequence[str]) -> str:
    """Return remarks as a list, nothing for none."""
    items = "".join(f"<li>{html.escape(remark)}</li>" for remark in dict.fromkeys(remarks))
    return f"<ul>{items}</ul>" if items else ""


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table of plain texts."""
    top = "".join(f"<th>{html.escape(cell)}</th>" for cell in head)
    body = "".join("<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    return f'<div class="scroll"><table><tr>{top}</tr>{body}</table></div>'


def figures(*drawn: Figure) -> str:
    """Return figures as inline SVG, side by side."""
    return "".join(f"<figure>{to_svg(figure)}</figure>" for figure in drawn)


def image(rgb_uint8: NDArray[np.uint8], caption: str, width: int | None = None) -> str:
    """Return a picture as an inline PNG with words below it.

    Parameters
    ----------
    rgb_uint8 : ndarray, shape (H, W, 3), uint8
    caption : str
    width : int, optional
        In which it is shown; None: its own.
    """
    shown = rgb_uint8.shape[1] if width is None else width
    return (
        f'<figure><img width="{shown}" src="{png_address(rgb_uint8)}" alt="{html.escape(caption)}">'
        f'<figcaption style="max-width:{max(shown, _CAPTION)}px">{html.escape(caption)}</figcaption></figure>'
    )
