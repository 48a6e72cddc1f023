"""Drafts of many ghosts: faint ghosts are drawn coarsely without a visible difference."""

import numpy as np
import pytest

from flarewright.kernels.raster.polygons import sum_rows
from flarewright.model import Art, Camera, Light, Output, Project, Quality, Rule
from flarewright.optics.colour.rgb import luminance_weights
from flarewright.optics.lens.paths import ghost_paths
from flarewright.render.ghosts import draft_colors, draft_ghosts, matrix_flux, paraxial_ghosts
from flarewright.render.render import render
from flarewright.render.scene.opening import make_opening
from flarewright.render.scene.resolve import resolve_project
from flarewright.render.scene.shots import make_shots

CANON = Project(
    lens="canon-28-80",
    f_number=5.6,
    lights=(Light(field_deg=(9.0, 5.0)),),
    camera=Camera(size_px=(480, 270)),
    quality=Quality(mode="draft", wavelengths=3),
    output=Output(starburst=False),
)


def sheet(project, monkeypatch, crowd):
    monkeypatch.setattr(draft_ghosts, "CROWDED_GHOSTS", crowd)
    layer = next(layer for layer in render(project).layers if layer.name == "ghosts")
    x, y, width, height = layer.window
    whole = np.zeros((270, 480, 3))
    whole[y : y + height, x : x + width] = layer.pixels
    return whole


@pytest.mark.parametrize("rules", [(), (Rule(select="all", gain=0.5), Rule(select="row:7", tint=(1.0, 0.2, 0.0)))])
def test_coarse_ghosts_look_like_fine_ones(rules, monkeypatch):
    project = CANON.replace(art=Art(rules=rules))
    fine, coarse = (sheet(project, monkeypatch, crowd) for crowd in (10**9, 1))
    assert not np.array_equal(fine, coarse)
    np.testing.assert_allclose(coarse.sum(axis=(0, 1)), fine.sum(axis=(0, 1)), rtol=2e-3)
    level = fine.mean(axis=(0, 1))
    # a ghost at half the resolution is fainter than 1.5 % of the mean; edges can coincide
    assert np.abs(coarse - fine).max(axis=(0, 1)) == pytest.approx(0.0, abs=0.1 * level.max())
    assert np.abs(coarse - fine).mean() < 2e-3 * level.mean()


def test_ghosts_are_weighed_as_they_are_drawn():
    # a prime, as each ghost is drawn alone
    settled = resolve_project(CANON.replace(lens="double-gauss-tronnier", camera=Camera(size_px=(160, 90))))
    (shot,) = make_shots(settled, make_opening(settled, None))
    paths = ghost_paths(settled.lens)
    drawn = np.empty(len(paths))
    for k, path in enumerate(paths):
        picture = np.zeros((90, 160, 3))
        paraxial_ghosts.draw_draft(shot, [path], picture)
        sum_rows(picture, picture)
        drawn[k] = luminance_weights(shot.colorspace) @ picture.sum(axis=(0, 1))
    seen = matrix_flux.weigh_drafts(shot, paths, draft_colors.draft_colors(shot, paths))
    # the middle wavelength represents all, so cuts by edges or picture that depend on colour differ
    assert seen[:, 0].sum() == pytest.approx(drawn.sum(), rel=0.03)
    bright = (drawn > 1e-3 * drawn.max()) & (seen[:, 0] > 0.0)
    assert drawn[bright].sum() > 0.99 * drawn.sum()
    np.testing.assert_allclose(seen[bright, 0], drawn[bright], rtol=0.25)
    assert ((seen[:, 1] > 0.0) == (seen[:, 0] > 0.0)).all()


def test_brightest_ghosts_keep_all_detail():
    settled = resolve_project(CANON)
    (shot,) = make_shots(settled, make_opening(settled, None))
    paths = ghost_paths(settled.lens)
    details = paraxial_ghosts.draft_details((shot,), paths, [draft_colors.draft_colors(shot, paths)])[0]
    brightness = matrix_flux.weigh_drafts(shot, paths, draft_colors.draft_colors(shot, paths))[:, 1]
    assert set(details) == {0, 1, 2}
    # a ghost that is dark at the middle wavelength can be bright at others
    assert not details[brightness == 0.0].any()
    order = np.argsort(-brightness[brightness > 0.0], kind="stable")
    assert (np.diff(details[brightness > 0.0][order]) >= 0).all()


def test_a_light_that_is_off_says_nothing_of_the_others(monkeypatch):
    monkeypatch.setattr(draft_ghosts, "CROWDED_GHOSTS", 1)
    dark, bright = (Light(field_deg=(x, 3.0), intensity=power) for x, power in ((8.0, 0.0), (4.0, 1.0)))
    together, alone = (render(CANON.replace(lights=lights)) for lights in ((bright, dark), (bright,)))
    sums = [next(one for one in done.layers if one.name == "ghosts").pixels.sum() for done in (together, alone)]
    assert sums[0] == pytest.approx(sums[1], rel=2e-3)
