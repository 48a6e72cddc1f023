"""The starburst against Airy, Parseval, the exact polygon, and itself at other samplings."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flarewright.kernels.diffraction.resample import SpikeTables, blend_blade_wings
from flarewright.model import D65, Art, Camera, Iris, Light, Output, Project, Quality, Rule
from flarewright.optics.colour.spectrum import band_weights
from flarewright.optics.diffraction.fraunhofer import BladeWings, FanWings, pupil_pattern
from flarewright.optics.diffraction.spike_profile import spike_profile
from flarewright.optics.pupil.iris import blade_edges, iris_outline
from flarewright.render.render import render
from flarewright.render.starburst.bands import BAND
from flarewright.render.starburst.pattern import starburst_layer

WHITE_NM = np.arange(380.0, 781.0, 5.0)
WHITE = band_weights(D65(), WHITE_NM, "rec709")
GREY = np.repeat(WHITE.mean(axis=1, keepdims=True).clip(0), 3, axis=1)
GREEN_NM, GREEN = [550.0], [[1.0, 1.0, 1.0]]
# each opening costs a large transform, so the tests share few
SIX = Iris(blades=6, rotation_deg=20)
SHAPES = [
    Iris(),
    SIX,
    Iris(blades=7, rotation_deg=11),
    SIX.replace(rounding=0.5),
    Iris(blades=9, rounding=0.8),
]


def layer(iris, f_number=16.0, pitch=0.028, size=(200, 160), centre=None, wave=WHITE_NM, weights=WHITE, mask=None):
    centre = centre or (size[0] / 2 + 0.3, size[1] / 2 - 0.2)
    return starburst_layer(pupil_pattern(iris, mask), f_number, (pitch, pitch), size, centre, wave, weights)


def some(fast, others):
    """Pair f-numbers (and pixels) with shapes: `fast` in every run, the others in slow runs."""
    return [
        pytest.param(*frame, iris, id=f"{frame[0]}-{k}", marks=() if k in fast.get(frame, ()) else pytest.mark.slow)
        for frame in (*fast, *others)
        for k, iris in enumerate(SHAPES)
    ]


def radii(size, centre, pitch):
    x = (np.arange(size[0]) + 0.5 - centre[0]) * pitch
    y = (np.arange(size[1]) + 0.5 - centre[1]) * pitch
    return np.hypot(x, y[:, None])


def airy_rings():
    """Monochromatic round pattern on pixels of 1/50 of the first zero's radius."""
    N, lam = 8.0, 550e-6
    zero = 1.219670 * lam * N
    pitch = zero / 50
    # a quarter: the pattern is round
    size, centre = (300, 300), (0.0, 0.0)
    E = layer(Iris(), N, pitch, size, centre, GREEN_NM, GREEN)[..., 0].astype(float)
    return E, radii(size, centre, pitch), zero, pitch


def test_airy_first_zero_and_encircled_energy():
    E, r, zero, pitch = airy_rings()
    profile = [E[(r > a) & (r <= a + pitch)].mean() for a in np.arange(0, 2 * zero, pitch)]
    first_minimum = next(k for k in range(1, 90) if profile[k] < profile[k + 1])
    assert (first_minimum + 0.5) * pitch == pytest.approx(zero, rel=0.015)
    assert profile[first_minimum] < 3e-3 * profile[0]
    for ring, share in ((1.0, 0.8378), (2.233131 / 1.219670, 0.9099), (3.238315 / 1.219670, 0.9376)):
        assert 4.0 * E[r <= ring * zero].sum() * pitch**2 == pytest.approx(share, abs=3e-3)
    # Central irradiance of unit flux: pi / (4 N^2 lambda^2); the spline through the table blurs it by 3.4 %.
    assert E.max() == pytest.approx(math.pi / (4 * 8.0**2 * 550e-6**2), rel=0.04)


def test_size_scales_with_wavelength_and_f_number():
    a = layer(Iris(blades=5), 8.0, 0.002, (150, 150), wave=[450.0], weights=GREEN)
    b = layer(Iris(blades=5), 8.0, 0.002 * 600 / 450, (150, 150), wave=[600.0], weights=GREEN)
    c = layer(Iris(blades=5), 16.0, 0.004, (150, 150), wave=[450.0], weights=GREEN)
    np.testing.assert_allclose(b * (600 / 450) ** 2, a, rtol=2e-5)
    np.testing.assert_allclose(c * 4, a, rtol=2e-5)


@pytest.mark.parametrize(
    ("f_number", "pitch", "iris"),
    some({(16.0, 0.028): (1, 3), (4.0, 0.028): (4,), (1.0, 0.05): (0, 2), (22.0, 0.004): (1,)}, ()),
)
def test_unit_flux(f_number, pitch, iris):
    side = 501 if pitch < 0.01 else 301
    size = (side, side)
    # Few wavelengths suffice: the flux outside is linear in the wavelength.
    wave, grey = WHITE_NM[::4], GREY[::4]
    E = layer(iris, f_number, pitch, size, wave=wave, weights=grey)
    mean_nm = wave @ grey[:, 0] / grey[:, 0].sum()
    # Flux outside a circle of radius r: perimeter * 2 N lambda / (2 pi^2 area r), exact for the circle.
    r, centre = radii(size, (side / 2 + 0.3, side / 2 - 0.2), pitch), 0.45 * side * pitch
    line = iris_outline(iris, 1.0, 2000)
    perimeter = np.linalg.norm(line - np.roll(line, -1, axis=0), axis=1).sum()
    outside = perimeter * 2 * f_number * mean_nm * 1e-6 / (2 * math.pi**3 * centre)
    inside = E[..., 0][r < centre].sum(dtype=float) * pitch**2 / grey[:, 0].sum()
    assert inside + outside == pytest.approx(1.0, abs=6e-4)
    assert E.min() >= 0.0


def test_wings_of_the_round_opening_are_the_mean_airy_tail():
    # A quarter of the picture: the pattern is round.
    size, centre, N = (301, 301), (0.5, 0.5), 16.0
    for pitch in (0.004, 0.028):
        E, r = layer(Iris(), N, pitch, size, centre, weights=GREY), radii(size, centre, pitch)
        moment = (2 * N * WHITE_NM * 1e-6) @ GREY[:, 0] / (2 * math.pi**3)
        # From s = 12 for red light through the blend to the picture's border: no seam anywhere.
        for a in np.geomspace(12 * 2 * N * 700e-6, 0.42 * 601 * pitch, 25)[:-1]:
            ring = (r > a) & (r < 1.1 * a)
            if ring.any():
                assert np.mean(E[ring, 0] * r[ring] ** 3) == pytest.approx(moment, rel=0.02)


def exact_polygon(iris, sx, sy):
    """Return |transform|^2 / area of a straight-bladed opening of radius 1, by the sum over its edges."""
    p = iris_outline(iris, 1.0, iris.blades)
    total = 0j
    for a, b in zip(p, np.roll(p, -1, axis=0), strict=True):
        t, m = b - a, (a + b) / 2
        total = total + (t[1] * sx - t[0] * sy) * np.sinc(t[0] * sx + t[1] * sy) * np.exp(
            -2j * np.pi * (m[0] * sx + m[1] * sy)
        )
    return np.abs(total / (2 * np.pi * (sx**2 + sy**2))) ** 2 / math.pi


@pytest.mark.parametrize("iris", [SHAPES[2], SIX])
def test_core_is_the_exact_polygon(iris):
    pattern = pupil_pattern(iris)
    whole = np.diff(np.diff(pattern.table, axis=0), axis=1) * pattern.knots_per_s**2
    K = len(whole) // 2
    near = int(11 * pattern.knots_per_s)
    # All samples near the centre, every third one per axis farther out.
    parts = (np.arange(K - near, K + near + 1), ((3, 10),)), (np.arange(0, 2 * K + 1, 3), ((10, 30), (30, 58)))
    for samples, rings in parts:
        P, s = whole[np.ix_(samples, samples)], (samples - K) / pattern.knots_per_s
        with np.errstate(invalid="ignore"):
            exact = exact_polygon(iris, s, s[:, None])
        r = np.hypot(s, s[:, None])
        assert np.abs(P - exact)[(r > 0) & (r < 3)].max() < 1e-5 * math.pi
        # Everywhere, and between the spikes alone, where little light is.
        between = np.min([np.abs(n[0] * s[:, None] - n[1] * s) for n in blade_edges(iris, 1.0)], axis=0) > 2.0
        for low, high in rings:
            ring = (r > low) & (r < high)
            assert P[ring].sum() == pytest.approx(exact[ring].sum(), rel=3e-3)
            assert P[ring & between].sum() == pytest.approx(exact[ring & between].sum(), rel=5e-3)


def test_blade_wings_are_the_exact_polygon_without_its_fringes():
    iris = SIX
    wings = pupil_pattern(iris).wings
    assert isinstance(wings, BladeWings)
    edges = blade_edges(iris, 1.0)
    rng = np.random.default_rng(5)
    # Along a spike, one cell of fringes wide and across it at several distances.
    for off in (0.0, 0.3, 0.7, 2.3):
        along = rng.uniform(80.0, 90.0, 10000)
        across = off + rng.uniform(-0.05, 0.05, along.size)
        n = edges[1, :2]
        sx, sy = along * n[0] - across * n[1], along * n[1] + across * n[0]
        exact = np.mean(exact_polygon(iris, sx, sy))
        pred = 0.0
        for nx, ny, *_ in edges[:3]:
            u, v = nx * sx + ny * sy, nx * sy - ny * sx
            r2 = u * u + v * v
            sinc2 = np.sinc(wings.length * np.sqrt(r2) * v / u) ** 2
            pred += wings.multiplicity * np.mean(wings.length**2 * sinc2 / (4 * math.pi**3 * r2))
        assert exact == pytest.approx(pred, rel=0.05)


def test_spike_profile_is_the_averaged_sinc():
    wings = pupil_pattern(SIX).wings
    profile = spike_profile(wings, np.array([550.0]), np.ones((1, 1)), 8.0, (1e-6, 1e-6))
    v = np.arange(profile.density.shape[1]) * profile.step
    first = v < 0.4 * v[-1]
    expected = wings.multiplicity * wings.length**2 / (4 * math.pi**3) * np.sinc(wings.length * v / 550e-6) ** 2
    np.testing.assert_allclose(profile.density[0, first, 0], expected[first], atol=1e-3 * expected.max())
    # The whole flux across is the integral of sinc^2.
    total = wings.multiplicity * wings.length / (4 * math.pi**3) * 550e-6 / 2
    np.testing.assert_allclose(profile.half_total, total, rtol=1e-12)


@pytest.mark.parametrize(("pitch", "N"), [(0.028, 8.0), (0.3, 2.0)], ids=["fine", "coarse"])
@pytest.mark.parametrize("lines", ["white", "lines"])
def test_spike_profile_is_averaged_over_the_pixel(pitch, N, lines):
    wings = pupil_pattern(SIX).wings
    nm, weights = WHITE_NM, WHITE
    if lines == "lines":
        nm, weights = np.array([610.0, 436.0, 546.0]), np.array([[1.0, 0.2, 0.0], [0.1, 0.0, 2.0], [0.3, 1.0, 0.2]])
    profile = spike_profile(wings, nm, weights, N, (pitch, 0.5 * pitch))
    # the shadow of a pixel across a spike is a trapezoid: a box of its width's and a box of its height's projection
    for k, angle in enumerate(wings.angle):
        wide, narrow = sorted(np.abs([pitch * np.sin(angle), 0.5 * pitch * np.cos(angle)]) / (2 * N), reverse=True)
        span = wide + narrow
        shift = (np.arange(6000) + 0.5) / 6000 * span - 0.5 * span
        weight = np.clip((0.5 * span - np.abs(shift)) / max(narrow, 1e-12), 0.0, 1.0)
        for at in (0, 60, 200):
            u = wings.length * (at * profile.step + shift) / (nm[:, None] * 1e-6)
            averaged = np.sinc(u) ** 2 @ weight / weight.sum()
            brute = wings.multiplicity * wings.length**2 / (4 * math.pi**3) * averaged @ weights
            np.testing.assert_allclose(profile.density[k, at], brute, rtol=5e-3)


@pytest.mark.parametrize(("f_number", "iris"), some({(2.8,): (0, 1, 4), (8.0,): (2, 3), (22.0,): (0, 1)}, ()))
def test_a_draft_errs_near_the_centre_only(f_number, iris):
    size, centre = (320, 180), (160.3, 89.8)
    final = layer(iris, f_number, size=size, centre=centre, weights=GREY)
    draft = starburst_layer(pupil_pattern(iris), f_number, (0.028, 0.028), size, centre, WHITE_NM, GREY, split=1)
    assert np.abs(draft - final).max() < 5e-6 * final.max()
    assert draft.sum(dtype=float) == pytest.approx(final.sum(dtype=float), rel=3e-5)
    far = radii(size, centre, 1.0) > 12.0
    np.testing.assert_array_equal(draft[far], final[far])


@pytest.mark.parametrize(
    ("f_number", "blades", "spikes"),
    [
        (2.8, 5, 10),
        (16.0, 5, 10),
        (2.8, 6, 6),
        (16.0, 6, 6),
        *(pytest.param(2.8, n, m, marks=pytest.mark.slow) for n, m in ((4, 4), (7, 14), (8, 8), (9, 18))),
        *(pytest.param(16.0, n, m, marks=pytest.mark.slow) for n, m in ((4, 4), (7, 14), (8, 8), (9, 18))),
    ],
)
def test_even_blades_give_n_spikes_odd_ones_2n(blades, spikes, f_number):
    iris = SIX if blades == 6 else Iris(blades=blades)
    E = layer(iris, f_number, 0.056, (350, 350), (175.0, 175.0), WHITE_NM[::4], WHITE[::4])[..., 1]
    turn = np.linspace(0, 2 * np.pi, 1440, endpoint=False)
    ring = np.zeros(1440)
    for r in range(125, 165, 2):
        ring += E[(175 - r * np.sin(turn)).astype(int), (175 + r * np.cos(turn)).astype(int)] * r**2
    peaks = ring > 0.25 * ring.max()
    assert np.count_nonzero(peaks & ~np.roll(peaks, 1)) == spikes


def test_spikes_stand_along_the_normals_of_the_blades_in_the_upright_picture():
    E = layer(SIX, 8.0, 0.028, (400, 400), (200.0, 200.0), WHITE_NM[::4], WHITE[::4])[..., 1]
    for k in range(6):
        a = math.radians(90 + 20 + 60 * k)
        i, j = int(200 - 150 * math.sin(a)), int(200 + 150 * math.cos(a))
        b = a + math.radians(12)
        dark = E[int(200 - 150 * math.sin(b)), int(200 + 150 * math.cos(b))]
        assert E[i - 1 : i + 2, j - 1 : j + 2].max() > 100 * dark


@pytest.mark.parametrize("roundings", [(0.0, 0.5, 1.0), pytest.param((0.2, 0.9, 1.0), marks=pytest.mark.slow)])
def test_a_curved_blade_spreads_its_spike_into_a_fan_of_the_same_flux(roundings):
    size, centre, N, pitch = (400, 400), (200.0, 200.0), 16.0, 0.056
    r = radii(size, centre, pitch)
    ring = (r > 5) & (r < 10)
    flux = {}
    for rounding in roundings:
        iris = SIX.replace(rounding=rounding)
        line = iris_outline(iris, 1.0, 4000)
        perimeter = np.linalg.norm(line - np.roll(line, -1, axis=0), axis=1).sum()
        E = layer(iris, N, pitch, size, centre, WHITE_NM[::2], GREY[::2])[..., 0]
        flux[rounding] = E[ring].sum(dtype=float) / perimeter
        if 0 < rounding < 1:
            wings = pupil_pattern(iris).wings
            assert isinstance(wings, BladeWings)
            assert wings.length * 6 == pytest.approx(perimeter, rel=1e-5)
    for value in flux.values():
        assert value == pytest.approx(flux[1.0], rel=5e-3)


@pytest.mark.parametrize(("f_number", "iris"), some({(2.0,): (0, 1, 4), (16.0,): (2, 3)}, ()))
def test_resolution_independence(f_number, iris):
    fine = layer(iris, f_number, 0.014, (180, 180), (91.2, 88.6), weights=GREY)
    coarse = layer(iris, f_number, 0.028, (90, 90), (45.6, 44.3), weights=GREY)
    blocks = fine.reshape(90, 2, 90, 2, 3).mean(axis=(1, 3), dtype=float)
    assert np.abs(blocks - coarse).sum() < 2e-3 * coarse.sum()
    bright = coarse > 1e-4 * coarse.max()
    np.testing.assert_allclose(blocks[bright], coarse[bright], rtol=0.02)


def test_shift_by_a_part_of_a_pixel_conserves():
    sums = [
        layer(SIX, 8.0, 0.028, (300, 300), (150 + d, 150 - d), WHITE_NM[::4], GREY[::4]).sum(dtype=float)
        for d in (0.0, 0.13, 0.5, 0.81)
    ]
    np.testing.assert_allclose(sums, sums[0], rtol=2e-4)


@pytest.mark.parametrize(("f_number", "iris"), some({(4.0,): (1, 2, 4), (16.0,): (0, 3)}, ()))
def test_a_picture_is_a_window_on_an_unbounded_one(f_number, iris):
    whole = layer(iris, f_number, 0.028, (300, 200), (40.3, 30.8))
    part = layer(iris, f_number, 0.028, (180, 120), (40.3 - 70, 30.8 - 50))
    np.testing.assert_allclose(part, whole[50:170, 70:250], rtol=1e-5, atol=1e-9 * whole.max())


def test_symmetry_under_half_a_turn_and_mirrors():
    E = layer(Iris(blades=5), 8.0, 0.028, (201, 201), (100.5, 100.5), WHITE_NM[::4], GREY[::4])
    np.testing.assert_allclose(E, E[::-1, ::-1], rtol=1e-4, atol=1e-9 * E.max())
    np.testing.assert_allclose(E, E[:, ::-1], rtol=1e-2, atol=1e-7 * E.max())


def test_a_pixel_in_the_very_middle_of_a_spike_holds_a_number():
    # its distance to the spike is exactly 0
    out = np.zeros((1, 3, 1), np.float32)
    table = np.linspace(0.0, 1.0, 9)[None, :, None]
    one = np.ones(1)
    spikes = SpikeTables(np.zeros(1), 0.0, table, np.full_like(table, 1.0), one, one, 0.125, 1.0)
    blend_blade_wings(np.array([-1.0, 1.0, 2.0]), np.zeros(1), np.full(2, 0.1), spikes, 0.1, 0.2, out)
    assert np.isfinite(out).all()
    assert (out > 0.0).all()


def test_a_mask_of_a_disc_is_the_round_opening():
    at = (np.arange(600) + 0.5) / 300 - 1
    disc = np.clip((1 - np.hypot(at, at[:, None])) * 300 + 0.5, 0, 1)
    few = {"wave": WHITE_NM[::4], "weights": GREY[::4]}
    round_one = layer(Iris(), 8.0, 0.028, (300, 300), **few)
    masked = layer(Iris(), 8.0, 0.028, (300, 300), mask=disc, **few)
    assert isinstance(pupil_pattern(Iris(), disc).wings, FanWings)
    assert np.abs(masked - round_one).sum() < 0.01 * round_one.sum()
    far = radii((300, 300), (150.3, 149.8), 0.028) > 2.5
    assert masked[far].sum() == pytest.approx(round_one[far].sum(), rel=0.1)


def test_a_mask_of_a_slit_sends_its_light_across_the_slit():
    mask = np.zeros((256, 256))
    mask[:, 118:138] = 1.0  # upright slit
    frame = (16.0, 0.028, (301, 301), (150.5, 150.5), WHITE_NM[::4], GREY[::4])
    E = layer(Iris(), *frame, mask=mask)[..., 0]
    assert E[150, 250:].sum() > 50 * E[250:, 150].sum()
    assert E.sum(dtype=float) * 0.028**2 == pytest.approx(GREY[::4, 0].sum(), rel=0.01)
    turned = layer(Iris(rotation_deg=90), *frame, mask=mask)[..., 0]
    assert np.abs(turned.T - E).sum() < 0.02 * E.sum()


def test_darkness_is_black_and_flux_is_linear():
    assert not layer(Iris(), weights=0 * WHITE).any()
    one = layer(SIX)
    np.testing.assert_allclose(layer(SIX, weights=3 * WHITE), 3 * one, rtol=1e-5)
    assert layer(SIX, 4.0, centre=(1e7, -1e7)).max() < 1e-12


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"weights": WHITE[:3]}, "do not fit"),
        ({"wave": WHITE_NM[::-1]}, "rise"),
        ({"weights": np.full_like(WHITE, np.nan)}, "finite"),
        ({"f_number": 0.0}, "larger than 0"),
        ({"pitch": -1.0}, "larger than 0"),
        ({"mask": np.zeros((8, 8))}, "dark everywhere"),
    ],
)
def test_bad_arguments(change, words):
    with pytest.raises(ValueError, match=words):
        layer(Iris(), **change)


@pytest.mark.parametrize("mode", ["draft", "final"])
@pytest.mark.parametrize("lights", [1, 9])
def test_no_flux_is_lost_where_the_core_is_smaller_than_a_pixel(mode, lights):
    """A fast lens in a small picture, against one of many more pixels."""
    found = []
    for size in ((64, 36), (640, 360)):
        project = Project(
            lens="biotar-50-f1.4",
            lights=(Light(field_deg=(0.0, 0.0)),) * lights,
            iris=Iris(),
            camera=Camera(size_px=size),
            quality=Quality(mode=mode, wavelengths=3, ringing="off"),
            output=Output(layers="passes"),
            # no ghosts: the test is about the starburst
            art=Art(rules=(Rule(select="all", enable=False),)),
        )
        (layer,) = (layer for layer in render(project).layers if layer.name == "starburst")
        found.append(layer.pixels.sum(dtype=np.float64) / size[0] ** 2)
    assert found[0] == pytest.approx(found[1], rel=1e-4)


@pytest.mark.parametrize("iris", [SIX, SHAPES[3], Iris()])
def test_threads_change_nothing(iris):
    size, centre = (90, 2 * BAND + 7), (40.3, 70.8)
    alone, together = (
        starburst_layer(pupil_pattern(iris), 8.0, (0.02, 0.02), size, centre, WHITE_NM, GREY, threads=n) for n in (1, 3)
    )
    assert alone.tobytes() == together.tobytes()
