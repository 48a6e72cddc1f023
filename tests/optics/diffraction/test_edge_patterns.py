"""Fresnel patterns from tables of edges and corners: against the transform of each opening, and the knife edge."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.special import fresnel
from whole_bands import band_intensity

from flarewright.model import Iris
from flarewright.optics.diffraction import edge_patterns
from flarewright.optics.diffraction.edge_patterns import (
    CORNER_SAMPLES,
    EDGE_SAMPLES,
    NEARLY_STRAIGHT,
    PROFILE_SAMPLES,
    SMALL_SPREAD,
    Corner,
    averaged,
    corner_of,
    edge_tables,
    gain,
)
from flarewright.optics.diffraction.fresnel import REACH, fresnel_grid
from flarewright.optics.pupil.blade_form import blade_form
from flarewright.optics.pupil.iris import blade_edges, coverage, softened
from flarewright.render.ghosts.ring_tables import SHORTEST, edge_crossing

RADIUS = 2.0
IRISES = [Iris(), Iris(blades=8, rotation_deg=7), Iris(blades=3), Iris(blades=5, rounding=0.5, rotation_deg=11)]


def looked_up(tables, form, scale, x, y):
    """Return the pattern at positions in the stop, mm, by a slow version of the kernel's look-up."""

    def across(beyond):
        count = len(tables.profile)
        return np.interp(beyond / scale * PROFILE_SAMPLES + count // 2, np.arange(count), tables.profile)

    if not len(form.corners):
        return across(np.hypot(x, y) - form.distance)
    towards = np.stack([x * cx + y * cy for cx, cy in form.corners])
    nearest = form.corners[towards.argmax(axis=0)]
    along, beside = towards.max(axis=0), np.abs(x * nearest[..., 1] - y * nearest[..., 0])
    normal, blunt = (math.cos(form.gamma), math.sin(form.gamma)), form.gamma - form.bend
    beyond, other = (along * normal[0] + side * beside * normal[1] - form.offset for side in (1, -1))
    if form.curvature > 0.0:
        back = form.offset - 1.0 / form.curvature
        beyond, other = (
            np.hypot(along - back * normal[0], side * beside - back * normal[1]) - 1 / form.curvature
            for side in (1, -1)
        )
    column = (beyond + other) / (2 * math.cos(blunt)) / scale * CORNER_SAMPLES + tables.first
    row = (beyond - other) / (2 * math.sin(blunt)) / scale * CORNER_SAMPLES
    rows, columns = tables.corner.shape
    near = (column >= 0) & (column < columns - 1) & (row < rows - 1)
    c, r = np.where(near, column, 0.0).astype(int), np.where(near, row, 0.0).astype(int)
    fx, fy = column - c, row - r
    upper, lower = (tables.corner[r + k, c] * (1 - fx) + tables.corner[r + k, c + 1] * fx for k in (0, 1))
    return np.where(near, upper * (1 - fy) + lower * fy, across(beyond))


def own(iris, areas, shares, finer):
    """Return an opening's white-light pattern for a band, by FFT of the whole; `finer` 6: 19 samples a fringe."""
    edges = blade_edges(iris, RADIUS)

    def opening(x, y):
        light = softened(coverage(edges, x, y, 2.0 * float(x[1] - x[0])))
        return light, light

    grid = fresnel_grid(opening, blade_form(edges).distance, RADIUS, (areas.min() / finer,) * 2, (areas.max(),) * 2)
    return grid, sum(h * band_intensity(grid, [(a, a)], np.ones(1)) for a, h in zip(areas, shares, strict=True))


# more than nine colours and 13 samples a fringe do not change the errors
@pytest.mark.parametrize(
    ("number", "colours", "finer"), [(100.0, 9, 3.0), pytest.param(300.0, 13, 6.0, marks=pytest.mark.slow)]
)
@pytest.mark.parametrize(
    "iris", [pytest.param(iris, marks=pytest.mark.slow if k in (1, 2) else ()) for k, iris in enumerate(IRISES)]
)
def test_shared_tables_are_the_openings_own_pattern(iris, number, colours, finer):
    form = blade_form(blade_edges(iris, RADIUS))
    at = np.linspace(-0.9, 0.9, colours)
    areas, shares = RADIUS**2 / number * (1.0 + 0.09 * at), (1.0 - np.abs(at)) / (1.0 - np.abs(at)).sum()
    grid, expected = own(iris, areas, shares, finer)
    scale = math.sqrt(0.5 * float(shares @ areas))
    logs = 0.5 * np.log(areas)
    spread = math.sqrt(float(shares @ logs**2 - (shares @ logs) ** 2))
    tables = averaged(form, scale, spread)
    x, y = np.meshgrid(*grid.at)
    found = looked_up(tables, form, scale, x, y)
    error = found - expected
    seen = np.hypot(x, y) < form.distance + 4.0 * scale
    assert expected[seen].std() > 0.3
    assert np.abs(error[seen]).max() < 0.09
    assert math.sqrt(np.mean(error[seen] ** 2)) < 3e-3
    # what the fringes that are left out take is given back
    light = found.sum() * math.prod(grid.steps)
    assert light * gain(form, scale, tables) == pytest.approx(math.pi * RADIUS**2, rel=2e-4)
    # it lies along the edge, so its fraction of the light is proportional to the scale
    assert abs(gain(form, scale, tables) - 1.0) < 2e-3 * math.sqrt(300.0 / number)
    # hundreds of tables are cached: the kernel's copy is the only one
    assert not tables.corner.size or np.shares_memory(tables.corner, tables.values)


@pytest.mark.parametrize(("colours", "finer"), [(9, 3.0), pytest.param(13, 6.0, marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    "iris", [pytest.param(iris, marks=pytest.mark.slow if k == 2 else ()) for k, iris in enumerate(IRISES)]
)
def test_tables_serve_blades_that_are_just_long_enough(iris, colours, finer):
    """Blades of `SHORTEST` scales per half: the fringes of the whole opening are still those of its corners."""
    form = blade_form(blade_edges(iris, RADIUS))
    at = np.linspace(-0.9, 0.9, colours)
    shortest = SHORTEST if iris.blades else REACH
    widest = (min(form.half_length, form.offset) / shortest) ** 2 / 0.6
    areas, shares = widest / 1.09 * (1.0 + 0.09 * at), (1.0 - np.abs(at)) / (1.0 - np.abs(at)).sum()
    known = np.array([500.0, 600.0]), np.array([widest, widest])
    assert edge_crossing(form, *known, 0.0) is not None
    assert edge_crossing(form, *known, 0.01 * form.offset) is None
    grid, expected = own(iris, areas, shares, finer)
    scale = math.sqrt(0.5 * float(shares @ areas))
    logs = 0.5 * np.log(areas)
    tables = averaged(form, scale, math.sqrt(float(shares @ logs**2 - (shares @ logs) ** 2)))
    x, y = np.meshgrid(*grid.at)
    found = looked_up(tables, form, scale, x, y)
    error = found - expected
    seen = np.hypot(x, y) < form.distance + 4.0 * scale
    assert np.abs(error[seen]).max() < 0.09
    assert math.sqrt(np.mean(error[seen] ** 2)) < 3.5e-3
    light = found.sum() * math.prod(grid.steps)
    assert light * gain(form, scale, tables) == pytest.approx(form.area, rel=1e-3)


def test_the_kernels_profile_is_the_tables():
    tables = averaged(blade_form(blade_edges(Iris(blades=6), RADIUS)), 0.05, 0.02)
    fine = tables.values[tables.corner.size :][: tables.edge_count]
    at = np.linspace(0.0, len(tables.profile) - 1.0, 9973)
    nearest = fine[np.rint(at * (EDGE_SAMPLES // PROFILE_SAMPLES)).astype(int)]
    assert np.abs(nearest - np.interp(at, np.arange(len(tables.profile)), tables.profile)).max() < 3e-3


def test_one_table_serves_all_fresnel_numbers_of_straight_blades():
    form = blade_form(blade_edges(Iris(blades=6), RADIUS))
    one, other = averaged(form, 0.05, 0.021), averaged(form, 0.004, 0.0211)
    assert one is other
    # curved blades: the same, with tables linear in s between powers of two
    curved = blade_form(blade_edges(Iris(blades=6, rounding=0.8), RADIUS))
    assert averaged(curved, 0.05, 0.021) is averaged(curved, 0.051, 0.021)
    assert averaged(curved, 0.05, 0.021) is not averaged(curved, 0.004, 0.021)
    corner = corner_of(curved, 0.06)
    exact = edge_patterns._tables(corner.gamma, corner.blunt, 1 / corner.scale, corner.curvature * corner.scale, 8.0)
    assert np.abs(edge_tables(corner, 8.0).corner - exact.corner).max() < 2e-3
    assert np.abs(edge_tables(corner, 8.0).profile - exact.profile).max() < 1e-3


def test_profile_is_the_knife_edge():
    profile = edge_tables(Corner(0.0, 0.0, 0.0, 0.0)).profile
    w = -(np.arange(len(profile)) - len(profile) // 2) / PROFILE_SAMPLES
    s, c = fresnel(w)
    edge = 0.5 * ((c + 0.5) ** 2 + (s + 0.5) ** 2)
    near = np.abs(w) < 2.0
    # fringes beyond the sixth begin to fade, which affects the pattern slightly further in
    assert np.abs(profile - edge)[near].max() < 0.03
    assert profile[w == 0.0][0] == pytest.approx(0.25, abs=0.01)
    assert profile.max() == pytest.approx(1.370, abs=0.02)
    assert abs(profile[0] - 1.0) < 3e-3
    assert profile[-1] < 1e-4


def test_a_square_corner_is_two_edges():
    tables = edge_tables(corner_of(blade_form(blade_edges(Iris(blades=4), RADIUS)), 0.01))
    rows, columns = tables.corner.shape
    along, beside = np.arange(columns) - tables.first, np.arange(rows)[:, None]
    across = [(along + side * beside) / math.sqrt(2.0) / CORNER_SAMPLES * PROFILE_SAMPLES for side in (1, -1)]
    count = len(tables.profile)
    x, y = (np.interp(place + count // 2, np.arange(count), tables.profile) for place in across)
    # the fade of the FFT pattern is round, that of two edges square
    assert np.abs(tables.corner - x * y).max() < 0.05
    assert math.sqrt(np.mean((tables.corner - x * y) ** 2)) < 5e-3


def test_pixels_average_and_keep_the_light():
    form = blade_form(blade_edges(Iris(blades=7), RADIUS))
    sharp, coarse = averaged(form, 0.02, 0.02), averaged(form, 0.02, 0.02, 1.0)
    assert coarse.profile.max() < sharp.profile.max() - 0.05
    places = np.arange(len(sharp.profile)) - len(sharp.profile) // 2
    wide = np.interp(places, np.arange(len(coarse.profile)) - len(coarse.profile) // 2, coarse.profile)
    assert wide.sum() == pytest.approx(sharp.profile.sum(), rel=1e-3)


@pytest.mark.parametrize("s_mm", [0.02, 0.05, 0.11])
def test_nearly_straight_blades_share_tables_over_an_octave(s_mm):
    """The effect of a weak curvature changes so little over an octave that the octave's middle serves it all."""
    form = blade_form(blade_edges(Iris(blades=6, rounding=0.03), 10.0))
    assert form.curvature * s_mm < NEARLY_STRAIGHT
    corner = corner_of(form, s_mm)
    assert math.frexp(corner.scale)[0] == 0.5
    shared, size = edge_tables(corner), s_mm / form.offset
    exact = edge_patterns._tables(corner.gamma, corner.blunt, 1.0 / size, corner.curvature * size, REACH)
    error = shared.corner - exact.corner
    assert np.abs(error).max() < 2e-3
    assert math.sqrt(np.mean(error**2)) < 3e-4
    assert np.abs(shared.profile - exact.profile).max() < 5e-4


def test_pixels_of_the_same_samples_share_tables():
    form = blade_form(blade_edges(Iris(blades=6), 10.0))
    tables = [averaged(form, 0.05, 0.02, pixel) for pixel in (0.1, 0.11, 0.13, 0.9)]
    assert tables[0] is tables[1]
    assert tables[2] is not tables[3]


@pytest.mark.parametrize("spread", [0.0036, 0.0055, 0.0092, 0.012, 0.1])
def test_rounded_spreads_fade_fringes_alike(spread):
    """Coarse steps of small spreads have no larger error than the finer steps above them, 1.2e-2."""
    form = blade_form(blade_edges(Iris(blades=6), 10.0))
    shared, exact = averaged(form, 0.05, spread), edge_patterns._band(corner_of(form, 0.05), spread, REACH + 0.5)
    error = shared.corner - exact.corner
    assert np.abs(error).max() < (8e-3 if spread < SMALL_SPREAD else 1.5e-2)
    assert math.sqrt(np.mean(error**2)) < 1.5e-3
