"""The form of look-up chosen for a polygon gives the value that a look-up at any place gives."""

from __future__ import annotations

import numpy as np
import pytest

from flarewright.kernels.jit.decorators import for_python
from flarewright.kernels.raster import stop_pattern
from flarewright.kernels.raster.stop_pattern import ALONG_BLADE, EDGE, EDGE_COUNT, EDGE_PER_MM, OPEN, RADIUS, ROUND
from flarewright.model import Iris
from flarewright.optics.pupil.blade_form import blade_form
from flarewright.optics.pupil.iris import blade_edges
from flarewright.render.ghosts.ring_tables import edge_crossing

place_in_pattern = for_python(stop_pattern.place_in_pattern)
pattern_value = for_python(stop_pattern.pattern_value)


def white_patterns(iris, blade_mm=2.0, area=4e-3):
    """Return the kernel's arrays for an iris in light of 450 to 650 nm, lambda L from 0.8 to 1.2 of `area` mm^2."""
    form = blade_form(blade_edges(iris, blade_mm))
    waves = np.linspace(450.0, 650.0, 9)
    crossing = edge_crossing(form, waves, area * np.linspace(0.8, 1.2, 9), 0.0)
    assert crossing is not None
    (piece,) = crossing.pieces([(waves, np.full(9, 1.0 / 9.0))])
    return form, piece.values, piece.row[None], np.ascontiguousarray(form.corners)


@pytest.mark.parametrize("iris", [Iris(blades=5, rounding=0.5, rotation_deg=11), Iris(blades=8, rounding=0.2)])
def test_a_curved_blade_beside_its_corners_is_read_across_its_arc(iris):
    """Small triangles along the border: those between the corners need only the distance from one arc."""
    form, values, table, corners = white_patterns(iris)
    rng = np.random.default_rng(3)
    forms = []
    for _ in range(3000):
        angle, radius = rng.uniform(0.0, 2.0 * np.pi), form.distance * rng.uniform(0.8, 1.05)
        middle = radius * np.array([np.cos(angle), np.sin(angle)])
        triangle = middle + rng.uniform(-0.02, 0.02, (3, 2))
        moved = triangle.copy()
        way = place_in_pattern(table, corners, 0, moved, 3)
        forms.append(way)
        if way == ROUND:
            share = rng.dirichlet(np.ones(3))
            x, y = share @ triangle
            beyond = np.hypot(*(share @ moved)) - table[0, RADIUS]
            count = table[0, EDGE_COUNT]
            at = np.clip(beyond * table[0, EDGE_PER_MM] + 0.5 * (count - 1.0), 0.0, count - 1.0)
            profile = values[int(table[0, EDGE]) + np.arange(int(count))]
            value = np.interp(at, np.arange(len(profile)), profile)
            assert pattern_value(values, table, corners, 0, x, y) == pytest.approx(value, abs=3e-3)
    # corners and the open middle keep their forms, and every form is met
    assert {ROUND, ALONG_BLADE, OPEN} <= set(forms)
    assert np.count_nonzero(np.array(forms) == ROUND) > 300


@pytest.mark.parametrize("iris", [Iris(blades=5, rounding=0.5), Iris(blades=6)])
def test_triangles_at_a_corner_read_its_table(iris):
    form, _, table, corners = white_patterns(iris)
    at = form.distance * corners[1]
    triangle = at + 0.01 * np.array([[1.0, 0.0], [-0.5, 0.8], [-0.5, -0.8]])
    assert place_in_pattern(table, corners, 0, triangle.copy(), 3) == ALONG_BLADE
