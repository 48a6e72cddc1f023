"""Scaled lenses: geometrical optics has no unit of length, so a lens scaled by k gives the scaled answer.

Wavelengths, coatings, imperfections and the default picture of 36 x 24 mm keep their size. A factor of 8 changes no
digit of a binary number, so any difference is an absolute length in the program.
"""

from __future__ import annotations

import os
from math import degrees
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from prescriptions import ghost_table_of

from flarewright.errors import LensError
from flarewright.io.lens.library import library_names
from flarewright.model import Dispersion, Everywhere, Lens, Medium, QuarterWave, Stop, Surface
from flarewright.optics.lens.paraxial import first_order
from flarewright.optics.lens_import.semi_diameters import half_field, with_semi_diameters
from flarewright.render.scene.resolve import load_lens

FOLDER = Path(os.environ.get("FLAREWRIGHT_CORPUS", Path(__file__).parents[3] / "shared" / "lens_corpus"))
FILES = sorted(FOLDER.glob("**/*.lens"))
NAMES = tuple(library_names())
FACTORS = (0.1, 0.125, 8.0, 10.0)
EVERY = [0.1, *(pytest.param(factor, marks=pytest.mark.slow) for factor in FACTORS[1:3]), 10.0]
LENGTHS = ("efl", "bfl", "entrance_pupil_diameter", "entrance_pupil_z", "stop_semi_diameter", "sensor_distance")


def scaled_rows(lens: Lens, k: float) -> tuple[Surface | Stop, ...]:
    """Return the rows `k` times as large."""

    def row_of(row: Surface | Stop) -> Surface | Stop:
        if isinstance(row, Stop):
            return row.replace(thickness=k * row.thickness)
        return row.replace(
            curvature=row.curvature / k, curvature_x=None if row.curvature_x is None else row.curvature_x / k,
            asphere=tuple(term / k ** (3 + 2 * n) for n, term in enumerate(row.asphere)),
            decentre=None if row.decentre is None else tuple(k * one for one in row.decentre),
            thickness=k * row.thickness, semi_diameter=None if row.semi_diameter is None else k * row.semi_diameter,
        )  # fmt: skip

    return tuple(map(row_of, lens.rows))


def scaled(lens: Lens, k: float) -> Lens:
    """Return a lens `k` times as large, with the same field."""

    def length(mm: float | None) -> float | None:
        return None if mm is None else k * mm

    return lens.replace(
        rows=scaled_rows(lens, k), field_deg=degrees(half_field(lens)), elements=(), positions=(),
        sensor_distance=length(lens.sensor_distance), focus_distance=length(lens.focus_distance),
        stated_focal_length=length(lens.stated_focal_length),
    )  # fmt: skip


def same_order(lens: Lens, other: Lens, k: float) -> None:
    """Compare first order and rims of a lens and of the scaled one, both completed."""
    one, two = first_order(lens), first_order(other)
    assert two.f_number == one.f_number
    for name in LENGTHS:
        assert getattr(two, name) == pytest.approx(k * getattr(one, name), rel=1e-9, abs=1e-9 * k * one.efl), name
    rims = [[row.semi_diameter for row in each.rows if isinstance(row, Surface)] for each in (lens, other)]
    np.testing.assert_allclose(rims[1], k * np.array(rims[0]), rtol=1e-9)


def same_ghosts(lens: Lens, other: Lens, k: float, **query: Any) -> None:
    """Compare the ghost tables of a lens and of the scaled one.

    Rounding by another factor than 8 can refine another cell of a faint ghost, or search its pupil in other cells. This
    changes it within the accuracy of the table: there the limit is a part of the light of all ghosts.
    """
    field = 0.3 * lens.field_deg, 0.2 * lens.field_deg
    one, two = (ghost_table_of(each, field, threads=1, **query) for each in (lens, other))
    found = {row.name: row for row in two.ghosts}
    every = sum(row.throughput_mm2 for row in one.ghosts)
    exact = k in (0.125, 8.0)
    assert two.direct.throughput_mm2 == pytest.approx(k**2 * one.direct.throughput_mm2, rel=1e-9)
    for row in one.ghosts:
        there = found[row.name]
        light = row.throughput_mm2
        assert there.throughput_mm2 / k**2 == pytest.approx(light, rel=1e-9, abs=0.0 if exact else 1e-7 * every)
        if light > 1e-5 * every or exact:
            assert there.bounded_by == row.bounded_by
            # other cells give other errors, of the table's accuracy
            near = 1e-6 if exact else 1e-3
            assert there.rms_radius_mm / k == pytest.approx(row.rms_radius_mm, rel=near)
            atol = (1e-9 if exact else 1e-5) * one.efl
            np.testing.assert_allclose(np.array(there.centroid_mm) / k, row.centroid_mm, rtol=near, atol=atol)


def air_spaced(gap: float) -> Lens:
    """Return an achromat whose two elements are a thin gap apart."""
    crown, flint = (
        Medium(n_d=n, dispersion=Dispersion(glass="Cauchy", formula="cauchy", coefficients=(n, 0.0),
                                            range_nm=(300.0, 1100.0)))
        for n in (1.5168, 1.62)
    )  # fmt: skip
    rows = (
        Surface(curvature=1 / 60, thickness=7.0, medium=crown), Surface(curvature=-1 / 44, thickness=gap),
        Surface(curvature=-1 / 43.9, thickness=3.0, medium=flint), Surface(curvature=-1 / 240, thickness=3.0), Stop(),
    )  # fmt: skip
    return Lens(name="air-spaced", f_number=6.0, field_deg=1.0, rows=rows)


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if k % 5 == 0 else pytest.mark.slow) for k, name in enumerate(NAMES)]
)
def test_a_scaled_lens_has_the_scaled_first_order_and_rims(name):
    lens = scaled(load_lens(name), 1.0)
    bare = lens.replace(
        rows=tuple(row.replace(semi_diameter=None) if isinstance(row, Surface) else row for row in lens.rows)
    )
    for factor in (0.1, 10.0):
        same_order(with_semi_diameters(bare), with_semi_diameters(scaled(bare, factor)), factor)


# a factor of ten, or a tenth, refines other cells; one of them shows it
@pytest.mark.parametrize("factor", [0.1, *(pytest.param(factor, marks=pytest.mark.slow) for factor in FACTORS[1:])])
def test_a_scaled_lens_has_the_scaled_ghosts(factor):
    lens = air_spaced(0.04)
    whole, other = with_semi_diameters(lens), with_semi_diameters(scaled(lens, factor))
    same_ghosts(whole, other, factor, coating=Everywhere(coating=QuarterWave(center_wavelength_nm=550.0)))


def test_rims_do_not_jump_as_a_gap_becomes_thin():
    """Each rim passes the axial beam, and varies by no more than a step of the estimate while the gap thins out."""
    order = first_order(air_spaced(0.06))
    for row in range(4):
        rims = [with_semi_diameters(air_spaced(gap)).rows[row].semi_diameter for gap in (0.1, 0.06, 0.05, 0.04, 0.02)]
        assert min(rims) > 0.98 * 0.5 * order.entrance_pupil_diameter * (1.0 - 0.05 * row)
        assert max(rims) < 1.03 * min(rims)


@pytest.mark.parametrize("factor", EVERY)
def test_afocal_is_what_rounding_leaves_of_the_surfaces_powers(factor):
    """A rod of length n (R1 - R2) / (n - 1) is a telescope; a weak surface alone has a focal length, if a long one."""
    glass = air_spaced(0.04).rows[0].medium.replace(n_d=1.5)
    front = Surface(curvature=1 / 7.3, thickness=3.0 * 14.6, medium=glass)
    rod = Lens(name="rod", f_number=4.0, rows=(front, Surface(curvature=-1 / 7.3), Stop()), field_deg=1.0)
    with pytest.raises(LensError, match="afocal"):
        first_order(rod.replace(rows=scaled_rows(rod, factor)))
    weak = rod.replace(rows=(front.replace(curvature=1e-10), Surface(), Stop()))
    assert first_order(weak.replace(rows=scaled_rows(weak, factor))).efl == pytest.approx(2e10 * factor, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("factor", EVERY)
@pytest.mark.parametrize("name", NAMES)
def test_every_shipped_lens_has_the_scaled_ghosts(name, factor):
    lens = with_semi_diameters(scaled(load_lens(name), 1.0))
    same_ghosts(lens, scaled(lens, factor), factor)


@pytest.mark.slow
@pytest.mark.skipif(not FILES, reason=f"no lens corpus at {FOLDER}; set FLAREWRIGHT_CORPUS to its folder")
@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem[:30])
def test_every_lens_of_the_corpus_has_the_scaled_answer(path):
    try:
        lens = scaled(load_lens(path), 1.0)
    except LensError:
        pytest.skip("refused")
    bare = lens.replace(
        rows=tuple(row.replace(semi_diameter=None) if isinstance(row, Surface) else row for row in lens.rows)
    )
    for factor in FACTORS:
        same_order(with_semi_diameters(bare), with_semi_diameters(scaled(bare, factor)), factor)
    same_ghosts(with_semi_diameters(lens), with_semi_diameters(scaled(lens, 8.0)), 8.0, paths="same-side")
