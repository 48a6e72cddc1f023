"""Conservation of flux: the sum of a layer is the flux of its rays, for any picture size, sensor, grid and iris."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from PIL import Image
from prescriptions import ghost_table_of
from pupil_sum import D_LINE, by_name, count, layer_flux, layers_of, mono, path_of, picture, scene, shots_of

from flarewright.model import D65, Art, Everywhere, Iris, Light, Output, Project, Quality, QuarterWave, Rule
from flarewright.optics.lens.paths import ghost_paths
from flarewright.optics.rays.pupil_region import find_region
from flarewright.render.ghosts.ghost_pass import render_ghosts
from flarewright.render.render import render
from flarewright.render.scene.resolve import load_lens

FLUX = 2e-3
FLOOR = 1e-4

ROUND, SIX, ROUNDED_FIVE = Iris(), Iris(blades=6), Iris(blades=5, rounding=0.4, rotation_deg=10.0)

HOLDS = (1200.0, 1200.0)
"""A sensor that contains every ghost of these lenses at f/8; flux outside it is excluded from the comparison."""


def monochrome(project) -> np.ndarray:
    """RGB of the one traced wavelength."""
    shot = shots_of(project)[0]
    return shot.weights(shot.packed.wavelengths_nm)[0]


def counted(project, rays: int | None = None, every: int = 1) -> dict:
    """Count rays for every path; 170 per side give the flux of plain ghosts to 4e-4, 120 to 7e-4."""
    # thin rings need more
    rays = rays or {"double-gauss-tronnier": 240, "tessar-brendel": 170}.get(project.lens, 120)
    camera = project.camera.replace(size_px=(64, 36))
    lit = project.replace(camera=camera, quality=Quality(wavelengths=1), output=Output())
    return _counted(lit.model_dump_json(), rays, every)


@lru_cache(maxsize=16)
def _counted(json: str, rays: int, every: int) -> dict:
    """Count once per light and sensor, for any number of pixels."""
    project = Project.model_validate_json(json)
    shot = shots_of(project)[0]
    lens = load_lens(project.lens)
    return {
        f"ghost.{path.name}": count(shot, path, project.iris, n=rays) for path in ghost_paths(lens)[every > 1 :: every]
    }


def complaints(project, truth: dict, floor: float = FLOOR, tolerance: float = FLUX) -> list[str]:
    """Compare every layer with the rays that land on the sensor, relative to the ghost's flux."""
    layers, rgb = layers_of(project), monochrome(project)
    brightest = max(c.flux for c in truth.values())
    wrong = []
    for name, c in truth.items():
        if c.flux < floor * brightest:
            continue
        drawn = layer_flux(layers[name], project) / rgb if name in layers else np.zeros(3)
        error = float(np.abs(drawn - c.on_sensor).max()) / c.flux
        if error > tolerance:
            wrong.append(f"{name} ({c.flux / brightest:.1e} of the brightest) is off by {error:.2e}")
    return wrong


def ghosts_of(lens: str, light: Light, **parts):
    return scene(lens, light, layers="ghosts", starburst=False, **parts)


def slow(*values):
    """Repeat a test on more lenses in slow runs."""
    return pytest.param(*values, marks=pytest.mark.slow)


# --- the sum of each layer


@pytest.mark.parametrize(
    "lens", ["triplet-pestrecov", slow("heliar-tronnier"), slow("tessar-brendel"), slow("double-gauss-tronnier")]
)
def test_each_layer_holds_its_flux_whatever_the_picture(lens):
    """A sensor that contains all, one of 36 mm and a square one; small, odd and ordinary sizes; two tolerances."""
    wide = ghosts_of(lens, mono((8.0, 5.0)), size_px=(64, 36), sensor_mm=HOLDS)
    truth = counted(wide)
    assert all(c.on_sensor == pytest.approx(c.flux, rel=1e-3) for c in truth.values() if c.flux > 0.0)
    assert complaints(wide, truth) == []
    for size, tolerance in (((161, 91), 0.05), ((127, 255), 1.0)):
        same = ghosts_of(lens, mono((8.0, 5.0)), size_px=size, sensor_mm=HOLDS, tolerance_px=tolerance)
        assert complaints(same, truth) == [], (size, tolerance)


@pytest.mark.parametrize(
    ("lens", "size", "sensor"),
    [
        ("triplet-pestrecov", (333, 187), (36.0, 20.25)),
        slow("tessar-brendel", (333, 187), (36.0, 20.25)),
        slow("tessar-brendel", (101, 99), (100.0, 40.0)),
        slow("heliar-tronnier", (333, 187), (36.0, 20.25)),
        slow("double-gauss-tronnier", (333, 187), (36.0, 20.25)),
        slow("heliar-tronnier", (101, 99), (100.0, 40.0)),
        slow("double-gauss-tronnier", (101, 99), (100.0, 40.0)),
    ],
)
def test_each_layer_holds_what_lands_on_the_sensor(lens, size, sensor):
    project = ghosts_of(lens, mono((-14.0, 3.0)), size_px=size, sensor_mm=sensor)
    assert complaints(project, counted(project)) == []


@pytest.mark.slow
def test_each_layer_holds_its_flux_behind_blades():
    """The iris passes the same rays as `optics.pupil.iris.transmission`."""
    project = ghosts_of("tessar-brendel", mono((8.0, 5.0)), iris=SIX, size_px=(160, 90), sensor_mm=(360.0, 202.5))
    assert complaints(project, counted(project)) == []


@pytest.mark.parametrize(
    ("lens", "iris", "f_number", "field", "size", "sensor"),
    [
        ("triplet-pestrecov", SIX, 8.0, (8.0, 5.0), (64, 36), (360.0, 202.5)),
        slow("heliar-tronnier", SIX, 8.0, (8.0, 5.0), (64, 36), (360.0, 202.5)),
        slow("tessar-brendel", ROUNDED_FIVE, 8.0, (8.0, 5.0), (320, 180), (360.0, 202.5)),
        slow("double-gauss-tronnier", ROUNDED_FIVE, 8.0, (-14.0, 3.0), (101, 99), (100.0, 100.0)),
        slow("tessar-brendel", ROUND, 8.0, (8.0, 5.0), (160, 90), HOLDS),
        slow("heliar-tronnier", ROUND, 32.0, (1.0, 0.75), (300, 300), (60.0, 60.0)),
        slow("heliar-tronnier", ROUND, 64.0, (0.5, 0.4), (300, 300), (60.0, 60.0)),
    ],
)
def test_every_edge_is_cut_exactly(lens, iris, f_number, field, size, sensor):
    project = ghosts_of(lens, mono(field), iris=iris, f_number=f_number, size_px=size, sensor_mm=sensor)
    assert complaints(project, counted(project)) == []


@pytest.mark.parametrize(
    ("lens", "field", "f_number", "rays", "every"),
    [
        slow("flektogon-35", (10.0, 5.0), 2.8, 120, 1),
        slow("takumar-50-f1.4", (8.0, 5.0), 1.4, 90, 1),
        # one of its ghosts is a ring so thin that few rays do not determine its flux; it is among every fourth
        ("double-gauss-tronnier", (0.0, 0.0), 2.1, 170, 4),
        slow("flektogon-35", (10.0, 5.0), 2.8, 240, 1),
        slow("takumar-50-f1.4", (8.0, 5.0), 1.4, 240, 1),
        slow("double-gauss-tronnier", (0.0, 0.0), 2.1, 240, 1),
    ],
)
def test_light_beside_rays_that_end_is_drawn(lens, field, f_number, rays, every):
    """Ghosts bounded by rays that miss a surface, before which T falls steeply, instead of by an edge."""
    project = ghosts_of(lens, mono(field), f_number=f_number, size_px=(120, 80), sensor_mm=HOLDS)
    truth = counted(project, rays, every)
    others = Rule(select="not " + ",".join(name.removeprefix("ghost.") for name in truth), enable=False)
    assert complaints(project.replace(art=Art(rules=(others,))), truth) == []


@pytest.mark.parametrize(
    ("lens", "field", "f_number"),
    [
        ("triplet-pestrecov", (8.0, 5.0), 8.0),
        slow("heliar-tronnier", (8.0, 5.0), 8.0),
        slow("double-gauss-tronnier", (8.0, 5.0), 8.0),
        slow("takumar-50-f1.4", (8.0, 5.0), 1.4),
    ],
)
def test_layers_agree_with_the_ghost_table(lens, field, f_number):
    """Two ways through the program: the picture and the analysis."""
    project = ghosts_of(lens, mono(field), f_number=f_number, size_px=(240, 160), sensor_mm=HOLDS)
    layers, rgb = layers_of(project), monochrome(project)
    table = ghost_table_of(load_lens(lens), field, f_number=f_number)
    for row in table.ghosts:
        if row.throughput_mm2 > FLOOR * table.ghosts[0].throughput_mm2:
            drawn = layer_flux(layers[f"ghost.{row.first_reflection}-{row.second_reflection}"], project) / rgb
            np.testing.assert_allclose(drawn, row.throughput_mm2, rtol=FLUX)


@pytest.mark.parametrize("mode", ["passes", "ghosts"])
@pytest.mark.parametrize("lens", ["triplet-pestrecov", slow("heliar-tronnier"), slow("tessar-brendel")])
def test_the_pass_holds_all_ghosts(lens, mode):
    """Drawn together, with faint ghosts at lower resolution, or one by one."""
    project = scene(lens, mono((8.0, 5.0)), layers=mode, starburst=False, size_px=(160, 90), sensor_mm=(72.0, 40.5))
    drawn = layer_flux(layers_of(project)["ghosts"], project) / monochrome(project)
    truth = counted(project)
    np.testing.assert_allclose(drawn, sum(c.on_sensor for c in truth.values()), rtol=FLUX)


def test_single_layers_add_up_to_the_pass():
    project = ghosts_of("heliar-tronnier", mono((8.0, 5.0)), size_px=(160, 90))
    layers = layers_of(project)
    singles = sum(picture(layer, (160, 90)) for name, layer in layers.items() if name.startswith("ghost."))
    whole = picture(layers["ghosts"], (160, 90))
    np.testing.assert_allclose(singles, whole, atol=2e-6 * np.abs(whole).max())


@pytest.mark.parametrize(("bridge", "waves"), [(False, 5), (True, 5)])
def test_colours_hold_the_flux_of_every_wavelength(bridge, waves):
    """White light, coated: each channel is the weighted sum of the flux, of the traced wavelengths or of all."""
    coating = Everywhere(coating=QuarterWave(center_wavelength_nm=550.0))
    project = scene(
        "tessar-brendel", Light(field_deg=(8.0, 5.0), spectrum=D65()), layers="ghosts", starburst=False,
        size_px=(200, 200), sensor_mm=(200.0, 200.0), wavelengths=waves, bridge=bridge, coating=coating,
    )  # fmt: skip
    layers = layers_of(project)
    every = project.quality.replace(wavelengths=21 if bridge else waves, bridge=False)
    (shot,) = shots_of(project.replace(quality=every))
    weights = shot.weights(shot.packed.wavelengths_nm)
    for name in ("ghost.7-6", "ghost.4-2", "ghost.2-0"):
        path = path_of(project, name)
        # with many wavelengths each needs less accuracy than with five
        rays = 60 if bridge else 120
        flux = np.array([count(shot, path, project.iris, w=w, n=rays).on_sensor for w in range(len(weights))])
        expected = flux @ weights
        error = np.abs(layer_flux(layers[name], project) - expected)
        # the grid serves all wavelengths, so its error adds to that of the colours between them
        limit = 2e-2 if bridge else 1.5 * FLUX
        assert (error < limit * np.abs(expected).max()).all(), name


@pytest.mark.parametrize(("mode", "limit"), [("draft", 0.025), ("final", 0.02)])
def test_few_wavelengths_tell_the_colours_of_single_films(mode, limit):
    """The reflectance of a film is near 0 at 550 nm and curved there; linear interpolation would miss that."""
    parts = {"layers": "passes", "starburst": False, "mode": mode, "size_px": (96, 54), "sensor_mm": (72.0, 40.5)}
    parts["paths"] = "same-side"
    film = Everywhere(coating=QuarterWave(center_wavelength_nm=550.0))
    found = {}
    for waves, bridge in ((21, False), (7, False), (7, True)):
        project = scene(
            "triplet-pestrecov", Light(field_deg=(5.0, 0.0), spectrum=D65()), wavelengths=waves, bridge=bridge,
            coating=film, **parts,
        )  # fmt: skip
        found[waves, bridge] = layer_flux(layers_of(project)["ghosts"], project)
    truth = found[21, False]
    error = {key: np.abs(rgb - truth).max() / np.abs(truth).max() for key, rgb in found.items()}
    assert error[7, True] < limit
    assert error[7, True] < 0.3 * error[7, False]


@pytest.mark.parametrize("mode", ["draft", "final"])
def test_the_brightest_get_layers_of_their_own(mode):
    """`brightest=3` returns the three ghosts with the most light, brightest first."""
    parts = {"layers": "ghosts", "starburst": False, "mode": mode, "size_px": (160, 90), "sensor_mm": HOLDS}
    every = layers_of(scene("heliar-tronnier", mono((8.0, 5.0)), **parts))
    flux = {name: layer.pixels[..., 0].sum(dtype=float) for name, layer in every.items() if name.startswith("ghost.")}
    best = sorted(flux, key=lambda name: -abs(flux[name]))[:3]
    three = layers_of(scene("heliar-tronnier", mono((8.0, 5.0)), brightest=3, **parts))
    assert [name for name in three if name.startswith("ghost.")] == best


# --- cropping


@pytest.mark.parametrize("lens", ["heliar-tronnier", slow("canon-28-80")])
def test_a_smaller_sensor_is_a_crop_of_a_larger_one(lens):
    parts = {"layers": "passes", "starburst": False, "paths": "same-side"}
    big = scene(lens, mono((8.0, 5.0)), size_px=(256, 144), sensor_mm=(64.0, 36.0), **parts)
    small = scene(lens, mono((8.0, 5.0)), size_px=(128, 72), sensor_mm=(32.0, 18.0), **parts)
    whole, part = picture(layers_of(big)["ghosts"], (256, 144)), picture(layers_of(small)["ghosts"], (128, 72))
    crop = whole[36:108, 64:192]
    # the outside is not refined, so grids differ there and at the border
    assert np.abs(part - crop).sum() < 5e-3 * np.abs(crop).sum()
    assert part.sum() == pytest.approx(crop.sum(), rel=1e-3)


def test_tiles_of_the_sensor_add_up_to_the_whole():
    """Four quarters, drawn separately by shifting the axis out of the picture, add up to the picture."""
    project = ghosts_of("double-gauss-tronnier", mono((8.0, 5.0)), size_px=(128, 96), sensor_mm=(64.0, 48.0))
    (shot,) = shots_of(project)
    paths = ghost_paths(load_lens(project.lens))
    whole = picture(render_ghosts([shot], paths, project.quality, singles=None).total, (128, 96))

    class Tile(type(shot)):  # with the view radius of the whole picture
        view_radius = shot.view_radius

    for left in (0, 64):
        for top in (0, 48):
            fields = {k: getattr(shot, k) for k in shot.__dataclass_fields__}
            shifted = shot.to_pixels - np.array([left, top, 0.0, 0.0])
            tile = Tile(**{**fields, "to_pixels": shifted, "size_px": (64, 48)})
            part = picture(render_ghosts([tile], paths, project.quality, singles=None).total, (64, 48))
            crop = whole[top : top + 48, left : left + 64]
            # a cell on a tile's border is drawn by triangles, inside a picture as one polygon
            assert np.abs(part - crop).sum() < 5e-5 * whole.sum()


# --- resolution


@pytest.mark.parametrize("lens", ["heliar-tronnier", slow("tessar-brendel")])
def test_a_fine_picture_averaged_is_the_coarse_one(lens):
    """On average (L1) within 0.5 %; away from caustics and edges, where a block is uniform, pixel for pixel."""
    fine = scene(lens, mono((8.0, 5.0)), layers="ghosts", starburst=False, size_px=(512, 288))
    coarse = scene(lens, mono((8.0, 5.0)), layers="ghosts", starburst=False, size_px=(128, 72))
    a = picture(layers_of(fine)["ghosts"], (512, 288))[..., 1].reshape(72, 4, 128, 4)
    b = picture(layers_of(coarse)["ghosts"], (128, 72))[..., 1]
    mean = a.mean(axis=(1, 3))
    assert np.abs(mean - b).sum() < 5e-3 * b.sum()
    even = np.ptp(a, axis=(1, 3)) < 0.02 * mean
    assert even.mean() > 0.3
    error = np.abs(b[even] / mean[even] - 1.0)
    assert np.quantile(error, 0.99) < 5e-3
    assert error.max() < 0.02


# --- determinism


@pytest.mark.parametrize("mode", ["draft", "final"])
@pytest.mark.parametrize("layers", ["passes", "ghosts"])
def test_threads_do_not_change_a_byte(mode, layers):
    lights = (Light(field_deg=(8.0, 5.0)), Light(field_deg=(-3.0, 9.0), intensity=0.3))
    # one of the four has a starburst too
    shown = {"layers": layers, "starburst": (mode, layers) == ("draft", "passes")}
    project = scene("triplet-pestrecov", *lights, iris=SIX, mode=mode, size_px=(96, 54), wavelengths=3, **shown)
    one, five = (render(project, threads=n).layers for n in (1, 5))
    for a, b in zip(one, five, strict=True):
        assert a.name == b.name
        assert a.window == b.window
        assert a.pixels.tobytes() == b.pixels.tobytes()


# --- symmetry


def beauty_of(lens: str, field, size=(160, 90), **parts):
    """Return a picture with its direct image, where that lies in the picture."""
    project = scene(lens, mono(field), size_px=size, layers="passes", **parts)
    return picture(by_name(render(project))["beauty"], size)


@pytest.mark.parametrize("mode", ["draft", "final"])
@pytest.mark.parametrize("lens", ["heliar-tronnier", slow("double-gauss-tronnier")])
def test_mirrored_light_makes_the_mirrored_picture(lens, mode):
    parts = {"mode": mode, "f_number": 5.6}
    a = beauty_of(lens, (8.0, 5.0), **parts)
    tiny = 2e-5 * np.abs(a).sum()
    assert np.abs(beauty_of(lens, (-8.0, 5.0), **parts)[:, ::-1] - a).sum() < tiny
    assert np.abs(beauty_of(lens, (8.0, -5.0), **parts)[::-1] - a).sum() < tiny
    assert np.abs(beauty_of(lens, (-8.0, -5.0), **parts)[::-1, ::-1] - a).sum() < tiny


@pytest.mark.parametrize("mode", ["draft", "final"])
def test_a_quarter_turn_of_the_light_turns_the_picture(mode):
    """A square sensor and a round iris have no preferred direction."""
    a = beauty_of("heliar-tronnier", (8.0, 5.0), (96, 96), sensor_mm=(30.0, 30.0), mode=mode)
    # (8, 5) rotated by a quarter turn counter-clockwise is (-5, 8)
    b = beauty_of("heliar-tronnier", (-5.0, 8.0), (96, 96), sensor_mm=(30.0, 30.0), mode=mode)
    assert np.abs(np.rot90(a) - b).sum() < 2e-5 * np.abs(a).sum()


@pytest.mark.parametrize("mode", ["draft", "final"])
def test_blades_turn_with_the_picture(mode):
    """Four blades are the same after a quarter turn; six equal six rotated by 30 degrees."""
    # both qualities have the same starburst
    parts = {"sensor_mm": (30.0, 30.0), "mode": mode, "starburst": mode == "draft"}
    a = beauty_of("heliar-tronnier", (8.0, 5.0), (96, 96), iris=SIX, **parts)
    b = beauty_of("heliar-tronnier", (-5.0, 8.0), (96, 96), iris=Iris(blades=6, rotation_deg=90.0), **parts)
    assert np.abs(np.rot90(a) - b).sum() < 1e-4 * np.abs(a).sum()
    c = beauty_of("heliar-tronnier", (-5.0, 8.0), (96, 96), iris=SIX, **parts)
    assert np.abs(np.rot90(a) - c).sum() > 1e-3 * np.abs(a).sum()


# --- linearity


@pytest.mark.parametrize("mode", ["draft", "final"])
def test_intensity_scales_everything(mode):
    parts = {"layers": "passes", "mode": mode, "size_px": (160, 90)}
    one, seven = (layers_of(scene("heliar-tronnier", mono((8.0, 5.0), k), **parts)) for k in (1.0, 7.0))
    for name in ("beauty", "starburst", "ghosts"):
        a, b = (picture(layers[name], (160, 90)) for layers in (one, seven))
        np.testing.assert_allclose(b, 7.0 * a, rtol=1e-4, atol=1e-6 * b.max())


@pytest.mark.parametrize("mode", ["draft", "final"])
def test_two_lights_are_the_sum_of_two_renders(mode):
    a, b = Light(field_deg=(8.0, 5.0)), Light(field_deg=(-4.0, 6.0), intensity=0.5, spectrum=D_LINE)
    parts = {"layers": "ghosts", "mode": mode, "size_px": (160, 90), "wavelengths": 3}
    together, alone_a, alone_b = (layers_of(scene("triplet-pestrecov", *who, **parts)) for who in ((a, b), (a,), (b,)))
    for name in together:
        parts_of_it = [picture(x[name], (160, 90)) for x in (alone_a, alone_b) if name in x]
        whole = picture(together[name], (160, 90))
        np.testing.assert_allclose(whole, sum(parts_of_it), rtol=1e-5, atol=2e-6 * np.abs(whole).max())


# --- the direct image


def test_the_f_number_sets_the_light():
    """On the axis: E ~ 1 / N^2, and exactly pi (f / 2N)^2 T in the limit of small pupils."""
    found = {}
    for n in (4.0, 8.0, 16.0, 32.0):
        summary = render(scene("heliar-tronnier", mono((0.0, 0.0)), f_number=n, size_px=(16, 9), mode="draft")).summary
        light = summary["lights"][0]
        (flux,) = light["direct_throughput_mm2"]
        found[n] = flux * n**2
        ideal = np.pi * (summary["efl_mm"] / (2.0 * n)) ** 2 * light["transmittance"]
        assert flux == pytest.approx(ideal, rel=0.1 / n)
    assert found[8.0] == pytest.approx(found[32.0], rel=5e-3)
    assert found[16.0] == pytest.approx(found[32.0], rel=1.5e-3)


@pytest.mark.parametrize(
    ("lens", "iris"),
    [
        ("heliar-tronnier", ROUND),
        ("double-gauss-tronnier", SIX),
        slow("heliar-tronnier", SIX),
        slow("double-gauss-tronnier", ROUND),
    ],
)
def test_the_starburst_holds_the_direct_flux(lens, iris):
    """The starburst's pixels add up to the rays counted on the direct path, if the sensor contains it."""
    project = scene(
        lens, mono((3.0, 2.0)), iris=iris, layers="passes", size_px=(600, 600), sensor_mm=(120.0, 120.0), mode="draft"
    )
    drawn = layer_flux(layers_of(project)["starburst"], project) / monochrome(project)
    (shot,) = shots_of(project)
    direct = count(shot, path_of(project, "direct"), iris)
    # the wings fall off as 1 / r^3, so a little lies outside any sensor
    np.testing.assert_allclose(drawn, direct.flux, rtol=FLUX)


def test_a_starburst_outside_the_picture_leaves_it_dark():
    project = scene("heliar-tronnier", mono((35.0, 0.0)), layers="passes", size_px=(96, 54), mode="draft")
    layer = layers_of(project)["starburst"]
    assert layer.pixels.max() < 1e-3


# --- draft and final


def test_draft_tends_to_exact_rays_near_the_axis():
    """Matrices are the limit of rays: flux of large ghosts against counted rays, as angle and opening shrink."""
    errors = []
    for shrink in (0.25, 0.0625):
        parts = {
            "f_number": 8.0 / shrink, "layers": "ghosts", "starburst": False, "sensor_mm": HOLDS, "size_px": (300, 300),
        }  # fmt: skip
        field = (4.0 * shrink, 3.0 * shrink)
        project = scene("heliar-tronnier", mono(field), mode="draft", **parts)
        draft, rgb, truth = layers_of(project), monochrome(project), counted(project, 90)
        # surfaces other than the first always bound some ghosts; these are bounded by the iris
        big = [name for name, c in truth.items() if c.flux > 0.05 * max(c.flux for c in truth.values())]
        assert len(big) >= 10
        drawn = {name: layer_flux(draft[name], project)[1] / rgb[1] for name in big}
        errors.append(max(abs(drawn[name] / truth[name].flux - 1.0) for name in big))
    assert errors[-1] < 5e-3
    assert errors[-1] < 0.15 * errors[0]


def test_draft_and_final_place_their_ghosts_alike():
    """Centroids near the axis, in units of the picture."""
    parts = {"layers": "ghosts", "starburst": False, "sensor_mm": HOLDS, "size_px": (300, 300), "f_number": 32.0}
    draft, final = (layers_of(scene("heliar-tronnier", mono((2.0, 1.0)), mode=m, **parts)) for m in ("draft", "final"))
    at = np.arange(300) + 0.5
    for name, layer in final.items():
        if name.startswith("ghost."):
            a, b = (np.abs(picture(x, (300, 300))[..., 1]) for x in (layer, draft[name]))
            for axis in (0, 1):
                places = [(p.sum(axis=axis) @ at) / p.sum() for p in (a, b)]
                assert abs(places[0] - places[1]) < 0.5, name


# --- the iris as an image


def write_mask(path, grey) -> Iris:
    Image.fromarray(np.round(grey * 255).astype(np.uint8)).save(path)
    return Iris(mask=str(path))


def disc(texels: int) -> np.ndarray:
    at = (np.arange(texels) + 0.5) * 2.0 / texels - 1.0
    return np.clip((1.0 - np.hypot(at, at[:, None])) * texels / 2.0 + 0.5, 0.0, 1.0)


@pytest.mark.parametrize("mode", ["draft", "final"])
def test_a_mask_of_a_disc_is_the_round_iris(tmp_path, mode):
    pytest.importorskip("PIL")
    parts = {"layers": "passes", "starburst": False, "mode": mode, "size_px": (160, 90)}
    a = picture(layers_of(scene("heliar-tronnier", mono((8.0, 5.0)), **parts))["ghosts"], (160, 90))
    masked = write_mask(tmp_path / "disc.png", disc(256))
    b = picture(layers_of(scene("heliar-tronnier", mono((8.0, 5.0)), iris=masked, **parts))["ghosts"], (160, 90))
    assert b.sum() == pytest.approx(a.sum(), rel=5e-3)
    assert np.abs(a - b).sum() < 0.02 * a.sum()


@pytest.mark.parametrize("mode", ["draft", "final"])
def test_a_half_black_mask_halves_the_light(tmp_path, mode):
    """On the axis both halves of the iris carry the same flux."""
    pytest.importorskip("PIL")
    whole = write_mask(tmp_path / "white.png", np.ones((64, 64)))
    half = write_mask(tmp_path / "half.png", np.repeat([[1.0], [0.0]], 32, axis=0) * np.ones((64, 64)))
    parts = {"layers": "ghosts", "starburst": False, "mode": mode, "size_px": (100, 100), "sensor_mm": HOLDS}
    a, b = (layers_of(scene("heliar-tronnier", mono((0.0, 0.0)), iris=iris, **parts)) for iris in (whole, half))
    one_crossing = {"ghost.1-0", "ghost.2-0", "ghost.4-1", "ghost.8-6", "ghost.8-7"}
    for name in one_crossing & set(a):
        assert b[name].pixels.sum(dtype=float) == pytest.approx(0.5 * a[name].pixels.sum(dtype=float), rel=5e-3), name


def test_a_mask_darkens_the_direct_image_by_its_own_mean(tmp_path):
    pytest.importorskip("PIL")
    grey = write_mask(tmp_path / "disc.png", disc(512))
    flux = []
    for iris in (ROUND, grey):
        # the pattern of an image takes long, and the direct image's light does not depend on it
        lit = scene("heliar-tronnier", mono((0.0, 0.0)), iris=iris, size_px=(16, 9), mode="draft", starburst=False)
        summary = render(lit).summary
        flux.append(summary["lights"][0]["direct_throughput_mm2"][0])
    assert flux[1] == pytest.approx(flux[0], rel=3e-3)


@pytest.mark.parametrize(("turn", "mode"), [(30.0, "draft"), (30.0, "final"), slow(90.0, "draft"), slow(90.0, "final")])
def test_a_turned_mask_is_a_mask_of_the_turned_image(tmp_path, mode, turn):
    """Ghosts rotate with the image, as the starburst does."""
    pytest.importorskip("PIL")
    parts = {"layers": "passes", "starburst": False, "mode": mode, "size_px": (160, 90)}
    at = (np.arange(256) + 0.5) / 128.0 - 1.0
    x, y = at, -at[:, None]
    pictures = []
    for baked in (0.0, turn):
        c, s = np.cos(np.radians(baked)), np.sin(np.radians(baked))
        along, across = c * x + s * y, c * y - s * x
        # a triangle with its corners inside the square at any rotation
        far = np.max([-across, 0.866 * along + 0.5 * across, -0.866 * along + 0.5 * across], axis=0)
        iris = write_mask(tmp_path / f"{baked}.png", np.clip((0.48 - far) * 128.0 + 0.5, 0.0, 1.0))
        turned = iris.replace(rotation_deg=turn - baked)
        layers = layers_of(scene("heliar-tronnier", mono((8.0, 5.0)), iris=turned, **parts))
        pictures.append(picture(layers["ghosts"], (160, 90)))
    unturned = layers_of(scene("heliar-tronnier", mono((8.0, 5.0)), iris=turned.replace(rotation_deg=50.0), **parts))
    # a soft border is interpolated once more
    assert np.abs(pictures[0] - pictures[1]).sum() < 0.01 * pictures[0].sum()
    assert np.abs(picture(unturned["ghosts"], (160, 90)) - pictures[1]).sum() > 0.1 * pictures[1].sum()


# --- remarks on missing light


def test_culling_leaves_out_what_it_says():
    parts = {"layers": "passes", "starburst": False, "size_px": (128, 72), "sensor_mm": HOLDS}
    whole = scene("heliar-tronnier", mono((8.0, 5.0)), **parts)
    culled = render(scene("heliar-tronnier", mono((8.0, 5.0)), cull=0.05, **parts))
    lost = 1.0 - layer_flux(by_name(culled)["ghosts"], whole)[1] / layer_flux(layers_of(whole)["ghosts"], whole)[1]
    assert 0.0 < culled.summary["ghosts"]["culled_share"] <= 0.05
    assert lost == pytest.approx(culled.summary["ghosts"]["culled_share"], abs=0.01)
    share = f"{100 * culled.summary['ghosts']['culled_share']:.2g} %"
    assert any(f"that carry {share} of the ghost light were left out" in remark for remark in culled.remarks)


def test_a_path_that_passes_the_picture_by_is_no_light_in_it():
    """The pre-pass finds nothing visible; the rays agree."""
    project = ghosts_of("heliar-tronnier", mono((20.0, 10.0)), size_px=(64, 36), sensor_mm=(8.0, 4.5))
    (shot,) = shots_of(project)
    far = 0
    for path in ghost_paths(load_lens(project.lens)):
        region = find_region(shot.packed, path, shot.incidence.tilt, shot.opening.radius, shot.view_radius)
        if region is not None and region.seen_flux == 0.0:
            far += 1
            assert count(shot, path, project.iris, n=100).on_sensor == 0.0
    assert far > 0
    assert replace(shot, size_px=(64, 36)).view_radius == pytest.approx(np.hypot(4.0, 2.25))


def test_a_black_picture_has_a_remark():
    lit, dark = (
        render(
            Project(
                lens="triplet-pestrecov",
                f_number=16.0,
                lights=(Light(field_deg=(8.0, 4.0), intensity=value),),
                camera={"size_px": (48, 27)},
                quality={"wavelengths": 1, "ringing": "off", "paths": "same-side"},
                output=Output(starburst=False),
            )
        )
        for value in (1.0, 0.0)
    )
    reported = [any("picture is black" in remark for remark in each.remarks) for each in (lit, dark)]
    assert reported == [False, True]


def test_an_iris_image_that_is_not_square_has_a_remark(tmp_path):
    reported = []
    for size in ((48, 48), (64, 48)):
        Image.new("L", size, 255).save(tmp_path / "iris.png")
        made = Project(
            lens="tessar-brendel",
            f_number=16.0,
            lights=(Light(field_deg=(8.0, 4.0)),),
            iris=Iris(mask=str(tmp_path / "iris.png")),
            camera={"size_px": (48, 27)},
            quality={"mode": "draft"},
            output=Output(starburst=False),
        )
        reported.append([remark for remark in render(made).remarks if "stretched" in remark])
    assert reported[0] == []
    assert reported[1] == [
        "the iris image has 64x48 pixels and is stretched to the square around the iris; give a square"
    ]
