"""Pictures during a drag against ordinary drafts of the same project."""

import numpy as np
import pytest

from flarewright.model import (
    Art,
    BlackBody,
    Camera,
    Holdout,
    Iris,
    Light,
    Output,
    Preset,
    Project,
    Quality,
    Rule,
    Starburst,
)
from flarewright.render.image.display import view, view_sum
from flarewright.render.preview.drag_preview import moving_picture
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
    found, wanted = moving_picture(project, ()), layers(project)
    np.testing.assert_array_equal(found.ghosts, wanted["ghosts"])
    np.testing.assert_allclose(found.rest, wanted["starburst"], rtol=2e-4, atol=1e-7 * wanted["starburst"].max())


def test_later_ones_move_the_starburst_along(project):
    (sheet,) = moving_picture(project, ()).sheets
    later = at(project, -4.0, -1.7, intensity=3.0)
    found, wanted = moving_picture(later, [sheet]), layers(later)
    assert found.sheets == (sheet,)
    np.testing.assert_array_equal(found.ghosts, wanted["ghosts"])
    star = wanted["starburst"]
    # all of its light, in the pixel of the light
    np.testing.assert_allclose(found.rest.sum(axis=(0, 1)), star.sum(axis=(0, 1)), rtol=2e-3)
    assert np.unravel_index(found.rest[..., 1].argmax(), star.shape[:2]) == np.unravel_index(
        star[..., 1].argmax(), star.shape[:2]
    )


def test_lights_of_one_spectrum_share_a_sheet(project):
    near, far = Light(field_deg=(5.0, 2.0)), Light(field_deg=(-7.0, 1.0), intensity=0.3)
    warm = Light(field_deg=(1.0, -4.0), spectrum=BlackBody(temperature_k=2700.0))
    three = project.replace(lights=(near, far, warm))
    first = moving_picture(three, ())
    one, other, third = first.sheets
    assert one is other
    assert third is not one
    moved = three.replace(lights=(near, Light(field_deg=(-6.0, 1.5), intensity=0.3), warm))
    found, wanted = moving_picture(moved, first.sheets), layers(moved)
    assert found.sheets == first.sheets
    np.testing.assert_array_equal(found.ghosts, wanted["ghosts"])
    star = wanted["starburst"]
    np.testing.assert_allclose(found.rest.sum(axis=(0, 1)), star.sum(axis=(0, 1)), rtol=2e-3)
    # a peak can be off by half a pixel: compare blocks of 8 x 8
    blocks = [part.reshape(17, 8, 30, 8, 3).sum(axis=(1, 3)) for part in (found.rest, star)]
    assert np.abs(blocks[0] - blocks[1]).sum() < 0.1 * blocks[1].sum()


def test_what_shapes_the_starburst_makes_a_new_sheet(project):
    (sheet,) = moving_picture(project, ()).sheets
    assert moving_picture(project.replace(art=Art()), [sheet]).sheets[0] is sheet
    assert moving_picture(project.replace(iris=Iris(blades=7)), [sheet]).sheets[0] is not sheet
    assert moving_picture(project.replace(f_number=11.0), [sheet]).sheets[0] is not sheet


def test_what_changes_on_the_way_is_left_to_the_renderer(project):
    assert moving_picture(at(project, 40.0, 3.0), ()) is None
    assert moving_picture(at(project, 6.0, 3.0, diameter_deg=2.0), ()) is None
    assert moving_picture(at(project, 6.0, 3.0, distance=2000.0), ()) is None
    assert moving_picture(project.replace(lights=project.lights * 5), ()) is None
    assert moving_picture(project.replace(lights=(*project.lights, Light(field_deg=(40.0, 3.0)))), ()) is None
    assert moving_picture(project.replace(starburst=Starburst(cats_eye=True)), ()) is None
    assert moving_picture(project.replace(holdout=Holdout(image="matte.png")), ()) is None


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
    # the order of multiplication can round a value to the other side of a code
    assert np.abs(found.astype(int) - wanted).max() <= 1
    assert (found != wanted).mean() < 1e-3


def test_during_a_drag_small_discs_have_ghosts_of_points_and_starbursts_of_discs(project):
    disc, large = at(project, 6.0, 3.0, diameter_deg=0.5), at(project, 6.0, 3.0, diameter_deg=1.5)
    found = moving_picture(disc, ())
    # the disc's centre is found to six digits
    np.testing.assert_allclose(found.ghosts, layers(project)["ghosts"], rtol=5e-3)
    wanted = layers(disc)
    np.testing.assert_allclose(found.rest, wanted["starburst"], rtol=2e-4, atol=1e-7 * wanted["starburst"].max())
    # the flux is that of the disc, only its borders are sharper
    np.testing.assert_allclose(found.ghosts.sum(axis=(0, 1)), wanted["ghosts"].sum(axis=(0, 1)), rtol=5e-3)
    # one sheet serves other positions, as for points
    later = at(project, -4.0, -1.7, diameter_deg=0.5)
    along, star = moving_picture(later, found.sheets), layers(later)["starburst"]
    assert along.sheets == found.sheets
    np.testing.assert_allclose(along.rest.sum(axis=(0, 1)), star.sum(axis=(0, 1)), rtol=5e-3)
    assert moving_picture(large, ()) is None
