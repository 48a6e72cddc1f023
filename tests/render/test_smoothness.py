"""Ghosts are smooth: the grid on which they are drawn is invisible."""

import numpy as np
import pytest

from flarewright.model import Camera, Light, Output, Project, Quality
from flarewright.render.render import render


def departure(light: np.ndarray) -> tuple[float, float]:
    """Return rms and largest departure from the best polynomial of sixth degree, relative to the mean."""
    y, x = (
        grid.ravel() for grid in np.meshgrid(*(np.linspace(-1.0, 1.0, side) for side in light.shape), indexing="ij")
    )
    terms = np.stack([x**i * y**j for i in range(7) for j in range(7 - i)], axis=1)
    values = light.ravel() / light.mean()
    left = values - terms @ np.linalg.lstsq(terms, values, rcond=None)[0]
    return float(left.std()), float(np.abs(left).max())


@pytest.mark.parametrize(
    ("lens", "field", "window", "wavelengths"),
    [
        ("heliar-tronnier", (4.71, 2.83), (380, 400, 80, 60), 1),
        ("speed-panchro-50", (3.86, 2.32), (400, 210, 60, 36), 1),
        pytest.param("heliar-tronnier", (4.71, 2.83), (380, 400, 80, 60), 3, marks=pytest.mark.slow),
        pytest.param("speed-panchro-50", (3.86, 2.32), (400, 210, 60, 36), 3, marks=pytest.mark.slow),
        pytest.param("double-gauss-tronnier", (-11.31, 6.8), (1030, 215, 60, 40), 3, marks=pytest.mark.slow),
    ],
)
def test_folded_ghosts_show_no_triangles(lens, field, window, wavelengths):
    project = Project(
        lens=lens, lights=(Light(field_deg=field),), camera=Camera(size_px=(1280, 720)),
        quality=Quality(wavelengths=wavelengths, ringing="off"), output=Output(layers="passes", starburst=False),
    )  # fmt: skip
    ghosts = next(layer for layer in render(project).layers if layer.name == "ghosts")
    x, y, width, height = window
    x, y = x - ghosts.window[0], y - ghosts.window[1]
    rms, worst = departure(ghosts.pixels[y : y + height, x : x + width, 1].astype(np.float64))
    assert rms < 5e-3
    assert worst < 2.5e-2
