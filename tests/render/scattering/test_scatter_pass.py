"""The scatter layer: content and smoothness; it changes other layers only by the light it takes."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from flarewright.model import Art, Camera, Light, Lines, Output, Project, Quality, RowScatter, Scatter, Surface
from flarewright.optics.colour.rgb import luminance_weights
from flarewright.render.reference import energy_ledger
from flarewright.render.render import render
from flarewright.render.scattering import scatter_pass
from flarewright.render.scattering.scatter_pass import chosen_scatter, gather, render_scatter, scatter_of
from flarewright.render.scene.direct_image import direct_image
from flarewright.render.scene.opening import make_opening
from flarewright.render.scene.resolve import load_lens, resolve_project
from flarewright.render.scene.shots import make_shots

GREEN = Lines(lines=((550.0, 1.0),))
POLISH = Scatter(model="harvey-shack", roughness_nm=2.0)
FINELY = Quality(mode="final", wavelengths=3)
BY_CHANCE = Quality(mode="reference", wavelengths=1, bridge=False, reference_samples=2 * 128**2)


def project(**changes):
    fields = {
        "lens": "triplet-pestrecov",
        "f_number": 5.6,
        "lights": (Light(field_deg=(8.0, 4.0), spectrum=GREEN),),
        "camera": Camera(size_px=(96, 64)),
        "quality": Quality(mode="draft", wavelengths=3),
        "scatter": POLISH,
    }
    return Project(**{**fields, **changes})


def singlet():
    """Return the front lens of the triplet and the stop: a quarter of the rays, which surfaces before a stop share."""
    whole = load_lens("triplet-pestrecov")
    rows = (*whole.rows[:2], whole.rows[whole.stop_row])
    return whole.replace(name="singlet", rows=rows, coating_presets={}, sensor_distance=None)


def drawn(reported):
    """Return the scatter layer alone, and its inputs."""
    settled = resolve_project(reported)
    shots = make_shots(settled, make_opening(settled, None))
    images = [direct_image(settled.lens, shot) for shot in shots]
    tables = scatter_of(settled, shots)
    return render_scatter(settled, shots, images, tables).pixels.astype(np.float64), settled, shots, images, tables


def layer(rendering, name):
    return next(found for found in rendering.layers if found.name == name).pixels


def luminance(pixels):
    return pixels @ luminance_weights("rec709")


def few(patch):
    """Gather at few points from few rays, for properties that do not depend on sampling."""
    for name in ("FINE", "COARSE"):
        patch.setattr(scatter_pass, name, getattr(scatter_pass, name)._replace(rays=6, rings=12, spokes=12, fan=8))


@pytest.fixture
def few_points(monkeypatch):
    few(monkeypatch)


@pytest.fixture(scope="module")
def plain():
    with pytest.MonkeyPatch.context() as patch:
        few(patch)
        return render(project(scatter=None)), render(project())


@pytest.fixture(scope="module")
def standard():
    return drawn(project(quality=FINELY))


@pytest.fixture(scope="module")
def rough_standard():
    """The same at few points."""
    with pytest.MonkeyPatch.context() as patch:
        few(patch)
        return drawn(project())[0]


@pytest.fixture(scope="module")
def by_chance():
    # a ledger is unbiased for any number of rays
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(energy_ledger, "SIDE", 32)
        return render(project(quality=BY_CHANCE), ledger=True)


def test_nothing_scatters_by_default(plain, few_points):
    without, _ = plain
    assert [found.name for found in without.layers] == ["beauty", "starburst", "ghosts"]
    assert "scatter" not in without.summary
    off = render(project(scatter=Scatter()))
    for one, other in zip(without.layers, off.layers, strict=True):
        np.testing.assert_array_equal(one.pixels, other.pixels)


def test_it_is_a_layer_of_its_own(plain):
    without, scattered = plain
    assert [found.name for found in scattered.layers] == ["beauty", "starburst", "ghosts", "scatter"]
    np.testing.assert_array_equal(layer(without, "ghosts"), layer(scattered, "ghosts"))
    parts = [layer(scattered, name).astype(np.float64) for name in ("starburst", "scatter")]
    ghosts = next(found for found in scattered.layers if found.name == "ghosts")
    x, y, w, h = ghosts.window
    parts[0][y : y + h, x : x + w] += ghosts.pixels
    np.testing.assert_allclose(layer(scattered, "beauty"), sum(parts), rtol=1e-5, atol=1e-12)
    # the direct image loses the scattered light
    kept = scattered.summary["scatter"]["direct_kept"]
    assert 0.99 < kept < 1.0
    assert layer(scattered, "starburst").sum() / layer(without, "starburst").sum() == pytest.approx(kept, rel=1e-6)


def test_a_lens_file_may_say_it():
    lens = load_lens("triplet-pestrecov").replace(scatter=POLISH)
    assert chosen_scatter(resolve_project(project(lens=lens, scatter=None))) == POLISH
    assert chosen_scatter(resolve_project(project(lens=lens, scatter=Scatter(model="abg")))).model == "abg"
    assert chosen_scatter(resolve_project(project(lens=lens, scatter=Scatter(model="none")))) is None
    # its exceptions refer to its own rows, with or without a filter before them
    rows = lens.replace(scatter=POLISH.replace(rows=(RowScatter(row=1, roughness_nm=9.0),)))
    reported = project(lens=rows, scatter=None, filter={"glass": "N-BK7", "thickness": 2.0, "gap": 5.0})
    assert chosen_scatter(resolve_project(reported)).rows[0].row == 3


def test_pixels_do_not_depend_on_threads(few_points):
    one, three = (render(project(), threads=threads) for threads in (1, 3))
    np.testing.assert_array_equal(layer(one, "scatter"), layer(three, "scatter"))


def test_light_is_kept():
    """Scatter by long ripples stays near the image, so all of it lands in the picture: the total of every surface."""
    ripples = Scatter(model="harvey-shack", roughness_nm=2.0, correlation_um=50.0, slope=6.0)
    # near the axis, where incidence is nearly normal, for which the totals are defined
    light = Light(field_deg=(1.0, 0.5), spectrum=GREEN)
    view = {"camera": Camera(size_px=(480, 320)), "f_number": 16.0, "quality": FINELY}
    reported = project(scatter=ripples, lights=(light,), **view)
    pixels, _, shots, images, tables = drawn(reported)
    area = 1.0 / float(shots[0].to_pixels[2] * shots[0].to_pixels[3])
    flux = luminance(pixels).sum() * area
    shares = tables[0].shares[0]
    left = np.concatenate([[1.0], np.cumprod(1.0 - shares)[:-1]])
    assert flux / images[0].throughput_mm2[0] == pytest.approx((shares * left).sum(), rel=5e-3)


@pytest.mark.parametrize("peaked", [{"correlation_um": 100.0}, {"cleanliness_level": 500.0}])
def test_a_small_picture_holds_the_light_of_a_large_one(peaked):
    """It used to take the light at the centres of pixels: at 36 pixels up to 63 % of a channel was missing."""
    sums = []
    for size in ((360, 240), (36, 24), (9, 6)):
        camera = Camera(size_px=size, sensor_mm=(36.0, 24.0))
        lights = (Light(field_deg=(8.0, 4.0)),)
        pixels, *_ = drawn(project(camera=camera, lights=lights, scatter=Scatter(model="harvey-shack", **peaked)))
        sums.append(pixels.sum(axis=(0, 1)) / (size[0] * size[1]))
    np.testing.assert_allclose(sums[1:], [sums[0]] * 2, rtol=5e-3)


def test_twice_the_roughness_scatters_four_times(few_points):
    rough, fine = (drawn(project(scatter=POLISH.replace(roughness_nm=nm)))[0] for nm in (1.0, 0.5))
    assert luminance(rough).sum() / luminance(fine).sum() == pytest.approx(4.0, rel=2e-3)


def test_blue_scatters_more(few_points):
    sums, shares = {}, {}
    for nm in (450.0, 650.0):
        light = Light(field_deg=(8.0, 4.0), spectrum=Lines(lines=((nm, 1.0),)))
        pixels, _, _, _, tables = drawn(project(lights=(light,)))
        sums[nm], shares[nm] = luminance(pixels)[:, :24].sum(), tables[0].shares.sum()
    # totals fall as lambda^-2, slightly faster by dispersion; far from the shoulder they spread as lambda^(slope - 2)
    assert shares[450.0] / shares[650.0] == pytest.approx((650.0 / 450.0) ** 2, rel=0.1)
    reported = shares[450.0] / shares[650.0] * (450.0 / 650.0) ** 0.5
    assert sums[450.0] / sums[650.0] == pytest.approx(reported, rel=0.02)


def test_it_is_smooth():
    pixels, _, shots, images, _ = drawn(project(camera=Camera(size_px=(240, 160))))
    level = np.log(luminance(pixels))
    x, y = images[0].position_mm
    column, row = shots[0].to_pixels[0] + x * shots[0].to_pixels[2], shots[0].to_pixels[1] - y * shots[0].to_pixels[3]
    away = np.hypot(np.arange(240) + 0.5 - column, (np.arange(160) + 0.5 - row)[:, None])[1:-1, 1:-1]
    bend = np.abs(level[2:, 1:-1] + level[:-2, 1:-1] + level[1:-1, 2:] + level[1:-1, :-2] - 4.0 * level[1:-1, 1:-1])
    # the curvature of a power of the distance r is about (slope / r)^2
    assert (bend[away > 5.0] < 12.0 / away[away > 5.0] ** 2 + 2e-3).all()
    assert (pixels > 0.0).any(axis=2).all()


@pytest.mark.parametrize(
    ("lens", "field", "close"),
    [
        ("triplet-pestrecov", (8.0, 4.0), 0.02),
        pytest.param("triplet-pestrecov", (0.0, 0.0), 0.02, marks=pytest.mark.slow),
        # far outside the field only a sliver of the front surfaces is lit, which needs more rays
        (singlet, (35.0, -10.0), 0.08),
        pytest.param("triplet-pestrecov", (35.0, -10.0), 0.08, marks=pytest.mark.slow),
    ],
    ids=["inside", "on the axis", "far outside a singlet", "far outside"],
)
def test_pixels_are_what_their_points_gather(lens, field, close, standard):
    lens = lens() if callable(lens) else lens
    reported = project(lens=lens, lights=(Light(field_deg=field, spectrum=GREEN),), quality=FINELY)
    pixels, settled, shots, _, tables = standard if reported == project(quality=FINELY) else drawn(reported)
    shot = shots[0]
    rng = np.random.default_rng(3)
    rows, columns = rng.integers(0, 64, 40), rng.integers(0, 96, 40)
    place = np.stack(
        [(columns + 0.5 - shot.to_pixels[0]) / shot.to_pixels[2], (shot.to_pixels[1] - rows - 0.5) / shot.to_pixels[3]],
        axis=1,
    )
    points = np.ascontiguousarray(-place @ shot.incidence.axes.T)
    with ThreadPoolExecutor(1) as pool:
        fine = gather(settled.lens, shot, tables[0], [0], points, pool, rays=40)[0] * shot.gain
    assert luminance(pixels)[rows, columns] == pytest.approx(fine, rel=close)


@pytest.mark.parametrize(
    ("lens", "field"),
    [
        (singlet, (8.0, 4.0)),
        pytest.param("triplet-pestrecov", (8.0, 4.0), marks=pytest.mark.slow),
        pytest.param("triplet-pestrecov", (25.0, 4.0), marks=pytest.mark.slow),
    ],
    ids=["inside, singlet", "inside", "beside"],
)
def test_a_draft_gathers_less_and_shows_the_same(lens, field):
    asked = project(lens=lens() if callable(lens) else lens, lights=(Light(field_deg=field),))
    final, draft = (drawn(asked.replace(quality=Quality(mode=mode)))[0] for mode in ("final", "draft"))
    sums = [pixels.sum(axis=(0, 1)) for pixels in (final, draft)]
    # each channel, whose wavelengths draft and final choose otherwise
    assert sums[1] == pytest.approx(sums[0], rel=0.03)
    assert luminance(draft) == pytest.approx(luminance(final), rel=0.05)


def test_general_surfaces_scatter_alike(rough_standard, few_points):
    """An asphere too weak to matter sends every ray through the code for surfaces of any shape."""
    lens = load_lens("triplet-pestrecov")
    first = next(k for k, row in enumerate(lens.rows) if isinstance(row, Surface))
    rows = list(lens.rows)
    rows[first] = rows[first].replace(asphere=(1e-15,))
    near = Light(field_deg=(8.0, 4.0), spectrum=GREEN, distance=800.0)
    for lights in (project().lights, (near,)):
        plain = drawn(project(lights=lights))[0] if near in lights else rough_standard
        general = drawn(project(lens=lens.replace(rows=tuple(rows)), lights=lights))[0]
        np.testing.assert_allclose(general, plain, rtol=1e-4, atol=1e-12)


def test_a_far_near_light_is_a_distant_one(rough_standard, few_points):
    far = Light(field_deg=(8.0, 4.0), spectrum=GREEN, distance=1e7)
    np.testing.assert_allclose(drawn(project(lights=(far,)))[0], rough_standard, rtol=1e-3, atol=1e-12)


def test_lights_add(rough_standard, few_points):
    red = Lines(lines=((620.0, 1.0),))
    lights = (*project().lights, Light(field_deg=(-5.0, 0.0), intensity=0.3, spectrum=red))
    both = drawn(project(lights=lights))[0]
    alone = rough_standard + drawn(project(lights=lights[1:]))[0]
    np.testing.assert_allclose(both, alone, rtol=1e-5, atol=1e-12)


def test_the_artist_may_grade_it(plain, few_points):
    graded = render(project(art=Art(gain={"scatter": 3.0})))
    np.testing.assert_allclose(layer(graded, "scatter"), 3.0 * layer(plain[1], "scatter"), rtol=1e-6, atol=1e-12)


def test_a_sensor_that_reflects_changes_nothing_here(rough_standard, few_points):
    mirror = project(camera=Camera(size_px=(96, 64), sensor_reflectance=0.1))
    np.testing.assert_array_equal(drawn(mirror)[0], rough_standard)


def test_the_reference_scatters_by_chance_and_the_ledger_shows_it(by_chance, standard, few_points, monkeypatch):
    found = by_chance
    names = [kept.name for kept in found.layers]
    assert names == [
        "beauty", "starburst", "ghosts", "ghosts.order4+", "scatter",
        "ghosts.variance", "ghosts.order4+.variance", "scatter.variance",
    ]  # fmt: skip
    mine = luminance(standard[0]).sum()
    assert luminance(layer(found, "scatter")).sum() == pytest.approx(mine, rel=0.05)
    monkeypatch.setattr(energy_ledger, "SIDE", 32)
    final = render(project(), ledger=True)
    for reported in (found, final):
        shares = {line.name: line.share for line in reported.ledger.lines}
        assert shares["scatter.in_picture"] > 0.0
        assert shares["scatter.ended"] > 0.0
        assert reported.ledger.total.share == pytest.approx(1.0, abs=1e-3)
    monkeypatch.setattr(energy_ledger, "SIDE", 8)
    without = render(project(scatter=None), ledger=True)
    assert not any("scatter" in line.name for line in without.ledger.lines)


@pytest.mark.parametrize(
    ("changes", "scale"),
    [
        ({"camera": Camera(size_px=(96, 64), sensor_reflectance=0.1)}, 1e-6),
        # a small area light, which scatters like a light at its centre
        ({"lights": (Light(field_deg=(8.0, 4.0), spectrum=GREEN, diameter_deg=0.5),)}, 0.05),
    ],
)
def test_the_reference_scatters_alike(changes, scale, by_chance):
    """A reflecting sensor does not change the incident light; an area light scatters like a light at its centre."""
    plain = layer(by_chance, "scatter").astype(np.float64)
    other = layer(render(project(quality=BY_CHANCE, **changes)), "scatter").astype(np.float64)
    assert luminance(other).sum() == pytest.approx(luminance(plain).sum(), rel=scale)


def test_single_layers_keep_it(few_points):
    found = render(project(output=Output(layers="beauty")))
    assert [kept.name for kept in found.layers] == ["beauty"]
