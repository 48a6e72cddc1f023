"""What a film takes away at the middle wavelength is not gone: bright ghosts of coated lenses are drawn in full.

An ideal quarter wave has R = 0 at its centre. A ghost by two such mirrors is blue and red, and as bright as others in
these; judged by its green alone it would be drawn coarsely, in few colours, or not at all.
"""

from __future__ import annotations

import numpy as np
import pytest

from flarewright.model import Light, Project
from flarewright.model.coating import QuarterWave
from flarewright.model.project import Everywhere
from flarewright.render.prepare import load_lens, settle
from flarewright.render.render import render
from flarewright.render.shot import make_opening, make_shots

SIZE = (320, 180)


def project(lens: str, **quality: object) -> Project:
    return Project(
        lens=lens,
        f_number=5.6,
        lights=(Light(field_deg=(12.0, 7.0)),),
        coating=Everywhere(coating=QuarterWave(center_wavelength_nm=550.0, index="ideal")),
        camera={"size_px": SIZE},
        quality={"wavelengths": 7, **quality},
        output={"starburst": False},
    )


def ghosts(shown: Project) -> np.ndarray:
    layer = next(layer for layer in render(shown).layers if layer.name == "ghosts")
    x, y, width, height = layer.window
    picture = np.zeros((SIZE[1], SIZE[0], 3))
    picture[y : y + height, x : x + width] = layer.pixels
    return picture


def blocks(picture: np.ndarray) -> np.ndarray:
    return picture[:160].reshape(10, 16, 20, 16, 3).mean(axis=(1, 3))


@pytest.fixture(scope="module")
def in_full() -> np.ndarray:
    """All ghosts as layers of their own, which are drawn in full."""
    shown = project("canon-28-80")
    return ghosts(shown.replace(output=shown.output.replace(layers="ghosts")))


def test_detail_is_lost_where_nobody_sees_it(in_full):
    error = ghosts(project("canon-28-80")) - in_full
    # green is negative here: such a purple is none of the screen's
    mean = np.abs(in_full).mean(axis=(0, 1))
    assert np.abs(error.mean(axis=(0, 1)) / mean).max() < 1e-3
    assert (np.abs(blocks(error)) / mean).max() < 0.01
    assert np.quantile(np.abs(error) / mean, 0.999) < 0.02


def test_what_is_culled_carries_what_was_allowed(in_full):
    lost = 1.0 - ghosts(project("canon-28-80", cull=3e-3)).sum() / in_full.sum()
    assert 2e-4 < lost < 6e-3


def test_a_path_is_weighed_by_all_wavelengths():
    """Power means: of mirrors with one coating the mean of the product, of different ones never less."""
    settled = settle(project("heliar-tronnier"))
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
    # the middle wavelength alone says next to nothing
    middle = table[len(table) // 2, coated[0], -1]
    assert middle**2 < 0.01 * typical[coated[0], -1] ** 2
