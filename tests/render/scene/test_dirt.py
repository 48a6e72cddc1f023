"""Dirt, rough edges, the light's disc and the cat's eye: Parseval, Babinet, and invariants."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import trapezoid

from flarewright.model import Art, Camera, Dirt, Iris, Light, Output, Project, Quality, Rule, Starburst
from flarewright.optics.diffraction.fraunhofer import Pattern, Soil, pupil_pattern
from flarewright.optics.pupil.dirt import FIELD, RAGGED, Elements, generate_dirt, mean_depth, rasterise, scattered
from flarewright.optics.pupil.polygon import closed
from flarewright.optics.pupil.pupil_function import FFT_SIZE, WINDOW, pupil_amplitude
from flarewright.render.ghosts.extent_blur import blur_by_extent, shape_kernel
from flarewright.render.render import render
from flarewright.render.scene.direct_image import PUPIL_SPAN, direct_image, traced_pupil
from flarewright.render.scene.opening import make_opening
from flarewright.render.scene.resolve import resolve_project
from flarewright.render.scene.shots import make_shots
from flarewright.render.starburst import starburst_pass
from flarewright.render.starburst.pattern import starburst_layer

GREEN = (np.array([550.0]), np.ones((1, 3)))
WAVES = np.arange(500.0, 601.0, 10.0)
ROUND, SIX = Iris(), Iris(blades=6, rotation_deg=7.0)
SOILS = {
    "dust": Dirt(dust_per_mm2=2.0, dust_um=(20.0, 200.0), seed=3),
    "fine dust": Dirt(dust_per_mm2=20.0, dust_um=(5.0, 40.0), seed=3),
    "scratches": Dirt(scratches_per_cm2=5.0, scratch_um=40.0, seed=4),
    "fingerprint": Dirt(fingerprint=0.5, seed=5),
}


def energy(terms):
    """Return the integral over the plane of a veil's terms."""
    return sum(2 * math.pi * trapezoid(t.radial * t.s**2, np.log(t.s)) * t.angular.mean() for t in terms)


@pytest.mark.parametrize("name", ["dust", "scratches"])
def test_babinet_dirt_scatters_as_much_light_as_it_takes(name):
    elements = generate_dirt(SOILS[name], 8.0)
    discs, arcs = np.ones(len(elements.discs), bool), np.ones(len(elements.arcs), bool)
    veil = scattered(elements, discs, arcs, power=2.0)
    area = math.pi * (elements.discs[:, 2] ** 2).sum() + (elements.arcs[:, 3] * elements.arcs[:, 4]).sum()
    # the table starts at s = 1, inside which 1 % of the energy lies
    assert energy(veil) == pytest.approx(area / 2.0, rel=0.03)


def test_veil_of_random_discs_is_the_transform_of_their_picture():
    """Second method: the pattern of the drawn dirt alone, averaged over rings, against the sum of Airy discs."""
    spacing = WINDOW / FFT_SIZE
    at = (np.arange(-560, 560) + 0.5) * spacing
    # half of the plane (the other half is its mirror image), up to the widest ring
    s = np.fft.fftfreq(2048, spacing)
    half = s[: np.searchsorted(s[:1024], 50.0)]
    r = np.hypot(half, s[:, None])
    rings = [np.nonzero((r > low) & (r < high)) for low, high in ((8, 12), (12, 20), (20, 30), (30, 50))]
    widths = [r[ring] for ring in rings]
    found, expected = np.zeros(len(rings)), np.zeros(len(rings))
    for seed in range(2):
        elements = generate_dirt(Dirt(dust_per_mm2=0.2, dust_um=(150.0, 600.0), seed=seed), 8.0)
        inside = np.hypot(*elements.discs[:, :2].T) < 1.2
        amplitude, _ = rasterise(Elements(elements.discs[inside], elements.arcs), at)
        columns = np.fft.rfft(1.0 - amplitude, 2048, axis=1)[:, : len(half)]
        spectrum = np.fft.fft(columns, 2048, axis=0)
        (term,) = scattered(elements, inside, np.ones(0, bool), power=1.0)
        for k, (ring, at_s) in enumerate(zip(rings, widths, strict=True)):
            found[k] += (np.abs(spectrum[ring]) ** 2 * spacing**4 / np.sinc(spacing * at_s) ** 4).mean()
            expected[k] += np.interp(at_s, term.s, term.radial).mean()
    # speckle: a ring of n grains is known to 1 / sqrt(n), the smallest of two pupils to 3 %
    np.testing.assert_allclose(found, expected, rtol=0.1)


@pytest.mark.parametrize(
    ("name", "iris"),
    [
        ("fine dust", SIX),
        pytest.param("dust", ROUND, marks=pytest.mark.slow),
        pytest.param("scratches", SIX, marks=pytest.mark.slow),
        pytest.param("fingerprint", ROUND, marks=pytest.mark.slow),
        pytest.param("dust", SIX, marks=pytest.mark.slow),
        pytest.param("fine dust", ROUND, marks=pytest.mark.slow),
        pytest.param("scratches", ROUND, marks=pytest.mark.slow),
        pytest.param("fingerprint", SIX, marks=pytest.mark.slow),
    ],
)
def test_unit_flux_whatever_lies_on_the_pupil(name, iris):
    pattern = pupil_pattern(iris, radius_mm=8.0, soil=Soil(SOILS[name]))
    size, pitch = (301, 301), 0.18
    E = starburst_layer(pattern, 4.0, (pitch, pitch), size, (150.7, 150.2), WAVES[::2], np.ones((len(WAVES[::2]), 3)))
    clean = starburst_layer(
        pupil_pattern(iris), 4.0, (pitch, pitch), size, (150.7, 150.2), WAVES[::2], np.ones((len(WAVES[::2]), 3))
    )
    assert E[..., 0].sum(dtype=float) * pitch**2 / len(WAVES[::2]) == pytest.approx(1.0, abs=2e-3)
    assert 0.8 < pattern.transmittance < 0.9999
    # far from the centre there is more light than without dirt
    assert E[:, :100].sum(dtype=float) > 1.02 * clean[:, :100].sum(dtype=float)


def test_parseval_in_the_fourier_core():
    soil = SOILS["dust"]
    pattern = pupil_pattern(Iris(), radius_mm=8.0, soil=Soil(soil))
    elements = generate_dirt(soil, 8.0)
    pupil = pupil_amplitude(Iris(), None, 1.0, 8.0, elements, None, 0.0)
    assert pupil.light == pytest.approx(math.pi * pattern.transmittance, rel=1e-4)
    # the loss by dust is its area, apart from overlaps and the edge
    inside = np.hypot(*elements.discs[:, :2].T) < 1.0
    assert 1.0 - pattern.transmittance == pytest.approx((elements.discs[inside, 2] ** 2).sum(), rel=0.05)
    # the centre of the pattern: |mean amplitude|^2 of the area
    K = (pattern.table.shape[0] - 1) // 2
    centre = np.diff(np.diff(pattern.table[K : K + 2, K : K + 2], axis=0), axis=1)[0, 0] * pattern.knots_per_s**2
    expected = (pupil.amplitude.sum() * (WINDOW / FFT_SIZE) ** 2) ** 2 / pupil.light
    assert centre == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize(
    "dirt",
    [
        Dirt(dust_per_mm2=20.0, dust_um=(90.0, 400.0), seed=1),
        pytest.param(Dirt(dust_per_mm2=20.0, dust_um=(200.0, 200.0), seed=2), marks=pytest.mark.slow),
        Dirt(scratches_per_cm2=100.0, scratch_um=120.0, scratch_mm=6.0, seed=3),
    ],
    ids=["dust", "equal dust", "scratches"],
)
def test_random_pieces_pass_the_exponential_of_their_depth(dirt):
    """A Boolean model, against the drawn picture; the tolerance is the spread of a picture of few pieces."""
    spacing = WINDOW / FFT_SIZE
    at = (np.arange(-170, 170) + 0.5) * spacing * 2.0
    _, light = rasterise(generate_dirt(dirt, 8.0), at)
    assert mean_depth(dirt) > 0.5
    assert -math.log(light.mean()) == pytest.approx(mean_depth(dirt), rel=0.1)


def test_dirt_without_a_gap_is_refused_before_it_is_drawn(monkeypatch):
    monkeypatch.setattr("flarewright.optics.diffraction.fraunhofer.generate_dirt", None)
    dark = Dirt(dust_per_mm2=200.0, dust_um=(400.0, 500.0))
    with pytest.raises(ValueError, match="the dirt blocks all light"):
        pupil_pattern(Iris(), radius_mm=20.0, soil=Soil(dark))


@pytest.mark.parametrize("width_um", [1e-6, 1e-3, 1.0])
def test_a_scratch_of_any_small_width_keeps_its_area(width_um):
    """Softening a band narrower than a sample adds 4 % to its area, whatever its width."""
    spacing, width = WINDOW / FFT_SIZE, 1e-3 * width_um / 8.0
    arc = np.array([[0.02, 0.01, 0.3, 0.2, width, 0.05]])
    _, light = rasterise(Elements(np.empty((0, 4)), arc), (np.arange(-60, 60) + 0.5) * spacing)
    assert (1.0 - light).sum() * spacing**2 == pytest.approx(0.2 * width, rel=0.05)


@pytest.mark.parametrize("normal", [0.0, 0.5, 0.79, 1.6, 2.4, 3.2, 4.0, 5.5])
@pytest.mark.parametrize("width", [0.002, 0.04])
def test_a_scratch_is_drawn_in_its_whole_window(normal, width, monkeypatch):
    """The samples near the arc are all that it covers: drawing every sample of its window gives the same bytes."""
    from flarewright.optics.pupil import dirt

    at = (np.arange(-150, 150) + 0.5) * 0.01
    arc = np.array([[0.1, -0.2, normal, 1.0, width, 0.08]])
    few = rasterise(Elements(np.empty((0, 4)), arc), at)

    def every(_at, rows, columns, *_):
        row, column = np.meshgrid(np.arange(rows.start, rows.stop), np.arange(columns.start, columns.stop))
        return row.ravel(), column.ravel()

    monkeypatch.setattr(dirt, "_near_arc", every)
    whole = rasterise(Elements(np.empty((0, 4)), arc), at)
    assert few[1].min() < 1.0
    np.testing.assert_array_equal(few, whole)


def test_dirt_stays_where_it_is_when_the_iris_closes():
    for dirt in SOILS.values():
        wide, small = generate_dirt(dirt, 8.0), generate_dirt(dirt, 4.0)
        for many, few in ((wide.discs, small.discs), (wide.arcs, small.arcs)):
            central = np.hypot(many[:, 0], many[:, 1]) * 8.0 < 4.0 * FIELD - 0.5
            assert np.isin(np.round(many[central, 0] * 8.0, 9), np.round(few[:, 0] * 4.0, 9)).all()
        again, other = generate_dirt(dirt, 8.0), generate_dirt(dirt.replace(seed=99), 8.0)
        np.testing.assert_array_equal(again.discs, wide.discs)
        assert again.discs.shape != other.discs.shape or not np.array_equal(again.discs, other.discs) or len(again.arcs)


def test_smooth_is_the_limit_of_rough():
    # the next test needs the smooth one too
    smooth = pupil_pattern(Iris(blades=4))
    nearly = pupil_pattern(Iris(blades=4, roughness_um=1e-3), radius_mm=8.0)
    np.testing.assert_allclose(nearly.table, smooth.table, atol=1e-6)


def test_roughness_takes_its_share_of_the_spike_and_keeps_the_flux():
    """A Gaussian edge keeps exp(-(2 pi sigma s)^2) of the specular spike (Debye and Waller)."""
    sigma_um, radius = 40.0, 8.0
    args = (4.0, (0.04, 0.04), (301, 301), (150.5, 150.5), *GREEN)
    kept = []
    iris = Iris(blades=4, roughness_um=sigma_um, roughness_length_um=100.0)
    for seed in range(2):
        rough = pupil_pattern(iris.replace(roughness_seed=seed), radius_mm=radius)
        kept.append(spike(rough) / spike(pupil_pattern(Iris(blades=4))))
    s = SPIKE_AT
    assert np.mean(kept, axis=0) == pytest.approx(np.exp(-((2 * np.pi * sigma_um * 1e-3 / radius * s) ** 2)), abs=0.12)
    E = starburst_layer(rough, *args)
    smooth = starburst_layer(pupil_pattern(Iris(blades=4)), *args)
    assert E.sum(dtype=float) == pytest.approx(smooth.sum(dtype=float), rel=3e-3)
    # the lost light of the spikes lies between them
    assert E[175:, 200:230].sum() > 3 * smooth[175:, 200:230].sum()


def test_the_light_of_rough_edges_goes_where_their_normals_point():
    """Second method: the Fourier transform of drawn rough irises, in a ring, by direction, without the spikes."""
    iris = Iris(blades=4, roughness_um=60.0, roughness_length_um=250.0)
    patterns = [pupil_pattern(iris.replace(roughness_seed=seed), radius_mm=8.0) for seed in range(2)]
    pattern = patterns[-1]
    cells = len(pattern.table) - 1
    # the lower half: a pattern is symmetric about its centre
    y, x = np.mgrid[cells // 2 : cells, :cells].astype(np.float32) - np.float32((cells - 1) / 2)
    squared = (x * x + y * y) / pattern.knots_per_s**2
    ring = np.nonzero((squared > 40.0**2) & (squared < 58.0**2))
    place = np.round(np.degrees(np.arctan2(y[ring], x[ring])) / 9.0).astype(int) % 20
    scale = pattern.knots_per_s**2 * squared[ring] ** 1.5
    drawn = []
    for each in patterns:
        t = each.table[cells // 2 :]
        light = np.diff(np.diff(t, axis=0), axis=1)[ring] * scale
        drawn.append(np.bincount(place, light, 20) / np.bincount(place, minlength=20))
    fans = pattern.rough.angular
    place = np.round(np.arange(len(fans)) * 20.0 / len(fans)).astype(int) % 20
    expected = np.bincount(place, fans, 20) / np.bincount(place, minlength=20)
    beside = np.arange(20) % 10 != 0
    found = np.mean(drawn, axis=0)
    np.testing.assert_allclose(found[beside], expected[beside], atol=0.2 * expected.max())
    assert found[beside].sum() == pytest.approx(expected[beside].sum(), rel=0.08)


SPIKE_AT = np.array([15.0, 25.0, 35.0])


def spike(pattern: Pattern):
    """Light in narrow boxes on the upward spike around some s, fringes averaged."""
    K = (pattern.table.shape[0] - 1) / 2
    out = []
    for s in SPIKE_AT:
        y0, y1 = int(K + (s - 3) * pattern.knots_per_s), int(K + (s + 3) * pattern.knots_per_s)
        x0, x1 = int(K - 4), int(K + 5)
        t = pattern.table
        out.append(t[y1, x1] - t[y0, x1] - t[y1, x0] + t[y0, x0])
    return np.array(out)


def shot_of(**changes):
    given = {"lens": "canon-28-80", "f_number": 2.8, "lights": (Light(field_deg=(20.0, 10.0)),), **changes}
    settled = resolve_project(Project(**given))
    shot = make_shots(settled, make_opening(settled, None))[0]
    return settled, shot


def test_the_traced_pupil_is_the_iris_on_the_axis():
    settled, shot = shot_of(f_number=5.6, iris=Iris(blades=5, rotation_deg=12.0), lights=(Light(field_deg=(0.0, 0.0)),))
    found = traced_pupil(settled.lens, shot, settled.order.f_number)
    at = ((np.arange(1024) + 0.5) / 512 - 1) * PUPIL_SPAN
    from flarewright.optics.pupil.iris import transmission

    blades = transmission(settled.iris, 1.0, at, -at[:, None], footprint=0.004)
    # the pupil's aberration is a few per mille of its radius
    assert np.abs(np.clip(found, 0, 1) - blades).sum() < 0.02 * blades.sum()


def test_rims_make_a_cats_eye_off_the_axis():
    settled, shot = shot_of()
    found = traced_pupil(settled.lens, shot, 2.8)
    area = found.sum() * (2 * PUPIL_SPAN / 1024) ** 2
    # etendue: area in cosines times area of the image, which grows as 1 / cos^3, equals the light, but for distortion
    _, straight = shot_of(lights=(Light(field_deg=(0.0, 0.0)),))
    flux = direct_image(settled.lens, shot).throughput_mm2[3] / direct_image(settled.lens, straight).throughput_mm2[3]
    assert area / math.pi < 0.8
    assert area / math.pi == pytest.approx(flux * shot.incidence.cosine**3, rel=0.03)
    y, x = np.nonzero(found > 0.5)
    spread = np.linalg.eigvalsh(np.cov(x, y))
    assert spread[0] < 0.8 * spread[1]


def picture(name="starburst", **changes):
    given = {
        "lens": "heliar-tronnier", "f_number": 8.0, "lights": (Light(field_deg=(5.0, 2.0)),),
        # the starburst does not depend on the ghosts
        "art": Art(rules=() if name == "ghosts" else (Rule(select="all", enable=False),)),
        "camera": Camera(size_px=(150, 100)), "quality": Quality(mode="draft", wavelengths=3, paths="same-side"),
        "output": Output(layers="passes"), **changes,
    }  # fmt: skip
    return next(layer.pixels for layer in render(Project(**given)).layers if layer.name == name)


@pytest.fixture(scope="module")
def plain():
    return picture()


def test_the_lights_disc_blurs_and_keeps_the_flux(plain):
    for degrees in (0.02, 0.53, 3.0):
        disc = picture(lights=(Light(field_deg=(5.0, 2.0), diameter_deg=degrees),))
        assert disc.sum(dtype=float) == pytest.approx(plain.sum(dtype=float), rel=2e-3)
        radius = 99.24 * math.tan(math.radians(degrees / 2)) / (36 / 150)
        if radius > 2:
            bright = disc[..., 1] > 0.5 * disc[..., 1].max()
            assert bright.sum() == pytest.approx(math.pi * radius**2, rel=0.1)


def test_disc_blur_of_a_dot_is_the_disc():
    dot = np.zeros((41, 51, 1))
    dot[20, 25] = 1.0
    angle = np.linspace(0.0, 2.0 * math.pi, 400, endpoint=False)
    border = closed(np.stack([7.0 * np.cos(angle), 5.0 * np.sin(angle)], axis=1))
    disc = blur_by_extent(dot, shape_kernel(border))[..., 0]
    assert disc.sum() == pytest.approx(1.0, rel=1e-12)
    y, x = np.mgrid[-20:21, -25:26]
    np.testing.assert_allclose(disc[(x / 7) ** 2 + (y / 5) ** 2 < 0.7], 1 / (math.pi * 35), rtol=0.01)
    assert np.abs(disc[(x / 7) ** 2 + (y / 5) ** 2 > 1.4]).max() < 1e-12


def test_one_switch_turns_art_direction_off(plain, monkeypatch):
    monkeypatch.setattr(starburst_pass, "SPIRAL_COPIES", 3)
    np.testing.assert_allclose(picture(starburst=Starburst(intensity=3.0)), 3 * plain, rtol=1e-5)
    wide = picture(starburst=Starburst(size=80.0))
    assert wide.sum(dtype=float) == pytest.approx(plain.sum(dtype=float), rel=0.1)
    assert wide.max() < 0.6 * plain.max()
    smeared = picture(starburst=Starburst(spiral_deg=10.0))
    assert smeared.sum(dtype=float) == pytest.approx(plain.sum(dtype=float), rel=0.01)
    by_hand = Starburst(size=4.0, intensity=3.0, spiral_deg=10.0)
    np.testing.assert_array_equal(picture(starburst=by_hand, art=Art(physical=True)), plain)


def test_dirt_takes_its_light_from_the_direct_image(plain):
    dirt = Dirt(dust_per_mm2=5.0, dust_um=(50.0, 200.0), seed=2)
    settled, _ = shot_of(lens="heliar-tronnier", f_number=8.0)
    kept = pupil_pattern(settled.iris, radius_mm=settled.order.stop_semi_diameter, soil=Soil(dirt)).transmittance
    assert 0.5 < kept < 0.97
    assert picture(dirt=dirt).sum(dtype=float) == pytest.approx(kept * plain.sum(dtype=float), rel=0.01)


def test_a_drawn_image_of_dirt(plain, tmp_path):
    from PIL import Image

    image = np.full((200, 200), 255, np.uint8)
    image[:, 98:102] = 0
    Image.fromarray(image).save(tmp_path / "hair.png")
    with_hair = picture(dirt=Dirt(image=str(tmp_path / "hair.png")))
    # a bar of 1/50 of the width blocks 2 / (50 pi) * 2 of a disc's light
    assert with_hair.sum(dtype=float) == pytest.approx((1 - 0.04 * 2 / math.pi) * plain.sum(dtype=float), rel=5e-3)
    row = int(50 - 99.24 * math.tan(math.radians(2.0)) / 0.24)
    beside = np.r_[0:50]
    gain = with_hair[row - 1 : row + 2, beside].sum() / plain[row - 1 : row + 2, beside].sum()
    assert gain > 1.5
    assert gain > 1.3 * with_hair[:, 135:145].sum() / plain[:, 135:145].sum()


def test_dirt_in_ghosts_takes_its_share_and_leaves_the_edges():
    dirt = Dirt(dust_per_mm2=1.0, dust_um=(300.0, 800.0), seed=2, in_ghosts=True)
    given = {
        "f_number": 5.6,
        "iris": Iris(blades=6),
        "quality": Quality(wavelengths=1, paths="same-side", ringing="off"),
        "output": Output(layers="passes", starburst=False),
    }
    clean, dirty = picture("ghosts", **given), picture("ghosts", dirt=dirt, **given)
    only_burst = picture("ghosts", dirt=dirt.replace(in_ghosts=False), **given)
    np.testing.assert_array_equal(only_burst, clean)
    settled, _ = shot_of(lens="heliar-tronnier", f_number=5.6, iris=Iris(blades=6))
    kept = pupil_pattern(settled.iris, radius_mm=settled.order.stop_semi_diameter, soil=Soil(dirt)).transmittance
    assert 0.6 < kept < 0.9
    # ghosts bounded by the entrance use another part of the dirt
    assert dirty.sum(dtype=float) == pytest.approx(kept * clean.sum(dtype=float), rel=0.15)
    # smooth cells are drawn whole where nothing cuts them, but triangle by triangle through a mask
    assert (dirty <= clean + 0.02 * clean.max()).all()


def test_scratches_of_many_widths_make_no_comb():
    """Many widths have the stated mean; the fringes of a single width average out."""
    dirt = Dirt(scratches_per_cm2=400.0, scratch_um=40.0, seed=1)
    arcs = generate_dirt(dirt, 8.0).arcs
    widths = 8e3 * arcs[:, 4]
    assert len(widths) > 1000
    assert widths.mean() == pytest.approx(40.0, rel=0.03)
    assert widths.max() / widths.min() == pytest.approx(8.0, rel=0.02)
    # a part of them, for less time
    arcs = arcs[::3]
    many = scattered(Elements(np.empty((0, 4)), arcs), np.zeros(0, bool), np.ones(len(arcs), bool), math.pi)
    same = arcs.copy()
    same[:, 4] = 5e-3
    (comb,) = scattered(Elements(np.empty((0, 4)), same), np.zeros(0, bool), np.ones(len(arcs), bool), math.pi)
    s = np.linspace(150.0, 1000.0, 3000)
    mixed = sum(np.interp(s, term.s, term.radial) for term in many) * s**3
    holes = np.interp(s, comb.s, comb.radial) * s**3
    assert mixed.min() > 0.6 * mixed.max()
    assert holes.min() < 0.3 * holes.max()


def test_the_fringes_of_a_scratch_fade_as_colours_mix_and_end_nowhere():
    """Second method: waves of two ragged edges of every wavelength, summed along a scratch's fan, orders 2 to 8."""
    # one scratch lies in this opening
    dirt, N, pitch = Dirt(scratches_per_cm2=0.5, scratch_um=40.0, seed=82), 16.0, 0.02
    soil, radius_mm = Soil(dirt), 8.0
    ((_, _, _, _, width, _),) = generate_dirt(dirt, radius_mm).arcs
    pattern = pupil_pattern(Iris(), radius_mm=radius_mm, soil=soil)
    (term,) = pattern.veil
    bright = np.flatnonzero(term.angular > 0.99 * term.angular.max())
    direction = math.pi * float(np.median(bright)) / len(term.angular)
    weights = np.exp(-(((WAVES - 550.0) / 25.0) ** 2))[:, None] * np.ones(3)
    place = np.arange(3.0, 8.0 * 0.55e-3 * 2.0 * N / width, 0.15)
    wide, high = (int(abs(part) * place[-1] / pitch) + 20 for part in (math.cos(direction), math.sin(direction)))
    cx = 10.0 if math.cos(direction) > 0.0 else wide - 10.0
    frame = ((pitch, pitch), (wide, high), (cx, high - 10.0), WAVES, weights)
    spread_light = starburst_layer(pattern, N, *frame, threads=None)
    clean = starburst_layer(replace(pattern, veil=()), N, *frame, threads=None)
    columns = np.floor(cx + place * math.cos(direction) / pitch).astype(int)
    rows = np.floor(high - 10.0 - place * math.sin(direction) / pitch).astype(int)
    found = (spread_light - clean)[rows, columns, 0]
    # distance of the pixel from the centre
    r = pitch * np.hypot(columns + 0.5 - cx, rows + 0.5 - (high - 10.0))
    scale = 2.0 * N * WAVES * 1e-6
    s = r[:, None] / scale
    order = s * width
    even = (1.0 / s**3 / scale**2 @ weights[:, 0]) * 0.5
    # random deviations from the mean width, by quadrature over the normal distribution
    off, part = np.polynomial.hermite_e.hermegauss(60)
    widths = 1.0 + math.sqrt(2.0) * RAGGED * off
    light = np.abs(np.exp(2j * math.pi * order[..., None] * widths) - 1.0) ** 2 @ (part / part.sum())
    fringes = (light / 4.0 / s**3 / scale**2) @ weights[:, 0]
    ratio = found / even
    ratio *= (fringes / even).mean() / ratio.mean()
    np.testing.assert_allclose(ratio, fringes / even, rtol=0.0, atol=0.02)
    # fringes are clear at first, and invisible beyond the fifth order
    middle = order[:, len(WAVES) // 2]
    assert np.ptp((fringes / even)[middle < 2.5]) > 0.2
    assert np.ptp(ratio[middle > 5.0]) < 0.02
