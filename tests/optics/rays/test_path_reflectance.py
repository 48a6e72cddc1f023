"""Coatings over wavelength: against traced rays, and against films computed one by one."""

from __future__ import annotations

import numpy as np
import pytest

from flarewright.kernels.tracing.sequential import ALIVE, REL, WEIGHT
from flarewright.model import D65, AsLens, Everywhere, QuarterWave, Standard
from flarewright.optics.coatings.thin_film import film_stack, stack_reflectance
from flarewright.optics.colour.spectrum import hats
from flarewright.optics.lens.dispersion import refractive_index
from flarewright.optics.lens.paraxial import first_order
from flarewright.optics.lens.paths import ghost_path, sensor_path
from flarewright.optics.rays.bundle import trace_points
from flarewright.optics.rays.pack import SensorMirror, facing, pack_lens, resolve_coatings
from flarewright.optics.rays.path_reflectance import (
    CURVE_NM,
    band_curves,
    coating_curves,
    path_spectra,
    products_between,
    spectra_of_rays,
)
from flarewright.optics.rays.pupil_region import find_region
from flarewright.render.scene.resolve import load_lens

FILM = Everywhere(coating=QuarterWave(center_wavelength_nm=550.0))
TILT = -0.12
SEVEN_NM = tuple(np.linspace(420.0, 680.0, 7).tolist())


def banded(lens, coatings, sensor=None, waves=SEVEN_NM):
    return band_curves(coating_curves(lens, coatings, sensor), D65(), waves)


@pytest.mark.parametrize("name", ["tessar-brendel", "anamorphic-heliar-2x"])
@pytest.mark.parametrize(("first", "second"), [(1, 0), (3, 2), (-1, 0)])
def test_a_ray_passes_what_its_curve_says(name, first, second):
    """Return the product of R and T of a traced ray at each of nine wavelengths; some mirrors are coated."""
    lens = load_lens(name)
    waves = np.linspace(410.0, 690.0, 9)
    coatings = resolve_coatings(lens, FILM)
    packed = facing(pack_lens(lens, first_order(lens), coatings, waves), np.eye(2))
    curves = banded(lens, coatings)
    rows = [k for k, coating in enumerate(coatings) if coating is not None]
    path = ghost_path(lens, rows[first], rows[second])
    region = find_region(packed, path, TILT, 4.0)
    assert region is not None
    x0, x1, y0, y1 = region.box
    points = np.stack([g.ravel() for g in np.meshgrid(np.linspace(x0, x1, 7), np.linspace(y0, y1, 9))], axis=1)
    rays = np.stack([trace_points(packed, w, path, TILT, points) for w in range(len(waves))])
    lit = ((rays[..., ALIVE] > 0.0) & (rays[..., REL] <= 1.0)).all(axis=0)
    assert lit.sum() >= 3
    middle = len(waves) // 2
    for ray in np.flatnonzero(lit):
        found = spectra_of_rays(packed, path, TILT, curves, points[[ray]], middle)
        assert found is not None
        np.testing.assert_array_equal(*found.passed)
        reported, carried = np.interp(waves, CURVE_NM, found.passed[0]), rays[:, ray, WEIGHT]
        # the only difference is that rays diverge with the colour
        assert reported[middle] == pytest.approx(carried[middle], rel=5e-3)
        assert np.abs(reported - carried).max() < 0.012 * carried.max()
    # of several rays: means of every other one, without those that end and without the last of an odd number
    ended = np.flatnonzero(rays[middle, :, ALIVE] == 0.0)
    chosen = np.insert(np.flatnonzero(lit)[:3], 1, ended[:1])
    both = spectra_of_rays(packed, path, TILT, curves, points[chosen], middle)
    alone = [spectra_of_rays(packed, path, TILT, curves, points[[ray]], middle) for ray in np.flatnonzero(lit)[:2]]
    assert both is not None
    np.testing.assert_allclose(both.passed, [one.passed[0] for one in alone], rtol=1e-12)


def films_of(lens, coatings):
    """Return a function for R of a row from its films, at `CURVE_NM`: not from tables."""
    media = [None]
    for row in lens.rows:
        media.append(media[-1] if row is lens.rows[lens.stop_row] else row.medium)

    def reflected(row: int, square) -> np.ndarray:
        n_d = [1.0 if medium is None else medium.n_d for medium in media[row : row + 2]]
        films = film_stack(coatings[row], *n_d)
        low, high = (refractive_index(medium, CURVE_NM) for medium in media[row : row + 2])
        if n_d[0] > n_d[1]:
            low, high, films = high, low, (films[0][::-1], films[1][::-1])
        return stack_reflectance(low, high, *films, CURVE_NM, np.sqrt(1.0 - square))

    return reflected


def test_a_curve_is_the_product_of_its_films():
    lens = load_lens("tessar-brendel")
    coatings = resolve_coatings(lens, FILM)
    curves, reflected = banded(lens, coatings), films_of(lens, coatings)
    path = ghost_path(lens, 7, 2)
    random = np.random.default_rng(5)
    squares = random.uniform(0.0, 0.5, (2, len(path.rows)))
    got = path_spectra(curves, [path], squares).passed[0]
    expected = np.zeros(len(CURVE_NM))
    for ray in squares:
        part = np.ones(len(CURVE_NM))
        for row, action, square in zip(path.rows, path.actions, ray, strict=True):
            if row == lens.stop_row:
                continue
            r = reflected(int(row), square)
            part *= r if action == 1 else 1.0 - r
        expected += 0.5 * part
    np.testing.assert_allclose(got, expected, rtol=0.0, atol=5e-4 * expected.max())


@pytest.mark.parametrize("square", [0.02, 0.045, 0.08])
def test_what_films_reflect_near_their_zero_is_right_too(square):
    """A light of few wavelengths may have no others; lines between the tables' angles make P up to 10 % too large."""
    lens = load_lens("flektogon-35")
    coatings = resolve_coatings(lens, Everywhere(coating=Standard(name="early-multicoat")))
    curves, reflected = banded(lens, coatings), films_of(lens, coatings)
    path = ghost_path(lens, 3, 1)
    got = path_spectra(curves, [path], np.full((1, len(path.rows)), square)).passed[0]
    expected = np.ones(len(CURVE_NM))
    for row, action in zip(path.rows, path.actions, strict=True):
        if row != lens.stop_row:
            r = reflected(int(row), square)
            expected *= r if action == 1 else 1.0 - r
    assert expected.min() < 1e-3 * expected.max()
    np.testing.assert_allclose(got, expected, rtol=2e-3)


def test_mirrors_reflect_at_the_angles_of_each_wavelength():
    lens = load_lens("tessar-brendel")
    coatings = resolve_coatings(lens, FILM)
    curves, reflected = banded(lens, coatings), films_of(lens, coatings)
    path = ghost_path(lens, 7, 2)
    random = np.random.default_rng(8)
    squares, nodes = random.uniform(0.0, 0.4, len(path.rows)), random.uniform(0.0, 0.4, (3, len(path.rows)))
    shares = hats(CURVE_NM, [400.0, 550.0, 700.0])
    reflectance = curves.reflectance[:, :, : len(CURVE_NM)]
    got = products_between(reflectance, [path, path], np.tile(squares, 2), np.tile(nodes, 2), shares)
    expected = np.ones(len(CURVE_NM))
    for k, (row, action) in enumerate(zip(path.rows, path.actions, strict=True)):
        if row == lens.stop_row:
            continue
        if action == 1:
            expected *= sum(share * reflected(int(row), node[k]) for share, node in zip(shares, nodes, strict=True))
        else:
            expected *= 1.0 - reflected(int(row), squares[k])
    np.testing.assert_allclose(got[0], expected, rtol=0.0, atol=5e-4 * expected.max())
    np.testing.assert_array_equal(got[0], got[1])
    # one angle for all wavelengths
    one = products_between(reflectance, [path], squares, np.tile(squares, (3, 1)), shares)
    np.testing.assert_allclose(one[0], path_spectra(curves, [path], squares[None]).passed[0], rtol=1e-12)


@pytest.mark.parametrize("waves", [SEVEN_NM, (450.0, 540.0, 610.0), (550.0,)])
def test_rays_carry_the_means_of_their_bands(waves):
    """Packed tables hold the mean of the fine curve over each band, and `carried` is the product of these means."""
    lens = load_lens("tessar-brendel")
    coatings = resolve_coatings(lens, FILM)
    curves = banded(lens, coatings, waves=waves)
    tables = curves.tables
    assert tables.shape == (len(waves), len(lens.rows), 1025)
    path = ghost_path(lens, 7, 2)
    squares = np.zeros((1, len(path.rows)))
    product = np.ones(len(waves))
    for row, action in zip(path.rows, path.actions, strict=True):
        r = tables[:, row, -1]
        product *= {0: 1.0 - r, 1: r}.get(int(action), 1.0)
    np.testing.assert_allclose(path_spectra(curves, [path], squares).carried[0], product, rtol=1e-12)
    # between the extremes of the band, and not at its end
    fine = curves.reflectance[0, -1, : len(CURVE_NM)]
    for mean, hat in zip(tables[:, 0, -1], hats(CURVE_NM, waves), strict=True):
        assert fine[hat > 0.0].min() < mean < fine[hat > 0.0].max()


def test_bare_glass_has_no_curves_and_the_sensor_reflects_alike():
    lens = load_lens("tessar-brendel")
    assert coating_curves(lens, resolve_coatings(lens, AsLens())) is None or lens.coating_presets
    path = sensor_path(lens, 0)
    square = np.zeros((1, len(path.rows)))
    alone, brighter = (
        path_spectra(banded(lens, resolve_coatings(lens, FILM), SensorMirror(r)), [path], square).passed
        for r in (0.25, 0.5)
    )
    np.testing.assert_allclose(brighter, 2.0 * alone)
