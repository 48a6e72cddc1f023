"""Area lights are the limit of sums of point lights."""

from functools import cache

import numpy as np
import pytest
from judge import judge, probabilities

from flarewright.errors import ProjectError
from flarewright.kernels.raster.edge_blur import spread_marks
from flarewright.model import Camera, Light, Lines, Output, Polygon, Project, Quality, Rectangle
from flarewright.optics.colour.rgb import luminance_weights
from flarewright.optics.pupil.light_shape import light_outline, parts
from flarewright.optics.pupil.polygon import closed, points
from flarewright.render.ghosts import extent_blur
from flarewright.render.ghosts.draft_spread import spread_light
from flarewright.render.ghosts.extent_blur import (
    blur_by_extent,
    extent_coverage,
    shape_kernel,
    spread_window,
    spread_within,
)
from flarewright.render.render import render
from flarewright.render.scene.area_lights import spread_border
from flarewright.render.scene.opening import make_opening
from flarewright.render.scene.resolve import resolve_project
from flarewright.render.scene.shots import make_shots

D_LINE = Lines(lines=((587.56, 1.0),))
SIZE = (240, 160)
L_SHAPE = Polygon(corners_deg=((0.0, 0.0), (3.0, 0.0), (3.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)))


def project(*lights, lens="triplet-pestrecov", f_number=8.0, mode="final", step=2.0, size=SIZE, paths="all", **parts_):
    return Project(
        lens=lens,
        f_number=f_number,
        lights=lights,
        camera=Camera(size_px=size, **parts_.pop("camera", {})),
        quality=Quality(mode=mode, wavelengths=1, bridge=False, ringing="off", source_step_deg=step, paths=paths),
        output=Output(**parts_),
    )


def light(field=(6.0, 4.0), **how):
    return Light(field_deg=field, spectrum=D_LINE, **how)


def picture(made, name="ghosts"):
    return pictured(render(made), made, name)


def pictured(rendering, made, name="ghosts"):
    layer = next(layer for layer in rendering.layers if layer.name == name)
    whole = np.zeros((made.camera.size_px[1], made.camera.size_px[0]))
    x, y, w, h = layer.window
    whole[y : y + h, x : x + w] = layer.pixels @ luminance_weights("rec709")
    return whole


def many(extended, step):
    """Return the points that make up an area light, one per fine part."""
    return [light(part.field_deg, intensity=part.share, distance=extended.distance) for part in parts(extended, step)]


def _moments(pixels):
    """Return flux, then centroid and rms widths of the bright pixels; the picture's border cuts spikes."""
    lit = np.where(pixels > 0.03 * pixels.max(), pixels, 0.0)
    rows, columns = np.indices(lit.shape)
    middle = [float((lit * at).sum() / lit.sum()) for at in (rows, columns)]
    widths = [
        float(np.sqrt((lit * (at - m) ** 2).sum() / lit.sum())) for at, m in zip((rows, columns), middle, strict=True)
    ]
    return [float(pixels.sum()), *middle, *widths]


def test_a_wide_light_has_as_many_parts_as_one_of_24_degrees():
    def number(step=2.0, mode="final", **how):
        made = resolve_project(project(light(**how), step=step, mode=mode))
        return len(make_shots(made, make_opening(made, None)))

    assert number(diameter_deg=10.0) < number(diameter_deg=20.0) < number(diameter_deg=60.0) <= 12 * 12
    assert number(shape=Rectangle(size_deg=(60.0, 0.5))) == 12
    assert number(shape=Rectangle(size_deg=(60.0, 0.5)), step=1.0) == 24
    # a large step is kept: the cap bounds the number of parts, not their width
    assert number(shape=Rectangle(size_deg=(70.0, 50.0)), step=30.0) == 6
    assert number(shape=Rectangle(size_deg=(60.0, 0.5)), mode="draft") == 4


@pytest.mark.slow
def test_parts_of_a_wide_light_are_fine_enough():
    """Against parts half as wide, whose error is a fourth."""
    coarse, fine = (
        picture(project(light(diameter_deg=50.0), step=step, size=(60, 40), paths="same-side", starburst=False))
        for step in (2.0, 1.0)
    )
    assert np.abs(coarse - fine).sum() < 0.005 * fine.sum()
    assert coarse.sum() == pytest.approx(fine.sum(), rel=2e-3)


SHAPES = {
    "sun": {"diameter_deg": 0.53},
    "disc": {"diameter_deg": 3.0},
    "window": {"shape": Rectangle(size_deg=(5.0, 2.5), rotation_deg=20.0)},
    "concave": {"shape": L_SHAPE},
    "near lamp": {"diameter_deg": 2.0, "distance": 400.0},
}


@cache
def points_image(name):
    """Return the direct image of the points that make up an area light, from a draft, where it is the same."""
    step = {"sun": 0.05, "near lamp": 0.5}.get(name, 0.35)
    fine = project(*many(light(**SHAPES[name]), step), lens="heliar-tronnier", mode="draft", paths="same-side")
    return picture(fine, "starburst")


def late(name, mode, effort):
    # a concave outline shows the same in final quality, and a lamp the same as sun, disc and window
    return effort == "whole" or (mode == "final" and name != "concave") or name in ("sun", "disc", "window")


# half of the paths and a quarter of the points suffice to compare spreads; `test_holdout.py` also tests a disc of
# several parts
@pytest.mark.parametrize(
    ("name", "mode", "effort"),
    [
        pytest.param(name, mode, effort, marks=pytest.mark.slow if late(name, mode, effort) else ())
        for name in SHAPES
        for mode in ("final", "draft")
        for effort in ("small", "whole")
    ],
)
def test_an_area_light_is_the_sum_of_its_points(name, mode, effort):
    """Ghosts and direct image; the residual is the step size of the sum and the error in `docs/sources.md`."""
    extended = light(**SHAPES[name])
    step, paths = (1.0, "all") if effort == "whole" else (2.0, "same-side")
    step *= 0.05 if name == "sun" else 0.35
    # a lens with little distortion, which one part of a light does not follow
    one = project(extended, lens="heliar-tronnier", mode=mode, paths=paths)
    rendering = render(one)
    fine = project(*many(extended, step), lens="heliar-tronnier", mode=mode, paths=paths, starburst=False)
    area, points = pictured(rendering, one), picture(fine)
    assert area.sum() == pytest.approx(points.sum(), rel=2e-3)
    assert np.abs(area - points).sum() < 0.02 * points.sum()
    # the direct images of points are dots, so only flux, position and widths are compared
    area, points = _moments(pictured(rendering, one, "starburst")), _moments(points_image(name))
    assert area[0] == pytest.approx(points[0], rel=2e-3)
    assert area[1:3] == pytest.approx(points[1:3], abs=0.1)
    # each dot stands for a cell of four pixels, which has a width itself
    assert area[3:] == pytest.approx(points[3:], rel=0.06, abs=0.12)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("wide", "size", "paths"),
    [((6.0, 2.0), (120, 80), "same-side"), pytest.param((6.0, 4.0), SIZE, "all", marks=pytest.mark.slow)],
)
def test_smaller_parts_come_closer_to_the_sum(wide, size, paths):
    extended = light(shape=Rectangle(size_deg=wide))
    how = {"lens": "heliar-tronnier", "size": size, "paths": paths, "starburst": False}
    # the same distance in pixels
    points = picture(project(*many(extended, 0.4 * SIZE[0] / size[0]), **how))
    errors = [
        np.abs(picture(project(extended, step=step, **how)) - points).sum() / points.sum() for step in (6.0, 3.0, 1.5)
    ]
    assert errors[0] > 1.5 * errors[1] > 2.0 * errors[2]
    assert errors[2] < 0.01


def test_a_disc_of_no_size_is_a_point():
    point, dot = (
        picture(project(light(**how), paths="same-side", starburst=False)) for how in ({}, {"diameter_deg": 1e-6})
    )
    # a rounding difference in direction can change the subdivision of a cell of the mesh
    assert np.abs(point - dot).sum() < 1e-3 * point.sum()


def test_shares_go_by_solid_angle():
    wide = light((0.0, 0.0), shape=Rectangle(size_deg=(80.0, 80.0)))
    # so that borders of parts follow the square of half the width
    pieces = parts(wide, 4.02)
    assert sum(part.share for part in pieces) == pytest.approx(1.0)
    # the solid angle of a square of half width a at distance 1: 4 asin(a^2 / (1 + a^2))
    a = np.tan(np.radians(40.0))
    inner = [
        part.share
        for part in pieces
        if np.abs(np.tan(np.radians(part.field_deg)) + part.corners).max() < 0.5 * a * (1.0 + 1e-9)
    ]
    whole, half = (4.0 * np.arcsin(x * x / (1.0 + x * x)) for x in (a, 0.5 * a))
    assert sum(inner) == pytest.approx(half / whole, rel=2e-3)


def test_parts_tile_the_light():
    for how in ({"diameter_deg": 9.0}, {"shape": L_SHAPE}, {"shape": Rectangle(size_deg=(7, 3), rotation_deg=33.0)}):
        whole = light((10.0, -5.0), **how)
        rim = light_outline(whole)
        found = parts(whole, 1.0)
        area = [0.5 * np.sum(p[:, 0] * np.roll(p[:, 1], -1) - np.roll(p[:, 0], -1) * p[:, 1]) for p in
                [rim, *(part.corners for part in found)]]  # fmt: skip
        assert sum(area[1:]) == pytest.approx(area[0], rel=1e-9)
        assert all(np.ptp(part.corners, axis=0).max() <= np.tan(np.radians(1.0)) * (1 + 1e-9) for part in found)


def test_the_direct_image_is_the_lights_picture():
    """A window in front of a long lens: its image is efl tan wide, evenly lit, and of the given irradiance."""
    window = Rectangle(size_deg=(4.0, 2.0))
    made = project(light((2.0, 1.0), shape=window), size=(600, 400), f_number=8.0, paths="same-side")
    rendering = render(made)
    seen = pictured(rendering, made, "starburst")
    settled = resolve_project(made)
    pixel = 36.0 / 600
    columns = settled.order.efl * np.tan(np.radians([0.0, 4.0])) / pixel + 300.0
    rows = 200.0 - settled.order.efl * np.tan(np.radians([0.0, 2.0])) / pixel
    inside = seen[int(rows[1]) + 4 : int(rows[0]) - 4, int(columns[0]) + 4 : int(columns[1]) - 4]
    assert inside.std() < 0.02 * inside.mean()
    flux = sum(rendering.summary["lights"][0]["direct_throughput_mm2"])
    area = np.diff(columns)[0] * -np.diff(rows)[0] * pixel**2
    assert inside.mean() == pytest.approx(flux / area, rel=0.02)
    outside = seen.copy()
    outside[int(rows[1]) - 6 : int(rows[0]) + 7, int(columns[0]) - 6 : int(columns[1]) + 7] = 0.0
    assert outside.sum() < 0.02 * seen.sum()


def test_a_light_beside_the_frame_has_its_ghosts_in_it():
    few = {"size": (120, 80), "paths": "same-side"}
    made = project(light((16.0, 0.0), diameter_deg=2.0), **few)
    settled, rendering = resolve_project(made), render(made)
    image = rendering.summary["lights"][0]["direct_position_mm"]
    assert image[0] - settled.order.efl * np.tan(np.radians(1.0)) > 0.5 * made.camera.sensor[0]
    assert len(make_shots(settled, make_opening(settled, None))) == 4
    area = pictured(rendering, made)
    assert area.sum() > 0.0
    points = picture(project(*many(light((16.0, 0.0), diameter_deg=2.0), 0.5), starburst=False, **few))
    assert np.abs(area - points).sum() < 0.02 * points.sum()


@pytest.mark.slow
def test_final_quality_agrees_with_the_reference_on_an_area_light():
    judged = judge(
        project(
            light((7.0, 4.0), diameter_deg=3.0), lens="heliar-tronnier", f_number=5.6, layers="ghosts",
            starburst=False, step=1.0,
        ),
        batches=96, side=64,
    )  # fmt: skip
    final, mean, error = judged.total
    assert abs(final - mean) < 2e-3 * mean + 4.0 * error
    # final quality approximates parts as linear: 0.5 % of a block in addition to the stated error for points
    spread_ = np.sqrt(judged.variance + (0.01 * judged.mean) ** 2 + (1e-3 * judged.mean.mean()) ** 2)
    assert np.abs((judged.final - judged.mean) / spread_).max() < 5.0
    _, worst = probabilities(judged, judged.mean)
    assert worst > 1e-4


def test_a_single_ghost_is_spread_too():
    """As a separate layer, also with art overrides: a gain, a ramp and a blur do not change the flux."""
    made = project(light(diameter_deg=1.0), layers="ghosts", starburst=False, paths="same-side")
    layers = {layer.name: layer for layer in render(made).layers}
    singles = [layer for name, layer in layers.items() if name.startswith("ghost.")]
    total = sum(layer.pixels.sum(dtype=np.float64) for layer in singles)
    assert total == pytest.approx(layers["ghosts"].pixels.sum(dtype=np.float64), rel=1e-4)
    art = {"rules": [{"select": "3-1", "gain": 2.0, "blur_px": 2.0, "ramp": [[0, 1, 1, 1], [2, 1, 1, 1]]}]}
    changed = {layer.name: layer for layer in render(made.replace(art=type(made.art).model_validate(art))).layers}
    before, after = (found["ghost.3-1"].pixels.sum(dtype=np.float64) for found in (layers, changed))
    assert after == pytest.approx(2.0 * before, rel=0.01)


def test_the_same_pixels_whatever_the_threads():
    # 30 ghosts of two parts are drawn in groups
    made = project(light(shape=Rectangle(size_deg=(3.5, 1.5))), size=(120, 80))
    assert len(make_shots(resolve_project(made), make_opening(resolve_project(made), None))) == 2
    one, three = (render(made, threads=n) for n in (1, 3))
    for a, b in zip(one.layers, three.layers, strict=True):
        assert a.pixels.tobytes() == b.pixels.tobytes()


@pytest.mark.parametrize(
    ("how", "words"),
    [
        ({"field": (80.0, 0.0), "diameter_deg": 30.0}, "its disc of 30 degrees reaches beyond 89"),
        ({"shape": Polygon(corners_deg=((0, 0), (1, 0), (0, 1e308)))}, "beside or behind the camera"),
        ({"shape": Polygon(corners_deg=((0, 0), (1, 1), (2, 2)))}, "has no area"),
        ({"shape": Polygon(corners_deg=((0, 0), (4, 0), (0, 3), (3, 3)))}, "edges that cross each other"),
        ({"shape": Rectangle(size_deg=(120.0, 10.0)), "field": (60.0, 0.0)}, "beside or behind the camera"),
    ],
)
def test_shapes_that_cannot_be(how, words):
    with pytest.raises(ProjectError, match=words):
        render(project(light(**how)))


def test_coverage_is_exact():
    square = np.array([[1.25, 2.5], [3.75, 2.5], [3.75, 4.0], [1.25, 4.0]])
    found = extent_coverage(closed(square), (6, 6))
    assert abs(found.sum()) == pytest.approx(2.5 * 1.5)
    assert np.abs(found[3]) == pytest.approx([0.0, 0.75, 1.0, 0.75, 0.0, 0.0])
    assert np.abs(found[2]) == pytest.approx([0.0, 0.375, 0.5, 0.375, 0.0, 0.0])
    # concave, in both orientations, and the centroid of its light
    corners = np.tan(np.radians(np.array(L_SHAPE.corners_deg))) * 400.0
    kernel = shape_kernel(closed(corners - corners.mean(axis=0)))
    assert kernel.sum() == pytest.approx(1.0)
    assert kernel == pytest.approx(shape_kernel(closed((corners - corners.mean(axis=0))[::-1])))
    # practically no area: a line, a dot
    assert shape_kernel(closed(np.zeros((4, 2))))[1, 1] == pytest.approx(1.0)


def test_a_window_is_spread_like_the_whole():
    rng = np.random.default_rng(4)
    sheet = np.zeros((50, 60, 3))
    sheet[0:9, 40:60] = rng.random((9, 20, 3))
    kernel = shape_kernel(closed(np.array([[-4.0, -3.0], [6.0, -1.0], [2.0, 5.0]])))
    a, b = (side // 2 for side in kernel.shape)
    whole = blur_by_extent(sheet, kernel)[a:-a, b:-b]
    assert np.abs(spread_within(sheet, kernel) - whole).max() < 1e-12


@pytest.mark.parametrize("most_taps", [0, 600])
@pytest.mark.parametrize("rows", [slice(0, 9), slice(20, 31), slice(41, 50)])
def test_the_lit_window_of_a_spread_picture_is_the_whole_one(rows, most_taps, monkeypatch):
    """By Fourier transform and tap by tap; beside the window there is no light."""
    monkeypatch.setattr(extent_blur, "MOST_TAPS", most_taps)
    sheet = np.zeros((50, 60, 3), dtype=np.float32)
    sheet[rows, 40:60] = np.random.default_rng(4).random(sheet[rows, 40:60].shape)
    kernel = shape_kernel(closed(np.array([[-4.0, -3.0], [6.0, -1.0], [2.0, 5.0]])))
    whole = spread_within(sheet.astype(float), kernel)
    light, (x, y) = spread_window(sheet[rows, 40:60], (40, rows.start), (60, 50), kernel)
    found = np.zeros_like(whole)
    found[y : y + light.shape[0], x : x + light.shape[1]] = light
    assert np.abs(found - whole).max() < 1e-6 * whole.max()
    assert light.shape[0] * light.shape[1] < 0.5 * whole.shape[0] * whole.shape[1]


def test_a_dark_window_spreads_to_an_empty_one():
    kernel = shape_kernel(closed(np.array([[-4.0, -3.0], [6.0, -1.0], [2.0, 5.0]])))
    light, _ = spread_window(np.zeros((0, 0, 3), dtype=np.float32), (0, 0), (60, 50), kernel)
    assert light.size == 0


@pytest.mark.parametrize("reach", [(3, 5), (12, 4), (1, 70)])
def test_edges_spread_by_edges_are_the_spread_picture(reach):
    """Spreading by differences equals Fourier transforms of the whole picture, also at its borders."""
    rng = np.random.default_rng(8)
    kernel = np.zeros((2 * reach[0] + 1, 2 * reach[1] + 1))
    # uniform, in two pieces, with a soft border
    kernel[:, : reach[1]] = 1.0
    kernel[reach[0] :, -2:] = 0.25
    kernel /= kernel.sum()
    sheet = np.zeros((40 + 2 * reach[0], 60 + 2 * reach[1], 3))
    for _ in range(6):
        x, y = rng.integers(0, sheet.shape[1]), rng.integers(0, sheet.shape[0])
        sheet[y : y + rng.integers(3, 30), x : x + rng.integers(3, 90)] += rng.uniform(0.1, 1.0, 3)
    steps = np.diff(kernel, axis=1, prepend=0.0, append=0.0)
    rows, columns = np.nonzero(steps)
    got = np.zeros((40, 60, 3))
    marks = np.diff(sheet, axis=1, prepend=0.0)
    spread_marks(marks, rows, columns, steps[rows, columns], np.array(reach), got)
    np.testing.assert_allclose(spread_light(got), spread_within(sheet, kernel), atol=1e-11)


@pytest.mark.parametrize("turn_deg", [0.0, 30.0, -50.0])
def test_a_rectangle_turns_counter_clockwise(turn_deg):
    """The middle of its right short side moves up for a positive angle, as seen from the camera."""
    corners = light_outline(Light(field_deg=(0.0, 0.0), shape=Rectangle(size_deg=(8.0, 1.0), rotation_deg=turn_deg)))
    x, y = 0.5 * (corners[1] + corners[2])
    assert np.degrees(np.arctan2(y, x)) == pytest.approx(turn_deg, abs=0.1)
    assert np.degrees(np.arctan(np.hypot(x, y))) == pytest.approx(4.0, rel=2e-3)


def test_what_a_ghost_is_spread_over_stands_upright():
    """A ghost that moves up and right with the light is spread over the light's outline; rows count downward."""
    sail = Polygon(corners_deg=((-0.6, -0.3), (0.6, -0.3), (0.3, 0.9)))
    settled = resolve_project(project(light((1.0, 0.5), shape=sail)))
    (shot,) = make_shots(settled, make_opening(settled, None))
    across, down = shot.to_pixels[2:]
    spread_px = points(spread_border(shot, np.diag([300.0, 120.0]), shot.to_pixels))
    slopes = points(shot.border)
    # within the allowed rounding of a spread
    assert spread_px == pytest.approx(slopes * [300.0 * across, -120.0 * down], rel=0.03, abs=0.5)
    assert spread_px[np.argmax(slopes[:, 1]), 1] == spread_px[:, 1].min() < 0.0


def test_a_disc_that_moves_a_ghost_one_way_is_a_line_bright_in_the_middle():
    """The streak of a cylinder: its light at each height is the width of the disc there, the chord."""
    settled = resolve_project(project(light((1.0, 0.5), diameter_deg=1.0)))
    (shot,) = make_shots(settled, make_opening(settled, None))
    border = spread_border(shot, np.diag([0.0, 150.0]), shot.to_pixels)
    ends = points(border)
    half = np.abs(ends[:, 1]).max()
    assert half > 5.0
    assert np.abs(ends[:, 0]).max() < 0.02
    kernel = shape_kernel(border)
    rows = np.arange(len(kernel) + 1) - 0.5 * len(kernel)
    t = np.clip(rows / half, -1.0, 1.0)
    # the integral of the chord, relative to the whole disc
    below = 0.5 + (t * np.sqrt(1.0 - t**2) + np.arcsin(t)) / np.pi
    assert kernel.sum(axis=1) == pytest.approx(np.diff(below), abs=2e-3)


def test_ghosts_of_an_area_light_that_nobody_sees_may_be_drawn_in_few_colours():
    """Second method: each ghost in full detail, as a separate layer."""
    made = Project(
        lens="triplet-pestrecov", f_number=5.6, lights=(Light(field_deg=(6.0, 4.0), diameter_deg=0.5),),
        camera=Camera(size_px=(120, 80)), quality=Quality(wavelengths=5, ringing="off"),
        output=Output(starburst=False, layers="ghosts"),
    )  # fmt: skip
    full = render(made)
    few = render(made.replace(output=Output(starburst=False, layers="passes")))
    expected, found = (next(x for x in one.layers if x.name == "ghosts").pixels for one in (full, few))
    assert sum(layer.name.startswith("ghost.") for layer in full.layers) > 10
    # in few colours a ghost whose throughput is steep keeps the colour of its traced wavelengths
    assert np.abs(found - expected).mean() < 1.5e-3 * expected.mean()
    assert not np.array_equal(found, expected)
