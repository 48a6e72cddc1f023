"""Rays through odd aspheres, against a tracer that bisects for the hit and takes differences for the normal."""

from __future__ import annotations

import math

import numpy as np
import pytest
from prescriptions import TRIPLET, lens

from flarewright.kernels.tracing.incident_light import IncidentLight
from flarewright.kernels.tracing.sequential import trace_hits
from flarewright.model import Stop
from flarewright.optics.lens.paraxial import first_order
from flarewright.optics.lens.paths import direct_path
from flarewright.optics.rays.bundle import incidence
from flarewright.optics.rays.pack import facing, pack_lens

TERMS = {"odd_asphere": (3e-4, -2e-6, 1e-8), "asphere": (-1e-5, 2e-8), "conic": -0.3}


def height(row, x, y):
    """Return the sag from the textbook's formula, term by term."""
    if isinstance(row, Stop):
        return 0.0
    r = math.hypot(x, y)
    sag = row.curvature * r**2 / (1.0 + math.sqrt(1.0 - (1.0 + row.conic) * row.curvature**2 * r**2))
    sag += sum(term * r ** (4 + 2 * k) for k, term in enumerate(row.asphere))
    return sag + sum(term * r ** (3 + 2 * k) for k, term in enumerate(row.odd_asphere))


def bisected(rows, indices, z, place, direction):
    """Return the hits of a ray on all rows, in the lens' frame."""
    hits = []
    for k, row in enumerate(rows):

        def above(t, row=row, vertex=z[k], place=place, direction=direction):
            x, y, depth = place + t * direction
            return depth - vertex - height(row, x, y)

        start = (z[k] - place[2]) / direction[2]
        low, high = start - 3.0, start + 3.0
        assert above(low) < 0.0 < above(high)
        for _ in range(60):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if above(middle) < 0.0 else (low, middle)
        place = place + low * direction
        hits.append(place)
        step, (x, y, _) = 1e-5, place
        slope_x = (height(row, x + step, y) - height(row, x - step, y)) / (2.0 * step)
        slope_y = (height(row, x, y + step) - height(row, x, y - step)) / (2.0 * step)
        normal = np.array([slope_x, slope_y, -1.0]) / math.sqrt(1.0 + slope_x**2 + slope_y**2)
        ratio, cosine = indices[k] / indices[k + 1], -normal @ direction
        direction = ratio * direction + (ratio * cosine - math.sqrt(1.0 - ratio**2 * (1.0 - cosine**2))) * normal
    return np.array(hits)


def test_rays_meet_and_leave_odd_aspheres_as_the_formula_says():
    a_lens = lens(TRIPLET, 5.0)
    rows = tuple(row.replace(**TERMS) if k in (0, 5) else row for k, row in enumerate(a_lens.rows))
    a_lens = a_lens.replace(rows=rows)
    seen = incidence((3.0, 5.0), None)
    packed = facing(pack_lens(a_lens, first_order(a_lens), (None,) * len(rows), np.array([550.0])), seen.axes, 0.0)
    assert packed.symmetric
    path = direct_path(a_lens)
    x, y = np.random.default_rng(7).uniform(-3.0, 3.0, (2, 20))
    # the axis, where r^3 has no slope
    x[0], y[0] = 0.0, 0.0
    hits = np.empty((x.size, len(path.rows) + 2, 3))
    trace_hits(
        path.rows, path.actions, packed.curvature, packed.form, packed.z_vertex, packed.n_gap[0], packed.sensor_z,
        *IncidentLight(seen.tilt, 0.0), x, y, hits,
    )  # fmt: skip
    assert np.isfinite(hits).all()
    # the rays of a distant light are parallel
    leg = hits[1, 1] - hits[1, 0]
    for found in hits:
        wanted = bisected(rows, packed.n_gap[0], packed.z_vertex, found[0], leg / np.linalg.norm(leg))
        assert found[1:-1] == pytest.approx(wanted, abs=1e-8)
