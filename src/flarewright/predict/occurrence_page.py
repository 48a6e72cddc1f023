"""HTML report of one camera's flare over the constellation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..io.images.html_page import html_page
from ..render.image.display import auto_exposure, view
from ..render.plots.chart import COLOURS, Series, chart, number
from ..render.plots.svg import Chart
from ..typing import Pixels
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


def occurrence_page(found: Occurrence) -> str:
    """Return the report of a prediction.

    Returns
    -------
    str
        HTML.
    """
    shown, stops = shown_together([picture for _, picture in found.pictures])
    return html_page(
        "occurrence", title=f"Flare of {found.flare.name}", found=found, flare=found.flare,
        efl="" if found.flare.efl is None else f"{found.flare.efl:.4g} mm, ", charts=_charts(found),
        extremes=_extremes(found), stops=stops, context=_context(found), checked=_check(found),
        pictures=[(pixels, f"{angle:.4g} degrees") for pixels, (angle, _) in zip(shown, found.pictures, strict=True)],
    )  # fmt: skip


def _charts(found: Occurrence) -> list[Chart]:
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
    return drawn


def _extremes(found: Occurrence) -> list[tuple[str, ...]]:
    at = found.curves.constellation_deg
    rows: list[tuple[str, ...]] = []
    for name in NAMES:
        values = found.curves.column(name)
        low, high = int(np.argmin(values)), int(np.argmax(values))
        worst = at[bins_of(values, found.bins)[1] == found.bins]
        span = "-" if worst.size == 0 or values[high] == values[low] else f"{worst.min():.3g} to {worst.max():.3g}"
        rows.append((WORDS[name], number(values[low]), f"{at[low]:.4g}", number(values[high]), f"{at[high]:.4g}", span))
    return rows


def shown_together(pictures: Sequence[Pixels]) -> tuple[list[NDArray[np.uint8]], float]:
    """Convert linear pictures to 8 bits at one exposure at which the brightest is not clipped.

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


def _context(found: Occurrence) -> dict[str, Any]:
    if not np.isfinite(found.flare.scene_scale):
        words = "There is no scene to compare with: give the value of a scene of 1 cd/m² in the captures with "
        return {"charts": (), "words": words + "--unit-per-cd-m2."}
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
        drawn.append(chart("remaining contrast, K_real / K_ideal", [Series("", at, ratio, COLOURS[1])], x_label=_ANGLE))
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
    return {"charts": drawn, "words": words}


def _check(found: Occurrence) -> dict[str, Any] | None:
    check = found.check
    if check is None:
        return None
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
    return {"head": head, "rows": rows}
