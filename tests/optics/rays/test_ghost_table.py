"""The ghost table: each column against rays and pictures."""

from __future__ import annotations

import numpy as np
import pytest
from prescriptions import HELIAR, TESSAR, ghost_table_of, lens
from sensor_rays import trace_rays

from flarewright.errors import FlarewrightError
from flarewright.model import Bare, Everywhere, QuarterWave
from flarewright.optics.lens.dispersion import D_LINE_NM
from flarewright.optics.lens.paraxial import first_order, path_matrices, vertex_positions
from flarewright.optics.lens.paths import ghost_path, ghost_paths
from flarewright.optics.rays.ghost_table import bounding_edges
from flarewright.optics.rays.pack import pack_lens
from flarewright.render.scene.resolve import load_lens

FIELD = (8.0, 5.0)


@pytest.fixture(scope="module")
def heliar():
    # stopped down, a table takes a third of the time
    return lens(HELIAR, 8.0)


@pytest.fixture(scope="module")
def table(heliar):
    return ghost_table_of(heliar, FIELD)


def pupil_rays(a_lens, path, count: int = 400):
    """Return a square grid of rays over the front, which of them pass, and the area of each."""
    order = first_order(a_lens)
    packed = pack_lens(a_lens, order, (None,) * len(a_lens.rows), np.array([D_LINE_NM]))
    at = (np.arange(count) + 0.5) / count * 34.0 - 17.0
    x, y = (g.ravel() for g in np.meshgrid(at, at))
    found = trace_rays(packed, path, x, y, FIELD)
    ok = (found["status"] > 0) & (found["rel_radius"] <= 1.0)
    ok &= np.hypot(found["stop_x"], found["stop_y"]) <= packed.stop_semi
    cosine = 1.0 / np.sqrt(1.0 + sum(np.tan(np.radians(f)) ** 2 for f in FIELD))
    return {k: v[ok] for k, v in found.items()}, (34.0 / count) ** 2 * cosine


@pytest.mark.parametrize("pair", [(4, 1), (8, 6), (3, 2), (2, 0)])
def test_throughput_centroid_and_size_are_sums_over_rays(heliar, table, pair):
    """Paths within one side of the stop; positions in the upright picture, which is the sensor turned around."""
    row = next(g for g in table.ghosts if (g.first_reflection, g.second_reflection) == pair)
    rays, cell = pupil_rays(heliar, ghost_path(heliar, *pair))
    w = rays["weight"]
    cx, cy = -(w @ rays["x"]) / w.sum(), -(w @ rays["y"]) / w.sum()
    rms = np.sqrt(w @ ((-rays["x"] - cx) ** 2 + (-rays["y"] - cy) ** 2) / w.sum())
    assert row.throughput_mm2 == pytest.approx(w.sum() * cell, rel=5e-3)
    assert row.centroid_mm == pytest.approx((cx, cy), abs=5e-3 * rms)
    assert row.rms_radius_mm == pytest.approx(rms, rel=5e-3)


def test_peak_is_the_mean_or_more(table):
    """Irradiance of a patch per direct flux: at least about that of a uniform disc of the same rms radius."""
    for g in table.ghosts:
        if g.throughput_mm2 > 1e-4 * table.ghosts[0].throughput_mm2:
            even = g.throughput_mm2 / table.direct.throughput_mm2 / (2.0 * np.pi * g.rms_radius_mm**2)
            assert g.peak_irradiance > 0.7 * even
            # nor more than all its light in one patch
            assert g.peak_irradiance * g.peak_patch_mm**2 <= g.throughput_mm2 / table.direct.throughput_mm2 * 1.001


def test_the_focus_of_a_path_is_where_its_matrix_says(heliar, table):
    """With the sensor moved there, the ghost of a light on the axis is a point, to first order."""
    order = first_order(heliar)
    plane = float(vertex_positions(heliar)[-1] + order.sensor_distance)
    for g in table.ghosts:
        path = ghost_path(heliar, g.first_reflection, g.second_reflection)
        if g.focus_distance_mm is not None:
            _, total = path_matrices(heliar, path, D_LINE_NM, plane + g.focus_distance_mm)
            assert total[0, 0] == pytest.approx(0.0, abs=1e-6)
    direct = table.direct.focus_distance_mm
    assert direct == pytest.approx(0.0, abs=1e-9)


def test_stopping_down_hands_the_ghosts_to_the_stop(heliar):
    """The smaller of the two apertures limits a ghost; with a smaller stop, only the stop can take over."""
    wide, tight = (ghost_table_of(heliar, (0.0, 0.0), f_number=n) for n in (8.0, 22.0))
    by_stop = [
        {(g.first_reflection, g.second_reflection) for g in t.ghosts if g.bounded_by == "stop"} for t in (wide, tight)
    ]
    assert by_stop[0] < by_stop[1]
    assert {g.bounded_by for g in wide.ghosts} == {"stop", "entrance"}


def test_of_three_crossings_of_the_stop_the_tightest_bounds_the_ghost(heliar):
    """A ray at the edge of the entrance misses the stop at one of its crossings, or the entrance limits the ghost."""
    for f_number in (8.0, 16.0):
        order = first_order(heliar, f_number=f_number)
        pack = pack_lens(heliar, order, (None,) * len(heliar.rows), np.array([D_LINE_NM]))
        edge = pack.semi[pack.first_surface]
        paths = ghost_paths(heliar)
        heights = [[abs(Ma[0, 0]) * edge for Ma in path_matrices(heliar, path, D_LINE_NM, 0.0)[0]] for path in paths]
        reported = bounding_edges(heliar, order, paths)
        assert reported == ["stop" if max(crossings) > pack.stop_semi else "entrance" for crossings in heights]
        # some cross it three times, with different clearances
        assert any(min(one) < pack.stop_semi < max(one) for one in heights if len(one) == 3)


def test_threads_do_not_change_a_digit(heliar):
    one, three = (ghost_table_of(heliar, FIELD, f_number=16.0, paths="same-side", threads=n) for n in (1, 3))
    assert one == three


def test_the_direct_image_lands_where_the_focal_length_says():
    """Near the axis: (+f tan X, +f tan Y) in the upright picture, and sharp."""
    for name in ("heliar-tronnier", "canon-28-80", "tessar-brendel"):
        a_lens = load_lens(name)
        with pytest.MonkeyPatch.context() as patch:
            # skip the hundreds of ghosts of a zoom
            patch.setattr("flarewright.optics.rays.ghost_table.ghost_paths", lambda *_, **__: ())
            found = ghost_table_of(a_lens, (1.0, 0.5), f_number=16.0)
        expected = found.efl * np.tan(np.radians([1.0, 0.5]))
        assert found.direct.centroid_mm == pytest.approx(expected, rel=5e-3)
        assert found.direct.rms_radius_mm < 0.02
        assert found.direct.first_reflection is None


def test_a_wavelength_of_its_own(heliar):
    """A coating designed for the wavelength dims its ghosts most."""
    quarter = Everywhere(coating=QuarterWave(center_wavelength_nm=450.0))
    at_450, at_650 = (
        ghost_table_of(lens(TESSAR, 8.0), FIELD, coating=quarter, wavelength_nm=nm, paths="same-side")
        for nm in (450.0, 650.0)
    )
    pick = {(g.first_reflection, g.second_reflection): g.throughput_mm2 for g in at_450.ghosts}
    red = {(g.first_reflection, g.second_reflection): g.throughput_mm2 for g in at_650.ghosts}
    assert pick[7, 6] < 0.7 * red[7, 6]
    assert at_450.wavelength_nm == 450.0


def test_a_light_behind_the_rim_leaves_zeros(heliar):
    """No light passes at 80 degrees: zeros, no NaN, no exception."""
    found = ghost_table_of(heliar, (80.0, 0.0), coating=Everywhere(coating=Bare()))
    assert found.direct.throughput_mm2 == 0.0
    for g in found.ghosts:
        assert np.isfinite([g.throughput_mm2, *g.centroid_mm, g.rms_radius_mm, g.peak_irradiance]).all()


def test_a_coating_list_of_the_wrong_length_is_refused(heliar):
    from flarewright.model import PerRow

    with pytest.raises(FlarewrightError, match="one entry per row"):
        ghost_table_of(heliar, FIELD, coating=PerRow(coatings=(None,) * 3))
