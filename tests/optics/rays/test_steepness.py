"""Throughput between the traced wavelengths: against SciPy's spline, and shares that add up."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from flarewright.optics.colour.spectrum import hats
from flarewright.optics.rays.path_reflectance import CURVE_NM
from flarewright.optics.rays.steepness import EVERY, bright_wavelengths, interpolation_error, throughput_ratios

SEVEN = np.linspace(417.0, 683.0, 7)


@pytest.mark.parametrize("nodes", [SEVEN, np.array([450.0, 540.0, 610.0]), np.array([480.0, 600.0])])
def test_the_estimate_is_a_natural_spline_over_the_line(nodes):
    rng = np.random.default_rng(3)
    throughput, passed = rng.uniform(2.0, 3.0, len(nodes)), rng.random(len(CURVE_NM))
    light = rng.random((len(CURVE_NM), 3))
    curve_nm = CURVE_NM[::EVERY]
    spline = CubicSpline(nodes, throughput, bc_type="natural")
    within = np.clip(curve_nm, nodes[0], nodes[-1])
    bent = np.maximum(spline(within) + (curve_nm - within) * spline(within, 1), 0.0)
    line = np.interp(curve_nm, nodes, throughput)
    seen = passed[::EVERY, None] * light[::EVERY]
    error, total = interpolation_error(passed, light, nodes, throughput)
    assert error == pytest.approx(np.abs((bent - line) @ seen).max(), rel=1e-12)
    assert total == pytest.approx(np.abs(line @ seen).max(), rel=1e-12)


def test_wavelengths_beyond_the_traced_bend_the_spline_but_not_the_line():
    nodes = np.array([385.0, *SEVEN, 755.0])
    rng = np.random.default_rng(4)
    throughput, light = rng.uniform(2.0, 3.0, len(nodes)), rng.random((len(CURVE_NM), 3))
    curve_nm = CURVE_NM[::EVERY]
    spline = CubicSpline(nodes, throughput, bc_type="natural")
    within = np.clip(curve_nm, nodes[0], nodes[-1])
    bent = np.maximum(spline(within) + (curve_nm - within) * spline(within, 1), 0.0)
    line = np.interp(curve_nm, SEVEN, throughput[1:-1])
    error, total = interpolation_error(np.ones(len(CURVE_NM)), light, nodes, throughput, (1, 1))
    assert error == pytest.approx(np.abs((bent - line) @ light[::EVERY]).max(), rel=1e-12)
    assert total == pytest.approx(np.abs(line @ light[::EVERY]).max(), rel=1e-12)


def test_one_wavelength_tells_nothing():
    light = np.ones((len(CURVE_NM), 3))
    error, total = interpolation_error(np.ones(len(CURVE_NM)), light, np.array([550.0]), np.array([2.0]))
    assert error == 0.0
    assert total > 0.0


def test_shares_of_the_traced_add_up_to_what_passes():
    """A dark wavelength represents nothing; its neighbours represent its band."""
    fine_nm = np.linspace(365.0, 755.0, 21)
    fine = np.stack([np.maximum(470.0 - fine_nm, 0.0), fine_nm - 300.0])
    throughput = np.array([np.interp(SEVEN, fine_nm, one) for one in fine])
    lit = bright_wavelengths(throughput, fine)
    assert lit.tolist() == [[True, True] + 5 * [False], 7 * [True]]
    for k, which in enumerate(lit):
        shares, ratios = throughput_ratios(which, SEVEN, throughput[k : k + 1], fine_nm, fine[k : k + 1])
        assert (shares[~which] == 0.0).all()
        np.testing.assert_allclose(shares.sum(axis=0), 1.0)
        np.testing.assert_allclose((throughput[k] @ shares) * ratios[0], fine[k] @ hats(CURVE_NM, fine_nm), atol=1e-9)
