"""Throughput between the traced wavelengths: against SciPy's spline, and shares that add up."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from flarewright.optics.colour.spectrum import hats
from flarewright.optics.rays.path_reflectance import CURVE_NM
from flarewright.optics.rays.steepness import (
    EVERY,
    bright_wavelengths,
    gap_errors,
    interpolation_error,
    throughput_ratios,
)

SEVEN = np.linspace(417.0, 683.0, 7)


def gathered(light):
    """Return the light at every third wavelength, each with what lies between it and its neighbours."""
    return np.array([np.interp(CURVE_NM, CURVE_NM[::EVERY], one) for one in np.eye(len(CURVE_NM[::EVERY]))]) @ light


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
    seen = passed[::EVERY, None] * gathered(light)
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
    error, total = interpolation_error(np.ones(len(CURVE_NM)), light, nodes, throughput, np.isin(nodes, SEVEN))
    assert error == pytest.approx(np.abs((bent - line) @ gathered(light)).max(), rel=1e-12)
    assert total == pytest.approx(np.abs(line @ gathered(light)).max(), rel=1e-12)


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
    fine = fine @ hats(CURVE_NM, fine_nm)
    lit = bright_wavelengths(throughput, fine)
    assert lit.tolist() == [[True, True] + 5 * [False], 7 * [True]]
    for k, which in enumerate(lit):
        shares, ratios = throughput_ratios(which, SEVEN, throughput[k : k + 1], fine[k : k + 1])
        assert (shares[~which] == 0.0).all()
        np.testing.assert_allclose(shares.sum(axis=0), 1.0)
        np.testing.assert_allclose((throughput[k] @ shares) * ratios[0], fine[k], atol=1e-9)


def test_the_errors_of_gaps_add_up_to_that_of_the_path():
    """Grey light, and throughput above its line in every gap: all errors have one sign."""
    light, nodes = np.ones((len(CURVE_NM), 3)), np.linspace(360.0, 830.0, 8)
    throughput = 1.0 - ((nodes - 595.0) / 300.0) ** 2
    passed = np.random.default_rng(6).random(len(CURVE_NM))
    error, total = interpolation_error(passed, light, nodes, throughput)
    errors, shares = gap_errors(passed, light, nodes, throughput[None])
    assert errors.sum() == pytest.approx(error / total, rel=1e-9)
    assert shares.sum() == pytest.approx(1.0, rel=1e-9)
    dark = gap_errors(passed, light, nodes, np.zeros((1, 8)))
    assert (dark[0] == 0.0).all()
    assert (dark[1] == 1.0).all()
