"""The plot of a coating: R against wavelength at several angles, and the colour of reflected light."""

from __future__ import annotations

import re
import textwrap
from dataclasses import dataclass, replace
from math import ceil, log10

import numpy as np

from ...optics.coatings.response import CoatingResponse
from ...typing import Floats
from ..image.display import srgb_oetf
from .svg import FAINT, INK, Box, Chart, Line, Mark, Text

PLOT_ANGLES_DEG = (0.0, 15.0, 30.0, 45.0, 60.0)
STRIP_ANGLES_DEG = tuple(float(angle) for angle in range(0, 81))

_CURVES = ("#1d3f72", "#2f7fd1", "#2d9a72", "#e08a1e", "#c8313b")
_STRIPS = ("at equal brightness", "beside bare glass")
# percent; lowest value of the logarithmic axis, on which the 0 of an ideal film has no position
_FLOOR = 0.01
# mean width of a letter relative to its size
_LETTER = 0.56


@dataclass(frozen=True)
class Layout:
    """Positions in the figure, px.

    Attributes
    ----------
    width, height : int
    left, right, top, bottom : float
        Of the axes.
    headline, words : float
        Font sizes.
    films : float
        Baseline of the list of films; further lines shift everything below it.
    strips : tuple of float
        Upper edges of the colour strips.
    strip_height : float
    narrow : bool
        Omit axis titles and means of curves: the last tick shows the unit, and the strips share one caption.
    """

    width: int
    height: int
    left: float
    right: float
    top: float
    bottom: float
    headline: float
    words: float
    films: float
    strips: tuple[float, float]
    strip_height: float
    narrow: bool = False


SHEET = Layout(900, 560, 76.0, 872.0, 84.0, 400.0, 17.0, 11.0, 56.0, (442.0, 486.0), 24.0)
# for a panel beside other content, at its final size
PANEL = Layout(410, 214, 46.0, 398.0, 52.0, 142.0, 11.5, 10.0, 28.0, (174.0, 186.0), 11.0, narrow=True)


def coating_figure(
    curves: CoatingResponse, strip: CoatingResponse, bare: float, name: str, glass: str, layout: Layout = SHEET
) -> Chart:
    """Draw a coating.

    Parameters
    ----------
    curves : CoatingResponse
        At the angles of the curves, at most five.
    strip : CoatingResponse
        At the angles of the colour strips.
    bare : float
        Luminous reflectance of the bare glass at normal incidence: white in the second strip.
    name, glass : str
        Text of the headline.
    layout : Layout
        `SHEET` or `PANEL`.
    """
    lines = _lines(_films(curves), (layout.right - layout.left) / (_LETTER * layout.words))
    at = _lowered(layout, (len(lines) - 1) * 1.2 * layout.words)
    top = 10.0 ** max(ceil(log10(max(100.0 * float(curves.reflectance.max()), 1e-9)) - 1e-12), 0)
    above = 2.0 * layout.words if not layout.narrow else 1.4 * layout.words
    marks: list[Mark] = [Text(at.left, layout.films - above, f"{name} on {glass}", at.headline)]
    for k, line in enumerate(lines):
        marks.append(Text(at.left, layout.films + 1.2 * k * at.words, line, at.words, FAINT))
    marks += _axes(at, curves, top)
    for k, row in enumerate(curves.reflectance):
        points = list(zip(_across(at, curves), _up(at, 100.0 * row, top), strict=True))
        marks.append(Line(points, _CURVES[k], 1.2 if at.narrow else 2.0))
    marks += _legend(at, curves)
    marks += _strips(at, strip, bare)
    return Chart(at.width, at.height, f"Reflectance of {name} on {glass}", tuple(marks))


def _lowered(layout: Layout, by: float) -> Layout:
    """Shift everything below the list of films."""
    first, second = layout.strips
    return replace(
        layout, top=layout.top + by, bottom=layout.bottom + by, strips=(first + by, second + by),
        height=layout.height + round(by),
    )  # fmt: skip


def _films(curves: CoatingResponse) -> str:
    if not curves.films:
        return "no film"
    return "from the air: " + ", ".join(f"n {film.index:.4g}, {film.thickness_nm:.1f} nm" for film in curves.films)


def _lines(words: str, letters: float) -> list[str]:
    """Wrap a list of films without breaking a film."""
    whole = re.sub(r"(n [\d.]+), ([\d.]+) nm", lambda film: film[0].replace(" ", "\xa0"), words)
    return [line.replace("\xa0", " ") for line in textwrap.wrap(whole, int(letters))]


def _across(at: Layout, curves: CoatingResponse, wavelength_nm: Floats | None = None) -> Floats:
    wave = curves.wavelengths_nm
    nm = wave if wavelength_nm is None else wavelength_nm
    return np.asarray(at.left + (at.right - at.left) * (nm - wave[0]) / (wave[-1] - wave[0]))


def _up(at: Layout, percent: Floats, top: float) -> Floats:
    """Return positions on the logarithmic axis, which shows 0.1 % and 5 % together; clip values below its end."""
    part = np.log10(np.maximum(percent, _FLOOR) / _FLOOR) / log10(top / _FLOOR)
    return np.asarray(at.bottom - (at.bottom - at.top) * part)


def _axes(at: Layout, curves: CoatingResponse, top: float) -> list[Mark]:
    marks: list[Mark] = []
    wave = curves.wavelengths_nm
    ticks = np.arange(50.0 * ceil(wave[0] / 50.0), wave[-1] + 1.0, 50.0)
    for nm, x in zip(ticks, _across(at, curves, ticks), strict=True):
        words = f"{nm:.0f} nm" if at.narrow and nm == ticks[-1] else f"{nm:.0f}"
        marks.append(Line([(x, at.top), (x, at.bottom)], "#e3e8ed"))
        marks.append(Text(x, at.bottom + 1.4 * at.words, words, at.words, INK, "middle"))
    for decade in range(round(log10(_FLOOR)), round(log10(top))):
        for digit in range(1, 11):
            percent = digit * 10.0**decade
            y = float(_up(at, np.array(percent), top))
            marks.append(Line([(at.left, y), (at.right, y)], "#cfd7de" if digit in (1, 10) else "#eef1f4"))
            if digit in ((10,) if at.narrow else (2, 5, 10)) or percent == _FLOOR:
                marks.append(Text(at.left - 0.7 * at.words, y + 4, f"{percent:.3g} %", at.words, INK, "end"))
    marks.append(Line([(at.left, at.top), (at.left, at.bottom), (at.right, at.bottom)], INK, 1.2))
    if not at.narrow:
        marks.append(Text(at.right, at.bottom + 30.0, "wavelength, nm", at.words, FAINT, "end"))
    return marks


def _legend(at: Layout, curves: CoatingResponse) -> list[Mark]:
    marks: list[Mark] = []
    for k, (angle, mean) in enumerate(zip(curves.angles_deg, curves.mean_reflectance, strict=True)):
        x = at.left + (at.right - at.left) / len(PLOT_ANGLES_DEG) * k
        words = f"{angle:g}°" if at.narrow else f"{angle:g} degrees, mean {100.0 * mean:.2f} %"
        marks += [
            Line([(x, at.top - 12.0), (x + 20.0, at.top - 12.0)], _CURVES[k], 3.0),
            Text(x + 26.0, at.top - 8.0, words, at.words),
        ]
    return marks


def _strips(at: Layout, strip: CoatingResponse, bare: float) -> list[Mark]:
    """Draw the colours of reflected daylight by angle: hue alone, and relative to bare glass."""
    light = np.maximum(strip.rgb, 0.0)
    brightest = np.maximum(light.max(axis=1, keepdims=True), 1e-30)
    marks: list[Mark] = []
    step = (at.right - at.left) / len(light)
    if at.narrow:
        words = f"reflected daylight by angle: {' and '.join(_STRIPS)}"
        marks.append(Text(at.left, at.strips[0] - 4.0, words, at.words, FAINT))
    for y, words, shown in zip(at.strips, _STRIPS, (light / brightest, light / bare), strict=True):
        if not at.narrow:
            marks.append(Text(at.left, y - 5.0, f"reflected daylight {words}", at.words, FAINT))
        for k, rgb in enumerate(np.rint(255.0 * srgb_oetf(np.minimum(shown, 1.0))).astype(int)):
            # overlap the next box, so that no background is visible between them
            wide = step + (0.5 if k < len(light) - 1 else 0.0)
            marks.append(Box(at.left + k * step, y, wide, at.strip_height, f"#{rgb[0]:02x}{rgb[1]:02x}{rgb[2]:02x}"))
    foot = at.strips[1] + at.strip_height
    for k, angle in enumerate(strip.angles_deg):
        if angle % 10.0 == 0.0:
            x = at.left + (k + 0.5) * step
            words = f"{angle:g}{'°' if at.narrow else ''}"
            marks.append(Text(x, foot + 1.3 * at.words, words, at.words, INK, "middle"))
    if not at.narrow:
        marks.append(Text(at.right, foot + 30.0, "angle of incidence, degrees", at.words, FAINT, "end"))
    return marks
