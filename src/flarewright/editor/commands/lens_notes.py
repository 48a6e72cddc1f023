"""Remarks on cells of a prescription: unusual values, and values without effect."""

from __future__ import annotations

import numpy as np

from ...errors import FlarewrightError
from ...io.lens.media import attach
from ...model import Lens, Surface
from ...optics.lens.surface_shape import sag

# thinner glass at edge or middle cannot be manufactured, mm
THIN_MM = 0.5
STEEP = 0.95
# tolerance for the image distance, which patents round
RECORD_MM = 0.1


def notes(lens: Lens, sensor_distance: float | None = None) -> dict[int, dict[str, str]]:
    """Return remarks on values that cannot be manufactured or have no effect.

    Parameters
    ----------
    lens : Lens
    sensor_distance : float, optional
        Distance of the sensor behind the last vertex, mm; None if unknown.

    Returns
    -------
    dict of int to dict
        Row to column to sentence.
    """
    sentences: dict[int, dict[str, str]] = {}
    for k, row in enumerate(lens.rows):
        here: dict[str, str] = {}
        if isinstance(row, Surface):
            _rim(row, here)
            _glass(row, here)
        _gap(lens, k, here)
        if k == len(lens.rows) - 1:
            _image(row.thickness, sensor_distance, here)
        if here:
            sentences[k] = here
    return sentences


def _image(thickness: float, sensor_distance: float | None, here: dict[str, str]) -> None:
    if sensor_distance is not None and thickness != 0.0 and abs(thickness - sensor_distance) > RECORD_MM:
        here["thickness"] = (
            f"Kept as a record, without effect: the sensor is at the lens' focus, {sensor_distance:.4g} mm behind."
        )


def _rim(row: Surface, here: dict[str, str]) -> None:
    semi = row.semi_diameter
    if semi is None or row.curvature == 0.0:
        return
    if abs(row.curvature) * semi >= 1.0 and row.conic == 0.0:
        here["semi_diameter"] = "The rim lies beyond the sphere's equator: make it smaller than the radius."
    elif abs(row.curvature) * semi > STEEP and row.conic == 0.0:
        here["radius"] = "Nearly a hemisphere: rays meet its rim at a grazing angle."


def _glass(row: Surface, here: dict[str, str]) -> None:
    medium = row.medium
    if medium is None:
        return
    if not 1.4 <= medium.n_d <= 2.1:
        here["n_d"] = "No optical glass has this index; they lie between 1.43 and 2.1."
    if medium.v_d is None:
        here["v_d"] = "No Abbe number is given, so the dispersion of this glass is estimated from its index."
    elif not 15.0 <= medium.v_d <= 100.0:
        here["v_d"] = "No optical glass has this Abbe number; they lie between 16 and 95."
    if medium.glass:
        try:
            finding = attach(medium.glass, medium.n_d, medium.v_d)[1]
        except FlarewrightError:
            return
        if finding.kind == "reported":
            here["glass"] = f"{finding.text[:1].upper()}{finding.text[1:]}."


def _gap(lens: Lens, k: int, here: dict[str, str]) -> None:
    """Check the gap behind a row, on the axis and at the smaller of the two rims."""
    if k + 1 >= len(lens.rows):
        return
    row, following = lens.rows[k], lens.rows[k + 1]
    glass = isinstance(row, Surface) and row.medium is not None
    if row.thickness < 0.0:
        here["thickness"] = "Negative: the next surface stands in front of this one."
        return
    heights = [
        each.semi_diameter for each in (row, following) if isinstance(each, Surface) and each.semi_diameter is not None
    ]
    rim = row.thickness
    if heights:
        y = np.array([min(heights)])
        with np.errstate(invalid="ignore"):
            step = sag(following, np.zeros(1), y)[0] - sag(row, np.zeros(1), y)[0]
        rim = row.thickness + float(np.nan_to_num(step))
    if rim < -1e-6:
        here["thickness"] = f"The two surfaces cross {-rim:.2f} mm before their rim."
    elif glass and min(rim, row.thickness) < THIN_MM:
        here["thickness"] = f"The glass is only {min(rim, row.thickness):.2f} mm thick; it would break."
