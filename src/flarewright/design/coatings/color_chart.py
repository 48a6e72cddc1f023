"""Charts of the reflectance of a quarter-wave coating in each channel (Van Acoleyen 2025, figure 5.10)."""

from __future__ import annotations

import numpy as np

from ...model.project.design import Bounds
from ...render.plots.chart import Series, chart
from ...render.plots.svg import Chart
from ...typing import Floats
from .colors import STEP_NM, WAVELENGTHS_NM, reflectances

_COLOURS = ("#c8413b", "#2d8a5f", "#1d5fa8")


def channel_curves(n_d: Floats, row: int, bounds: Bounds) -> tuple[Floats, Floats]:
    """Return centre wavelengths and the reflectance of a quarter wave of each in red, green and blue.

    Parameters
    ----------
    n_d : ndarray, shape (K + 1,)
        Indices, before row 0 and behind every row.
    row : int
    bounds : Bounds

    Returns
    -------
    center_wavelengths_nm : ndarray, shape (V,)
    reflectance : ndarray, shape (V, 3)
    """
    low, high = bounds.center_wavelength_nm
    grid = np.linspace(low, high, round((high - low) / STEP_NM) + 1)
    return grid, reflectances("quarter-wave", float(n_d[row]), float(n_d[row + 1]), grid[:, None])


def channel_chart(n_d: Floats, row: int, bounds: Bounds) -> Chart:
    """Draw `channel_curves` as a chart in per cent.

    Parameters
    ----------
    n_d : ndarray, shape (K + 1,)
    row : int
    bounds : Bounds
    """
    across, reflectance = channel_curves(n_d, row, bounds)
    series = [
        Series(f"{wavelength:g} nm", across, 100.0 * reflectance[:, channel], _COLOURS[channel])
        for channel, wavelength in enumerate(WAVELENGTHS_NM)
    ]
    title = f"row {row}, from n = {n_d[row]:.3f} to {n_d[row + 1]:.3f}"
    return chart(title, series, x_label="centre wavelength, nm", y_label="reflected, %", size=(560, 320))
