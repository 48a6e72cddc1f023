"""The inverse of the direct image: round trips, and the centroid of the light in drawn pictures."""

from __future__ import annotations

import numpy as np
import pytest

from flarewright import Camera, Light, Lines, Output, Project, Quality, render
from flarewright.errors import ProjectError
from flarewright.io.lens.library import library_names
from flarewright.model import Art, Imperfection, Rule
from flarewright.optics.rays.image_height import image_heights
from flarewright.render.scene.direct_image import direct_image
from flarewright.render.scene.pixel_place import TOLERANCE_PX, direct_images, field_angles_at, image_px
from flarewright.render.scene.resolve import resolve_project

SIZE = (1920, 1080)
CASES = {
    "plain": {"lens": "heliar-tronnier"},
    "near, focused": {"lens": "tessar-brendel", "camera": Camera(size_px=SIZE, focus_distance=1500.0)},
    "zoom": {"lens": "canon-70-200", "zoom": 135.0},
    "decentred": {"lens": "heliar-tronnier", "imperfection": Imperfection(seed=3, decentre_um=200.0, tilt_arcmin=10.0)},
    "fisheye": {"lens": "fisheye-nikkor-10.5", "camera": Camera(size_px=SIZE, sensor_mm=(23.6, 13.3))},
    "flat pixels": {"lens": "triplet-pestrecov", "camera": Camera(size_px=(960, 1080), sensor_mm=(36.0, 20.25))},
}


def images_of(distance=None, spectrum=None, **settings):
    light = Light(field_deg=(0.0, 0.0), distance=distance, **({} if spectrum is None else {"spectrum": spectrum}))
    project = Project(lights=[light], **{"camera": Camera(size_px=SIZE), **settings})
    return direct_images(resolve_project(project), light)


@pytest.mark.parametrize("case", CASES)
def test_the_angles_of_a_pixel_have_their_direct_image_there(case):
    images = images_of(900.0 if case.startswith("near") else None, **CASES[case])
    width, height = images.shot.size_px
    # the middle, all quarters, a place outside the frame
    for part in ((0.5, 0.5), (0.7, 0.3), (0.2, 0.9), (0.3, 0.2), (0.9, 0.6), (1.1, 0.45)):
        if case == "fisheye" and part[0] > 0.8:
            continue
        place = (part[0] * width, part[1] * height)
        found = image_px(images, field_angles_at(images, place))
        assert np.hypot(found[0] - place[0], found[1] - place[1]) < TOLERANCE_PX


def test_the_place_is_that_of_the_direct_image_which_pictures_use():
    images = images_of(lens="nikkor-85-f1.4", f_number=2.0)
    field = field_angles_at(images, (1500.0, 200.0))
    light = Light(field_deg=field)
    project = Project(lens="nikkor-85-f1.4", f_number=2.0, lights=[light], camera=Camera(size_px=SIZE))
    from flarewright.render.scene.opening import make_opening
    from flarewright.render.scene.shots import make_shots

    settled = resolve_project(project)
    (shot,) = make_shots(settled, make_opening(settled, None))
    x, y = direct_image(settled.lens, shot).position_mm
    column, row, across, down = shot.to_pixels
    assert (column + x * across, row - y * down) == pytest.approx((1500.0, 200.0), abs=2 * TOLERANCE_PX)


def test_a_small_opening_agrees_with_the_chief_ray():
    """Another ray trace: at f/64 the centroid is the chief ray of `image_heights`."""
    images = images_of(lens="canon-28-80", f_number=64.0, spectrum=Lines(lines=((587.5618, 1.0),)))
    settled = resolve_project(Project(lens="canon-28-80", f_number=64.0, lights=[Light(field_deg=(0.0, 0.0))]))
    for angle in (5.0, 15.0, 25.0):
        (height,) = image_heights(settled.lens, settled.order, np.array([angle]))
        place = (960.0 + height * 1920.0 / 36.0, 540.0)
        x, y = field_angles_at(images, place)
        assert x == pytest.approx(angle, abs=0.0006)
        assert y == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize(
    ("place", "changes", "light"),
    [
        # wider than a pixel, or the picture shows nothing of the place within it
        ((20.25, 40.75), {}, {"diameter_deg": 3.0}),
        ((45.6, 12.3), {"sensor_distance": 60.0}, {}),
    ],
    ids=["disc", "out of focus"],
)
def test_the_drawn_light_has_its_centroid_at_the_pixel(place, changes, light):
    camera = Camera(size_px=(64, 64), sensor_mm=(36.0, 36.0), **changes)
    images = images_of(lens="heliar-tronnier", f_number=5.6, camera=camera)
    project = Project(
        lens="heliar-tronnier", f_number=5.6, camera=camera,
        lights=[Light(field_deg=field_angles_at(images, place), **light)],
        output=Output(layers="passes"), quality=Quality(mode="final", wavelengths=3, ringing="off"),
        art=Art(rules=(Rule(select="all", enable=False),)),
    )  # fmt: skip
    drawn = next(layer for layer in render(project).layers if layer.name == "starburst")
    pixels = drawn.pixels.sum(axis=2).astype(float)
    # without the wings, which the frame cuts
    pixels[pixels < 0.01 * pixels.max()] = 0.0
    y, x = np.mgrid[:64, :64] + 0.5
    centroid = (float((pixels * x).sum() / pixels.sum()), float((pixels * y).sum() / pixels.sum()))
    assert (pixels > 0.0).sum() > 20
    assert centroid == pytest.approx(place, abs=0.1)


def test_beyond_the_field_one_sentence_says_how_far_it_reaches():
    images = images_of(lens="canon-28-80")
    with pytest.raises(
        ProjectError, match=r"no direct image at 2600,-300 px, 1843 px .* up to 14\d\d px \(3\d\.\d deg"
    ):
        field_angles_at(images, (2600.0, -300.0))


@pytest.mark.slow
@pytest.mark.parametrize("lens", library_names())
def test_every_direct_image_of_every_lens_is_found_again(lens):
    """Up to the edge of the field that the lens images, where steps often lead to where it passes no light."""
    images = images_of(lens=lens)
    random = np.random.default_rng(1)
    found = 0
    for _ in range(60):
        slope, azimuth = np.tan(np.radians(random.uniform(0.0, 40.0))), random.uniform(0.0, 2.0 * np.pi)
        field = np.degrees(np.arctan([slope * np.cos(azimuth), slope * np.sin(azimuth)]))
        place = image_px(images, (float(field[0]), float(field[1])))
        if place is not None:
            again = image_px(images, field_angles_at(images, place))
            assert np.hypot(again[0] - place[0], again[1] - place[1]) < TOLERANCE_PX
            found += 1
    assert found > 4
