"""Estimated clear apertures: wide enough for the beam, marked as estimates, and possible as glass."""

from __future__ import annotations

from itertools import pairwise
from math import sqrt

import numpy as np
import pytest
from sensor_rays import trace_rays

from flarewright.io.lens.library import library_names
from flarewright.model import Dispersion, Lens, Medium, Stop, Surface
from flarewright.optics.lens.dispersion import D_LINE_NM
from flarewright.optics.lens.paraxial import first_order
from flarewright.optics.lens.paths import direct_path
from flarewright.optics.lens_import.semi_diameters import half_field, with_semi_diameters
from flarewright.optics.rays.pack import pack_lens
from flarewright.render.scene.resolve import load_lens

NAMES = tuple(library_names())


def stripped(name: str) -> Lens:
    """Return a lens of the library without its clear apertures."""
    a_lens = load_lens(name)
    rows = tuple(
        row if isinstance(row, Stop) else row.replace(semi_diameter=None, semi_diameter_estimated=False)
        for row in a_lens.rows
    )
    return a_lens.replace(rows=rows)


def beam(a_lens: Lens, field_deg: float, count: int = 401) -> dict[str, np.ndarray]:
    """Trace a meridional fan at the f-number with rims."""
    order = first_order(a_lens)
    packed = pack_lens(a_lens, order, (None,) * len(a_lens.rows), np.array([D_LINE_NM]))
    half = 0.5 * order.entrance_pupil_diameter
    lean = order.entrance_pupil_z * np.tan(np.radians(field_deg))
    y = np.linspace(-half, half, count) * 0.999 + lean
    found = trace_rays(packed, direct_path(a_lens), np.zeros(count), y, (0.0, field_deg))
    found["in_stop"] = np.abs(found["stop_y"]) <= order.stop_semi_diameter
    return found


def sag(row: Surface, r: float) -> float:
    c = row.curvature
    return c * r * r / (1.0 + sqrt(max(1.0 - (1.0 + row.conic) * c * c * r * r, 0.0)))


@pytest.mark.parametrize("name", NAMES)
def test_estimates_pass_the_beam_on_the_axis(name):
    """Every ray of the full opening that passes the stop passes every rim."""
    found = beam(with_semi_diameters(stripped(name)), 0.0)
    passing = found["in_stop"] & (found["status"] > 0.0)
    assert passing.mean() > 0.8
    assert found["rel_radius"][passing].max() <= 1.0 + 1e-9


@pytest.mark.parametrize("name", NAMES)
def test_estimates_are_marked_and_only_they(name):
    bare = stripped(name)
    full = with_semi_diameters(bare)
    surfaces = [row for row in full.rows if isinstance(row, Surface)]
    assert all(row.semi_diameter_estimated and row.semi_diameter > 0.0 for row in surfaces)
    given = load_lens(name)
    assert with_semi_diameters(given) is given
    # one given, the others missing
    first = next(k for k, row in enumerate(given.rows) if isinstance(row, Surface))
    mixed = with_semi_diameters(
        bare.replace(rows=tuple(given.rows[k] if k == first else row for k, row in enumerate(bare.rows)))
    )
    assert mixed.rows[first] == given.rows[first]
    assert sum(row.semi_diameter_estimated for row in mixed.rows if isinstance(row, Surface)) >= len(surfaces) - 1


@pytest.mark.parametrize("name", NAMES)
def test_estimates_do_not_cross_their_neighbours(name):
    for front, back in pairwise(with_semi_diameters(stripped(name)).rows):
        if isinstance(front, Surface) and isinstance(back, Surface):
            r = min(front.semi_diameter, back.semi_diameter)
            assert front.thickness + sag(back, r) - sag(front, r) >= 0.0
    for row in with_semi_diameters(stripped(name)).rows:
        if isinstance(row, Surface) and row.curvature:
            assert abs(row.curvature) * row.semi_diameter < 1.0


@pytest.mark.parametrize("name", NAMES)
def test_estimates_light_the_corner(name):
    """At the half field the beam is vignetted, but not dark."""
    a_lens = with_semi_diameters(stripped(name))
    angle = float(np.degrees(half_field(a_lens)))
    order = first_order(a_lens)
    packed = pack_lens(a_lens, order, (None,) * len(a_lens.rows), np.array([D_LINE_NM]))
    # the pupil of a wide angle moves: search the whole front
    front = next(row.semi_diameter for row in a_lens.rows if isinstance(row, Surface))
    y = np.linspace(-3.0 * front, 3.0 * front, 6001)
    found = trace_rays(packed, direct_path(a_lens), np.zeros_like(y), y, (0.0, min(angle, 80.0)))
    inside = np.abs(found["stop_y"]) <= order.stop_semi_diameter
    assert ((found["status"] > 0.0) & (found["rel_radius"] <= 1.0) & inside).any()


def test_a_lens_without_a_field_covers_the_small_format():
    flat = Dispersion(glass="Cauchy", formula="cauchy", coefficients=(1.5, 0.0), range_nm=(300.0, 1100.0))
    glass = Medium(n_d=1.5, dispersion=flat)
    rows = (
        Surface(curvature=0.02, thickness=4.0, medium=glass),
        Surface(curvature=0.0, thickness=2.0),
        Stop(),
    )
    a_lens = Lens(name="single", f_number=8.0, rows=rows)
    assert np.tan(half_field(a_lens)) * first_order(a_lens).efl == pytest.approx(21.63)
    full = with_semi_diameters(a_lens)
    assert full.rows[0].semi_diameter > first_order(a_lens).efl / 16.0
