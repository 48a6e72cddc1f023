"""The HTML report of one camera's flare over the constellation."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..render.chart import COLOURS, Series, chart, number
from ..render.display import auto_exposure, view
from ..render.page import figures, image, page, paragraph, remark_list, section, table
from .curves import bins_of
from .occurrence import Occurrence, contrast_curve
from .statistics import NAMES

WORDS = {
    "sum_mm2": "sum (times mm²)",
    "mean": "mean",
    "maximum": "maximum",
    "minimum": "minimum",
    "log_average": "log-average",
}
_DRAWN = ("sum_mm2", "mean", "maximum", "log_average")
_ANGLE = "constellation, degrees from the axis"

__all__ = ["WORDS", "occurrence_page", "shown_together"]


def occurrence_page(found: Occurrence) -> str:
    """Return the report.

    Parameters
    ----------
    found : Occurrence

    Returns
    -------
    str
        HTML.
    """
    flare, curves = found.flare, found.curves
    efl = "" if flare.efl is None else f"{flare.efl:.4g} mm, "
    lead = (
        f"{flare.name}, {efl}{flare.aperture}, sensor {found.frame.width:g} x {found.frame.height:g} mm, "
        f"{found.quality} quality, {len(curves.constellation_deg)} constellations. Values are {flare.unit}; "
        f"{flare.left_out}."
    )
    parts = [section("Flare over the constellation", _charts(found), _extremes(found))]
    if found.pictures:
        parts.append(section("What it looks like", _pictures(found)))
    parts.append(section("In context", _context(found)))
    if found.check is not None:
        parts.append(section("How far this holds", _check(found)))
    parts.append(remark_list(flare.remarks))
    return page(f"Flare of {flare.name}", lead, parts)


def _charts(found: Occurrence) -> str:
    at = found.curves.constellation_deg
    drawn = []
    for k, name in enumerate(_DRAWN):
        values = found.curves.column(name)
        series = [Series("", at, values, COLOURS[k])]
        if found.check is not None:
            rendered = found.check.rendered[:, NAMES.index(name)]
            series.append(Series("", found.check.constellation_deg, rendered, "#22313f", 0.0))
        edges, _ = bins_of(values, found.bins)
        drawn.append(chart(WORDS[name], series, x_label=_ANGLE, logarithmic=True, bands=edges[1:-1].tolist()))
    words = (
        f"Lines across divide each curve's range into {found.bins} even bins between its extremes (Walch 2017, section "
        "9.2)."
    )
    dots = " Dots are renders of their own." if found.check is not None else ""
    return figures(*drawn) + paragraph(words + dots)


def _extremes(found: Occurrence) -> str:
    at = found.curves.constellation_deg
    rows = []
    for name in NAMES:
        values = found.curves.column(name)
        low, high = int(np.argmin(values)), int(np.argmax(values))
        worst = at[bins_of(values, found.bins)[1] == found.bins]
        span = "-" if worst.size == 0 or values[high] == values[low] else f"{worst.min():.3g} to {worst.max():.3g}"
        rows.append((WORDS[name], number(values[low]), f"{at[low]:.4g}", number(values[high]), f"{at[high]:.4g}", span))
    head = ("estimator", "least", "at, degrees", "most", "at, degrees", "worst bin lies within, degrees")
    return table(head, rows)


def _pictures(found: Occurrence) -> str:
    shown, stops = shown_together([picture for _, picture in found.pictures])
    images = "".join(
        image(pixels, f"{angle:.4g} degrees", 232) for pixels, (angle, _) in zip(shown, found.pictures, strict=True)
    )
    return images + paragraph(f"All at one exposure, {stops:+.1f} stops; {found.flare.left_out}.")


def shown_together(pictures: Sequence[NDArray[np.float32]]) -> tuple[list[NDArray[np.uint8]], float]:
    """Turn linear pictures into 8 bits at one exposure that shows the brightest without burning it out.

    Parameters
    ----------
    pictures : sequence of ndarray, shape (H, W, 3)

    Returns
    -------
    shown : list of ndarray, uint8
    stops : float
    """
    lit = [auto_exposure(picture) for picture in pictures if float(picture.max(initial=0.0)) > 0.0]
    stops = min(lit, default=0.0)
    return [view(picture, stops) for picture in pictures], stops


def _context(found: Occurrence) -> str:
    if not np.isfinite(found.flare.scene_scale):
        return paragraph(
            "There is no scene to compare with: say what value a scene of 1 cd/m² has in the captures with "
            "--unit-per-cd-m2."
        )
    at, setting = found.curves.constellation_deg, found.setting
    veil = found.veil_cd_m2
    drawn = [
        chart(
            "mean flare as luminance of the scene", [Series("", at, veil, COLOURS[5])], x_label=_ANGLE,
            y_label="cd/m²", logarithmic=True,
        )
    ]  # fmt: skip
    light = "The light that was photographed"
    if found.flare.per_lux:
        light = f"A light that gives {number(setting.illuminance_lx)} lx on a plane facing it"
    words = f"{light} lights the sensor, on average, as much as a scene of {number(float(veil.max()))} cd/m² at worst."
    ratio = contrast_curve(found)
    if ratio is not None and setting.luminance_cd_m2 is not None:
        low, high = setting.luminance_cd_m2
        drawn.append(
            chart("contrast left, K_real / K_ideal", [Series("", at, ratio, COLOURS[1])], x_label=_ANGLE)
        )  # fmt: skip
        worst = int(np.argmin(ratio))
        words += (
            f" In a scene of {number(low)} to {number(high)} cd/m² it leaves {ratio[worst]:.1%} of the contrast at "
            f"{at[worst]:.4g} degrees (equations 9.1 to 9.3)."
        )
    if found.glare is not None:
        words += (
            f" The scene itself veils the lens too: its veiling glare index is {found.glare.index:.2%} at "
            f"{found.glare.wavelength_nm:.0f} nm."
        )
    return figures(*drawn) + paragraph(words)


def _check(found: Occurrence) -> str:
    assert found.check is not None
    check = found.check
    rows = []
    for k, angle in enumerate(check.constellation_deg):
        cells = [f"{angle:.4g}"]
        for name in _DRAWN:
            column = NAMES.index(name)
            cells += [number(check.predicted[k, column]), number(check.rendered[k, column])]
        rows.append(tuple(cells))
    head = ["degrees"]
    for name in _DRAWN:
        head += [WORDS[name], "rendered"]
    words = (
        "Between the samples the curves are straight lines. Here they stand beside final renders of their own, with "
        "all wavelengths and full detail, at constellations that were not sampled."
    )
    return paragraph(words) + table(head, rows)
