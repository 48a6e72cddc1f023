"""Invariants: laws that hold for any numbers. Public API only, no oracle."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from prescriptions import CANON, HELIAR, TESSAR, TRIPLET, ghost_table_of, lens

from flarewright.model import Everywhere, Lens, Medium, QuarterWave, Stop, Surface
from flarewright.render.analysis import ghosts as analyse

FIELD = (8.0, 5.0)
# stopped down, a table takes a third of the time
OPENINGS = [16.0, pytest.param(8.0, marks=pytest.mark.slow), pytest.param(4.5, marks=pytest.mark.slow)]


@cache
def heliar_table(f_number, field=FIELD):
    """Return the `ghost_table` of the bare Heliar, which many tests use."""
    return ghost_table_of(lens(HELIAR, f_number), field)


def by_path(table) -> dict:
    rows = {(g.first_reflection, g.second_reflection): g for g in table.ghosts}
    return {None: table.direct, **rows}


def carrying(table, floor: float = 1e-4) -> dict:
    """Return direct image and ghosts above a part of the strongest, by path."""
    best = table.ghosts[0].throughput_mm2
    return {p: g for p, g in by_path(table).items() if g.throughput_mm2 > floor * best}


def scaled(a_lens: Lens, factor: float) -> Lens:
    rows = []
    for row in a_lens.rows:
        changes = {"thickness": row.thickness * factor}
        if not isinstance(row, Stop):
            changes |= {"curvature": row.curvature / factor, "semi_diameter": row.semi_diameter * factor}
        rows.append(row.replace(**changes))
    return a_lens.replace(rows=tuple(rows))


@pytest.mark.parametrize(("prescription", "every", "same_side"), [(HELIAR, 28, 13), (TESSAR, 21, 9), (CANON, 351, 171)])
def test_ghost_counts(prescription, every, same_side):
    from flarewright.optics.lens.paths import ghost_paths

    a_lens = lens(prescription, 4.0)
    assert len(ghost_paths(a_lens, "all")) == every
    assert len(ghost_paths(a_lens, "same-side")) == same_side


def test_ghost_table_lists_every_path_brightest_first():
    table = heliar_table(16.0)
    assert len(table.ghosts) == 28
    assert len({(g.first_reflection, g.second_reflection) for g in table.ghosts}) == 28
    flux = [g.throughput_mm2 for g in table.ghosts]
    assert flux == sorted(flux, reverse=True)
    same = ghost_table_of(lens(HELIAR, 16.0), FIELD, paths="same-side")
    assert len(same.ghosts) == 13
    every = by_path(table)
    for path, g in by_path(same).items():
        assert g == every[path]


@pytest.mark.parametrize("f_number", OPENINGS)
@pytest.mark.parametrize(("at", "part"), [(0, 0.4), pytest.param(3, 0.5, marks=pytest.mark.slow), (7, 0.25)])
def test_a_surface_that_is_none_changes_nothing(at, part, f_number):
    """A plane in the gap behind row `at` with equal indices: old paths keep their values, new ones carry 0."""
    whole = lens(HELIAR, f_number)
    row = whole.rows[at]
    extra = row.replace(curvature=0.0, thickness=row.thickness * (1 - part), semi_diameter=60.0, coating=None)
    rows = (*whole.rows[:at], row.replace(thickness=row.thickness * part), extra, *whole.rows[at + 1 :])
    a = by_path(heliar_table(f_number))
    b = by_path(ghost_table_of(whole.replace(rows=rows), FIELD))

    def renamed(k: int) -> int:
        return k if k <= at else k + 1

    for path, g in a.items():
        h = b.pop(path and (renamed(path[0]), renamed(path[1])))
        assert h.throughput_mm2 == pytest.approx(g.throughput_mm2, rel=1e-9)
        if g.rms_radius_mm < 100.0:
            assert h.centroid_mm == pytest.approx(g.centroid_mm, abs=1e-7 * g.rms_radius_mm + 1e-9)
            assert h.rms_radius_mm == pytest.approx(g.rms_radius_mm, rel=1e-7)
    assert len(b) == 8
    assert all(h.throughput_mm2 == pytest.approx(0.0, abs=1e-15) for h in b.values())


@pytest.mark.parametrize("f_number", OPENINGS)
@pytest.mark.parametrize("prescription", [TRIPLET, pytest.param(HELIAR, marks=pytest.mark.slow)])
def test_mirrored_light_mirrors_the_table(prescription, f_number):
    a_lens = lens(prescription, f_number)
    table = heliar_table(f_number) if prescription is HELIAR else ghost_table_of(a_lens, FIELD)
    for sx, sy in ((-1, 1), (1, -1), (-1, -1)):
        b = by_path(ghost_table_of(a_lens, (sx * FIELD[0], sy * FIELD[1])))
        for path, g in carrying(table).items():
            h = b[path]
            assert h.throughput_mm2 == pytest.approx(g.throughput_mm2, rel=1e-6)
            assert (sx * h.centroid_mm[0], sy * h.centroid_mm[1]) == pytest.approx(
                g.centroid_mm, abs=1e-5 * g.rms_radius_mm
            )
            assert h.rms_radius_mm == pytest.approx(g.rms_radius_mm, rel=1e-5)


@pytest.mark.parametrize("f_number", OPENINGS)
@pytest.mark.parametrize(
    "azimuth_deg", [pytest.param(30.0, marks=pytest.mark.slow), pytest.param(90.0, marks=pytest.mark.slow), 211.0]
)
@pytest.mark.parametrize("prescription", [TRIPLET, pytest.param(HELIAR, marks=pytest.mark.slow)])
def test_turning_the_light_turns_the_ghosts(prescription, azimuth_deg, f_number):
    """A round lens has no preferred azimuth: flux and size are constant, centroids rotate with the light."""
    a_lens = lens(prescription, f_number)
    slope = np.tan(np.radians(9.0))
    phi = np.radians(azimuth_deg)
    field = tuple(np.degrees(np.arctan(slope * np.array([np.cos(phi), np.sin(phi)]))).tolist())
    b = by_path(ghost_table_of(a_lens, field))
    for path, g in carrying(ghost_table_of(a_lens, (9.0, 0.0))).items():
        h = b[path]
        x, y = g.centroid_mm
        assert y == pytest.approx(0.0, abs=1e-5 * g.rms_radius_mm)
        turned = (x * np.cos(phi) - y * np.sin(phi), x * np.sin(phi) + y * np.cos(phi))
        assert h.throughput_mm2 == pytest.approx(g.throughput_mm2, rel=1e-6)
        assert h.centroid_mm == pytest.approx(turned, abs=1e-5 * g.rms_radius_mm)
        assert h.rms_radius_mm == pytest.approx(g.rms_radius_mm, rel=1e-5)


def test_a_lens_of_twice_the_size():
    """Four times the area, twice the distances; bare glass does not depend on the wavelength."""
    one = lens(TRIPLET, 16.0)
    a = carrying(ghost_table_of(one, FIELD))
    b = by_path(ghost_table_of(scaled(one, 2.0), FIELD))
    for path, g in a.items():
        assert b[path].throughput_mm2 == pytest.approx(4.0 * g.throughput_mm2, rel=2e-3)
        assert b[path].centroid_mm == pytest.approx([2.0 * v for v in g.centroid_mm], abs=4e-3 * g.rms_radius_mm)
        assert b[path].rms_radius_mm == pytest.approx(2.0 * g.rms_radius_mm, rel=4e-3)


@pytest.mark.parametrize("f_number", OPENINGS)
def test_light_on_the_axis_lands_on_the_axis(f_number):
    table = heliar_table(f_number, (0.0, 0.0))
    for g in carrying(table).values():
        assert g.centroid_mm == pytest.approx((0.0, 0.0), abs=2e-3 * g.rms_radius_mm)


@pytest.mark.parametrize("f_number", OPENINGS)
def test_no_more_light_comes_out_than_goes_in(f_number):
    """Direct image and all ghosts together are less than what the front surface takes in."""
    for field in ((0.0, 0.0), FIELD, (20.0, 10.0)):
        table = heliar_table(f_number, field)
        total = table.direct.throughput_mm2 + sum(g.throughput_mm2 for g in table.ghosts)
        assert 0.0 < total < np.pi * 14.0**2


def test_flux_falls_with_the_area_of_the_stop():
    """Direct image on the axis: throughput is proportional to 1 / N^2 with the same T."""
    a_lens = lens(HELIAR, 4.5)
    wide, tight = (
        ghost_table_of(a_lens, (0.0, 0.0), f_number=n, paths="same-side").direct.throughput_mm2 for n in (11.0, 22.0)
    )
    assert wide / tight == pytest.approx(4.0, rel=0.01)


@pytest.mark.parametrize("f_number", OPENINGS)
def test_a_coating_dims_ghosts_and_brightens_the_image(f_number):
    a_lens = lens(HELIAR, f_number)
    bare = heliar_table(f_number)
    coated = ghost_table_of(a_lens, FIELD, coating=Everywhere(coating=QuarterWave(center_wavelength_nm=587.56)))
    assert coated.direct.throughput_mm2 > bare.direct.throughput_mm2
    both = [(p, g, by_path(coated)[p]) for p, g in carrying(bare).items() if p is not None]
    cemented = {1, 7}
    assert all(h.throughput_mm2 < g.throughput_mm2 for p, g, h in both if not cemented & set(p))


def test_a_stop_in_front_of_the_first_surface_on_either_side():
    """A negative gap behind the stop puts the glass in front of it; the whole oblique beam is still found."""
    glass = Medium(glass=None, n_d=1.5168, v_d=64.2)
    direct = []
    for gap in (-3.0, 3.0):
        rows = (
            Stop(thickness=gap),
            Surface(curvature=0.01, thickness=4.0, medium=glass, semi_diameter=15.0),
            Surface(curvature=-0.01, semi_diameter=15.0),
        )
        singlet = Lens(name="singlet", f_number=12.0, rows=rows)
        direct.append(analyse(singlet, (20.0, 0.0)).direct.throughput_mm2)
    # the stop alone limits the beam, on either side
    assert direct[0] == pytest.approx(direct[1], rel=0.02)
