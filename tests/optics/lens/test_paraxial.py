"""First-order optics against published numbers and analytic laws."""

from __future__ import annotations

import numpy as np
import pytest
from prescriptions import CANON, HELIAR, TESSAR, TRIPLET, lens
from sensor_rays import trace_rays

from flarewright.errors import LensError
from flarewright.model import Dispersion, Lens, Medium, Stop, Surface
from flarewright.optics.lens.dispersion import D_LINE_NM
from flarewright.optics.lens.paraxial import first_order, gap_indices, path_matrices, vertex_positions
from flarewright.optics.lens.paths import direct_path, ghost_path, ghost_paths
from flarewright.optics.rays.pack import pack_lens
from flarewright.render.scene.resolve import load_lens

FLAT = Dispersion(glass="Cauchy", formula="cauchy", coefficients=(1.5, 0.0), range_nm=(300.0, 1100.0))
GLASS = Medium(n_d=1.5, dispersion=FLAT)

HELIAR_GHOSTS = {
    (1, 0): (-10.937364, 9.366928),
    (2, 0): (-8.347156, 1.154423),
    (4, 1): (14.405193, 348.213947),
    (8, 6): (-4.527134, -53.968777),
    (8, 7): (-9.326399, -252.167933),
}
"""First row of the flare matrix, sensor at the paraxial focus (Van Acoleyen 2025, table 2.1, recomputed)."""


def sensor_plane(a_lens: Lens) -> float:
    return float(vertex_positions(a_lens)[-1] + first_order(a_lens).sensor_distance)


# --- known lenses


def test_heliar_of_the_thesis():
    order = first_order(lens(HELIAR, 4.5))
    assert order.efl == pytest.approx(99.235796, abs=1e-6)
    assert order.bfl == pytest.approx(81.315056, abs=1e-6)
    assert order.sensor_distance == order.bfl


def test_the_printed_plane_of_the_heliar_is_out_of_focus():
    printed = first_order(lens(HELIAR, 4.5), sensor_distance=81.857)
    assert printed.sensor_distance - printed.bfl == pytest.approx(0.542, abs=1e-3)


def test_canon_as_typed():
    order = first_order(lens(CANON, 2.8))
    assert order.efl == pytest.approx(35.8423, abs=6e-5)
    assert order.bfl == pytest.approx(38.3787, abs=6e-5)


def test_back_focus_of_the_tessar():
    assert first_order(load_lens("tessar-brendel")).bfl == pytest.approx(79.77, abs=1e-2)


@pytest.mark.parametrize(
    ("name", "efl", "digits"),
    [
        ("heliar-tronnier", 99.235796, 1e-5),
        ("canon-28-80", 35.8423, 1e-4),
        ("tessar-brendel", 99.96, 1e-2),
        ("nikon-28-75", 28.90, 1e-2),
        ("angenieux-50-f1.1", 49.99, 1e-2),
    ],
)
def test_shipped_lenses_have_the_known_focal_length(name, efl, digits):
    assert first_order(load_lens(name)).efl == pytest.approx(efl, abs=digits)


# --- flare matrices


@pytest.mark.parametrize("path", HELIAR_GHOSTS)
def test_flare_matrices_of_the_heliar(path):
    a_lens = lens(HELIAR, 4.5)
    _, total = path_matrices(a_lens, ghost_path(a_lens, *path), D_LINE_NM, sensor_plane(a_lens))
    assert tuple(total[0]) == pytest.approx(HELIAR_GHOSTS[path], abs=1e-6)
    assert np.linalg.det(total) == pytest.approx(1.0, abs=1e-9)


# every fifth of the zoom's 351 paths
ZOOM = [(CANON, 2.8, 5), pytest.param(CANON, 2.8, 1, marks=pytest.mark.slow)]


@pytest.mark.parametrize(("table", "f_number", "every"), [(HELIAR, 4.5, 1), (TESSAR, 2.8, 1), *ZOOM])
def test_determinants_are_the_ratio_of_the_indices(table, f_number, every):
    """n_in / n_out of each part: air in front and behind, so 1 at the stop and at the sensor, on every path."""
    a_lens = lens(table, f_number)
    for path in (direct_path(a_lens), *ghost_paths(a_lens)[::every]):
        to_stop, total = path_matrices(a_lens, path, D_LINE_NM, sensor_plane(a_lens))
        assert len(to_stop) == path.stop_crossings
        # entries reach 1e4, so their products cancel at 1e-8
        scale = np.abs(total).max() ** 2
        assert np.linalg.det(total) == pytest.approx(1.0, abs=1e-12 * scale + 1e-9)
        for Ma in to_stop:
            assert np.linalg.det(Ma) == pytest.approx(1.0, abs=1e-12 * np.abs(Ma).max() ** 2 + 1e-9)


def test_a_stop_within_glass_keeps_the_ratio():
    """Index 1.5 at the stop: det Ma = 1 / 1.5, det Ms = 1.5."""
    a_lens = Lens(
        name="split",
        f_number=8.0,
        rows=(
            Surface(curvature=0.02, thickness=2.0, medium=GLASS, semi_diameter=10.0),
            Stop(thickness=3.0),
            Surface(curvature=-0.01, thickness=0.0, semi_diameter=10.0),
        ),
    )
    n = gap_indices(a_lens, D_LINE_NM)
    assert n[1] == n[2] == pytest.approx(1.5, abs=1e-3)
    (Ma,), total = path_matrices(a_lens, direct_path(a_lens), D_LINE_NM, sensor_plane(a_lens))
    assert np.linalg.det(Ma) == pytest.approx(1.0 / n[1], rel=1e-9)
    assert np.linalg.det(total @ np.linalg.inv(Ma)) == pytest.approx(n[1], rel=1e-9)


def plain_matrices(a_lens: Lens, j: int, i: int, sensor_z: float) -> np.ndarray:
    """Textbook matrices in order: Re = +R forward and -R backward, first mirror +2/R, second -2/R."""
    n, z = gap_indices(a_lens, D_LINE_NM), vertex_positions(a_lens)
    M, here, forward = np.eye(2), 0.0, True
    legs = (range(j + 1), range(j - 1, i - 1, -1), range(i + 1, len(a_lens.rows)))
    for leg in legs:
        for row in leg:
            M = np.array([[1.0, abs(z[row] - here)], [0.0, 1.0]]) @ M
            here = z[row]
            surface = a_lens.rows[row]
            if isinstance(surface, Stop):
                continue
            power = surface.curvature if forward else -surface.curvature
            if row == leg[-1] and leg is not legs[-1]:
                M = np.array([[1.0, 0.0], [2.0 * power, 1.0]]) @ M
                continue
            n1, n2 = (n[row], n[row + 1]) if forward else (n[row + 1], n[row])
            M = np.array([[1.0, 0.0], [(n1 - n2) / n2 * power, n1 / n2]]) @ M
        forward = not forward
    return np.array([[1.0, sensor_z - here], [0.0, 1.0]]) @ M


@pytest.mark.parametrize(("table", "f_number", "every"), [(HELIAR, 4.5, 1), *ZOOM])
def test_flare_matrices_are_the_textbook_product(table, f_number, every):
    a_lens = lens(table, f_number)
    plane = sensor_plane(a_lens)
    for path in ghost_paths(a_lens)[::every]:
        _, total = path_matrices(a_lens, path, D_LINE_NM, plane)
        expected = plain_matrices(a_lens, path.first_reflection, path.second_reflection, plane)
        np.testing.assert_allclose(total, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("path", [None, *HELIAR_GHOSTS])
def test_exact_rays_tend_to_the_matrices(path):
    """To 4e-7 at a height of 5 micrometres; at ten times the height the error is a hundred times larger."""
    a_lens = lens(HELIAR, 4.5)
    order = first_order(a_lens)
    packed = pack_lens(a_lens, order, (None,) * len(a_lens.rows), np.array([D_LINE_NM]))
    way = direct_path(a_lens) if path is None else ghost_path(a_lens, *path)
    _, ((A, B), _) = path_matrices(a_lens, way, D_LINE_NM, packed.sensor_z)
    errors = []
    for size in (5e-3, 5e-2):
        # field angles (0, Y): rays run along (0, -tan Y, 1)
        slope = 1e-3 * size
        heights = np.array([-size, 0.5 * size, size])
        field = (0.0, float(np.degrees(np.arctan(-slope))))
        found = trace_rays(packed, way, np.zeros(3), heights, field)
        assert found["status"].all()
        expected = A * heights + B * slope
        scale = abs(A) * size + abs(B) * slope
        errors.append(float(np.abs(found["y"] - expected).max()) / scale)
    assert errors[0] < 4e-7
    assert 10.0 < errors[1] / errors[0] < 1000.0


# --- numbers of paths


@pytest.mark.parametrize(
    ("name", "every", "same_side"), [("heliar-tronnier", 28, 13), ("tessar-brendel", 21, 9), ("canon-28-80", 351, 171)]
)
def test_ghost_counts_of_the_shipped_lenses(name, every, same_side):
    a_lens = load_lens(name)
    paths, same = ghost_paths(a_lens), ghost_paths(a_lens, "same-side")
    assert (len(paths), len(same)) == (every, same_side)
    front = a_lens.stop_row
    back = len(a_lens.rows) - front - 1
    assert every == (front + back) * (front + back - 1) // 2
    assert same_side == front * (front - 1) // 2 + back * (back - 1) // 2
    # paths with a mirror on each side of the stop cross it three times, all others once
    for path in paths:
        across = path.first_reflection > front > path.second_reflection
        assert path.stop_crossings == (3 if across else 1)


# --- pupils


def biconvex(*, stop_first: bool, gap: float = 10.0) -> Lens:
    """Return a lens so thin that the thin-lens formulas hold to 1e-5, with the stop `gap` away."""
    front = Surface(curvature=0.01, thickness=1e-4, medium=GLASS, semi_diameter=20.0)
    back = Surface(curvature=-0.01, thickness=0.0 if stop_first else gap, semi_diameter=20.0)
    rows = (Stop(thickness=gap), front, back) if stop_first else (front, back, Stop(thickness=0.0))
    return Lens(name="thin", f_number=10.0, rows=rows)


def thin_focal_length() -> float:
    return 1.0 / (0.02 * (gap_indices(biconvex(stop_first=True), D_LINE_NM)[2] - 1.0))


def test_a_stop_in_front_is_its_own_entrance_pupil():
    f, order = thin_focal_length(), first_order(biconvex(stop_first=True))
    assert order.efl == pytest.approx(f, rel=1e-5)
    assert order.entrance_pupil_z == pytest.approx(0.0, abs=1e-12)
    assert order.entrance_pupil_diameter == pytest.approx(f / 10.0, rel=1e-5)
    assert order.stop_semi_diameter == pytest.approx(f / 20.0, rel=1e-5)
    # the exit pupil is its image: 1/s' = 1/f - 1/10, virtual, in front of the lens
    image = 1.0 / (1.0 / f - 1.0 / 10.0)
    assert order.exit_pupil_z == pytest.approx(10.0 + image, rel=1e-4)
    assert order.exit_pupil_diameter == pytest.approx(f / 10.0 * abs(image) / 10.0, rel=1e-4)


def test_a_stop_behind_is_its_own_exit_pupil():
    f, order = thin_focal_length(), first_order(biconvex(stop_first=False))
    assert order.exit_pupil_z == pytest.approx(10.0, abs=1e-3)
    magnification = f / (f - 10.0)
    assert order.entrance_pupil_diameter == pytest.approx(f / 10.0, rel=1e-5)
    assert order.exit_pupil_diameter == pytest.approx(f / 10.0 / magnification, rel=1e-4)
    assert order.entrance_pupil_z == pytest.approx(10.0 * magnification, rel=1e-4)


def test_a_stop_at_the_front_focus_is_telecentric():
    f = thin_focal_length()
    order = first_order(biconvex(stop_first=True, gap=f - 5e-5))
    assert abs(order.exit_pupil_z) > 1e6 or np.isinf(order.exit_pupil_z)


@pytest.mark.parametrize("name", ["heliar-tronnier", "canon-28-80", "flektogon-35", "nikkor-180-ed"])
def test_pupils_are_images_of_the_stop(name):
    """Rays through the centre and rim of the entrance pupil pass the centre and rim of the stop."""
    a_lens = load_lens(name)
    order = first_order(a_lens)
    (Ma,), _ = path_matrices(a_lens, direct_path(a_lens), D_LINE_NM, sensor_plane(a_lens))
    for u in (-0.1, 0.2):
        middle = Ma @ [-order.entrance_pupil_z * u, u]
        rim = Ma @ [order.entrance_pupil_diameter / 2.0 - order.entrance_pupil_z * u, u]
        assert middle[0] == pytest.approx(0.0, abs=1e-9)
        assert abs(rim[0]) == pytest.approx(order.stop_semi_diameter, rel=1e-9)


@pytest.mark.parametrize("name", ["heliar-tronnier", "canon-28-80", "nikkor-180-ed"])
def test_the_f_number_sets_the_stop(name):
    a_lens = load_lens(name)
    wide, tight = first_order(a_lens, a_lens.f_number), first_order(a_lens, 2.0 * a_lens.f_number)
    assert tight.stop_semi_diameter == pytest.approx(0.5 * wide.stop_semi_diameter, rel=1e-12)
    assert wide.entrance_pupil_diameter == pytest.approx(wide.efl / a_lens.f_number, rel=1e-12)


# --- focus


def test_focus_follows_the_thin_lens_formula():
    a_lens = biconvex(stop_first=True, gap=0.0)
    f = thin_focal_length()
    for s in (2.0 * f, 5.0 * f, 100.0 * f):
        order = first_order(a_lens, focus_distance=s)
        assert order.sensor_distance == pytest.approx(1.0 / (1.0 / f - 1.0 / s), rel=1e-5)
    assert first_order(a_lens, focus_distance=1e12).sensor_distance == pytest.approx(first_order(a_lens).bfl, rel=1e-9)


@pytest.mark.parametrize("name", ["heliar-tronnier", "canon-28-80"])
def test_focus_follows_newton(name):
    """x x' = f^2 from the foci of any lens."""
    a_lens = load_lens(name)
    order = first_order(a_lens)
    _, system = path_matrices(a_lens, direct_path(a_lens), D_LINE_NM, float(vertex_positions(a_lens)[-1]))
    front_focus = -system[1, 1] / system[1, 0]  # mm in front of the first vertex
    for distance in (600.0, 2000.0, 50000.0):
        moved = first_order(a_lens, focus_distance=distance).sensor_distance - order.bfl
        assert moved * (distance - front_focus) == pytest.approx(order.efl**2, rel=1e-9)


def test_focus_inside_the_front_focus_is_refused():
    with pytest.raises(LensError, match="front focus"):
        first_order(lens(TRIPLET, 5.0), focus_distance=10.0)


def test_a_stated_sensor_wins_over_the_focus_of_the_file():
    a_lens = lens(TRIPLET, 5.0).replace(focus_distance=1000.0)
    at_focus = first_order(a_lens).sensor_distance
    assert at_focus > first_order(lens(TRIPLET, 5.0)).sensor_distance
    assert first_order(a_lens, sensor_distance=40.0).sensor_distance == 40.0
    assert first_order(a_lens.replace(focus_distance=None, sensor_distance=41.0)).sensor_distance == 41.0


# --- systems that are no camera lens


@pytest.mark.parametrize(("curvatures", "words"), [((0.0, 0.0), "afocal"), ((-0.01, 0.01), "focal length is negative")])
def test_glass_without_an_image_is_refused(curvatures, words):
    rows = (
        Surface(curvature=curvatures[0], thickness=1.0, medium=GLASS, semi_diameter=5.0),
        Surface(curvature=curvatures[1], thickness=1.0, semi_diameter=5.0),
        Stop(),
    )
    with pytest.raises(LensError, match=words):
        first_order(Lens(name="window", f_number=8.0, rows=rows))
