"""What coatings do between the traced wavelengths: against rays, and against films computed one by one."""

from __future__ import annotations

import numpy as np
import pytest

from flarewright.kernels.trace import ALIVE, REL, WEIGHT
from flarewright.model import AsLens, Everywhere, QuarterWave
from flarewright.optics.bundle import trace_points
from flarewright.optics.coating_curves import CURVE_NM, bends, coating_curves, mirror_squares_traced, passed
from flarewright.optics.coatings import film_stack, stack_reflectance
from flarewright.optics.pack import SensorMirror, facing, pack_lens, resolve_coatings
from flarewright.optics.paraxial import D_LINE_NM, first_order, gap_indices
from flarewright.optics.paths import ghost_path, sensor_path
from flarewright.optics.region import find_region
from flarewright.render.prepare import load_lens

FILM = Everywhere(coating=QuarterWave(center_wavelength_nm=550.0))
TILT = -0.12
SEVEN_NM = np.linspace(420.0, 680.0, 7)


@pytest.mark.parametrize("name", ["tessar-brendel", "anamorphic-heliar-2x"])
@pytest.mark.parametrize(("first", "second"), [(1, 0), (3, 2), (-1, 0)])
def test_a_ray_passes_what_its_curve_says(name, first, second):
    """The product of R and T that a traced ray carries at each of nine wavelengths; mirrors among the coated."""
    lens = load_lens(name)
    waves = np.linspace(410.0, 690.0, 9)
    coatings = resolve_coatings(lens, FILM)
    packed = facing(pack_lens(lens, first_order(lens), coatings, waves), np.eye(2))
    curves = coating_curves(lens, coatings)
    rows = [k for k, coating in enumerate(coatings) if coating is not None]
    path = ghost_path(lens, rows[first], rows[second])
    region = find_region(packed, path, TILT, 4.0)
    assert region is not None
    x0, x1, y0, y1 = region.box
    points = np.stack([g.ravel() for g in np.meshgrid(np.linspace(x0, x1, 7), np.linspace(y0, y1, 9))], axis=1)
    rays = np.stack([trace_points(packed, w, path, TILT, points) for w in range(len(waves))])
    lit = ((rays[..., ALIVE] > 0.0) & (rays[..., REL] <= 1.0)).all(axis=0)
    assert lit.sum() >= 3
    squares = mirror_squares_traced(packed, path, TILT, points[lit])
    assert squares.shape == (lit.sum(), 2)
    for ray, square in zip(np.flatnonzero(lit), squares, strict=True):
        curve = passed(curves, [path], square[None, None])[0]
        told, carried = np.interp(waves, CURVE_NM, curve), rays[:, ray, WEIGHT]
        # glass at the d line, surfaces that are passed at normal incidence, rays that part with the colour
        assert np.abs(told / told.max() - carried / carried.max()).max() < 0.06
        assert told.max() == pytest.approx(carried.max(), rel=0.08)


def test_a_curve_is_the_product_of_its_films():
    lens = load_lens("tessar-brendel")
    curves = coating_curves(lens, resolve_coatings(lens, FILM))
    path = ghost_path(lens, 7, 2)
    squares = np.array([[[0.1, 0.35], [0.02, 0.0]]])
    got = passed(curves, [path], squares)[0]
    n, coatings = gap_indices(lens, D_LINE_NM), resolve_coatings(lens, FILM)

    def reflected(row: int, square: float) -> np.ndarray:
        films = film_stack(coatings[row], n[row], n[row + 1])
        low, high = sorted((n[row], n[row + 1]))
        if n[row] > n[row + 1]:
            films = films[0][::-1], films[1][::-1]
        return stack_reflectance(low, high, *films, CURVE_NM, np.sqrt(1.0 - square))

    mirrors = path.mirrors
    crossed = [int(row) for row, action in zip(path.rows, path.actions, strict=True) if action == 0]
    through = np.prod([1.0 - reflected(row, 0.0) for row in crossed], axis=0)
    expected = through * np.mean([reflected(mirrors[0], a) * reflected(mirrors[1], b) for a, b in squares[0]], axis=0)
    # lines between 33 entries of the squared sine
    assert np.abs(got - expected).max() < 2e-3 * expected.max()


def test_a_straight_curve_does_not_bend():
    line = (CURVE_NM * 2e-3 + 0.1)[None]
    inside = (SEVEN_NM[0] <= CURVE_NM) & (SEVEN_NM[-1] >= CURVE_NM)
    np.testing.assert_allclose(bends(line, SEVEN_NM)[0, inside], 1.0, rtol=1e-12)


def test_bends_give_the_curve_back():
    """A dip: lines between its traced wavelengths times the bend are the dip."""
    dip = (2e-3 + ((CURVE_NM - 550.0) / 150.0) ** 2)[None]
    line = np.interp(CURVE_NM, SEVEN_NM, np.interp(SEVEN_NM, CURVE_NM, dip[0]))
    np.testing.assert_allclose(bends(dip, SEVEN_NM)[0] * line, dip[0], rtol=1e-12)
    # half way between two wavelengths, on a slope of a parabola, lines are too high by h^2 / 8 f''
    h = SEVEN_NM[1] - SEVEN_NM[0]
    middle = 0.5 * (SEVEN_NM[3] + SEVEN_NM[4])
    over = np.interp(middle, CURVE_NM, line - dip[0])
    assert over == pytest.approx(h**2 / 8.0 * 2.0 / 150.0**2, rel=0.02)


def test_dark_paths_do_not_bend_without_end():
    dip = (np.abs(CURVE_NM - 550.0) > 60.0).astype(float)[None]
    found = bends(dip, np.array([500.0, 540.0, 560.0, 600.0]))
    assert np.isfinite(found).all()
    assert found.max() <= 4.0


def test_bare_glass_has_no_curves_and_the_sensor_reflects_alike():
    lens = load_lens("tessar-brendel")
    assert coating_curves(lens, resolve_coatings(lens, AsLens())) is None or lens.coating_presets
    curves = coating_curves(lens, resolve_coatings(lens, FILM), SensorMirror(0.25))
    path = sensor_path(lens, 0)
    alone = passed(curves, [path], np.zeros((1, 1, 2)))
    brighter = passed(
        coating_curves(lens, resolve_coatings(lens, FILM), SensorMirror(0.5)), [path], np.zeros((1, 1, 2))
    )
    np.testing.assert_allclose(brighter, 2.0 * alone)
