"""A hundred lights: sharing work and leaving out faint ghosts gives the sum of single renders."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flarewright.kernels.raster.bundle import measure_bundle
from flarewright.kernels.tracing.sequential import WEIGHT
from flarewright.model import (
    D65,
    Art,
    BlackBody,
    Camera,
    Dirt,
    Iris,
    Light,
    Lines,
    Output,
    Preset,
    Project,
    Quality,
    Rule,
    Starburst,
)
from flarewright.optics.colour.spectrum import band_weights
from flarewright.optics.diffraction.fraunhofer import Soil, pupil_pattern
from flarewright.optics.lens.paths import ghost_paths
from flarewright.optics.rays.bundle import Refinement, trace_bundle, trace_grid
from flarewright.render.ghosts import pupil_search
from flarewright.render.ghosts.traced_ghosts import find_final
from flarewright.render.ghosts.wavelength_subset import gathered_weights
from flarewright.render.render import render
from flarewright.render.scene.opening import make_opening
from flarewright.render.scene.path_color import visible_rays
from flarewright.render.scene.resolve import resolve_project
from flarewright.render.scene.shots import make_shots
from flarewright.render.starburst import translated_wings
from flarewright.render.starburst.many_lights import Stars, draw_stars
from flarewright.render.starburst.pattern import starburst_layer
from flarewright.render.starburst.spectrum_basis import basis_spectra

SIZE = (96, 64)


def many(count, seed=3):
    rng = np.random.default_rng(seed)
    angles = rng.uniform([-12.0, -8.0], [12.0, 8.0], (count, 2))
    return tuple(
        Light(field_deg=(float(x), float(y)), intensity=float(i))
        for (x, y), i in zip(angles, np.exp(rng.normal(size=count)), strict=True)
    )


def project(lights, mode="final", wavelengths=3, **changes):
    return Project(
        lens="heliar-tronnier",
        f_number=8.0,
        lights=lights,
        camera=Camera(size_px=SIZE),
        quality=Quality(mode=mode, wavelengths=wavelengths, **changes),
        output=Output(layers="passes"),
    )


def pictures(rendering):
    found = {}
    columns, rows = rendering.project.camera.size_px
    for layer in rendering.layers:
        x, y, width, height = layer.window
        found[layer.name] = np.zeros((rows, columns, 3))
        found[layer.name][y : y + height, x : x + width] = layer.pixels
    return found


@pytest.mark.parametrize(
    ("mode", "count", "quality"),
    [
        ("final", 8, {"paths": "same-side", "ringing": "off"}),
        ("draft", 8, {}),
        pytest.param("final", 24, {"wavelengths": 7}, marks=pytest.mark.slow),
        pytest.param("draft", 24, {}, marks=pytest.mark.slow),
    ],
)
def test_many_lights_are_the_sum_of_single_ones(mode, count, quality):
    lights = many(count)
    rendering = render(project(lights, mode, **quality))
    together = pictures(rendering)
    singles = [pictures(render(project((light,), mode, **quality))) for light in lights]
    for name in ("ghosts", "starburst"):
        alone = np.sum([single[name] for single in singles], axis=0)
        sums = together[name].sum(axis=(0, 1)) / alone.sum(axis=(0, 1))
        assert sums == pytest.approx(np.ones(3), abs=2e-3), name
        # tolerance for shifted patterns: coarse edges of faint ghosts, peaks within a pixel
        assert np.abs(together[name] - alone).sum() < 0.02 * alone.sum(), name
    if mode == "final":
        facts = rendering.summary["ghosts"]
        assert facts["faint"] > 0
        assert 0.0 < facts["faint_share"] <= 5e-4
        assert any("single lights" in remark for remark in rendering.remarks)


def test_an_intensity_of_stars_multiplies_those_of_many_lights_too():
    """Eight lights and more are drawn together; the starburst's intensity applies as for a single light."""
    lights = many(8)
    plain, brighter = (
        pictures(render(project(lights, "draft").replace(starburst=Starburst(**look))))["starburst"]
        for look in ({}, {"intensity": 2.5})
    )
    np.testing.assert_allclose(brighter, 2.5 * plain, rtol=1e-5, atol=1e-7 * plain.max())


def test_the_number_of_threads_does_not_show():
    few = project(many(8), paths="same-side", ringing="off", wavelengths=2)
    # the opening of the tests above, whose pattern is known
    wanted = few.replace(lens="triplet-pestrecov", iris=Iris())
    one, three = (render(wanted, threads=threads) for threads in (1, 3))
    for a, b in zip(one.layers, three.layers, strict=True):
        assert np.array_equal(a.pixels, b.pixels)


def test_a_layer_of_its_own_holds_every_light():
    lights = many(8)
    wanted = project(lights, paths="same-side", ringing="off").replace(lens="triplet-pestrecov")
    found = render(wanted.replace(output=Output(layers="ghosts", starburst=False)))
    assert found.summary["ghosts"].get("faint", 0) == 0
    whole = sum(layer.pixels.sum() for layer in found.layers if layer.name.startswith("ghost."))
    ghosts = next(layer for layer in found.layers if layer.name == "ghosts")
    assert whole == pytest.approx(ghosts.pixels.sum(), rel=1e-5)


@pytest.mark.parametrize(
    "iris", [Iris(), Iris(blades=6, rotation_deg=7.0), pytest.param(Iris(blades=5), marks=pytest.mark.slow)]
)
def test_stars_laid_together_are_stars_drawn_one_by_one(iris):
    wave = np.arange(380.0, 781.0, 10.0)
    weights = band_weights(D65(), wave, "rec709")
    pattern = pupil_pattern(iris)
    pixel, size = (0.05, 0.06), (200, 120)
    # inside, on the border, and far outside
    centres = np.array([[100.3, 50.8], [0.2, 119.9], [-60.0, 30.5], [152.5, 10.0]])
    gains = np.array([[1.0, 1.0, 1.0], [0.5, 0.7, 0.9], [3.0, 3.0, 3.0], [0.1, 0.1, 0.1]])
    stars = Stars(pattern, 8.0, wave, weights, centres, gains)
    together = draw_stars(stars, pixel, size, draft=False, threads=2)
    alone = np.zeros((size[1], size[0], 3))
    for (x, y), gain in zip(centres, gains, strict=True):
        alone += starburst_layer(pattern, 8.0, pixel, size, (x, y), wave, weights * gain)
    # the picture's border halves a peak
    assert together.sum(axis=(0, 1)) == pytest.approx(alone.sum(axis=(0, 1)), rel=5e-4)
    off = np.abs(together - alone) / alone
    assert np.quantile(off, 0.99) < 0.02
    assert np.median(off) < 2e-3


@pytest.mark.parametrize(
    ("iris", "mask", "soil"),
    [
        pytest.param(Iris(blades=6, rounding=0.5, rotation_deg=7.0), None, None, marks=pytest.mark.slow),
        pytest.param(Iris(blades=6, roughness_um=20.0), None, None, marks=pytest.mark.slow),
        (Iris(), np.kron([[0.0, 1.0], [1.0, 1.0]], np.ones((40, 40))), None),
        pytest.param(
            Iris(blades=7), None, Soil(Dirt(dust_per_mm2=2.0, scratches_per_cm2=20.0)), marks=pytest.mark.slow
        ),
    ],
    ids=["rounded", "rough", "mask", "dirt"],
)
def test_whatever_shapes_the_iris_its_stars_are_laid_together(iris, mask, soil):
    wave = np.arange(380.0, 781.0, 10.0)
    weights = band_weights(D65(), wave, "rec709")
    pattern = pupil_pattern(iris, mask, radius_mm=5.0, soil=soil)
    pixel, size = (0.05, 0.06), (150, 100)
    # inside, on the border, beside, and so far outside that it is drawn separately
    centres = np.array([[75.3, 40.8], [0.2, 99.3], [-30.0, 15.5], [111.5, 10.0], [90.25, -120.5]])
    gains = np.array([[1.0, 1.0, 1.0], [0.5, 0.7, 0.9], [3.0, 3.0, 3.0], [0.1, 0.1, 0.1], [2.0, 1.0, 1.0]])
    alone = np.zeros((size[1], size[0], 3))
    for (x, y), gain in zip(centres, gains, strict=True):
        alone += starburst_layer(pattern, 8.0, pixel, size, (x, y), wave, weights * gain)
    far = np.ones(size[::-1], dtype=bool)
    y, x = np.indices(far.shape) + 0.5
    for column, row in centres:
        far &= np.hypot(x - column, y - row) > 25.0
    for draft in (False, True):
        together = draw_stars(Stars(pattern, 8.0, wave, weights, centres, gains), pixel, size, draft=draft, threads=2)
        assert together.sum(axis=(0, 1)) == pytest.approx(alone.sum(axis=(0, 1)), rel=1e-3), draft
        # spikes widen by a fraction of a pixel
        assert np.abs(together - alone).sum() < (5e-3 if draft else 3e-3) * np.abs(alone).sum()
        assert np.median(np.abs(together - alone) / np.abs(alone)) < (0.05 if draft else 0.02)
        # the same for light far from every centre
        assert together[far].sum(axis=0) == pytest.approx(alone[far].sum(axis=0), rel=1e-2)
        assert np.abs(together - alone)[far].sum() < (0.25 if draft else 0.1) * np.abs(alone[far]).sum()


def test_a_sheet_in_parts_is_the_whole_sheet(monkeypatch):
    wave = np.arange(380.0, 781.0, 20.0)
    stars = Stars(
        pupil_pattern(Iris(blades=6, rounding=0.5)), 8.0, wave, band_weights(D65(), wave, "rec709"),
        np.array([[20.3, 190.8], [70.0, 3.0], [41.0, 300.9]]), np.ones((3, 3)),
    )  # fmt: skip
    whole = draw_stars(stars, (0.05, 0.05), (80, 260), draft=False, threads=2)
    monkeypatch.setattr(translated_wings, "ATLAS_BYTES", 1)
    np.testing.assert_allclose(draw_stars(stars, (0.05, 0.05), (80, 260), draft=False, threads=2), whole, rtol=1e-5)


def test_few_spectra_stand_for_many():
    wave = np.arange(380.0, 781.0, 5.0)
    rng = np.random.default_rng(2)
    lights = [BlackBody(temperature_k=t) for t in rng.uniform(2000.0, 9000.0, 30)]
    lights += [Lines(lines=((450.0, 1.0), (620.0, 2.0)))]
    power = rng.uniform(0.1, 9.0, len(lights))
    colors = np.array([p * band_weights(light, wave, "rec709") for p, light in zip(power, lights, strict=True)])
    colors[-1] = 0.0
    colors[-1, 14], colors[-1, 48] = (0.3, -0.1, 2.0), (1.5, 0.4, 0.01)
    chosen, gains, fits = basis_spectra(colors, 9)
    assert 2 <= len(chosen) <= 6
    assert fits.all()
    made = np.einsum("lkc,kmc->lmc", gains, colors[chosen])
    assert made.sum(axis=1) == pytest.approx(colors.sum(axis=1), rel=1e-4)
    assert (np.abs(made - colors).sum(axis=(1, 2)) <= 0.0201 * np.abs(colors).sum(axis=(1, 2))).all()
    # with too few basis spectra, the result marks lights that do not fit
    _, _, fits = basis_spectra(colors, 1)
    assert 0 < fits.sum() < len(lights)


@pytest.mark.parametrize(
    ("mode", "count", "f_number"),
    [
        # where the core of a star is as wide as a pixel, its surroundings need no fine cells
        ("draft", 11, 32.0),
        pytest.param("draft", 16, 8.0, marks=pytest.mark.slow),
        pytest.param("final", 16, 8.0, marks=pytest.mark.slow),
    ],
)
def test_lights_of_many_spectra_are_the_sum_of_single_ones(mode, count, f_number):
    rng = np.random.default_rng(5)
    lights = tuple(
        light.replace(spectrum=BlackBody(temperature_k=float(t)))
        for light, t in zip(many(count), rng.uniform(2000.0, 9000.0, count), strict=True)
    )
    lights += (Light(field_deg=(3.0, 2.0), spectrum=Lines(lines=((589.0, 1.0),))),)
    # no ghosts: only starbursts share patterns between spectra
    dark = Art(rules=(Rule(select="all", enable=False),))
    scene = project(lights, mode).replace(iris=Iris(blades=6, rounding=0.3), art=dark, f_number=f_number)
    together = pictures(render(scene))["starburst"]
    alone = np.sum([pictures(render(scene.replace(lights=(light,))))["starburst"] for light in lights], axis=0)
    assert together.sum(axis=(0, 1)) == pytest.approx(alone.sum(axis=(0, 1)), rel=2e-3)
    assert np.abs(together - alone).sum() < 0.02 * np.abs(alone).sum()


def _shots(lights):
    settled = resolve_project(project(lights, wavelengths=7))
    return settled, make_shots(settled, make_opening(settled, None))


def test_a_region_between_two_lights_holds_what_passes():
    """Searched one by one and bounded by neighbours, a path's ghosts have the same flux."""
    settled, shots = _shots(tuple(Light(field_deg=(0.1 * k, 3.0)) for k in range(60, 80)))
    paths = ghost_paths(settled.lens)
    shared = pupil_search.ghost_search(shots, paths, {})
    assert pupil_search._rows(shots), "nothing is shared"
    for path in paths[::4]:
        found = {item.shot.number: item for item in shared([path])[0]}
        for shot in shots[::5]:
            item = next(iter(pupil_search.ghost_search([shot], paths, {})([path])[0]), None)
            mine = found.get(shot.number)
            assert (item is None) == (mine is None)
            if item is None or mine is None:
                continue
            flux = []
            for region in (item.region, mine.region):
                bundle = trace_grid(
                    shot.packed, path, shot.incidence.tilt, (shot.opening.radius, shot.opening.inner), region,
                    Refinement(20.0),
                )  # fmt: skip
                flux.append(_flux(bundle, trace_bundle(shot.packed, 3, bundle, shot.incidence.tilt), path, shot))
            assert flux[1] == pytest.approx(flux[0], rel=5e-3, abs=1e-9)


def _flux(bundle, data, path, shot):
    return measure_bundle(
        data,
        bundle.pupil,
        bundle.triangles,
        path.stop_crossings,
        shot.opening.blades,
        shot.incidence.axes,
        bundle.halves,
    )[0]


def test_gathered_weights_keep_the_flux_of_every_wavelength():
    _, (shot,) = _shots((Light(field_deg=(6.0, 3.0)),))
    path = ghost_paths(resolve_project(project((shot.light,))).lens)[5]
    tilt = shot.incidence.tilt
    ((item,),) = pupil_search.ghost_search([shot], [path], {})([path])
    bundle = trace_grid(
        shot.packed, path, tilt, (shot.opening.radius, shot.opening.inner), item.region, Refinement(20.0)
    )
    weights = shot.weights(shot.packed.wavelengths_nm)
    shown = tuple(sorted(bundle.traced))
    gathered = gathered_weights(
        shot.packed, bundle, tilt, weights, shown, visible_rays(shot, shot.to_pixels, bundle.halves)
    )
    count = len(weights)
    flux = np.array([
        _flux(bundle, trace_bundle(shot.packed, w, bundle, tilt), path, shot) for w in range(count)
    ])  # fmt: skip
    assert tuple(gathered) == shown
    assert flux[list(shown)] @ np.array(list(gathered.values())) == pytest.approx(flux @ weights, rel=5e-3)


@pytest.mark.parametrize("one_color", [False, True])
def test_a_dark_wavelength_leaves_its_light_to_bright_ones(one_color):
    """A coating that removes the middle of the spectrum: its ends or the brightest wavelength get all the light."""
    project = Project(
        lens="canon-28-80", f_number=8.0, coating=Preset(name="single-coated"),
        lights=(Light(field_deg=(16.327, 8.881)),), camera=Camera(size_px=(1920, 1080)),
    )  # fmt: skip
    settled = resolve_project(project)
    (shot,) = make_shots(settled, make_opening(settled, None))
    tilt, opening = shot.incidence.tilt, shot.opening
    (path,) = [path for path in ghost_paths(settled.lens) if path.name == "14-8"]
    item = find_final(shot, path)
    bundle = trace_grid(
        shot.packed, path, tilt, (opening.radius, opening.inner), item.region,
        Refinement(float(shot.to_pixels[2]), one_color=one_color),
    )  # fmt: skip
    weights, shown = shot.weights(shot.packed.wavelengths_nm), tuple(sorted(bundle.traced))
    flux = np.array([
        _flux(bundle, trace_bundle(shot.packed, w, bundle, tilt), path, shot) for w in range(len(weights))
    ])  # fmt: skip
    middle = len(weights) // 2
    assert flux[middle] < 0.1 * flux.max()
    everything = (
        shot.packed,
        bundle,
        tilt,
        weights,
        shown,
        visible_rays(shot, np.append(shot.to_pixels[:2], [1e-3, 1e-3]), bundle.halves),
    )
    assert gathered_weights(*everything) is None
    gathered = gathered_weights(*everything, careful=False)
    assert tuple(gathered) == ((int(flux.argmax()),) if one_color else tuple(w for w in shown if w != middle))
    light = sum(flux[w] * rgb for w, rgb in gathered.items())
    # a hundred rays determine how much a wavelength passes
    whole = flux @ weights
    np.testing.assert_allclose(light, whole, atol=0.03 * np.abs(whole).max())
    # mirrors without reflectance have no colour, and no weight is NaN
    dark = replace(shot.packed, reflectance=np.zeros_like(shot.packed.reflectance))
    unlit = {w: np.where(np.arange(data.shape[1]) == WEIGHT, 0.0, data) for w, data in bundle.traced.items()}
    assert gathered_weights(dark, replace(bundle, traced=unlit), *everything[2:], careful=False) is None
