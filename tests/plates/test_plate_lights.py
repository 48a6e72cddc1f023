"""Lights of a plate: irradiance from solid angles, so that the picture of a light has the values of the plate."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from benchmarks.shots import sparse_plate

from flarewright import Camera, Light, Project, Quality, render
from flarewright.errors import ProjectError
from flarewright.plates.detection import LUMINANCE, find_sources
from flarewright.plates.field_map import field_map
from flarewright.plates.joining import joined
from flarewright.plates.lights import lights_at, plate_factor, plate_tracks
from flarewright.plates.marked import light_rows
from flarewright.plates.measured_plate import expanded
from flarewright.plates.settings import PlateSettings, parse_source
from flarewright.plates.tracking import follow
from flarewright.render.scene.direct_image import direct_image
from flarewright.render.scene.pixel_place import direct_images
from flarewright.render.scene.resolve import resolve_project

SIZE = (64, 36)
ROWS, COLUMNS = np.mgrid[: SIZE[1], : SIZE[0]] + 0.5


@pytest.fixture(scope="module")
def lens():
    project = Project(
        lens="heliar-tronnier", f_number=8.0, lights=[Light(field_deg=(0.0, 0.0))], camera=Camera(size_px=SIZE),
        quality=Quality(mode="draft", wavelengths=3),
    )  # fmt: skip
    settled = resolve_project(project)
    found = field_map(settled)
    return project, settled, found, plate_factor(settled, found)


def plate(*discs):
    pixels = np.zeros((*SIZE[::-1], 3), np.float32)
    for x, y, radius, rgb in discs:
        pixels[np.hypot(COLUMNS - x, ROWS - y) < radius] = rgb
    return pixels


def tracks_of(*plates, **changes):
    found = [find_sources(pixels, 1.0) for pixels in plates]
    return plate_tracks(follow(range(1, len(plates) + 1), found, SIZE[0]), SIZE, **changes)


def test_the_factor_is_that_of_an_extended_scene(lens):
    # a scene of radiance L is imaged as pi L T / (4 N^2): physics.md, Radiometry
    _, settled, _, factor = lens
    images = direct_images(settled, Light(field_deg=(0.0, 0.0)))
    passed = direct_image(images.lens, images.shot).transmittance
    assert 0.5 < passed < 0.9
    assert factor * pi * passed / (4.0 * 8.0**2) == pytest.approx(1.0, rel=0.01)


def test_the_image_of_a_light_has_the_sum_of_the_plate(lens):
    project, _, directions, factor = lens
    pixels = plate((32, 18, 1.0, (40.0, 20.0, 10.0)))
    lights, lost = lights_at(tracks_of(pixels), 1, directions, factor, SIZE)
    assert lost == 0.0
    star = next(layer for layer in render(project.replace(lights=lights)).layers if layer.name == "starburst")
    drawn = star.pixels.sum(axis=(0, 1), dtype=float) @ LUMINANCE
    # some light is diffracted out of the picture
    assert drawn == pytest.approx(pixels.sum(axis=(0, 1), dtype=float) @ LUMINANCE, rel=0.03)


def test_intensity_and_colour_are_those_of_the_pixels(lens):
    _, _, directions, _ = lens
    rgb = np.array([30.0, 15.0, 5.0])
    pixels = plate((50, 10, 3.0, rgb))
    (light,), _ = lights_at(tracks_of(pixels), 1, directions, 1.0, SIZE)
    where = np.argwhere(pixels[..., 0] > 0)[:, ::-1] + 0.5
    irradiance = (directions.solid_angles(where)[:, None] * rgb).sum(axis=0)
    assert light.intensity == pytest.approx(irradiance @ LUMINANCE, rel=1e-3)
    assert light.spectrum.rgb == pytest.approx(rgb / rgb.max())
    x, y = np.degrees(np.arctan(directions.slopes(np.array([[50.0, 10.0]]))[0]))
    assert light.field_deg == (pytest.approx(x, abs=0.02), pytest.approx(y, abs=0.02))
    assert x > 0 < y, "right of and above the middle"


def test_points_discs_and_rectangles_keep_their_size(lens):
    _, _, directions, factor = lens
    pixels = plate((10, 10, 1.0, 9.0), (30, 18, 6.0, 9.0))
    pixels[30:33, 35:60] = 9.0
    lights, _ = lights_at(tracks_of(pixels), 1, directions, factor, SIZE)
    point, disc, bar = sorted(lights, key=lambda light: light.field_deg[1], reverse=True)
    degrees_px = np.degrees(36.0 / SIZE[0] / 99.24)
    assert (point.diameter_deg, point.shape) == (0.0, None)
    assert disc.diameter_deg == pytest.approx(12 * degrees_px, rel=0.06)
    assert bar.shape.size_deg == (pytest.approx(25 * degrees_px, rel=0.06), pytest.approx(3 * degrees_px, rel=0.1))
    assert np.sin(np.radians(bar.shape.rotation_deg)) == pytest.approx(0.0, abs=0.01)
    # the list states the sizes that are drawn
    sizes = {row["kind"]: (row["width"], row["height"]) for row in light_rows(tracks_of(pixels), 1)}
    assert sizes["disc"] == pytest.approx((12.0, 12.0), rel=0.02)
    assert sizes["rectangle"] == pytest.approx((25.0, 3.0), abs=1e-3)
    # points are faster
    far, _ = lights_at(tracks_of(pixels, point_px=1e3), 1, directions, factor, SIZE)
    assert not any(light.extended for light in far)


def test_an_area_light_at_the_edge_of_a_fisheye_is_a_point():
    camera = Camera(size_px=SIZE)
    settled = resolve_project(Project(lens="fisheye-nikkor-10.5", lights=[Light(field_deg=(0, 0))], camera=camera))
    pixels = plate()
    pixels[16:20, 6:12] = 9.0
    pixels[16:20, 30:38] = 9.0
    lights, lost = lights_at(tracks_of(pixels), 1, field_map(settled), 1.0, SIZE)
    assert lost == 0.0
    assert sorted(light.extended for light in lights if abs(light.field_deg[0]) < 60) == [True]
    assert [light.extended for light in lights if abs(light.field_deg[0]) > 60] == [False]


def test_lights_move_between_frames(lens):
    _, _, directions, factor = lens
    shot = tracks_of(plate((20, 18, 1.0, 10.0)), plate((22, 18, 1.0, 30.0)))
    one, between, two = (lights_at(shot, at, directions, factor, SIZE)[0][0] for at in (1, 1.5, 2))
    assert between.intensity == pytest.approx(0.5 * (one.intensity + two.intensity), rel=1e-3)
    assert between.field_deg[0] == pytest.approx(0.5 * (one.field_deg[0] + two.field_deg[0]), rel=1e-3)
    # a frame without a light has one dark light, since a project needs one
    dark = tracks_of(plate((20, 18, 1.0, 10.0)), plate())
    assert [light.intensity for light in lights_at(dark, 2, directions, factor, SIZE)[0]] == [0.0]


def test_a_picture_of_another_size_has_the_same_lights(lens):
    _, settled, directions, factor = lens
    large = settled.project.replace(camera=Camera(size_px=(128, 72)))
    shot = tracks_of(plate((50, 10, 3.0, 9.0)))
    small = lights_at(shot, 1, directions, factor, SIZE)[0][0]
    twice = lights_at(shot, 1, field_map(resolve_project(large)), factor, (128, 72))[0][0]
    assert twice.field_deg == (pytest.approx(small.field_deg[0], rel=1e-3), pytest.approx(small.field_deg[1], rel=1e-3))
    assert twice.intensity == pytest.approx(small.intensity, rel=1e-3)


def test_the_sun_and_lamps_of_known_brightness_follow_the_white_of_the_plate(lens):
    _, _, directions, _ = lens
    pixels = plate((20, 18, 2.0, 1.05), (40, 18, 1.0, 1.2))
    given = {"white": 0.9, "clips_at": 1.0}
    sun, lamp = lights_at(tracks_of(pixels, known=parse_source("sun"), **given), 1, directions, 1.0, SIZE)[0]
    # white paper that faces the sun has the luminance E / pi
    assert max(sun.intensity, lamp.intensity) == pytest.approx(pi * 0.9)
    assert min(sun.intensity, lamp.intensity) < 0.01
    known = parse_source("lamp:800@3")
    both = lights_at(tracks_of(pixels, known=known, **given), 1, directions, 1.0, SIZE)[0]
    lux = 800 / (4 * pi) / 9
    assert [light.intensity for light in both] == pytest.approx([pi * 0.9 * lux / 1e5] * 2)
    # behind half a leaf the sun is half as bright
    half = plate((20, 18, 2.0, 1.05))
    half[:, :20] = 0.0
    covered = tracks_of(plate((20, 18, 2.0, 1.05)), half, known=parse_source("sun"), **given)
    assert lights_at(covered, 2, directions, 1.0, SIZE)[0][0].intensity == pytest.approx(0.5 * pi * 0.9, rel=0.01)


def test_joined_lights_have_ghosts_and_no_image(lens):
    project, _, directions, factor = lens
    pixels = plate((32, 18, 1.0, 40.0), (20, 10, 1.0, 5.0), (24, 12, 1.0, 5.0))
    found = follow([1], [find_sources(pixels, 1.0)], SIZE[0])
    limited, _, number = joined(found, 2)
    lights, _ = lights_at(plate_tracks(limited, SIZE, joined=number), 1, directions, factor, SIZE)
    assert [light.starburst for light in lights] == [True, False]
    alone = project.replace(lights=lights[1:])
    layers = {layer.name: layer.pixels for layer in render(alone).layers}
    assert not layers["starburst"].any()
    assert np.array_equal(layers["ghosts"], layers["beauty"])
    assert layers["ghosts"].any()
    # an image of both lamps would lie between them
    both = {layer.name: layer.pixels for layer in render(project.replace(lights=lights)).layers}
    first = {layer.name: layer.pixels for layer in render(project.replace(lights=lights[:1])).layers}
    assert np.array_equal(both["starburst"], first["starburst"])


def test_two_thousand_sources_keep_their_light_when_they_are_joined():
    """`python -m benchmarks --only shots` measures what they cost."""
    size = (480, 270)
    pixels = sparse_plate(size, 2000)
    found = find_sources(pixels, 1.0)
    assert len(found) == 2000
    limited, _, groups = joined(follow([1], [found], size[0]), PlateSettings("a.exr").most_lights)
    tracks = plate_tracks(limited, size, joined=groups).tracks
    assert len(tracks) <= PlateSettings("a.exr").most_lights
    np.testing.assert_allclose(tracks.light[:, 0].sum(axis=0), pixels.sum(axis=(0, 1)), rtol=0.01)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("moon", "no known lamp"),
        ("headlight", "needs a distance"),
        ("headlight@0", "not above 0"),
        ("lamp@3", "no known lamp"),
        ("lamp:800", "needs a distance"),
        ("sun@3", "no known lamp"),
        ("lamp:nan@3", "not above 0"),
        ("lamp:x@3", "needs a distance"),
    ],
)
def test_other_lamps_are_refused(text, words):
    with pytest.raises(ProjectError, match=words):
        parse_source(text)


@pytest.mark.parametrize(
    "changes",
    [
        {"threshold": 0.0}, {"threshold": float("nan")}, {"stops": 1e9}, {"fade": -1}, {"least_px": 0},
        {"most_lights": 0}, {"gain": float("nan")}, {"highlights": 0.5}, {"white": -1.0}, {"point_px": float("nan")},
        {"source": parse_source("sun")},
    ],
)  # fmt: skip
def test_settings_out_of_range_are_refused(changes):
    with pytest.raises(ProjectError, match="give"):
        PlateSettings("a.exr", **changes)


def test_expanded_highlights_invert_a_shoulder():
    scene = np.array([0.0, 1e-3, 0.18, 1.0, 50.0], np.float32)
    shoulder = scene / (1.0 + (1.0 - 1.0 / 50.0) * scene)
    assert expanded(shoulder, 50.0) == pytest.approx(scene, rel=1e-4)
    assert expanded(np.ones(1, np.float32), 80.0) == pytest.approx(80.0)
    # a plate of high dynamic range clips above 1
    above = expanded(np.array([0.01, 3.77, 5.0], np.float32), 80.0, 3.77)
    assert above == pytest.approx([0.01, 80.0, 80.0], rel=0.01)


def test_a_group_of_joined_lamps_is_not_the_sun(lens):
    """It can hold more light than the brightest single source, at a place where none is."""
    _, _, directions, _ = lens
    glitter = [(12 + 3 * k, 28, 1.0, 1.1) for k in range(14)]
    found = follow([1], [find_sources(plate((32, 8, 1.0, 1.2), *glitter), 1.0)], SIZE[0])
    limited, _, number = joined(found, 3)
    assert number > 0
    tracks = plate_tracks(limited, SIZE, joined=number, known=parse_source("sun"), white=0.9, clips_at=1.0)
    lights, _ = lights_at(tracks, 1, directions, 1.0, SIZE)
    sun = max(lights, key=lambda light: light.intensity)
    assert sun.starburst
    assert sun.intensity == pytest.approx(pi * 0.9)
