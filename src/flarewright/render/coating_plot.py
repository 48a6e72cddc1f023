"""The plot of a coating: R against wavelength at a few angles, and the colour of what it reflects."""

from __future__ import annotations

from math import ceil, log10

import numpy as np
from numpy.typing import NDArray

from ..optics.coating_response import CoatingResponse
from .display import srgb_oetf
from .figure import FAINT, INK, Box, Figure, Line, Mark, Text

Floats = NDArray[np.float64]

PLOT_ANGLES_DEG = (0.0, 15.0, 30.0, 45.0, 60.0)
STRIP_ANGLES_DEG = tuple(float(angle) for angle in range(0, 81))

_WIDTH, _HEIGHT = 900, 560
_LEFT, _RIGHT, _TOP, _BOTTOM = 76.0, 872.0, 84.0, 400.0
_CURVES = ("#1d3f72", "#2f7fd1", "#2d9a72", "#e08a1e", "#c8313b")
_STRIPS = ((442.0, "at equal brightness"), (486.0, "beside bare glass"))
_STRIP_HEIGHT = 24.0
# percent; an ideal film's zero has no place on a logarithmic axis
_FLOOR = 0.01


def coating_figure(curves: CoatingResponse, strip: CoatingResponse, bare: float, name: str, glass: str) -> Figure:
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
        For the headline.

    Returns
    -------
    Figure
    """
    top = 10.0 ** max(ceil(log10(max(100.0 * float(curves.reflectance.max()), 1e-9)) - 1e-12), 0)
    marks: list[Mark] = [Text(_LEFT, 34.0, f"{name} on {glass}", 17.0), Text(_LEFT, 56.0, _films(curves), 11.0, FAINT)]
    marks += _axes(curves, top)
    for k, row in enumerate(curves.reflectance):
        marks.append(Line(list(zip(_across(curves), _up(100.0 * row, top), strict=True)), _CURVES[k], 2.0))
    marks += _legend(curves)
    marks += _strips(strip, bare)
    return Figure(_WIDTH, _HEIGHT, f"Reflectance of {name} on {glass}", tuple(marks))


def _films(curves: CoatingResponse) -> str:
    if not curves.films:
        return "no film"
    return "from the air: " + ", ".join(f"n {film.index:.4g}, {film.thickness_nm:.1f} nm" for film in curves.films)


def _across(curves: CoatingResponse, wavelength_nm: Floats | None = None) -> Floats:
    wave = curves.wavelengths_nm
    at = wave if wavelength_nm is None else wavelength_nm
    return np.asarray(_LEFT + (_RIGHT - _LEFT) * (at - wave[0]) / (wave[-1] - wave[0]))


def _up(percent: Floats, top: float) -> Floats:
    """Place percents on a logarithmic axis, which shows 0.1 % and 5 % side by side; what is less stays on the floor."""
    part = np.log10(np.maximum(percent, _FLOOR) / _FLOOR) / log10(top / _FLOOR)
    return np.asarray(_BOTTOM - (_BOTTOM - _TOP) * part)


def _axes(curves: CoatingResponse, top: float) -> list[Mark]:
    marks: list[Mark] = []
    wave = curves.wavelengths_nm
    ticks = np.arange(50.0 * ceil(wave[0] / 50.0), wave[-1] + 1.0, 50.0)
    for nm, x in zip(ticks, _across(curves, ticks), strict=True):
        marks += [Line([(x, _TOP), (x, _BOTTOM)], "#e3e8ed"), Text(x, _BOTTOM + 16.0, f"{nm:.0f}", 11.0, INK, "middle")]
    for decade in range(round(log10(_FLOOR)), round(log10(top))):
        for digit in range(1, 11):
            percent = digit * 10.0**decade
            y = float(_up(np.array(percent), top))
            marks.append(Line([(_LEFT, y), (_RIGHT, y)], "#cfd7de" if digit in (1, 10) else "#eef1f4"))
            if digit in (2, 5, 10) or percent == _FLOOR:
                marks.append(Text(_LEFT - 8, y + 4, f"{percent:.3g} %", 11, INK, "end"))
    marks.append(Line([(_LEFT, _TOP), (_LEFT, _BOTTOM), (_RIGHT, _BOTTOM)], INK, 1.2))
    marks.append(Text(_RIGHT, _BOTTOM + 30.0, "wavelength, nm", 11.0, FAINT, "end"))
    return marks


def _legend(curves: CoatingResponse) -> list[Mark]:
    marks: list[Mark] = []
    for k, (angle, mean) in enumerate(zip(curves.angles_deg, curves.mean_reflectance, strict=True)):
        x = _LEFT + 160.0 * k
        marks += [
            Line([(x, _TOP - 12.0), (x + 20.0, _TOP - 12.0)], _CURVES[k], 3.0),
            Text(x + 26.0, _TOP - 8.0, f"{angle:g} degrees, mean {100.0 * mean:.2f} %", 11.0),
        ]
    return marks


def _strips(strip: CoatingResponse, bare: float) -> list[Mark]:
    """Draw the colours of reflected daylight against the angle: hue alone, and as bright as beside bare glass."""
    light = np.maximum(strip.rgb, 0.0)
    brightest = np.maximum(light.max(axis=1, keepdims=True), 1e-30)
    marks: list[Mark] = []
    step = (_RIGHT - _LEFT) / len(light)
    for (y, words), shown in zip(_STRIPS, (light / brightest, light / bare), strict=True):
        marks.append(Text(_LEFT, y - 5.0, f"reflected daylight {words}", 11.0, FAINT))
        for k, rgb in enumerate(np.rint(255.0 * srgb_oetf(np.minimum(shown, 1.0))).astype(int)):
            # a little wider than its place, so that no paper shows between
            wide = step + (0.5 if k < len(light) - 1 else 0.0)
            marks.append(Box(_LEFT + k * step, y, wide, _STRIP_HEIGHT, f"#{rgb[0]:02x}{rgb[1]:02x}{rgb[2]:02x}"))
    for k, angle in enumerate(strip.angles_deg):
        if angle % 10.0 == 0.0:
            x = _LEFT + (k + 0.5) * step
            marks.append(Text(x, _STRIPS[1][0] + _STRIP_HEIGHT + 15.0, f"{angle:g}", 11.0, INK, "middle"))
    marks.append(Text(_RIGHT, _STRIPS[1][0] + _STRIP_HEIGHT + 30.0, "angle of incidence, degrees", 11.0, FAINT, "end"))
    return marks
