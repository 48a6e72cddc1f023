"""Art direction: no change by default, and exact effects of rules."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from pupil_sum import by_name, layer_flux, layers_of, mono, picture, scene

import flarewright as fw
from flarewright.errors import ProjectError
from flarewright.model import Art, Imperfection, Light, Rule
from flarewright.optics.lens.paths import ghost_paths
from flarewright.optics.lens.tolerances import ghost_offset
from flarewright.render.ghosts.art_filters import gaussian, ramp_factors
from flarewright.render.render import render
from flarewright.render.scene.art_rules import PathArt, resolve_art
from flarewright.render.scene.resolve import load_lens, resolve_project

SIZE = (200, 160)
MODES = ["draft", "final"]
SOME = "4-1"


def project(mode="final", *rules, gain=None, physical=False, light=None, **parts):
    made = scene(
        "heliar-tronnier", light or mono((8.0, 5.0)), size_px=SIZE, sensor_mm=(150.0, 120.0), layers="ghosts",
        starburst=False, mode=mode, wavelengths=3, **parts,
    )  # fmt: skip
    return made.replace(art=Art(rules=rules, gain=gain or {}, physical=physical))


@cache
def drawn(mode, *rules):
    """Return the layers of a project with these rules; several tests compare with the same."""
    return layers_of(project(mode, *rules))


@cache
def single(mode, *rules, name=SOME):
    """Draw one ghost; the others are muted and have no influence on it."""
    return picture(layers_of(project(mode, Rule(select=f"not {name}", enable=False), *rules))[f"ghost.{name}"], SIZE)


def moments(pixels):
    """Return centroid and rms radius in pixels, right and up."""
    light = pixels.sum(axis=2)
    y, x = np.mgrid[: light.shape[0], : light.shape[1]]
    cx, cy = (light * x).sum() / light.sum(), (light * -y).sum() / light.sum()
    variance = (light * ((x - cx) ** 2 + (-y - cy) ** 2)).sum() / light.sum()
    return cx, cy, np.sqrt(variance)


def convolved(pixels, sigma):
    """Convolve with samples of a Gaussian, directly."""
    reach = int(6 * sigma)
    taps = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma) ** 2)
    for axis in (0, 1):
        pixels = np.apply_along_axis(np.convolve, axis, pixels, taps / taps.sum(), "full")
    return pixels[reach:-reach, reach:-reach]


# --- no change by default


@pytest.mark.parametrize("mode", MODES)
def test_the_identity_is_bit_identical(mode):
    few = {"paths": "same-side"}
    plain = render(project(mode, **few))
    neutral = Rule(select="all", gain=1.0, tint=(1, 1, 1), offset_px=(0, 0), scale=1.0, blur_px=0.0, enable=True)
    strong = (Rule(select="all", gain=3.0, blur_px=2.0), Rule(select=SOME, enable=False))
    for other in (
        project(mode, neutral, gain={"ghosts": 1.0}, **few),
        project(mode, *strong, gain={"ghosts": 7.0}, physical=True, **few),
        project(
            mode,
            Rule(select=SOME, enable=False),
            Rule(select="row:1", enable=True),
            Rule(select=SOME, enable=True),
            **few,
        ),
    ):
        changed = render(other)
        assert changed.summary["physical"] is True
        assert [layer.name for layer in changed.layers] == [layer.name for layer in plain.layers]
        for a, b in zip(plain.layers, changed.layers, strict=True):
            assert a.window == b.window
            assert a.about == b.about
            np.testing.assert_array_equal(a.pixels, b.pixels)


# --- random offsets


@pytest.mark.parametrize("mode", MODES)
def test_chance_moves_every_ghost_by_its_own_draw(mode):
    """Hullin et al. 2011, section 7: a variance that translates each ghost; the flux stays."""
    sample = Imperfection(seed=6, decentre_um=0.0, tilt_arcmin=0.0, ghost_offset_mm=3.0)
    drawn = project(mode, paths="same-side")
    moved = drawn.replace(imperfection=sample)
    plain, changed = render(drawn), render(moved)
    assert changed.summary["physical"] is False
    before, after = by_name(plain), by_name(changed)
    seen = []
    for name in ("4-1", "8-7", "4-3"):
        path = next(path for path in ghost_paths(resolve_project(moved).lens) if path.name == name)
        right, up = ghost_offset(path, sample)
        a, b = (moments(picture(layers[f"ghost.{name}"], SIZE)) for layers in (before, after))
        # 200 pixels on 150 mm; compare only ghosts that lie completely in the picture
        if before[f"ghost.{name}"].pixels.sum() == pytest.approx(after[f"ghost.{name}"].pixels.sum(), rel=1e-3):
            assert (b[0] - a[0], b[1] - a[1]) == pytest.approx((right * 4 / 3, up * 4 / 3), abs=0.02)
            seen.append((right, up))
    assert len(set(seen)) >= 2
    again = render(moved)
    assert all(np.array_equal(x.pixels, y.pixels) for x, y in zip(changed.layers, again.layers, strict=True))
    physical = render(moved.replace(art=Art(physical=True)))
    assert all(np.array_equal(x.pixels, y.pixels) for x, y in zip(plain.layers, physical.layers, strict=True))


def test_the_draws_have_the_deviation_asked_for():
    paths = ghost_paths(load_lens("canon-28-80"))
    drawn = np.array([ghost_offset(p, Imperfection(seed=s, ghost_offset_mm=0.5)) for s in range(4) for p in paths])
    assert drawn.shape == (4 * 351, 2)
    error = 0.5 / np.sqrt(len(drawn))
    assert np.abs(drawn.mean(axis=0)).max() < 4.0 * error
    assert drawn.std(axis=0) == pytest.approx([0.5, 0.5], abs=4.0 * error / np.sqrt(2.0))
    assert abs(np.corrcoef(drawn.T)[0, 1]) < 4.0 / np.sqrt(len(drawn))
    assert ghost_offset(paths[0], None) == (0.0, 0.0)


# --- gain, tint, mute


@pytest.mark.parametrize("mode", MODES)
def test_gain_two_adds_the_ghost_once_more(mode):
    plain, graded = drawn(mode), drawn(mode, Rule(select=SOME, gain=2.0))
    twice = picture(plain["ghosts"], SIZE) + picture(plain[f"ghost.{SOME}"], SIZE)
    np.testing.assert_allclose(picture(graded["ghosts"], SIZE), twice, rtol=2e-5, atol=1e-7 * twice.max())
    assert graded[f"ghost.{SOME}"].about["flux_mm2"] == pytest.approx(2 * plain[f"ghost.{SOME}"].about["flux_mm2"])
    assert "gain 2,2,2" in graded[f"ghost.{SOME}"].about["art"]
    assert "art" not in graded["ghost.8-7"].about


@pytest.mark.parametrize("mode", MODES)
def test_tints_and_gains_multiply_channel_by_channel(mode):
    rules = (Rule(select="row:4", tint=(1.0, 0.5, 0.0)), Rule(select=SOME, gain=3.0))
    plain, graded = single(mode), single(mode, *rules)
    np.testing.assert_allclose(graded, plain * [3.0, 1.5, 0.0], rtol=2e-5, atol=1e-7 * plain.max())


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("change", [{"offset_px": (6.0, 3.0)}, {"scale": 0.8}, {"blur_px": 2.0}], ids=" ".join)
@pytest.mark.parametrize("diameter_deg", [0.0, 3.0], ids=["point", "disc"])
def test_a_tint_colours_each_channel_whatever_else_is_done_to_the_ghost(mode, change, diameter_deg):
    """Colours are multiplied at a different place for each way to draw a ghost."""
    light, tint = Light(field_deg=(8.0, 5.0), diameter_deg=diameter_deg), (1.0, 0.5, 0.2)
    others = Rule(select=f"not {SOME}", enable=False)
    small = {"size_px": (50, 40), "sensor_mm": (150.0, 120.0)}
    shown = {"layers": "passes", "starburst": False}
    plain, tinted = (
        layers_of(project(mode, others, rule, light=light).replace(camera=small, output=shown))["ghosts"].pixels
        for rule in (Rule(select=SOME, **change), Rule(select=SOME, tint=tint, **change))
    )
    assert plain.max(axis=(0, 1)).min() > 0.0
    np.testing.assert_allclose(tinted, plain * tint, rtol=2e-5, atol=1e-6 * plain.max())


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("shown", ["passes", "ghosts"])
def test_with_every_ghost_muted_the_layer_of_ghosts_is_black(mode, shown):
    muted = project(mode, Rule(select="all", enable=False), light=Light(field_deg=(8.0, 5.0)))
    sun = Light(field_deg=(-3.0, 2.0), diameter_deg=0.53)
    done = render(muted.replace(lights=(*muted.lights, sun), output=muted.output.replace(layers=shown)))
    assert not by_name(done)["ghosts"].pixels.any()


@pytest.mark.parametrize("mode", MODES)
def test_mute_and_solo(mode):
    plain, muted = drawn(mode), drawn(mode, Rule(select=SOME, enable=False))
    rest = picture(plain["ghosts"], SIZE) - picture(plain[f"ghost.{SOME}"], SIZE)
    np.testing.assert_allclose(picture(muted["ghosts"], SIZE), rest, rtol=2e-5, atol=2e-7 * rest.max())
    assert f"ghost.{SOME}" not in muted
    solo = render(project(mode, Rule(select=f"not {SOME}", enable=False)))
    assert [layer.name for layer in solo.layers] == ["beauty", "ghosts", f"ghost.{SOME}"]
    assert solo.summary["ghosts"]["muted"] == 27
    assert solo.summary["physical"] is False
    np.testing.assert_array_equal(solo.layers[2].pixels, plain[f"ghost.{SOME}"].pixels)
    nothing = render(project(mode, Rule(select="all", enable=False)))
    assert not nothing.layers[0].pixels.any()


def test_pass_gains_scale_layers_and_are_recorded():
    bright = scene("heliar-tronnier", mono((8.0, 5.0)), size_px=(64, 48), layers="ghosts", mode="draft", wavelengths=3)
    plain = by_name(render(bright))
    rendering = render(bright.replace(art=Art(gain={"ghosts": 4.0, "starburst": 0.0})))
    graded = by_name(rendering)
    for name, layer in plain.items():
        if name == "ghosts" or name.startswith("ghost."):
            np.testing.assert_array_equal(graded[name].pixels, layer.pixels * np.float32(4.0))
            assert graded[name].about["pass_gain"] == 4.0
    assert not graded["starburst"].pixels.any()
    assert rendering.summary["physical"] is False
    np.testing.assert_array_equal(picture(graded["beauty"], (64, 48)), picture(graded["ghosts"], (64, 48)))


# --- positions


@pytest.mark.parametrize("mode", MODES)
def test_an_offset_moves_the_centroid_by_just_that(mode):
    plain, by_px = single(mode), single(mode, Rule(select=SOME, offset_px=(12.25, 7.5)))
    by_mm = single(mode, Rule(select=SOME, offset_mm=(3.0, 1.5)), Rule(select="all", offset_mm=(6.1875, 4.125)))
    before = moments(plain)
    for moved in (by_px, by_mm):
        after = moments(moved)
        assert after[0] - before[0] == pytest.approx(12.25, abs=2e-3)
        assert after[1] - before[1] == pytest.approx(7.5, abs=2e-3)
        assert after[2] == pytest.approx(before[2], rel=1e-3)
        assert moved.sum() == pytest.approx(plain.sum(), rel=1e-4)
    whole = single(mode, Rule(select=SOME, offset_px=(12, 7)))
    np.testing.assert_allclose(whole[:-7, 12:], plain[7:, :-12], rtol=1e-2, atol=3e-3 * plain.max())


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("scale", [0.5, 1.7])
def test_a_scale_keeps_centre_and_flux(mode, scale):
    before, after = moments(plain := single(mode)), moments(scaled := single(mode, Rule(select=SOME, scale=scale)))
    # the centre is that of the middle wavelength; others are slightly off
    assert np.hypot(after[0] - before[0], after[1] - before[1]) < 0.03 * before[2]
    assert after[2] == pytest.approx(scale * before[2], rel=5e-3)
    assert scaled.sum() == pytest.approx(plain.sum(), rel=1e-3)


@cache
def place_of_some():
    table = fw.ghosts("heliar-tronnier", (8.0, 5.0), f_number=8.0, paths="same-side")
    return next(row.centroid_mm for row in table.ghosts if (row.first_reflection, row.second_reflection) == (4, 1))


@pytest.mark.parametrize("mode", MODES)
def test_a_ghost_from_outside_the_picture_can_be_brought_in(mode):
    """The pre-pass must search where an offset brings light from."""
    x, y = place_of_some()
    small = project(mode).replace(camera={"size_px": (60, 60), "sensor_mm": (30.0, 30.0)})
    aside = small.replace(art=Art(rules=[Rule(select="all", enable=False), Rule(select=SOME, enable=True)]))
    far = aside.art.replace(rules=(*aside.art.rules, Rule(select=SOME, offset_mm=(500.0, 0.0), scale=0.3)))
    back = aside.art.replace(rules=(*far.rules, Rule(select=SOME, offset_mm=(-500.0 - x, -y))))
    assert not render(aside.replace(art=far)).layers[0].pixels.any()
    framed = by_name(render(aside.replace(art=back)))["ghosts"]
    whole = layer_flux(drawn(mode)[f"ghost.{SOME}"], project(mode))
    np.testing.assert_allclose(layer_flux(framed, small), whole, rtol=2e-3)


# --- blur and ramp


@pytest.mark.parametrize("sigma", [0.05, 0.3, 1.0, 2.7, 20.0])
def test_the_gaussian_has_its_width_and_keeps_flux(sigma):
    weights = gaussian(sigma)
    k = np.arange(len(weights)) - len(weights) // 2
    assert weights.sum() == pytest.approx(1.0, abs=1e-14)
    np.testing.assert_allclose(weights, weights[::-1], atol=1e-15)
    # weights beyond four standard deviations are missing
    assert (weights * k**2).sum() == pytest.approx(sigma**2, rel=2e-3)
    twice = np.convolve(weights, weights)
    at_once = gaussian(np.sqrt(2.0) * sigma)
    middle = slice(len(twice) // 2 - 2, len(twice) // 2 + 3)
    np.testing.assert_allclose(
        twice[middle], at_once[len(at_once) // 2 - 2 : len(at_once) // 2 + 3], rtol=3e-4, atol=1e-6
    )


@pytest.mark.parametrize("mode", MODES)
def test_a_blur_keeps_flux_and_adds_its_variance(mode):
    plain, blurred = single(mode), single(mode, Rule(select=SOME, blur_px=3.0))
    again = single(mode, Rule(select=SOME, blur_mm=3.0 * 0.75 * 0.6), Rule(select="all", blur_px=3.0 * 0.8))
    before, after = moments(plain), moments(blurred)
    np.testing.assert_allclose(blurred.sum(axis=(0, 1)), plain.sum(axis=(0, 1)), rtol=1e-5)
    np.testing.assert_allclose(after[:2], before[:2], atol=1e-4)
    assert after[2] ** 2 - before[2] ** 2 == pytest.approx(2 * 9.0, rel=5e-3)
    # 0.6 and 0.8 add up as Gaussians do
    np.testing.assert_allclose(again, blurred, rtol=1e-4, atol=1e-6 * blurred.max())


@pytest.mark.parametrize(
    ("sigma", "mode"),
    [
        (1.5, "draft"),
        (16.5, "draft"),
        (9.0, "final"),
        (24.0, "final"),
        *(pytest.param(sigma, "draft", marks=pytest.mark.slow) for sigma in (9.0, 24.0)),
        *(pytest.param(sigma, "final", marks=pytest.mark.slow) for sigma in (1.5, 16.5)),
    ],
)
def test_a_blur_is_the_convolution(sigma, mode):
    """Against direct convolution with samples of a Gaussian; wide blurs are drawn coarsely without a difference."""
    plain, blurred = single(mode), single(mode, Rule(select=SOME, blur_px=sigma))
    expected = convolved(plain, sigma)
    error = np.abs(blurred - expected)[10:-10, 10:-10]
    # the discrete analogue of a Gaussian has an excess kurtosis of 1 / sigma^2, visible at edges for a narrow one
    assert error.max() < max(4e-3, 0.025 / sigma**2) * expected.max()


@pytest.mark.parametrize("mode", [pytest.param("draft", marks=pytest.mark.slow), "final"])
def test_ghosts_blurred_together_are_the_sum_of_each(mode):
    lights = [Light(field_deg=(8.0, 5.0)), Light(field_deg=(-3.0, 1.0), intensity=0.3)]
    rules = [Rule(select="row:4", blur_px=3.0, gain=2.0), Rule(select="row:8", blur_px=4.0, offset_px=(5, 0))]
    rules.append(Rule(select="4-2", ramp=((0, 1, 1, 1), (1, 0, 1, 1))))
    both = project(mode, *rules, paths="same-side").replace(lights=lights)
    layers = layers_of(both)
    total = sum(picture(layer, SIZE) for name, layer in layers.items() if name.startswith("ghost."))
    without = layers_of(both.replace(output={"layers": "passes", "starburst": False}))
    np.testing.assert_allclose(picture(layers["ghosts"], SIZE), total, rtol=1e-4, atol=1e-6 * total.max())
    # only sharp ghosts lose detail; blurred ones are drawn in full in both
    summed = picture(without["ghosts"], SIZE)
    assert np.abs(summed - total).max() < 0.05 * total.max()
    np.testing.assert_allclose(summed.sum(axis=(0, 1)), total.sum(axis=(0, 1)), rtol=2e-3)


@pytest.mark.parametrize("mode", MODES)
def test_a_blur_is_that_of_the_whole_ghost_at_the_picture_s_edge(mode):
    """Light just outside the picture is blurred into it, and the picture's edge does not darken."""
    rules = [Rule(select="all", enable=False), Rule(select=SOME, enable=True, blur_mm=2.0)]
    wide = project(mode, *rules)
    inner = wide.replace(camera={"size_px": (60, 40), "sensor_mm": (45.0, 30.0)})
    x0, y0 = (SIZE[0] - 60) // 2, (SIZE[1] - 40) // 2
    cut = picture(drawn(mode, *rules)["ghosts"], SIZE)[y0 : y0 + 40, x0 : x0 + 60]
    assert cut.any()
    np.testing.assert_allclose(
        picture(layers_of(inner)["ghosts"], (60, 40)), cut, rtol=2e-2, atol=5e-3 * np.abs(cut).max()
    )


def test_ramp_factors_are_interpolated_and_multiply():
    ramp = ((0.0, 1.0, 0.0, 2.0), (0.5, 3.0, 0.0, 1.0))
    distance = np.array([[0.0, 0.25, 0.5, 4.0]])
    np.testing.assert_allclose(ramp_factors([ramp], distance)[:, 0], [[1, 2, 3, 3], [0, 0, 0, 0], [2, 1.5, 1, 1]])
    np.testing.assert_allclose(ramp_factors([ramp, ramp], distance), ramp_factors([ramp], distance) ** 2)


@pytest.mark.parametrize("mode", MODES)
def test_a_ramp_colours_the_middle_and_the_rim(mode):
    """White in the centre, red at the edge, with the ghost in place, scaled and moved."""
    ramp = ((0.0, 1.0, 1.0, 1.0), (0.3, 1.0, 1.0, 1.0), (0.31, 1.0, 0.0, 0.0))
    moved = (Rule(select=SOME, offset_px=(-20, 10), scale=1.3),)
    plain, ramped = single(mode, *moved), single(mode, *moved, Rule(select=SOME, ramp=ramp))
    cx, cy, rms = moments(plain)
    y, x = np.mgrid[: SIZE[1], : SIZE[0]]
    distance = np.hypot(x - cx, -y - cy) / (np.sqrt(2) * rms)
    np.testing.assert_allclose(ramped[..., 0], plain[..., 0], rtol=1e-5)
    middle, rim = distance < 0.2, distance > 0.45
    np.testing.assert_allclose(ramped[middle], plain[middle], rtol=1e-5)
    assert plain[middle].any()
    assert plain[rim].any()
    assert not ramped[rim][:, 1:].any()


@pytest.mark.parametrize("mode", MODES)
def test_a_ramp_is_laid_over_the_ghost_before_it_is_blurred(mode):
    ramp, sigma = ((0.0, 1.0, 1.0, 1.0), (0.5, 0.5, 0.2, 0.0)), 3.0
    ramped, both = (single(mode, Rule(select=SOME, ramp=ramp, **blur)) for blur in ({}, {"blur_px": sigma}))
    expected = convolved(ramped, sigma)
    error = np.abs(both - expected)[10:-10, 10:-10].max(axis=(0, 1))
    assert (error < 0.01 * np.abs(expected).max(axis=(0, 1))).all()


# --- selection


def chosen(select, **parts):
    # stopped down, a table takes less time, and few ghosts less
    wide = scene("triplet-pestrecov", mono((8.0, 5.0)), f_number=22.0, mode="draft", **parts)
    return set(resolve_art(resolve_project(wide.replace(art=Art(rules=[Rule(select=select, gain=2.0)])))).paths)


def test_selectors_pick_what_ghosts_says():
    light = mono((8.0, 5.0))
    table = fw.ghosts("triplet-pestrecov", light.field_deg, f_number=22.0)
    names = [f"{row.first_reflection}-{row.second_reflection}" for row in table.ghosts]
    lit = [name for name, row in zip(names, table.ghosts, strict=True) if row.throughput_mm2 > 0.0]
    size = dict(zip(names, (row.rms_radius_mm for row in table.ghosts), strict=True))
    assert chosen("all") == set(names)
    assert chosen("brightest:5") == set(names[:5])
    assert chosen("brightest:5000") == set(lit)
    assert chosen("largest:4") == (largest := set(sorted(lit, key=size.get)[-4:]))
    assert chosen("not largest:4") == set(names) - largest
    assert chosen("row:5") == {name for name in names if "5" in name.split("-")}
    assert chosen(" 5-1 , 6-3 ") == {"5-1", "6-3"}
    assert chosen("NOT 5-1") == set(names) - {"5-1"}
    assert chosen("all", paths="same-side") < set(names)


@pytest.mark.parametrize(
    ("lens", "f_number"), [("triplet-pestrecov", 4.0), pytest.param("canon-28-80", 2.8, marks=pytest.mark.slow)]
)
def test_bounding_edges_are_those_that_ghosts_says(lens, f_number):
    table = fw.ghosts(lens, (8.0, 5.0), f_number=f_number)
    wide = scene(lens, mono((8.0, 5.0)), f_number=f_number, mode="draft")
    for edge in ("stop", "entrance"):
        said = {f"{r.first_reflection}-{r.second_reflection}" for r in table.ghosts if r.bounded_by == edge}
        assert said
        art = Art(rules=[Rule(select=f"bounded:{edge}", gain=2.0)])
        assert set(resolve_art(resolve_project(wide.replace(art=art))).paths) == said


def test_brightest_counts_all_lights_by_their_intensity():
    weak, strong = Light(field_deg=(2.0, 0.0), intensity=1e-6), Light(field_deg=(20.0, 0.0), intensity=1.0)
    parts = {"mode": "draft", "wavelengths": 1, "f_number": 22.0}
    both = scene("triplet-pestrecov", weak, strong, **parts)
    art = Art(rules=[Rule(select="brightest:3", gain=2.0)])
    alone = scene("triplet-pestrecov", strong, **parts)
    found, expected = (set(resolve_art(resolve_project(each.replace(art=art))).paths) for each in (both, alone))
    weakest = scene("triplet-pestrecov", weak, **parts)
    assert found == expected != set(resolve_art(resolve_project(weakest.replace(art=art))).paths)


@pytest.mark.parametrize(
    ("rule", "words"),
    [
        ({"select": "5-1"}, "has no ghost 5-1"),
        ({"select": "1-4"}, "has no ghost 1-4"),
        ({"select": "row:5"}, "nothing reflects at row 5"),
        ({"select": "row:99"}, "nothing reflects at row 99"),
        ({"select": "8-1", "paths": "same-side"}, "only paths on one side of the stop are drawn"),
        ({"select": "all", "blur_mm": 20.0}, "more than an eighth"),
    ],
)
def test_rules_that_do_not_fit_the_lens_are_refused(rule, words):
    parts = {"paths": rule.pop("paths")} if "paths" in rule else {}
    with pytest.raises(ProjectError, match=words):
        resolve_art(resolve_project(project("draft", Rule(**{"gain": 2.0, **rule}), **parts)))


# --- detail depends on gains


@pytest.mark.parametrize(
    ("lens", "rank", "size", "wavelengths"),
    [
        ("tessar-brendel", -3, (160, 100), 1),
        pytest.param("canon-28-80", -40, (320, 200), 3, marks=pytest.mark.slow),
    ],
)
def test_a_ghost_graded_up_is_drawn_in_full(lens, rank, size, wavelengths):
    """Culling and level of detail consider the gain: the brightened ghost is the same with or without a layer."""
    parts = {"size_px": size, "sensor_mm": (36.0, 22.5), "starburst": False, "wavelengths": wavelengths}
    base = scene(lens, mono((-12.0, 7.0)), layers="ghosts", **parts)
    faint = render(base).layers[rank].name.removeprefix("ghost.")
    lifted = Art(rules=[Rule(select=faint, gain=1e6), Rule(select=f"not {faint}", gain=1e-3)])
    with_layers = by_name(render(base.replace(art=lifted)))
    without = by_name(render(base.replace(art=lifted, output={"layers": "passes", "starburst": False})))
    single = picture(with_layers[f"ghost.{faint}"], size)
    whole = picture(without["ghosts"], size)
    others = picture(with_layers["ghosts"], size) - single
    assert np.abs(whole - single).max() < 0.05 * single.max() + np.abs(others).max()
    culled = render(base.replace(art=lifted, quality=base.quality.replace(cull=0.2)))
    assert f"ghost.{faint}" in by_name(culled)


@pytest.mark.parametrize("channel", [0, 1, 2])
def test_culling_and_level_of_detail_go_by_the_brightest_channel(channel):
    tint = [0.1, 0.1, 0.1]
    tint[channel] = 1.0
    rules = (Rule(select=SOME, tint=tint, gain=4.0), Rule(select=SOME, ramp=((0, 1, 1, 1), (1, 0, 1, 3))))
    changed = resolve_art(resolve_project(project("draft", *rules))).paths[SOME]
    assert changed.visible_gain == pytest.approx(4.0 * 3.0)


def test_pixels_do_not_depend_on_the_thread_count():
    rules = (Rule(select="row:4", blur_px=2.0, gain=2.0), Rule(select="row:1", offset_px=(3.3, 0), scale=0.7))
    for mode in MODES:
        one, three = (
            by_name(render(project(mode, *rules, paths="same-side"), threads=n))["beauty"].pixels for n in (1, 3)
        )
        np.testing.assert_array_equal(one, three)


def test_what_is_changed_is_said():
    art = PathArt(rgb=(1.0, 0.5, 0.0), offset=(1.0, -2.0), scale=2.0, blur=0.5, ramps=(((0.0, 1.0, 1.0, 1.0),),))
    for words in ("rgb gain 1,0.5,0", "offset 1,-2 mm", "scale 2", "blur 0.5 mm", "ramp 0,1,1,1"):
        assert words in art.text()


def test_ghosts_of_a_near_light_are_ranked_at_its_distance():
    """They used to be ranked as those of a distant light, unlike in the table of ghosts."""
    near = project("draft", Rule(select="largest:3", gain=2.0), light=mono((10.0, 5.0)).replace(distance=150.0))
    given = {"f_number": near.f_number, "coating": near.coating, "paths": near.quality.paths}
    table = fw.ghosts("heliar-tronnier", (10.0, 5.0), distance=150.0, **given)
    rows = sorted(table.ghosts, key=lambda row: -row.rms_radius_mm)[:3]
    chosen = {name for name, art in resolve_art(resolve_project(near)).paths.items() if art.rgb[0] == 2.0}
    assert chosen == {row.name for row in rows}
