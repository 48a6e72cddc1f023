"""The anamorphic adapter: its squeeze, its streak, and its oval ghosts."""

from __future__ import annotations

import numpy as np
import pytest
from sensor_rays import trace_rays

from flarewright.kernels.raster.bundle import draw_bundle, measure_bundle, node_densities
from flarewright.kernels.raster.polygons import blank_plane, to_pixels
from flarewright.model import Art, Camera, Everywhere, Iris, Light, Output, Preset, Project, Quality, Rule
from flarewright.model.lens.coating import Bare
from flarewright.optics.lens.dispersion import D_LINE_NM
from flarewright.optics.lens.paraxial import first_order
from flarewright.optics.lens.paths import direct_path, ghost_path
from flarewright.optics.rays.bundle import Refinement, trace_grid
from flarewright.optics.rays.pack import pack_lens
from flarewright.optics.rays.pupil_region import find_region
from flarewright.render.render import render
from flarewright.render.scene.opening import make_opening
from flarewright.render.scene.resolve import load_lens, resolve_project
from flarewright.render.scene.shots import make_shots

LENS = "anamorphic-heliar-2x"


@pytest.fixture(scope="module")
def lens():
    return load_lens(LENS)


@pytest.fixture(scope="module")
def packed(lens):
    return pack_lens(lens, first_order(lens, 8.0), (None,) * len(lens.rows), np.array([D_LINE_NM]))


def spot(packed, path, field=(0.0, 0.0)):
    """Return the landing points of the rays that pass, and their number."""
    at = np.linspace(-42.0, 42.0, 301)
    x, y = (grid.ravel() for grid in np.meshgrid(at, at))
    found = trace_rays(packed, path, x, y, field)
    ok = (found["status"] > 0) & (found["rel_radius"] <= 1.0)
    ok &= np.hypot(found["stop_x"], found["stop_y"]) <= packed.stop_semi
    return -found["x"][ok], -found["y"][ok]


def test_it_halves_the_focal_length_across_and_keeps_the_focus(lens):
    order, alone = first_order(lens), first_order(load_lens("heliar-tronnier"))
    assert (order.efl, order.bfl) == (pytest.approx(alone.efl, rel=1e-9), pytest.approx(alone.bfl, rel=1e-9))
    assert order.efl / order.efl_x == pytest.approx(lens.squeeze, rel=2e-3)
    assert order.bfl_x == pytest.approx(order.bfl, abs=1e-3)


@pytest.mark.parametrize("field", [(0.0, 0.0), (8.0, 0.0), (0.0, 5.0), (8.0, 4.0)])
def test_the_picture_is_squeezed_and_sharp(lens, packed, field):
    x, y = spot(packed, direct_path(lens), field)
    assert len(x) > 200
    slope_x, slope_y = np.tan(np.radians(field))
    assert x.mean() == pytest.approx(packed.first_order.efl_x * slope_x, rel=0.03, abs=1e-3)
    assert y.mean() == pytest.approx(packed.first_order.efl * slope_y, rel=0.03, abs=1e-3)
    assert np.hypot(x.std(), y.std()) < 0.06


def test_two_faces_of_a_cylinder_make_a_streak(lens, packed):
    """In focus vertically, out of focus horizontally: the light stays on the line through its image."""
    direct_y = spot(packed, direct_path(lens), (0.0, 3.0))[1].mean()
    longest = 0.0
    for j in range(1, 6):
        for i in range(j):
            x, y = spot(packed, ghost_path(lens, j, i), (0.0, 3.0))
            if len(x) < 5:
                continue
            away = np.abs(y - direct_y)
            # sharp near the middle; farther out, skew rays bend it: 0.08 mm at the edge of the sensor
            assert away[np.abs(x) < 4.0].max() < 0.03, (j, i)
            assert away[np.abs(x) < 12.0].max() < 0.08, (j, i)
            assert away.max() < 0.01 * max(float(np.ptp(x)), 3.0), (j, i)
            longest = max(longest, float(np.ptp(x)))
    assert longest > 10.0


def streak(coating, field, f_number):
    """Return the light of all pairs of faces between glass and air, column by column: blue, and red over blue."""
    pairs = [Rule(select=pair, enable=True) for pair in ("2-0", "3-0", "5-0", "3-2", "5-2", "5-3")]
    project = Project(
        lens=LENS, lights=(Light(field_deg=field),), coating=coating, f_number=f_number,
        camera=Camera(size_px=(180, 48), desqueeze=True), quality=Quality(wavelengths=3, ringing="off", bridge=False),
        output=Output(starburst=False, layers="passes"), art=Art(rules=(Rule(select="all", enable=False), *pairs)),
    )  # fmt: skip
    layer = {layer.name: layer for layer in render(project).layers}["ghosts"]
    light = np.zeros((180, 3))
    x, _, width, _ = layer.window
    light[x : x + width] = layer.pixels.sum(axis=0)
    return light[:, 2], light[:, 0].sum() / light[:, 2].sum()


@pytest.mark.parametrize(("field", "f_number"), [((6.0, 1.5), 8.0), ((2.0, 0.3), 8.0), ((9.0, 1.0), 4.0)])
def test_the_streak_is_blue_and_even(field, f_number):
    """From border to border: no pair of faces has a bright end within the picture."""
    blue, red = streak(Preset(name="blue-streak"), field, f_number)
    assert red < 0.25
    even = blue / np.median(blue)
    assert even.min() > 0.8
    assert even.max() < 1.2
    # ends within the picture are soft: no dashes
    assert np.abs(np.diff(even)).max() < 0.04


def test_the_streak_of_bare_glass_has_no_dashes():
    """All six pairs count; the former adapter had ten times as much light at one place as at another."""
    light, _ = streak(Everywhere(coating=Bare()), (6.0, 1.5), 8.0)
    assert light.max() < 4.0 * light.min()
    assert np.abs(np.diff(light)).max() < 0.15 * np.median(light)


def test_a_streak_keeps_its_flux_on_few_triangles(lens):
    """Thinner than a pixel it folds again and again across itself: that is not seen, and no light is lost by it."""
    project = Project(
        lens=LENS, lights=(Light(field_deg=(6.0, 0.3)),), f_number=4.0, iris=Iris(blades=6),
        camera=Camera(size_px=(900, 16), sensor_mm=(90.0, 3.2), desqueeze=True), quality=Quality(wavelengths=3),
    )  # fmt: skip
    settled = resolve_project(project)
    opening = make_opening(settled, None)
    (shot,) = make_shots(settled, opening)
    tilt, axes = shot.incidence.tilt, shot.incidence.axes
    for pair in ((2, 0), (5, 2)):
        path = ghost_path(lens, *pair)
        region = find_region(shot.packed, path, tilt, opening.radius)
        assert region is not None
        found = []
        for tolerance in (0.25, 0.02):
            bundle = trace_grid(
                shot.packed, path, tilt, (opening.radius, opening.inner), region,
                Refinement(float(shot.to_pixels[2:].max()), tolerance, one_color=True),
            )  # fmt: skip
            (data,) = bundle.traced.values()
            known = data, bundle.pupil, bundle.triangles
            plane = blank_plane(900, 16)
            draw_bundle(
                *known, node_densities(*known), path.stop_crossings, opening.blades, opening.levels, axes,
                shot.to_pixels, 1.0, np.ones(3), plane, bundle.halves,
            )  # fmt: skip
            light = to_pixels(plane, 900)[..., 0].sum(axis=0, dtype=float)
            sums = measure_bundle(*known, path.stop_crossings, opening.blades, axes, bundle.halves)
            # all of it lands in the picture
            assert light.sum() == pytest.approx(sums[0], rel=1e-4)
            found.append(light)
            if tolerance == 0.25:
                assert len(bundle.triangles) < 20_000
        coarse, fine = found
        assert np.abs(coarse - fine).sum() < 5e-3 * fine.sum()


def test_ghosts_of_the_lens_behind_it_are_ovals(lens, packed):
    x, y = spot(packed, ghost_path(lens, 10, 9))
    alone = load_lens("heliar-tronnier")
    round_pack = pack_lens(alone, first_order(alone, 8.0), (None,) * 9, np.array([D_LINE_NM]))
    u, v = spot(round_pack, ghost_path(alone, 4, 3))
    # behind the adapter, the light is the same cone of the iris: round on the film, an oval after desqueezing
    assert u.std() == pytest.approx(v.std(), rel=0.02)
    assert x.std() == pytest.approx(y.std(), rel=0.2)
    x, y = spot(packed, ghost_path(lens, 6, 3))
    # after reflection at a cylinder it is an oval on the film too
    assert abs(x.std() / y.std() - 1.0) > 0.1


def test_drawn_wide_it_is_the_same_light(lens):
    def shoot(size, **camera):
        project = Project(
            lens=LENS, lights=(Light(field_deg=(9.0, 2.0)),), coating=Preset(name="blue-streak"), f_number=8.0,
            camera=Camera(size_px=size, sensor_mm=(24.0, 20.0), **camera),
            quality=Quality(mode="draft", wavelengths=3), output=Output(starburst=False),
        )  # fmt: skip
        return render(project)

    narrow, wide = shoot((60, 50)), shoot((120, 50), desqueeze=True)
    assert narrow.project.camera.pixel_aspect == pytest.approx(2.0)
    assert wide.project.camera.pixel_aspect == pytest.approx(2.0 * 0.2 / 0.4)
    fine, coarse = wide.layers[0].pixels, narrow.layers[0].pixels
    assert fine.reshape(50, 60, 2, 3).mean(axis=2) == pytest.approx(coarse, abs=2e-3 * float(coarse.max()))
    assert Camera(size_px=(1200, 500), squeeze=2.0, desqueeze=True).sensor == pytest.approx((18.0, 15.0))
    assert Camera(size_px=(1200, 500)).sensor == pytest.approx((36.0, 15.0))


def test_a_lens_that_squeezes_nothing_says_so():
    project = Project(
        lens="heliar-tronnier", lights=(Light(field_deg=(3.0, 2.0)),),
        camera=Camera(size_px=(60, 40), desqueeze=True), quality=Quality(mode="draft", wavelengths=3),
        output=Output(starburst=False),
    )  # fmt: skip
    reported, plain = (render(project.replace(camera=project.camera.replace(desqueeze=d))) for d in (True, False))
    assert any("desqueeze has no effect" in remark for remark in reported.remarks)
    assert np.array_equal(reported.layers[0].pixels, plain.layers[0].pixels)
