"""Bright ghosts of coated lenses are drawn in full detail even where they are dark at the middle wavelength.

An ideal quarter wave has R = 0 at its centre. A ghost from two such mirrors is blue and red, and as bright as others in
these; judged by its green alone it would be drawn coarsely, in few colours, or not at all.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

from flarewright.model import Light, Project
from flarewright.model.lens.coating import QuarterWave
from flarewright.model.project.project import Everywhere
from flarewright.render.render import render
from flarewright.render.scene.opening import make_opening
from flarewright.render.scene.resolve import load_lens, resolve_project
from flarewright.render.scene.shots import make_shots

ZOOM = ("canon-28-80", (320, 180), {"wavelengths": 7})
"""351 ghosts, most of them faint."""

PRIME = ("double-gauss-tronnier", (96, 54), {"wavelengths": 3, "paths": "same-side", "ringing": "off"})
"""Fewer ghosts, some of which are drawn coarsely or in few colours."""

FEW = ("heliar-tronnier", (48, 27), {"wavelengths": 3, "ringing": "off"})


def project(lens: str, size: tuple[int, int], quality: dict, **more: object) -> Project:
    return Project(
        lens=lens,
        f_number=5.6,
        lights=(Light(field_deg=(12.0, 7.0)),),
        coating=Everywhere(coating=QuarterWave(center_wavelength_nm=550.0, index="ideal")),
        camera={"size_px": size},
        quality={**quality, **more},
        output={"starburst": False},
    )


def ghosts(shown: Project) -> np.ndarray:
    layer = next(layer for layer in render(shown).layers if layer.name == "ghosts")
    x, y, width, height = layer.window
    columns, rows = shown.camera.size_px
    picture = np.zeros((rows, columns, 3))
    picture[y : y + height, x : x + width] = layer.pixels
    return picture


def blocks(picture: np.ndarray) -> np.ndarray:
    down, across = picture.shape[0] // 16, picture.shape[1] // 16
    return picture[: 16 * down, : 16 * across].reshape(down, 16, across, 16, 3).mean(axis=(1, 3))


@lru_cache(maxsize=1)
def zoom_in_full() -> np.ndarray:
    return in_full(project(*ZOOM))


def in_full(shown: Project) -> np.ndarray:
    """Return all ghosts as separate layers, which are drawn in full detail."""
    return ghosts(shown.replace(output=shown.output.replace(layers="ghosts")))


@pytest.mark.parametrize("scene", [PRIME, pytest.param(ZOOM, marks=pytest.mark.slow)], ids=["prime", "zoom"])
def test_detail_is_lost_only_where_it_is_invisible(scene):
    whole = zoom_in_full() if scene is ZOOM else in_full(project(*scene))
    error = ghosts(project(*scene)) - whole
    # green is negative here: the purple is outside the screen's gamut
    mean = np.abs(whole).mean(axis=(0, 1))
    assert error.any()
    assert np.abs(error.mean(axis=(0, 1)) / mean).max() < 1e-3
    assert (np.abs(blocks(error)) / mean).max() < 0.01
    assert np.quantile(np.abs(error) / mean, 0.999) < 0.02


@pytest.mark.parametrize("scene", [FEW, pytest.param(ZOOM, marks=pytest.mark.slow)], ids=["few", "zoom"])
def test_what_is_culled_carries_what_was_allowed(scene):
    whole = zoom_in_full() if scene is ZOOM else in_full(project(*scene))
    lost = 1.0 - ghosts(project(*scene, cull=3e-3)).sum() / whole.sum()
    assert 2e-4 < lost < 6e-3


def test_a_path_is_weighed_by_all_wavelengths():
    """Power means: for mirrors with one coating the mean of the product, for different ones never less."""
    settled = resolve_project(project(*FEW, wavelengths=7))
    packed = make_shots(settled, make_opening(settled, None))[0].packed
    table, typical = packed.reflectance, packed.typical_reflectance
    assert typical**2 == pytest.approx((table**2).mean(axis=0))
    coated = [k for k, row in enumerate(load_lens("heliar-tronnier").rows) if k != settled.lens.stop_row]
    assert len(coated) > 5
    for j in coated:
        for i in coated:
            mean = (table[:, j, -1] * table[:, i, -1]).mean()
            assert typical[j, -1] * typical[i, -1] >= mean * (1.0 - 1e-12)
    four = packed.typical_reflectance_of_four[coated, -1]
    assert four**4 == pytest.approx((table[:, coated, -1] ** 4).mean(axis=0))
    assert four[:4].prod() >= table[:, coated[:4], -1].prod(axis=1).mean() * (1.0 - 1e-12)
    # the middle wavelength alone shows almost no light
    middle = table[len(table) // 2, coated[0], -1]
    assert middle**2 < 0.01 * typical[coated[0], -1] ** 2
