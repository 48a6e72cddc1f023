"""Dispersion formulas against the makers' published numbers."""

from __future__ import annotations

import numpy as np
import pytest

from flarewright.errors import GlassError
from flarewright.io.lens.glass_catalogue import by_name, cauchy_from_abbe
from flarewright.model import Dispersion, Medium
from flarewright.optics.lens.dispersion import (
    D_LINE_NM,
    dispersion_index,
    refractive_index,
)

LINE_F_NM, LINE_C_NM = 486.1327, 656.2725

# n_d, V_d, n_F, n_C of the makers' data sheets (Schott 2017, Ohara 2017, Hoya 2017, CDGM 2017)
PUBLISHED = [
    ("SCHOTT N-BK7", 1.51680, 64.17, 1.52238, 1.51432),
    ("SCHOTT SF6", 1.80518, 25.43, 1.82775, 1.79609),
    ("SCHOTT F2", 1.62004, 36.37, 1.63208, 1.61503),
    ("SCHOTT N-SF11", 1.78472, 25.68, 1.80651, 1.77596),
    ("SCHOTT N-LAK7", 1.65160, 58.52, 1.65934, 1.64821),
    ("OHARA S-FPL51", 1.49700, 81.54, 1.50123, 1.49514),
    ("HOYA FCD1", 1.49700, 81.61, 1.50123, 1.49514),
    ("CDGM H-K9L", 1.51680, 64.20, 1.52238, 1.51432),
]


@pytest.mark.parametrize(("name", "n_d", "v_d", "n_f", "n_c"), PUBLISHED)
def test_formulas_give_the_published_indices(name, n_d, v_d, n_f, n_c):
    dispersion = by_name(name).dispersion
    n = dispersion_index(dispersion, np.array([587.5618, LINE_F_NM, LINE_C_NM]))
    np.testing.assert_allclose(n, [n_d, n_f, n_c], atol=1.5e-5)
    assert (n[0] - 1.0) / (n[1] - n[2]) == pytest.approx(v_d, abs=0.06)


def test_the_prescriptions_own_index_holds_at_the_d_line():
    medium = Medium(glass="N-BK7", n_d=1.5170, v_d=64.0, dispersion=by_name("N-BK7").dispersion)
    n = refractive_index(medium, np.array([D_LINE_NM, LINE_F_NM]))
    assert n[0] == 1.5170
    assert n[1] - n[0] == pytest.approx(1.52238 - 1.51680, abs=1e-5)


def test_air_is_one_and_shape_is_kept():
    n = refractive_index(None, np.full((2, 3), 500.0))
    assert n.shape == (2, 3)
    assert np.all(n == 1.0)


def test_glass_without_dispersion_is_told_not_held_constant():
    with pytest.raises(GlassError, match="no dispersion"):
        refractive_index(Medium(n_d=1.5), 500.0)


@pytest.mark.parametrize(("n_d", "v_d"), [(1.5, 64.0), (1.8, 25.0), (1.6, 40.0)])
def test_cauchy_has_the_asked_index_and_abbe_number(n_d, v_d):
    cauchy = cauchy_from_abbe(n_d, v_d)
    n = dispersion_index(cauchy, np.array([587.56, LINE_F_NM, LINE_C_NM]))
    assert n[0] == pytest.approx(n_d, abs=2e-6)
    # the printed constant 0.52345 is the exact 0.52366 to 4e-4
    assert (n[0] - 1.0) / (n[1] - n[2]) == pytest.approx(v_d, rel=5e-4)


def test_sellmeier_and_polynomial_forms_are_the_documented_ones():
    L = 0.55
    sellmeier = Dispersion(glass="x", formula="sellmeier", coefficients=(0.1, 1.0, 0.01), range_nm=(400, 700))
    assert dispersion_index(sellmeier, np.array([550.0]))[0] == pytest.approx(np.sqrt(1 + 0.1 + L**2 / (L**2 - 0.01)))
    polynomial = Dispersion(glass="x", formula="polynomial", coefficients=(2.5, 0.01, -2.0), range_nm=(400, 700))
    assert dispersion_index(polynomial, np.array([550.0]))[0] == pytest.approx(np.sqrt(2.5 + 0.01 / L**2))


def test_a_wavelength_far_outside_the_range_is_told():
    with pytest.raises(GlassError, match="known from 300 to 2500 nm, not at 5000 nm"):
        dispersion_index(by_name("N-BK7").dispersion, np.array([5000.0]))
    assert np.all(np.isfinite(dispersion_index(by_name("HIKARI LAK9").dispersion, np.array([360.0, 830.0]))))


def test_a_formula_without_an_index_is_told():
    broken = Dispersion(glass="x", formula="polynomial", coefficients=(-2.0,), range_nm=(400, 700))
    with pytest.raises(GlassError, match="no index above 1"):
        dispersion_index(broken, np.array([550.0]))
