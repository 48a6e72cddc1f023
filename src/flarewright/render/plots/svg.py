"""Figures of lines, texts and boxes, as SVG or as pixels, without a plot library."""

from __future__ import annotations

import html
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ...io.files.atomic_write import write_text_atomically
from ...io.images.png import png_address, write_png

INK, FAINT, PAPER = "#22313f", "#8796a5", "#fbfcfd"

# supersampling factor for smooth edges
_FINER = 3


@dataclass(frozen=True)
class Line:
    """A polyline; coordinates in pixels from the upper left corner."""

    points: Sequence[tuple[float, float]]
    colour: str = INK
    width: float = 1.0


@dataclass(frozen=True)
class Area:
    """A semi-transparent filled polygon."""

    points: Sequence[tuple[float, float]]
    colour: str
    opacity: float


@dataclass(frozen=True)
class Box:
    """A filled rectangle."""

    x: float
    y: float
    width: float
    height: float
    colour: str


@dataclass(frozen=True)
class Text:
    """Text on a baseline."""

    x: float
    y: float
    words: str
    size: float = 12.0
    colour: str = INK
    anchor: Literal["start", "middle", "end"] = "start"


@dataclass(frozen=True)
class EmbeddedImage:
    """Pixels over a rectangle; shape (H, W, 3), uint8."""

    x: float
    y: float
    width: float
    height: float
    pixels: NDArray[np.uint8]


Mark = Line | Area | Box | Text | EmbeddedImage


@dataclass(frozen=True)
class Chart:
    """A list of marks on a canvas; later marks cover earlier ones."""

    width: int
    height: int
    title: str
    marks: tuple[Mark, ...]

    def __html__(self) -> str:
        """Return the chart as inline SVG, for templates (`io.images.html_page`)."""
        return to_svg(self)


def write_figure(path: Path, figure: Chart, about: str) -> None:
    """Write a figure as `.svg` or `.png`; on failure no partial file remains.

    Parameters
    ----------
    path : path
        The suffix determines the format.
    figure : Chart
    about : str
        Name of the program, for the file's metadata.

    Raises
    ------
    OutputError
        The file cannot be written.
    """
    if path.suffix.lower() == ".svg":
        write_text_atomically(path, to_svg(figure))
    else:
        write_png(path, chart_pixels(figure), {"Software": about, "Title": figure.title})


def to_svg(figure: Chart) -> str:
    """Return a figure as SVG text."""
    body = "\n".join(_svg_mark(mark) for mark in figure.marks)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {figure.width} {figure.height}" width="{figure.width}" '
        f'height="{figure.height}" font-family="Helvetica, Arial, sans-serif">\n'
        f"<title>{html.escape(figure.title)}</title>\n"
        f'<rect width="100%" height="100%" fill="{PAPER}"/>\n{body}\n</svg>\n'
    )


def _svg_mark(mark: Mark) -> str:
    if isinstance(mark, Line):
        return (
            f'<polyline points="{_svg_points(mark.points)}" fill="none" stroke="{mark.colour}" '
            f'stroke-width="{mark.width:g}" stroke-linejoin="round"/>'
        )
    if isinstance(mark, Area):
        return f'<polygon points="{_svg_points(mark.points)}" fill="{mark.colour}" fill-opacity="{mark.opacity:g}"/>'
    if isinstance(mark, Box):
        return (
            f'<rect x="{mark.x:.2f}" y="{mark.y:.2f}" width="{mark.width:.2f}" height="{mark.height:.2f}" '
            f'fill="{mark.colour}"/>'
        )
    if isinstance(mark, EmbeddedImage):
        return (
            f'<image x="{mark.x:.2f}" y="{mark.y:.2f}" width="{mark.width:.2f}" height="{mark.height:.2f}" '
            f'preserveAspectRatio="none" href="{png_address(mark.pixels)}"/>'
        )
    return (
        f'<text x="{mark.x:.2f}" y="{mark.y:.2f}" font-size="{mark.size:g}" text-anchor="{mark.anchor}" '
        f'fill="{mark.colour}">{html.escape(mark.words)}</text>'
    )


def _svg_points(points: Sequence[tuple[float, float]]) -> str:
    return " ".join(f"{x:.2f},{y:.2f}" for x, y in points)


def chart_pixels(figure: Chart) -> NDArray[np.uint8]:
    """Return a figure as 8-bit sRGB pixels, shape (height, width, 3)."""
    from PIL import Image, ImageColor, ImageDraw, ImageFont

    s = _FINER
    canvas = Image.new("RGB", (figure.width * s, figure.height * s), PAPER)
    draw = ImageDraw.Draw(canvas)
    for mark in figure.marks:
        if isinstance(mark, Line):
            points = [(x * s, y * s) for x, y in mark.points]
            draw.line(points, fill=mark.colour, width=max(1, round(mark.width * s)), joint="curve")
        elif isinstance(mark, Area):
            overlay = ImageDraw.Draw(canvas, "RGBA")
            red, green, blue = ImageColor.getrgb(mark.colour)[:3]
            points = [(x * s, y * s) for x, y in mark.points]
            overlay.polygon(points, fill=(red, green, blue, round(255 * mark.opacity)))
        elif isinstance(mark, Box):
            # Pillow's boxes include their last pixel
            right, low = (mark.x + mark.width) * s - 1, (mark.y + mark.height) * s - 1
            draw.rectangle([mark.x * s, mark.y * s, max(right, mark.x * s), max(low, mark.y * s)], fill=mark.colour)
        elif isinstance(mark, EmbeddedImage):
            held = Image.fromarray(mark.pixels).resize((round(mark.width * s), round(mark.height * s)))
            canvas.paste(held, (round(mark.x * s), round(mark.y * s)))
        else:
            font = ImageFont.load_default(mark.size * s)
            anchor = {"start": "ls", "middle": "ms", "end": "rs"}[mark.anchor]
            draw.text((mark.x * s, mark.y * s), mark.words, fill=mark.colour, font=font, anchor=anchor)
    return np.asarray(canvas.resize((figure.width, figure.height), Image.Resampling.BOX))
