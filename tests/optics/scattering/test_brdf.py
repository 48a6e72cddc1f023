"""Scatter formulas against closed-form integrals, limits, reciprocity and published numbers."""

import numba
import numpy as np
import pytest
from scipy.integrate import quad, trapezoid

from flarewright.errors import ProjectError
from flarewright.kernels.scattering.single_scatter import (
    CORE,
    HIGH,
    LOW,
    chaumond_phase,
    scattered_density,
    scattered_total,
)
from flarewright.model import RowScatter, Scatter
from flarewright.optics.lens.paraxial import first_order
from flarewright.optics.rays.pack import pack_lens
from flarewright.optics.scattering.brdf import (
    NODES,
    abg_density,
    roughness_density,
    scatter_tables,
)
from flarewright.optics.scattering.dust import LEAST_UM, dust_density, particles_above
from flarewright.optics.scattering.mie import mie
from flarewright.render.scene.resolve import load_lens


@numba.njit
def density(table, amount, n_in, n_out, cos_spec, cos_s, v2, between):
    return scattered_density(table, amount, n_in, n_out, cos_spec, cos_s, v2, between)


@numba.njit
def phase(cosine):
    return chaumond_phase(cosine)


def nodes():
    return np.sqrt(np.maximum(np.exp(np.linspace(LOW, HIGH, NODES)) - CORE**2, 0.0))


def rough(roughness_nm, wavelength_nm, correlation_um, slope):
    """Return the kernel's total scatter of a rough surface."""
    depth = (2.0 * np.pi * roughness_nm / wavelength_nm) ** 2
    table = np.full((2, NODES), -640.0)
    table[0] = np.log(depth * roughness_density(nodes(), wavelength_nm, correlation_um, slope))
    return table, np.array([depth, 0.0])


def refracted_scatter(n_in, n_out, cos_in, roughness_nm, wavelength_nm):
    """Return the fraction of refracted light that a rough surface scatters.

    H. E. Bennett and J. O. Porteus, J. Opt. Soc. Am. 51, 123 (1961): 1 - exp(-(2 pi depth rms / lambda)^2). A height h
    delays the light by h times the depth, n_out cos_out - n_in cos_in.
    """
    cos_out = np.sqrt(1.0 - (n_in / n_out) ** 2 * (1.0 - cos_in**2))
    return -np.expm1(-((2.0 * np.pi * (n_out * cos_out - n_in * cos_in) * roughness_nm / wavelength_nm) ** 2))


# --- roughness


@pytest.mark.parametrize("slope", [2.05, 2.5, 4.0])
def test_roughness_spreads_all_of_it(slope):
    shoulder = 0.55 / (2.0 * np.pi * 10.0)
    whole, _ = quad(
        lambda t: 2.0 * np.pi * np.exp(2.0 * t) * roughness_density(np.exp(t), 550.0, 10.0, slope), -30.0, 300.0,
        limit=2000,
    )  # fmt: skip
    assert whole == pytest.approx(1.0, rel=1e-5)
    # flat below the shoulder, a power law above it
    near, far = roughness_density([1e-3 * shoulder, 1e3 * shoulder], 550.0, 10.0, slope)
    assert roughness_density(0.0, 550.0, 10.0, slope) == pytest.approx(near, rel=1e-5)
    further = roughness_density(1e4 * shoulder, 550.0, 10.0, slope)
    assert np.log10(further / far) == pytest.approx(-slope, abs=1e-5)


@pytest.mark.parametrize(("n_in", "n_out"), [(1.0, 1.6), (1.6, 1.0), (1.5, 1.7)])
@pytest.mark.parametrize("angle_deg", [0.0, 25.0])
def test_small_angles_integrate_to_the_total(n_in, n_out, angle_deg):
    """A surface rough over long distances scatters forward: the sum over directions is the Harvey-Shack total."""
    table, amount = rough(3.0, 550.0, 200.0, 6.0)
    cos_in = np.cos(np.radians(angle_deg))
    cos_spec = np.sqrt(1.0 - (n_in / n_out) ** 2 * (1.0 - cos_in**2))
    reported = refracted_scatter(n_in, n_out, cos_in, 3.0, 550.0)
    assert scattered_total(table, amount, n_in, n_out, cos_spec, 400, 32) == pytest.approx(reported, rel=2e-3)


def test_light_may_be_reversed():
    """The share per area of v is the scatter function over n^2, which by reciprocity is equal both ways."""
    table, amount = rough(0.1, 550.0, 3.0, 2.5)
    rng = np.random.default_rng(5)
    n = (1.0, 1.65)
    for _ in range(200):
        # tangential components that propagate on both sides
        p, q = (np.sqrt(rng.random(2)) * 0.99)[:, None] * np.array([[1.0, 0.0], [np.cos(1.0), np.sin(1.0)]])
        v2 = float(((p - q) ** 2).sum())
        (p1, p2), (q1, q2) = ([np.sqrt(1.0 - (t @ t) / m**2) for m in n] for t in (p, q))
        between_behind = p @ q / n[1] ** 2 + p2 * q2
        there = density(table, amount, n[0], n[1], p2, q2, v2, between_behind)
        between_before = p @ q / n[0] ** 2 + p1 * q1
        back = density(table, amount, n[1], n[0], q1, p1, v2, between_before)
        assert there == pytest.approx(back, rel=1e-9)
        assert there > 0.0


# --- measured functions


@pytest.mark.parametrize(
    ("abg", "total"),
    [
        ((2e-5, 1e-3, 2.0), np.pi * 2e-5 * np.log(1.0 + 1e3)),
        ((1e-3, 0.5, 2.0), np.pi * 1e-3 * np.log(3.0)),
        ((1e-3, 1e-2, 1.0), 2.0 * np.pi * 1e-3 * (1.0 - 1e-2 * np.log(101.0))),
    ],
)
def test_abg_against_its_integral(abg, total):
    table = np.full((2, NODES), -640.0)
    table[1] = np.log(abg_density(nodes(), abg))
    # into air the whole disc, into glass slightly more
    found = scattered_total(table, np.zeros(2), 1.5, 1.0, 1.0, 2000, 8)
    assert found == pytest.approx(total, rel=3e-3)
    assert scattered_total(table, np.zeros(2), 1.0, 1.5, 1.0, 2000, 8) > found


def test_abg_is_flat_then_a_power():
    a, b, g = 3e-4, 1e-4, 1.7
    assert abg_density(0.0, (a, b, g)) == pytest.approx(a / b)
    near, far = abg_density([0.1, 1.0], (a, b, g))
    assert np.log10(far / near) == pytest.approx(-g, abs=3e-3)


# --- Chaumond


def test_chaumonds_phase_function_over_the_sphere():
    whole, _ = quad(lambda c: 2.0 * np.pi * phase(c), -1.0, 1.0)
    forward, _ = quad(lambda c: 2.0 * np.pi * phase(c), 0.0, 1.0)
    assert whole == pytest.approx(1.0, rel=1e-12)
    assert forward == pytest.approx(0.8, rel=1e-12)
    assert phase(1.0) / phase(0.0) == pytest.approx((1.25 + 1.0) / 0.625)
    assert min(phase(c) for c in np.linspace(-1.0, 1.0, 201)) > 0.0


def test_chaumonds_share_goes_where_the_phase_function_says():
    """Into the solid angle behind the surface, for any index there."""
    table = np.full((2, NODES), -640.0)
    for n_out in (1.0, 1.7):
        angle = np.radians(40.0)
        v = n_out * np.sin(angle)
        per_v = density(table, np.array([0.0, 0.01]), 1.3, n_out, 1.0, np.cos(angle), v**2, np.cos(angle))
        per_steradian = per_v * n_out**2 * np.cos(angle)
        assert per_steradian == pytest.approx(0.01 * phase(np.cos(angle)), rel=1e-9)


# --- dust


def test_mie_against_bohren_and_huffman():
    """Appendix A: a water-like sphere of 0.525 um and index 1.55 at 0.6328 um."""
    x = np.array([2.0 * np.pi * 0.525 / 0.6328])
    extinction, scattering, intensity = mie(x, 1.55, np.array([-1.0]))
    assert extinction[0] == pytest.approx(3.10543, abs=1e-5)
    assert scattering[0] == pytest.approx(3.10543, abs=1e-5)
    assert 4.0 * intensity[0, 0] / x[0] ** 2 == pytest.approx(2.92534, abs=1e-5)


def test_mie_small_and_large():
    index = 1.5
    polarisable = ((index**2 - 1.0) / (index**2 + 2.0)) ** 2
    x = np.array([0.01])
    cosine = np.linspace(-1.0, 1.0, 5)
    _, scattering, intensity = mie(x, index, cosine)
    assert scattering == pytest.approx(8.0 / 3.0 * x**4 * polarisable, rel=1e-3)
    assert intensity[0] == pytest.approx(x[0] ** 6 * polarisable * 0.5 * (1.0 + cosine**2), rel=1e-3)
    # a large sphere removes twice its shadow from the light
    assert mie(np.array([3000.0]), 1.5 + 0.1j, cosine)[0] == pytest.approx(2.0, rel=0.02)


def test_mie_keeps_light():
    nodes_, weights = np.polynomial.legendre.leggauss(400)
    x = np.array([3.0, 30.0, 100.0])
    extinction, scattering, intensity = mie(x, 1.53, nodes_)
    assert extinction == pytest.approx(scattering, rel=1e-9)
    assert 2.0 * (intensity @ weights) / x**2 == pytest.approx(scattering, rel=1e-9)
    absorbed, rest, _ = mie(x, 1.53 + 0.01j, nodes_)
    assert (absorbed > rest).all()


def test_specks_follow_the_standard():
    assert particles_above(500.0, 500.0) == pytest.approx(1.0 / 1e5)
    assert np.log10(particles_above(10.0, 300.0) * 1e5) == pytest.approx(0.926 * (np.log10(300.0) ** 2 - 1.0))


def area_covered(level):
    """Return the fraction of a surface's area that round particles of a cleanliness level cover."""
    edges = np.geomspace(LEAST_UM, level, 2001)
    middle = np.sqrt(edges[1:] * edges[:-1])
    return (-np.diff(particles_above(edges, level)) * 0.25e-6 * np.pi * middle**2).sum()


@pytest.mark.parametrize("level", [200.0, 500.0, 1000.0])
def test_dust_covers_what_the_field_counts_with(level):
    """log10 of the per cent covered is about -7.245 + 0.926 log10(level)^2 (Ma, Fong and Lee, SPIE 1165, 1989)."""
    reported = 10.0 ** (-7.245 + 0.926 * np.log10(level) ** 2) / 100.0
    assert area_covered(level) == pytest.approx(reported, rel=0.15)


@pytest.mark.parametrize("wavelength_nm", [pytest.param(450.0, marks=pytest.mark.slow), 650.0])
def test_dust_scatters_nearly_twice_what_it_covers(wavelength_nm):
    t = np.linspace(-14.0, 0.0, 101)
    total = 2.0 * np.pi * trapezoid(np.exp(2.0 * t) * dust_density(np.exp(t), wavelength_nm, 400.0), t)
    assert 1.3 < total / area_covered(400.0) < 2.0


def test_dust_falls_with_the_angle():
    v = np.geomspace(1e-4, 0.9, 200)
    found = dust_density(v, 550.0, 300.0)
    assert (np.diff(found) <= 0.0).all()
    # half of the light stays within a few degrees: particles are many wavelengths wide
    assert found[0] / dust_density(0.1, 550.0, 300.0) > 1e3


# --- scatter of a lens


def packed(lens, wavelengths=(550.0,)):
    order = first_order(lens)
    return pack_lens(lens, order, (None,) * len(lens.rows), np.array(wavelengths))


def test_every_row_scatters_what_its_roughness_says():
    lens = load_lens("triplet-pestrecov")
    pack = packed(lens, (450.0, 650.0))
    exception = RowScatter(row=2, roughness_nm=6.0)
    reported = scatter_tables(lens, pack, Scatter(model="harvey-shack", roughness_nm=2.0, slope=4.0, rows=(exception,)))
    assert reported.shares[:, lens.stop_row] == pytest.approx(0.0)
    for w, nm in enumerate((450.0, 650.0)):
        for k in range(len(lens.rows)):
            share = refracted_scatter(pack.n_gap[w, k], pack.n_gap[w, k + 1], 1.0, 6.0 if k == 2 else 2.0, nm)
            assert reported.shares[w, k] == pytest.approx(share, rel=0.02, abs=1e-12)
    assert reported.kept == pytest.approx(np.prod(1.0 - reported.shares, axis=1))


def test_dust_and_measured_functions_belong_to_air():
    lens = load_lens("tessar-brendel")
    pack = packed(lens)
    reported = scatter_tables(lens, pack, Scatter(model="abg", cleanliness_level=300.0)).shares[0]
    air = np.minimum(pack.n_gap[0, 1:], pack.n_gap[0, :-1]) == 1.0
    glass = pack.n_gap[0, 1:] != pack.n_gap[0, :-1]
    assert (reported[air & glass] > 0.0).all()
    assert (reported[~(air & glass)] == 0.0).all()
    assert (~air & glass).any()


def test_what_cannot_scatter_is_told():
    lens = load_lens("triplet-pestrecov")
    pack = packed(lens)
    for row in (lens.stop_row, 99):
        with pytest.raises(ProjectError, match=f"row {row} of"):
            scatter_tables(lens, pack, Scatter(model="abg", rows=(RowScatter(row=row, share=0.1),)))
    with pytest.raises(ProjectError, match="reduce it"):
        scatter_tables(lens, pack, Scatter(model="abg", abg=(1.0, 1e-3, 2.0)))
