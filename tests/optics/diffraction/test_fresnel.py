"""Fresnel diffraction of the iris: analytic knife edge, disc and far field, Parseval, and both limits."""

from __future__ import annotations

import math
import tracemalloc

import numpy as np
import pytest
from scipy.integrate import trapezoid
from scipy.interpolate import RectBivariateSpline
from scipy.ndimage import uniform_filter
from scipy.special import fresnel, j1
from whole_bands import band_intensity

from flarewright.kernels.diffraction.fresnel import open_softly
from flarewright.model import Iris
from flarewright.model.project.light import BlackBody, Lines
from flarewright.optics.colour.spectrum import band_contents
from flarewright.optics.diffraction.collins import (
    FRFT_FILL,
    FRFT_SAMPLES,
    frft_fresnel_number,
    ripple_height,
    stop_to_sensor,
)
from flarewright.optics.diffraction.fresnel import (
    SHADOW,
    band_pattern,
    crop,
    fresnel_grid,
    fresnel_intensity,
    halved_pattern,
)
from flarewright.optics.lens.paraxial import first_order, flare_matrices
from flarewright.optics.lens.paths import ghost_paths
from flarewright.optics.pupil.iris import blade_edges, coverage, resampled, softened, transmission
from flarewright.optics.rays.pack import pack_lens
from flarewright.render.scene.resolve import load_lens

RADIUS = 2.0


def of_blades(edges):
    def opening(x, y):
        light = np.empty((len(y), len(x)), dtype=np.float32)
        open_softly(edges, x, y[:, 0], light)
        return light, light

    return opening


def blades(iris):
    return of_blades(blade_edges(iris, RADIUS))


def square(half):
    """A square opening: four blades."""
    edges = blade_edges(Iris(blades=4), RADIUS)
    edges[:, 2] = half
    edges[:, :2] = np.round(edges[:, :2])
    return of_blades(edges)


def diffracted(opening, fresnel_number, reach=1.7 * RADIUS, finer=9.0):
    """Return a pattern and its fringe scale; a grid for areas down to a ninth has 24 samples a fringe instead of 8."""
    area = RADIUS**2 / fresnel_number
    grid = fresnel_grid(opening, reach, RADIUS, (abs(area) / finer,) * 2, (abs(area),) * 2)
    return grid, fresnel_intensity(grid, (area, area)), math.sqrt(abs(area) / 2.0)


def white(grid, area):
    """Return the few fringes of white light at one Fresnel area."""
    return band_intensity(grid, [(area, area)], np.ones(1))


def slit_field(at, half, scale):
    """Return the analytic wave behind a slit: the difference of two Fresnel integrals."""
    (s1, c1), (s2, c2) = fresnel((at + half) / scale), fresnel((at - half) / scale)
    return ((c1 - c2) + 1j * (s1 - s2)) * np.exp(-0.25j * math.pi) / math.sqrt(2.0)


def unlike_slits(fresnel_number, finer):
    """Return rms and largest error of a square opening's pattern against the product of two slits."""
    grid, found, scale = diffracted(square(1.5), fresnel_number, 1.5, finer)
    x, y = (np.abs(slit_field(at, 1.5, scale)) ** 2 for at in grid.at)
    seen = np.abs(grid.at[0]) < 1.5 + 4.0 * scale
    error = (found - y[:, None] * x)[np.ix_(seen, seen)]
    return math.sqrt(np.mean(error**2)), np.abs(error).max()


@pytest.mark.parametrize(
    ("fresnel_number", "mean", "most"), [(3.0, 3e-4, 4e-3), (40.0, 8e-4, 5e-3), (-40.0, 8e-4, 5e-3)]
)
def test_square_is_the_product_of_two_analytic_slits(fresnel_number, mean, most):
    error = unlike_slits(fresnel_number, 9.0)
    assert error[0] < mean
    assert error[1] < most


@pytest.mark.parametrize("number", [300.0, pytest.param(700.0, marks=pytest.mark.slow)])
def test_grids_of_a_picture_leave_out_the_finest_ripples_only(number):
    # eight samples a fringe do not resolve ripples at a sixteenth of one
    assert unlike_slits(40.0, 1.0)[0] < 0.03
    coarse, fine = (unlike_slits(number, finer)[0] for finer in (1.0, 9.0))
    assert coarse < 0.03
    assert fine < 0.5 * coarse + 0.002


def test_a_grid_as_fine_as_pixels_show_holds_what_pixels_see():
    """Second method: two analytic slits, averaged over texels of four samples: half a fringe, and two fringes wide."""
    for texels_a_scale in (2.0, 0.5):
        area = RADIUS**2 / 200.0
        scale = math.sqrt(area / 2.0)
        shown = scale / texels_a_scale / 4.0
        grid = fresnel_grid(square(1.5), 1.5, RADIUS, (area, area), (area, area), (shown, shown))
        fine = fresnel_grid(square(1.5), 1.5, RADIUS, (area, area), (area, area))
        assert grid.steps[0] == pytest.approx(max(shown, fine.steps[0]))
        found = white(grid, area)
        assert grid.light * math.prod(grid.steps) == pytest.approx(9.0, rel=1e-3)
        # each texel of the slit from 16 places within it, along a line through the middle
        count = len(grid.at[0]) // 4 * 4
        at = (grid.at[0][:count, None] + grid.steps[0] * (np.arange(4) - 1.5) / 4.0).reshape(-1, 16).mean(axis=1)
        inside = (grid.at[0][:count, None] + grid.steps[0] * (np.arange(4) - 1.5) / 4.0).reshape(-1, 16)
        expected = (np.abs(slit_field(inside, 1.5, scale)) ** 2).mean(axis=1)
        middle = len(grid.at[1]) // 2
        row = found[middle - 8 : middle + 8, :count].mean(axis=0).reshape(-1, 4).mean(axis=1)
        row /= row[np.abs(at) < 0.7].mean() / expected[np.abs(at) < 0.7].mean()
        seen = np.abs(at) < 1.5 + 3.0 * scale
        assert math.sqrt(np.mean((row - expected)[seen] ** 2)) < 0.008
        # a step there misses the rings by several times that
        step = np.clip((1.5 - np.abs(at)) / (4.0 * grid.steps[0]) + 0.5, 0.0, 1.0)
        assert math.sqrt(np.mean((step - expected)[seen] ** 2)) > 0.035


def test_edge_of_a_wide_opening_is_the_analytic_knife_edge():
    grid, found, scale = diffracted(square(RADIUS), 1000.0, RADIUS)
    middle = len(grid.at[1]) // 2
    w = (RADIUS - grid.at[0]) / scale
    s, c = fresnel(w)
    edge = 0.5 * ((c + 0.5) ** 2 + (s + 0.5) ** 2)
    near = (w > -5.0) & (w < 8.0)
    # ripples of the three other edges: 1 / (pi w) of the wave, w at least 40 scales away
    ripple = 2.0 * sum(math.sqrt(0.5) / math.pi / (far / scale) for far in (RADIUS, RADIUS, 2.0 * RADIUS))
    row, w = (0.5 * (found[middle] + found[middle - 1]))[::-1], w[::-1]
    near = near[::-1]
    assert np.abs(row - edge[::-1])[near].max() < ripple
    # textbook values: a quarter at the edge, 1.37 at the first maximum, w = 1.217
    assert np.interp(0.0, w, row) == pytest.approx(0.25, abs=0.5 * ripple)
    assert row[near].max() == pytest.approx(1.370, abs=ripple)
    assert w[near][np.argmax(row[near])] == pytest.approx(1.217, abs=0.1)


@pytest.mark.parametrize("fresnel_number", [2.0, 3.0, 7.5, 30.0])
def test_middle_of_a_disc_is_its_closed_form(fresnel_number):
    """4 sin^2(pi N_F / 2): dark for even Fresnel numbers, four times the open light for odd ones."""
    grid, found, _ = diffracted(blades(Iris()), fresnel_number)
    k = len(grid.at[0]) // 2
    middle = found[k - 1 : k + 1, k - 1 : k + 1].mean()
    assert middle == pytest.approx(4.0 * math.sin(0.5 * math.pi * fresnel_number) ** 2, abs=0.07)


def test_small_fresnel_numbers_tend_to_the_airy_disc():
    number = 0.1
    grid, found, _ = diffracted(blades(Iris()), number, RADIUS, 1.0)
    r = np.hypot(grid.at[0], grid.at[1][:, None]) / RADIUS
    near = r < 1.5 / number
    v = 2.0 * math.pi * number * r[near]
    airy = (math.pi * number) ** 2 * (2.0 * j1(v) / v) ** 2
    # the wave's curvature over the opening is pi N_F, which the intensity contains squared
    assert np.abs(found[near] - airy).max() < 0.02 * airy.max()
    # first zero at 1.22 lambda L / (2 h): 0.61 / N_F radii
    row = found[len(found) // 2]
    ring = (grid.at[0] > 0.4 * RADIUS / number) & (grid.at[0] < 0.9 * RADIUS / number)
    assert grid.at[0][ring][np.argmin(row[ring])] == pytest.approx(0.61 * RADIUS / number, rel=0.02)


# each opening, and two Fresnel numbers; the knife edge has a large one, which costs most
PARSEVAL = [(0, 1.5), (1, 1.5), (2, 1.5), (0, 60.0)]


@pytest.mark.parametrize(
    ("iris", "fresnel_number"),
    [
        pytest.param(iris, number, marks=() if (k, number) in PARSEVAL else pytest.mark.slow)
        for number in (1.5, 60.0, 5000.0)
        for k, iris in enumerate((Iris(), Iris(blades=5, rotation_deg=11), Iris(blades=6, rounding=0.4)))
    ],
)
def test_parseval_and_what_is_kept(iris, fresnel_number):
    opening = blades(iris)
    grid, found, scale = diffracted(opening, fresnel_number)
    _, light = opening(grid.at[0], grid.at[1][:, None])
    # the light of the opening, for any propagation
    assert found.sum(dtype=float) == pytest.approx(light.sum(), rel=0.01)
    again = fresnel_intensity(grid, (0.3 * RADIUS**2 / fresnel_number,) * 2)
    assert found.sum(dtype=float) == pytest.approx(again.sum(dtype=float), rel=1e-5)
    assert light.sum() * math.prod(grid.steps) == pytest.approx(math.pi * RADIUS**2, rel=2e-3)
    reach = 1.7 * RADIUS + min(SHADOW * scale, 2.0 * RADIUS)
    kept, box = crop(grid, found, ((-reach, reach),) * 2)
    # the crop restores the light that it cuts off, which is little
    assert kept.sum(dtype=float) == pytest.approx(light.sum(), rel=1e-5)
    assert box[0][1] >= min(reach, 0.5 * len(grid.at[0]) * grid.steps[0]) - 0.51 * grid.steps[0]
    assert box[0][0] == pytest.approx(-box[0][1])
    middle = len(kept) // 2, len(found) // 2
    assert kept[middle[0], middle[0]] / found[middle[1], middle[1]] == pytest.approx(
        1.0, abs=0.06 if fresnel_number < 2 else 0.02
    )
    for times in ((1, 0), (2, 3)):
        coarse, wide = halved_pattern(kept, box, times)
        cell = math.prod(high - low for low, high in wide) / coarse.size
        at = [
            low + (np.arange(n) + 0.5) * (high - low) / n
            for (low, high), n in zip(wide, coarse.shape[::-1], strict=True)
        ]
        assert abs(coarse.sum(axis=0) @ at[0]) + abs(coarse.sum(axis=1) @ at[1]) < 2e-2 * RADIUS * coarse.sum()
        assert coarse.sum(dtype=float) * cell == pytest.approx(light.sum() * math.prod(grid.steps), rel=1e-5)
        assert max(coarse[0].max(), coarse[-1].max(), coarse[:, 0].max(), coarse[:, -1].max()) == 0.0


@pytest.mark.parametrize("least", [10.0, pytest.param(30.0, marks=pytest.mark.slow)])
def test_large_fresnel_numbers_tend_to_the_geometric_shadow(least):
    """Fringes finer than the resolution leave no trace."""
    opening, errors = blades(Iris(blades=6)), []
    for number in (least, 10.0 * least, 100.0 * least):
        # the default grid has eight samples a fringe instead of 24
        grid, found, _ = diffracted(opening, number, finer=1.0 if least < 30.0 else 9.0)
        _, light = opening(grid.at[0], grid.at[1][:, None])
        kept, _ = crop(grid, found, ((-3.0 * RADIUS, 3.0 * RADIUS),) * 2)
        shadow, _ = crop(grid, np.asarray(light, dtype=np.float32), ((-3.0 * RADIUS, 3.0 * RADIUS),) * 2)
        look = [uniform_filter(pattern, round(0.2 * RADIUS / grid.steps[0])) for pattern in (kept, shadow)]
        errors.append(float(np.abs(look[0] - look[1]).mean()) / float(look[1].mean()))
    # light that moves within fringes of width 1 / sqrt(N_F) is of that order
    assert errors[1] < 0.5 * errors[0]
    assert errors[2] < 0.4 * errors[1]
    assert errors[2] < 0.01


@pytest.mark.parametrize(("finest", "count"), [(150.0, 27), pytest.param(600.0, 53, marks=pytest.mark.slow)])
def test_white_patterns_are_the_fringes_that_a_band_of_colours_leaves(finest, count):
    opening, scale = square(1.5), math.sqrt(RADIUS**2 / 60.0 / 2.0)
    grid = fresnel_grid(opening, 1.5, RADIUS, (RADIUS**2 / finest,) * 2, (RADIUS**2 / 40.0,) * 2)
    row = len(grid.at[1]) // 2
    areas = RADIUS**2 / 60.0 * np.linspace(0.87, 1.13, count)
    weights = 1.0 - np.abs(np.linspace(-1.0, 1.0, count))
    shares = weights / weights.sum()
    found = [
        sum(w * pattern(a)[row] for w, a in zip(shares, areas, strict=True))
        for pattern in (lambda a: fresnel_intensity(grid, (a, a)), lambda a: white(grid, a))
    ]
    assert np.abs(found[1] - found[0]).max() < 0.02
    # white light keeps the fringes near an edge and loses the far ones
    one, faded = fresnel_intensity(grid, (areas[count // 2],) * 2)[row], white(grid, areas[count // 2])[row]
    near = np.abs(np.abs(grid.at[0]) - 1.5) < 2.0 * scale
    assert np.sqrt(np.mean((faded - one)[near] ** 2)) < 0.25 * np.std(one[near])
    middle = np.abs(grid.at[0]) < 3.0 * scale
    assert np.std(faded[middle]) < 0.6 * np.std(one[middle])


def band(number, width, ratio=1.0, count=41):
    """Return Fresnel areas and shares of a triangular band, `width` of its mean wide."""
    at = np.linspace(-1.0, 1.0, count)
    areas = RADIUS**2 / number * (1.0 + 0.5 * width * at)
    return np.column_stack([areas, ratio * areas]), (1.0 - np.abs(at)) / (1.0 - np.abs(at)).sum()


@pytest.mark.parametrize(
    ("width", "ratio", "number"),
    [
        (0.1, 1.0, 200.0),
        pytest.param(0.16, 2.5, 200.0, marks=pytest.mark.slow),
        (0.16, -1.0, 200.0),
        *(
            pytest.param(width, ratio, 400.0, marks=pytest.mark.slow)
            for ratio in (1.0, 2.5, -1.0)
            for width in (0.1, 0.16)
        ),
    ],
)
def test_one_transform_holds_the_light_of_a_band(width, ratio, number):
    """Second method: the sum of the intensities of all colours of the band, each by its own FFT."""
    areas, shares = band(number, width, ratio, count=21 if number < 400.0 else 41)
    sides = tuple(np.abs(areas).min(axis=0)), tuple(np.abs(areas).max(axis=0))
    grid = fresnel_grid(blades(Iris(blades=3)), RADIUS, RADIUS, *sides)
    found = band_intensity(grid, areas, shares)
    each = [band_intensity(grid, areas[k : k + 1], np.ones(1)) * shares[k] for k in range(len(shares))]
    expected = np.sum(each, axis=0, dtype=float)
    _, light = blades(Iris(blades=3))(grid.at[0], grid.at[1][:, None])
    reach = 8.0 * math.sqrt(areas.max() / 2) / np.array(grid.steps[::-1])
    edge = uniform_filter((np.abs(light - 0.5) < 0.49).astype(float), np.round(reach).astype(int)) > 0
    error = found - expected
    assert math.sqrt(np.mean(error[edge] ** 2)) < 3e-3
    # single samples deep in corners reach 0.026, where the steps of x and y differ most
    assert np.quantile(np.abs(error), 0.9999) < 0.02
    assert np.abs(error).max() < 0.03
    assert expected[edge].std() > 0.3
    # the light missing in the shadow is a small part of it, and almost nothing of the total
    shadow = light == 0.0
    assert expected[shadow].sum() * 0.9 < found[shadow].sum() < expected[shadow].sum()
    assert found.sum(dtype=float) == pytest.approx(expected.sum(), rel=2e-3)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_part_of_a_pattern_is_cut_out_of_all_of_it(sign):
    """Second method: the whole pattern, summed and cropped; for a whole opening and for a window of it."""
    areas, shares = band(500.0, 0.1, 0.7 * sign)
    opening = blades(Iris(blades=5, rotation_deg=11))
    sides = tuple(np.abs(areas).min(axis=0)), tuple(np.abs(areas).max(axis=0))
    for place in (None, ((-0.5, 0.9), (0.6, 2.0))):
        grid = fresnel_grid(opening, RADIUS, RADIUS, *sides, (0.0, 0.0), place)
        window = ((-0.4, 0.8), (0.7, 1.9))
        found, box = band_pattern(grid, areas, shares, window)
        expected, at = crop(grid, band_intensity(grid, areas, shares), window)
        assert box == at
        assert found.std() > 0.1
        np.testing.assert_allclose(found, expected, atol=2e-5)


def test_colours_that_run_alike_are_joined(monkeypatch):
    """Against the sum over colours, for a wide band of a light by the nanometre."""
    areas, shares = band(200.0, 0.16, count=80)
    opening = blades(Iris(blades=6))
    grid = fresnel_grid(opening, RADIUS, RADIUS, (areas[:, 0].min(),) * 2, (areas[:, 0].max(),) * 2)
    joined = band_intensity(grid, areas, shares)
    monkeypatch.setattr("flarewright.optics.diffraction.fresnel.ALIKE", 1e-6)
    each = band_intensity(grid, areas, shares)
    assert 0.0 < np.abs(joined - each).max() < 1e-3


@pytest.mark.parametrize("number", [250.0, pytest.param(500.0, marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    "window",
    [
        ((-0.9, 0.5), (-2.3, -1.1)),
        pytest.param(((0.6, 2.4), (-0.4, 0.8)), marks=pytest.mark.slow),
        ((0.9, 2.2), (0.2, 2.4)),
    ],
)
def test_a_window_shows_what_all_of_the_opening_makes_there(window, number):
    """Second method: the whole opening, sampled equally finely; only for white light, which has few fringes."""
    areas, shares = band(number, 0.15)
    # 20 samples a fringe: with eight, the grid position changes values by up to 0.03
    sides = (areas[:, 0].min() / 6.0,) * 2, (areas[:, 0].max(),) * 2
    opening = blades(Iris(blades=5, rotation_deg=11))
    whole, part = (fresnel_grid(opening, RADIUS, RADIUS, *sides, (0.0, 0.0), place) for place in (None, window))
    assert part.spectrum.size < 0.6 * whole.spectrum.size
    assert whole.whole
    assert not part.whole
    patterns = [crop(grid, band_intensity(grid, areas, shares), window) for grid in (whole, part)]
    # the grids differ: compare along lines, by cubic interpolation
    lines = [np.linspace(low + 0.1, high - 0.1, 400) for low, high in window]
    seen = []
    for values, box in patterns:
        at = [
            low + (np.arange(n) + 0.5) * (high - low) / n
            for (low, high), n in zip(box, values.shape[::-1], strict=True)
        ]
        seen.append(RectBivariateSpline(at[1], at[0], values)(lines[1], lines[0]))
    assert seen[0].std() > 0.01
    # crops restore the light that they cut off, which for the whole is more than its fringes lose
    scale = float((seen[0] * seen[1]).sum() / (seen[1] ** 2).sum())
    error = seen[1] * scale - seen[0]
    assert np.abs(error).max() < 0.015
    assert math.sqrt(np.mean(error**2)) < 2.5e-3


def test_a_window_within_an_opening_that_it_knows_all_of_is_no_brighter():
    """Few fringes: its grid cuts nothing off, yet most of the light lies beside the window."""
    areas, shares = band(60.0, 0.15)
    sides = (areas[:, 0].min(),) * 2, (areas[:, 0].max(),) * 2
    window = ((-0.8, 0.8), (-0.8, 0.8))
    grid = fresnel_grid(blades(Iris(blades=6)), RADIUS, RADIUS, *sides, (0.0, 0.0), window)
    assert min(float(at.max()) for at in grid.at) > RADIUS
    seen, _ = band_pattern(grid, areas, shares, window)
    expected = band_intensity(grid, areas, shares)
    inside = np.ix_(*(np.abs(at) < 0.7 for at in grid.at[::-1]))
    assert seen[1:-1, 1:-1].mean() == pytest.approx(expected[inside].mean(), rel=0.02)
    assert expected[inside].mean() == pytest.approx(1.0, abs=0.05)


def test_either_sign_is_the_same_light():
    opening = blades(Iris(blades=5))
    grid, one, _ = diffracted(opening, 100.0, finer=1.0)
    np.testing.assert_allclose(fresnel_intensity(grid, (-(RADIUS**2) / 100.0,) * 2), one, atol=1e-4)


def test_two_meridians_are_two_slits():
    area = (RADIUS**2 / 50.0, -(RADIUS**2) / 400.0)
    most = abs(area[0]), abs(area[1])
    # twice the samples, as of lines, whose fringes do not end
    grid = fresnel_grid(square(1.5), 1.5, RADIUS, (most[0] / 4.0, most[1] / 4.0), most)
    found = fresnel_intensity(grid, area)
    x, y = (np.abs(slit_field(at, 1.5, math.sqrt(abs(a) / 2.0))) ** 2 for at, a in zip(grid.at, area, strict=True))
    assert np.sqrt(np.mean((found - y[:, None] * x) ** 2)) < 0.012


@pytest.mark.parametrize(
    ("sign", "rounding"),
    [
        (1.0, 0.4),
        (-1.0, 0.0),
        pytest.param(1.0, 0.0, marks=pytest.mark.slow),
        pytest.param(-1.0, 0.4, marks=pytest.mark.slow),
    ],
)
def test_each_meridian_has_samples_for_its_own_fringes(rounding, sign):
    """Second method: as many samples along both as the finer one asks for."""
    opening = blades(Iris(blades=6, rotation_deg=7, rounding=rounding))
    areas = np.array([[RADIUS**2 / 450.0, sign * RADIUS**2 / 50.0]])
    most = tuple(np.abs(areas[0]).tolist())
    grid = fresnel_grid(opening, 1.2 * RADIUS, RADIUS, most, most)
    fine = fresnel_grid(opening, 1.2 * RADIUS, RADIUS, (min(most),) * 2, most)
    assert grid.steps[1] == pytest.approx(3.0 * grid.steps[0], rel=1e-6)
    assert fine.steps == pytest.approx((grid.steps[0],) * 2, rel=1e-6)
    found, expected = (band_intensity(one, areas, np.ones(1)) for one in (grid, fine))
    inside = np.abs(grid.at[1]) < 1.2 * RADIUS
    seen = RectBivariateSpline(fine.at[1], fine.at[0], expected)(grid.at[1][inside], grid.at[0])
    assert expected.std() > 0.3
    assert np.sqrt(np.mean((found[inside] - seen) ** 2)) < 5e-3
    assert found.sum(dtype=float) * math.prod(grid.steps) == pytest.approx(
        expected.sum(dtype=float) * math.prod(fine.steps), rel=1e-3
    )


def test_an_opening_is_sampled_as_its_coverage_says():
    """Second method: NumPy's, with a border as wide in all directions."""
    for iris in (Iris(blades=7, rotation_deg=3), Iris(blades=5, rounding=0.5), Iris()):
        edges = blade_edges(iris, RADIUS)
        x = np.linspace(-1.2, 1.2, 151) * RADIUS
        found = np.empty((151, 151), dtype=np.float32)
        open_softly(edges, x, x, found)
        expected = softened(coverage(edges, x, x[:, None], 2.0 * float(x[1] - x[0])))
        assert np.abs(found - expected).max() < 5e-3
        assert 0.0 < np.mean((found > 0.0) & (found < 1.0)) < 0.1


def test_frft_is_the_fractional_fourier_transform():
    """Second method: the integral of the transform in Ozaktas' plane, and Hullin's order."""
    wave, f_number = 550.0, 16.0
    phi = 0.5 * math.pi * 0.15 * (wave / 400.0) * (f_number / 18.0)
    n = FRFT_SAMPLES
    half = 0.5 * FRFT_FILL * math.sqrt(n)  # of the slit, in the plane's units
    u = np.linspace(-half, half, 20001)
    at = np.linspace(-1.2, 1.2, 51) * half  # in the opening; the transform lies at cos(phi) times it
    image = at * math.cos(phi)
    kernel = np.exp(1j * math.pi * (u**2 / math.tan(phi) - 2.0 * u * image[:, None] / math.sin(phi)))
    transform = trapezoid(kernel, u, axis=1) / math.sqrt(math.sin(phi))
    expected = np.abs(transform) ** 2 * math.cos(phi)
    number = float(frft_fresnel_number(np.array([wave]), f_number)[0])
    field = slit_field(at / half, 1.0, math.sqrt(0.5 / number))
    np.testing.assert_allclose(np.abs(field) ** 2, expected, atol=2e-3)
    # longer wavelengths and smaller openings ring more
    numbers = frft_fresnel_number(np.array([400.0, 700.0]), f_number)
    assert numbers[0] > numbers[1] > frft_fresnel_number(np.array([700.0]), 22.0)[0]
    assert frft_fresnel_number(np.array([700.0]), 250.0)[0] == 1.0


def test_matrices_of_a_ghost_tell_its_fresnel_length():
    """Second method: the ghost's matrices behind the stop, and traced rays."""
    lens = load_lens("heliar-tronnier")
    order = first_order(lens, 8.0)
    packed = pack_lens(lens, order, (None,) * len(lens.rows), np.array([486.0, 587.56]))
    for path in ghost_paths(lens, "all"):
        for nearness in (0.0, 1e-3):
            way = stop_to_sensor(packed, path, nearness)[0]
            Ma, Ms = flare_matrices(lens, path, 587.56, packed.sensor_z)
            # a ray of the light at height 1 in the first plane
            y, slope = Ma @ (1.0, nearness)
            A, B = Ms[0]
            magnification = A + B * slope / y
            assert way.magnification[1] == pytest.approx(np.full(2, magnification), rel=1e-6)
            # the stop stands in air
            assert way.length[1] == pytest.approx(np.full(2, B / magnification), rel=1e-6)


def test_bands_share_out_all_light():
    nodes = np.array([440.0, 500.0, 560.0, 650.0])
    bands = band_contents(BlackBody(temperature_k=4000.0), nodes)
    for node, (waves, shares) in zip(nodes, bands, strict=True):
        assert shares.sum() == pytest.approx(1.0)
        assert waves.min() <= node <= waves.max()
    # an inner band ends at its neighbours
    assert bands[1][0].min() > 440.0
    assert bands[1][0].max() < 560.0
    lines = Lines(lines=((500.0, 1.0), (560.0, 3.0)))
    for (waves, shares), wave in zip(band_contents(lines, np.array([500.0, 560.0])), (500.0, 560.0), strict=True):
        assert (waves.tolist(), shares.tolist()) == ([wave], [1.0])


def test_an_image_resampled_keeps_its_light_and_its_side():
    image = np.zeros((6, 8), dtype=np.float32)
    image[0, 7] = 1.0  # up and right
    at = (np.arange(400) + 0.5) * 0.01 - 2.0
    found = resampled(image, 1.5, at, at)
    assert found.sum() * 0.01**2 == pytest.approx((3.0 / 8) * (3.0 / 6), rel=1e-3)
    assert found[at > 1.0][:, at > 1.1].max() == pytest.approx(1.0, abs=0.1)
    assert found[at < 0.5].max() == 0.0


@pytest.mark.parametrize(("pixels", "step"), [((5, 9), 0.02), ((40, 50), 0.09), ((200, 160), 0.11)])
def test_samples_of_an_image_are_its_means_over_triangles(pixels, step):
    """Against sums over many points of the linear interpolation, of windows inside and across the image's border."""
    image = np.random.default_rng(3).random(pixels, dtype=np.float32)
    x, y = 0.3 + step * np.arange(11), -1.3 + step * np.arange(9)
    part = (np.arange(400) + 0.5) / 200.0 - 1.0
    shares = (1.0 - np.abs(part)) / 200.0

    def means(at, count):
        # linear interpolation is a matrix of hats around the pixels' centres
        places = (at[:, None] + step * part + 1.0) * 0.5 * count - 0.5
        return np.maximum(1.0 - np.abs(places[..., None] - np.arange(count)), 0.0).transpose(0, 2, 1) @ shares

    wanted = means(y, pixels[0]) @ image[::-1] @ means(x, pixels[1]).T
    assert resampled(image, 1.0, x, y) == pytest.approx(wanted, abs=2e-4)
    assert not resampled(image, 1.0, x + 5.0, y).any()


def test_a_large_image_is_resampled_and_rotated_without_copies_of_its_points():
    image = np.ones((1000, 1000), dtype=np.float32)
    at = np.linspace(-1.2, 1.2, 500)
    tracemalloc.start()
    resampled(image, 1.0, at, at)
    small = tracemalloc.get_traced_memory()[1]
    tracemalloc.reset_peak()
    wide = np.linspace(-1.4, 1.4, 1400)
    seen = transmission(Iris(rotation_deg=30.0), 1.0, wide, wide[:, None], mask=image)
    large = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    # the result and one pass; the result, the image with its border, and some lines
    assert small < 3 * image.nbytes
    assert large < seen.nbytes + 2 * image.nbytes + 0.8 * seen.nbytes


@pytest.mark.parametrize("blur", [0.05, 0.1, 0.3, 0.7, 1.0, 1.5, 2.5, 4.0, 7.0, 12.0, 20.0])
def test_ripples_of_a_knife_edge_are_as_high_as_told_once_they_are_blurred(blur):
    at = np.arange(-60.0, 60.0, 0.005)
    sine, cosine = fresnel(at)
    apart = 0.5 * ((cosine + 0.5) ** 2 + (sine + 0.5) ** 2) - (at > 0.0)
    count = max(round(blur / 0.005), 1)
    across = (np.arange(count) + 0.5) / count * 2.0 - 1.0
    highest = []
    for weights in (np.ones(count), np.sqrt(1.0 - across**2)):
        blurred = np.convolve(apart, weights / weights.sum(), "same")
        highest.append(blurred[np.abs(at) < 25.0].max())
    assert max(highest) - 1e-3 < ripple_height(blur) < 1.35 * max(highest)
