"""Drafts with single ghosts: each is drawn in the part of the picture that it covers, with the same pixels."""

from __future__ import annotations

import numpy as np
import pytest

from flarewright.kernels.raster.polygons import sum_rows
from flarewright.model import Camera, Iris, Light, Lines, Output, Project, Quality
from flarewright.optics.lens.paths import ghost_paths
from flarewright.render.ghosts import draft_ghosts
from flarewright.render.ghosts.matrix_flux import draft_window
from flarewright.render.ghosts.paraxial_ghosts import draw_draft
from flarewright.render.render import render
from flarewright.render.scene.opening import make_opening
from flarewright.render.scene.resolve import resolve_project
from flarewright.render.scene.shots import make_shots

SIZE = (160, 90)
PLAIN = Project(
    lens="double-gauss-tronnier", f_number=4.0, iris=Iris(blades=6), lights=(Light(field_deg=(9.0, 5.0)),),
    camera=Camera(size_px=SIZE), quality=Quality(mode="draft", wavelengths=3, bridge=False),
    output=Output(starburst=False, layers="ghosts"),
)  # fmt: skip
# the second has one wavelength
TWO = PLAIN.replace(
    lights=(
        Light(field_deg=(9.0, 5.0)),
        Light(field_deg=(-14.0, 2.0), intensity=0.3, spectrum=Lines(lines=((550.0, 1.0),))),
    )
)


def shots_of(project):
    settled = resolve_project(project)
    return make_shots(settled, make_opening(settled, None)), ghost_paths(settled.lens)


@pytest.mark.parametrize(
    "project", [PLAIN, TWO, PLAIN.replace(lens="anamorphic-heliar-2x")], ids=["one", "two lights", "toroids"]
)
def test_all_light_of_a_ghost_lies_in_its_window(project):
    shots, paths = shots_of(project)
    outside = inside = 0
    for path in paths:
        picture = np.zeros((SIZE[1], SIZE[0], 3))
        for shot in shots:
            draw_draft(shot, [path], picture)
        left, top, right, bottom = draft_window(shots, path)
        assert 0 <= left < SIZE[0]
        assert 0 <= top < SIZE[1]
        if right <= left or bottom <= top:
            assert not picture.any()
            outside += 1
            continue
        sum_rows(picture, picture)
        light = picture.max(axis=2) > 1e-9 * max(picture.max(), 1e-300)
        rows, columns = np.flatnonzero(light.any(axis=1)), np.flatnonzero(light.any(axis=0))
        assert rows.size == 0 or (top <= rows[0] and rows[-1] < bottom)
        assert columns.size == 0 or (left <= columns[0] and columns[-1] < right)
        inside += (right - left) * (bottom - top) < SIZE[0] * SIZE[1]
    # both kinds occur
    assert inside > 3
    assert outside > 0 or project is not PLAIN


@pytest.mark.parametrize("project", [PLAIN, TWO], ids=["one", "two lights"])
def test_layers_are_those_of_whole_pictures(project, monkeypatch):
    windowed = render(project).layers
    monkeypatch.setattr(draft_ghosts, "_draw_alone", lambda *_: None)
    whole = render(project).layers
    assert [layer.name for layer in windowed] == [layer.name for layer in whole]
    for one, other in zip(windowed, whole, strict=True):
        pictures = []
        for layer in (one, other):
            x, y, width, height = layer.window
            picture = np.zeros((SIZE[1], SIZE[0], 3), np.float32)
            picture[y : y + height, x : x + width] = layer.pixels
            pictures.append(picture)
        # sums along a row leave rounding errors of 1e-17 beyond a ghost
        np.testing.assert_allclose(*pictures, rtol=1e-6, atol=1e-9 * float(pictures[1].max()))
        assert one.about.get("path") == other.about.get("path")
        if "flux_mm2" in one.about:
            assert one.about["flux_mm2"] == pytest.approx(other.about["flux_mm2"], rel=1e-6, abs=1e-15)
