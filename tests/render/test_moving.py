"""Pictures of a moving hand against ordinary drafts of the same project."""

import numpy as np
import pytest

from flarewright.model import Art, Camera, Holdout, Iris, Light, Output, Preset, Project, Quality, Rule, Starburst
from flarewright.render.display import view, view_sum
from flarewright.render.moving import moving_picture
from flarewright.render.render import render


@pytest.fixture
def project():
    return Project(
        lens="heliar-tronnier", f_number=8.0, iris=Iris(blades=6), coating=Preset(name="thesis"),
        lights=(Light(field_deg=(6.0, 3.0)),), camera=Camera(size_px=(240, 136)),
        quality=Quality(mode="draft", wavelengths=3), output=Output(layers="passes"),
        art=Art(rules=(Rule(select="8-6", gain=0.5),), gain={"starburst": 0.5}),
    )  # fmt: skip


def layers(project):
    height, width = project.camera.size_px[1], project.camera.size_px[0]
    out = {}
    for layer in render(project).layers:
        whole = np.zeros((height, width, 3), dtype=np.float32)
        x, y, w, h = layer.window
        whole[y : y + h, x : x + w] = layer.pixels
        out[layer.name] = whole
    return out


def at(project, *field_deg, **more):
    return project.replace(lights=(Light(field_deg=field_deg, **more),))


def test_the_first_picture_is_a_draft_of_the_project(project):
    found, wanted = moving_picture(project, None), layers(project)
    np.testing.assert_array_equal(found.ghosts, wanted["ghosts"])
    np.testing.assert_allclose(found.rest, wanted["starburst"], rtol=2e-4, atol=1e-7 * wanted["starburst"].max())


def test_later_ones_move_the_starburst_along(project):
    sheet = moving_picture(project, None).sheet
    later = at(project, -4.0, -1.7, intensity=3.0)
    found, wanted = moving_picture(later, sheet), layers(later)
    assert found.sheet is sheet
    np.testing.assert_array_equal(found.ghosts, wanted["ghosts"])
    star = wanted["starburst"]
    # all of its light, in the pixel where the light is
    np.testing.assert_allclose(found.rest.sum(axis=(0, 1)), star.sum(axis=(0, 1)), rtol=2e-3)
    assert np.unravel_index(found.rest[..., 1].argmax(), star.shape[:2]) == np.unravel_index(
        star[..., 1].argmax(), star.shape[:2]
    )


def test_what_shapes_the_starburst_makes_a_new_sheet(project):
    sheet = moving_picture(project, None).sheet
    assert moving_picture(project.replace(art=Art()), sheet).sheet is sheet
    assert moving_picture(project.replace(iris=Iris(blades=7)), sheet).sheet is not sheet
    assert moving_picture(project.replace(f_number=11.0), sheet).sheet is not sheet


def test_what_changes_on_the_way_is_left_to_the_renderer(project):
    assert moving_picture(at(project, 40.0, 3.0), None) is None
    assert moving_picture(at(project, 6.0, 3.0, diameter_deg=2.0), None) is None
    assert moving_picture(at(project, 6.0, 3.0, distance=2000.0), None) is None
    assert moving_picture(project.replace(lights=project.lights * 2), None) is None
    assert moving_picture(project.replace(starburst=Starburst(cats_eye=True)), None) is None
    assert moving_picture(project.replace(holdout=Holdout(image="matte.png")), None) is None


def test_the_quick_view_is_the_view():
    random = np.random.default_rng(5)
    ghosts = (10.0 ** random.uniform(-7.0, 1.0, (40, 60, 3))).astype(np.float32)
    sheet = (10.0 ** random.uniform(-7.0, 2.0, (81, 121, 3))).astype(np.float32)
    ghosts[0, 0] = np.nan
    ghosts[1, 1] = np.inf
    gain, other = np.array([0.9, 0.8, 0.7], np.float32), np.array([1.0, 0.5, 0.25], np.float32)
    with np.errstate(invalid="ignore"):
        whole = np.nan_to_num(ghosts * gain + sheet[7:47, 11:71] * other, nan=0.0, posinf=1e30)
    wanted = view(whole, 3.3)
    found = view_sum(ghosts, sheet, 3.3, ghost_gain=gain, rest_gain=other, corner=(7, 11))
    # the order in which three numbers are multiplied may round one of them over a border
    assert np.abs(found.astype(int) - wanted).max() <= 1
    assert (found != wanted).mean() < 1e-3
