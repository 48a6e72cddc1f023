"""Aspheres, toroids, decentre, tilt and figure errors: limits that are known exactly."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from prescriptions import HELIAR, TESSAR, TRIPLET, ghost_table_of, lens
from sensor_rays import trace_rays

from flarewright.kernels.jit.decorators import for_python
from flarewright.kernels.tracing import general_ray
from flarewright.model import Dispersion, Element, Figure, Lens, Medium, Stop, Surface
from flarewright.optics.lens.dispersion import D_LINE_NM
from flarewright.optics.lens.paraxial import first_order
from flarewright.optics.lens.paths import direct_path, ghost_path
from flarewright.optics.rays.pack import pack_lens

cross_shape = for_python(general_ray.cross_shape)

FIELDS = [(0.0, 0.0), (7.0, -3.0), (-12.0, 9.0)]
INDEX = 1.6
GLASS = Medium(
    n_d=INDEX, dispersion=Dispersion(glass="x", formula="cauchy", coefficients=(INDEX, 0.0), range_nm=(300.0, 1100.0))
)


def changed(a_lens: Lens, row: int, **fields) -> Lens:
    rows = list(a_lens.rows)
    rows[row] = rows[row].replace(**fields)
    return a_lens.replace(rows=tuple(rows))


def everywhere(a_lens: Lens, how=None, **fields) -> Lens:
    if how == "toroid":
        # nearly equal, but not bit-identical
        rows = [
            r if isinstance(r, Stop) else r.replace(curvature_x=np.nextafter(r.curvature, 1.0)) for r in a_lens.rows
        ]
        return a_lens.replace(rows=tuple(rows))
    fields |= how or {}
    return a_lens.replace(rows=tuple(r if isinstance(r, Stop) else r.replace(**fields) for r in a_lens.rows))


def rays(a_lens: Lens, path=None, field=(0.0, 0.0), radius: float = 4.0, distance: float | None = None):
    packed = pack_lens(
        a_lens, first_order(a_lens, sensor_distance=distance), (None,) * len(a_lens.rows), np.array([D_LINE_NM])
    )
    x, y = np.random.default_rng(8).uniform(-radius, radius, (2, 80))
    route = direct_path(a_lens) if path is None else ghost_path(a_lens, *path)
    return x, y, trace_rays(packed, route, x, y, field)


def largest_difference(one, other) -> float:
    both = (one["status"] > 0) & (other["status"] > 0) & (one["rel_radius"] < 1.0)
    assert both.sum() > 4
    assert (one["status"] == other["status"])[one["rel_radius"] < 1.0].all()
    keys = ("x", "y", "weight", "rel_radius", "stop_x", "stop_y")
    return max(float(np.abs(one[k] - other[k])[both].max()) for k in keys)


GENERAL = {
    "by its sag": {"figure": Figure()},
    "with terms that are zero": {"asphere": (0.0, 0.0, 0.0)},
    "as a toroid of equal curvatures": "toroid",
    "in its frame": {"tilt_deg": (1e-13, 0.0)},
}


@pytest.mark.parametrize("conic", [0.0, -0.7])
@pytest.mark.parametrize("how", GENERAL)
@pytest.mark.parametrize("path", [None, (4, 1), (8, 6)])
def test_a_sphere_is_the_same_in_every_form(path, how, conic):
    plain = changed(lens(HELIAR, 4.5), 0, conic=conic)
    reported = everywhere(plain, GENERAL[how])
    for field in FIELDS[:2]:
        assert largest_difference(rays(plain, path, field)[2], rays(reported, path, field)[2]) < 1e-9


def test_a_conic_equals_its_series():
    """A paraboloid plus the remaining series of the circle is the sphere: 2^-k binomials of c^(2k-1) r^2k."""
    plain = lens(TRIPLET, 5.0)
    c = plain.rows[0].curvature
    series, term = [], 0.5
    for k in range(2, 11):
        term *= (2 * k - 3) / (2 * k)
        series.append(term * c ** (2 * k - 1))
    reported = changed(plain, 0, conic=-1.0, asphere=tuple(series))
    assert largest_difference(rays(plain, radius=3.0)[2], rays(reported, radius=3.0)[2]) < 1e-9


def stigmatic(kind: str) -> tuple[Lens, float]:
    """Return a lens that focuses a distant axial point without error, and the position of its focus."""
    stop = Stop(thickness=1.0)
    if kind == "ellipsoid":
        # front with conic -1 / n^2; back a sphere around the focus, which every ray meets at normal incidence
        f = 60.0
        front = Surface(
            curvature=INDEX / (INDEX - 1.0) / f, conic=-1.0 / INDEX**2, thickness=10.0, medium=GLASS, semi_diameter=12.0
        )
        back = Surface(curvature=1.0 / (f - 10.0), semi_diameter=12.0)
        return Lens(name=kind, f_number=3.0, rows=(stop, front, back)), f - 10.0
    # plane front, back a hyperboloid with conic -n^2
    f = 60.0
    front = Surface(thickness=10.0, medium=GLASS, semi_diameter=12.0)
    back = Surface(curvature=-1.0 / (f * (INDEX - 1.0)), conic=-(INDEX**2), semi_diameter=12.0)
    return Lens(name=kind, f_number=3.0, rows=(stop, front, back)), f


@pytest.mark.parametrize("kind", ["ellipsoid", "hyperboloid"])
@pytest.mark.parametrize("figure", [None, Figure()])
def test_cartesian_surfaces_focus_to_a_point(kind, figure):
    a_lens, distance = stigmatic(kind)
    reported = everywhere(a_lens, figure=figure)
    _, _, found = rays(reported, radius=8.0, distance=distance)
    assert found["status"].all()
    assert max(np.abs(found["x"]).max(), np.abs(found["y"]).max()) < 1e-9


def test_a_paraboloid_sends_light_of_its_axis_through_its_focus():
    """Silvered from behind: a plane plate in front, light back through its plane face, all in one medium."""
    # first mirror the paraboloid (row 2), second a plane (row 1): the focus is met on the way back, 2 d - f ahead of it
    f, d = 80.0, 20.0
    rows = (
        Stop(),
        Surface(thickness=d, medium=GLASS, semi_diameter=20.0),
        Surface(curvature=-1.0 / (2.0 * f), conic=-1.0, thickness=0.0, semi_diameter=20.0, figure=Figure()),
    )
    a_lens = Lens(name="mirror", f_number=5.0, rows=rows)
    packed = pack_lens(a_lens, first_order(a_lens, sensor_distance=5.0), (None,) * 3, np.array([D_LINE_NM]))
    x, y = np.random.default_rng(8).uniform(-9.0, 9.0, (2, 80))
    # trace inside the glass explicitly: the ghost's leg between the mirrors points at the focus
    for u, v in zip(x, y, strict=True):
        at = cross_shape(packed.shapes, 2, d, u, v, 0.0, 0.0, 0.0, 1.0, 1.0, INDEX, 1.0)
        hit, way = np.array(at[:3]), np.array(at[3:6])
        to_axis = -hit[0] / way[0]
        place = hit + to_axis * way
        assert abs(place[1]) < 1e-9
        assert place[2] == pytest.approx(d - f, abs=1e-8)


def test_a_sphere_turned_about_its_centre_changes_nothing():
    plain = lens(TRIPLET, 5.0)
    row, angle = 2, np.radians(3.0)
    radius = 1.0 / plain.rows[row].curvature
    # rotation about y by b moves the vertex to (-R sin b, 0, R (1 - cos b))
    back = radius * (1.0 - np.cos(angle))
    turned = changed(
        plain, row, decentre=(-radius * np.sin(angle), 0.0), tilt_deg=(0.0, 3.0),
        thickness=plain.rows[row].thickness - back,
    )  # fmt: skip
    turned = changed(turned, row - 1, thickness=plain.rows[row - 1].thickness + back)
    distance = first_order(plain).sensor_distance
    seen = 0
    for path in (None, (3, 1), (5, 2)):
        for field in FIELDS:
            a, b = (rays(one, path, field, radius=3.0, distance=distance)[2] for one in (plain, turned))
            both = (a["status"] > 0) & (b["status"] > 0)
            seen += both.sum()
            for key in ("x", "y", "weight"):
                assert np.abs(a[key] - b[key])[both].max(initial=0.0) < 1e-9
    assert seen > 200


def test_a_cylinder_focuses_a_line():
    f = 60.0
    rows = (
        Stop(),
        Surface(curvature=0.0, curvature_x=0.0, thickness=6.0, medium=GLASS, semi_diameter=15.0),
        Surface(
            curvature=-1.0 / (f * (INDEX - 1.0)), conic=-(INDEX**2), curvature_x=0.0, conic_x=0.0, semi_diameter=15.0
        ),
    )
    a_lens = Lens(name="cylinder", f_number=4.0, rows=rows)
    order = first_order(a_lens)
    assert order.efl == pytest.approx(f)
    assert order.efl_x == np.inf
    x, _, found = rays(a_lens, radius=7.0)
    assert np.abs(found["y"]).max() < 1e-9
    assert found["x"] == pytest.approx(x, abs=1e-9)


def test_a_toroid_is_two_lenses_to_first_order():
    cx, cy = 0.02, 0.03
    rows = (
        Stop(),
        Surface(curvature=cy, curvature_x=cx, thickness=4.0, medium=GLASS, semi_diameter=10.0),
        Surface(curvature=-cy, curvature_x=-cx, semi_diameter=10.0),
    )
    toroid = Lens(name="toroid", f_number=8.0, rows=rows)
    order = first_order(toroid)
    for c, efl, bfl in ((cy, order.efl, order.bfl), (cx, order.efl_x, order.bfl_x)):
        front, back = (rows[k].replace(curvature=s * c, curvature_x=None) for k, s in ((1, 1.0), (2, -1.0)))
        round_rows = (Stop(), front, back)
        alone = first_order(Lens(name="round", f_number=8.0, rows=round_rows))
        assert (efl, bfl) == (pytest.approx(alone.efl, rel=1e-12), pytest.approx(alone.bfl, rel=1e-12))
    # exact rays tend to both foci
    for axis, bfl in (("y", order.bfl), ("x", order.bfl_x)):
        _, _, found = rays(toroid, radius=0.01, distance=bfl)
        assert np.abs(found[axis]).max() < 1e-7


def flux_of(table):
    return {(g.first_reflection, g.second_reflection): g for g in (table.direct, *table.ghosts)}


LENSES = {"triplet": TRIPLET, "heliar": HELIAR, "tessar": TESSAR}


@cache
def half_pupil(name, f_number):
    """Return the ghosts of a lens with the whole and with half of its pupil."""
    return flux_of(ghost_table_of(lens(LENSES[name], f_number), (8.0, 5.0)))


@pytest.mark.parametrize(
    ("name", "f_number", "row"),
    [
        # stopped down, a table takes a third of the time
        ("triplet", 16.0, 2),
        pytest.param("heliar", 16.0, 3, marks=pytest.mark.slow),
        pytest.param("heliar", 8.0, 3, marks=pytest.mark.slow),
        pytest.param("tessar", 8.0, 0, marks=pytest.mark.slow),
        pytest.param("heliar", 4.5, 3, marks=pytest.mark.slow),
        pytest.param("tessar", 2.8, 0, marks=pytest.mark.slow),
    ],
)
@pytest.mark.parametrize("how", [pytest.param("by its sag", marks=pytest.mark.slow), "in its frame"])
def test_the_whole_pupil_carries_what_two_halves_carry(name, f_number, row, how):
    plain = lens(LENSES[name], f_number)
    half, whole = half_pupil(name, f_number), flux_of(ghost_table_of(changed(plain, row, **GENERAL[how]), (8.0, 5.0)))
    most = max(g.throughput_mm2 for key, g in half.items() if key[0] is not None)
    for key, one in half.items():
        other = whole[key]
        # each has an error of about 1e-4; the faintest relative to the brightest
        assert other.throughput_mm2 == pytest.approx(one.throughput_mm2, rel=2e-4, abs=2e-7 * most), key
        if one.throughput_mm2 > 1e-3 * most:
            assert np.hypot(*np.subtract(one.centroid_mm, other.centroid_mm)) < 2e-3 * max(one.rms_radius_mm, 0.1), key
            if one.rms_radius_mm < 50.0:  # beyond, a ghost's size depends on its farthest few rays
                assert other.rms_radius_mm == pytest.approx(one.rms_radius_mm, rel=5e-3, abs=1e-4), key


@pytest.mark.parametrize(
    "f_number", [20.0, *(pytest.param(f_number, marks=pytest.mark.slow) for f_number in (10.0, 5.0))]
)
def test_turning_lens_and_light_together_turns_the_ghosts(f_number):
    plain = lens(TRIPLET, f_number)
    one = changed(plain, 2, decentre=(0.4, 0.1), tilt_deg=(0.5, -0.8))
    # a quarter turn: x -> y, y -> -x, for position and axes of the tilts. Rotations have a fixed order, so only one of
    # them may differ from zero
    quarter = {"decentre": (-0.1, 0.4)}
    first = ghost_table_of(changed(plain, 2, decentre=(0.4, 0.1), tilt_deg=(0.5, 0.0)), (9.0, 0.0))
    second = ghost_table_of(changed(plain, 2, **quarter, tilt_deg=(0.0, 0.5)), (0.0, 9.0))
    a, b = flux_of(first), flux_of(second)
    other = ghost_table_of(one, (9.0, 0.0), paths="same-side").direct
    assert not np.allclose(first.direct.centroid_mm, other.centroid_mm, atol=1e-3)
    for key, g in a.items():
        if g.throughput_mm2 > 1e-4 * first.ghosts[0].throughput_mm2:
            assert b[key].throughput_mm2 == pytest.approx(g.throughput_mm2, rel=3e-4)
            x, y = g.centroid_mm
            assert b[key].centroid_mm == (pytest.approx(-y, abs=2e-3), pytest.approx(x, abs=2e-3))


def test_a_whole_lens_moved_as_one_element_sees_the_light_from_where_it_stands():
    """Both parts tilted about one point equal the tilted lens: the light comes from the other side by that angle."""
    plain = lens(TRIPLET, 5.0)
    z = np.concatenate([[0.0], np.cumsum([row.thickness for row in plain.rows[:-1]])])
    b = 0.6
    lever = float(z[5] - z[4])
    sine = np.sin(np.radians(b))
    # rotated about the stop's centre, so that the stop stays in place
    parts = (
        Element(rows=(0, 3), decentre=(-float(z[4]) * sine, 0.0), tilt_deg=(0.0, b)),
        Element(rows=(5, 6), decentre=(lever * sine, 0.0), tilt_deg=(0.0, b)),
    )
    tilted = plain.replace(elements=parts)
    seen = ghost_table_of(tilted, (0.0, 0.0), paths="same-side").direct
    # in the lens frame the light comes from b degrees; in the tilted image plane its position moves by the pupil only
    straight = ghost_table_of(plain, (b, 0.0), paths="same-side").direct
    order = first_order(plain)
    # the light's image lies efl * b from the lens axis, which itself is tilted by b from the stop to the sensor
    axis = float(order.sensor_distance + z[6] - z[4]) * sine
    assert abs(seen.centroid_mm[1]) < 1e-6
    assert seen.centroid_mm[0] == pytest.approx(straight.centroid_mm[0] - axis, abs=0.01)
    assert seen.throughput_mm2 == pytest.approx(straight.throughput_mm2, rel=2e-3)


@pytest.mark.parametrize("kind", [{}, {"figure": Figure()}], ids=["conic", "by its sag"])
def test_the_rim_of_a_decentred_surface_is_around_its_own_axis(kind):
    """The height of a ray at a decentred surface is measured from the surface's vertex."""
    a_lens = changed(lens(TESSAR, 5.0), 0, decentre=(3.0, -2.0), **kind)
    packed = pack_lens(a_lens, first_order(a_lens), (None,) * len(a_lens.rows), np.array([D_LINE_NM]))
    eta = 1.0 / packed.n_gap[0, 1]
    for x, y in ((3.0, -2.0), (7.0, -2.0), (0.0, 2.0), (0.0, 0.0)):
        met = cross_shape(packed.shapes, 0, packed.z_vertex[0], x, y, -20.0, 0.0, 0.0, 1.0, 1.0, eta, 0.0)
        assert met[:2] == pytest.approx((x, y), abs=1e-12)
        assert met[6] == pytest.approx((x - 3.0) ** 2 + (y + 2.0) ** 2, abs=1e-9)
