"""The anamorphic adapter: what it squeezes, and the streak and the ovals that it makes by itself."""

from __future__ import annotations

import numpy as np
import pytest

from flarewright.model import Art, Camera, Everywhere, Light, Output, Preset, Project, Quality, Rule
from flarewright.model.coating import Bare
from flarewright.optics.pack import pack_lens
from flarewright.optics.paraxial import D_LINE_NM, first_order
from flarewright.optics.paths import direct_path, ghost_path
from flarewright.optics.trace import trace_rays
from flarewright.render.prepare import load_lens
from flarewright.render.render import render

LENS = "anamorphic-heliar-2x"


@pytest.fixture(scope="module")
def lens():
    return load_lens(LENS)


@pytest.fixture(scope="module")
def packed(lens):
    return pack_lens(lens, first_order(lens, 8.0), (None,) * len(lens.rows), np.array([D_LINE_NM]))


def spot(packed, path, field=(0.0, 0.0)):
    """Where the rays land that pass, and how many there are."""
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
    """Flat up and down, so in focus; curved across, so spread: the light stays on the line through its image."""
    direct_y = spot(packed, direct_path(lens), (0.0, 3.0))[1].mean()
    longest = 0.0
    for j in range(1, 6):
        for i in range(j):
            x, y = spot(packed, ghost_path(lens, j, i), (0.0, 3.0))
            if len(x) < 5:
                continue
            away = np.abs(y - direct_y)
            # sharp near the middle; farther out rays askew bow it: 0.08 mm at the edge of the sensor
            assert away[np.abs(x) < 4.0].max() < 0.03, (j, i)
            assert away[np.abs(x) < 12.0].max() < 0.08, (j, i)
            assert away.max() < 0.01 * max(float(np.ptp(x)), 3.0), (j, i)
            longest = max(longest, float(np.ptp(x)))
    assert longest > 10.0


def streak(coating, field, f_number):
    """Light of all pairs of faces between glass and air, column by column; blue, and red over blue."""
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
    """From border to border: no pair of faces ends within the picture and is bright beside the one that does not."""
    blue, red = streak(Preset(name="blue-streak"), field, f_number)
    assert red < 0.25
    even = blue / np.median(blue)
    assert even.min() > 0.8
    assert even.max() < 1.2
    # what ends does so softly: no dashes
    assert np.abs(np.diff(even)).max() < 0.04


def test_the_streak_of_bare_glass_has_no_dashes():
    """All six pairs count; of the former adapter one place had ten times as much light as another."""
    light, _ = streak(Everywhere(coating=Bare()), (6.0, 1.5), 8.0)
    assert light.max() < 4.0 * light.min()
    assert np.abs(np.diff(light)).max() < 0.15 * np.median(light)


def test_ghosts_of_the_lens_behind_it_are_ovals(lens, packed):
    x, y = spot(packed, ghost_path(lens, 10, 9))
    alone = load_lens("heliar-tronnier")
    round_pack = pack_lens(alone, first_order(alone, 8.0), (None,) * 9, np.array([D_LINE_NM]))
    u, v = spot(round_pack, ghost_path(alone, 4, 3))
    # behind the adapter the light is the same cone of the iris: round on the film, an oval when the picture is wide
    assert u.std() == pytest.approx(v.std(), rel=0.02)
    assert x.std() == pytest.approx(y.std(), rel=0.2)
    x, y = spot(packed, ghost_path(lens, 6, 3))
    # by way of a cylinder it is an oval on the film too
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
    )  # fmt: skip
    told, plain = (render(project.replace(camera=project.camera.replace(desqueeze=d))) for d in (True, False))
    assert any("desqueeze changes nothing" in remark for remark in told.remarks)
    assert np.array_equal(told.layers[0].pixels, plain.layers[0].pixels)
