"""Rays traced in lanes compared with the same rays traced one by one, for every kind of surface."""

from __future__ import annotations

import numpy as np
import pytest
from prescriptions import TRIPLET, lens

from flarewright.kernels.tracing.incident_light import IncidentLight
from flarewright.kernels.tracing.path_steps import PathSteps
from flarewright.kernels.tracing.sequential import ALIVE, LANES, STOP, STOP_X, X, Y, trace_hits, trace_nodes
from flarewright.model import Figure
from flarewright.optics.lens.paraxial import first_order
from flarewright.optics.lens.paths import direct_path, ghost_path
from flarewright.optics.rays.bundle import incidence
from flarewright.optics.rays.pack import facing, pack_lens

BUMPS = tuple(tuple(float(v) for v in row) for row in np.random.default_rng(1).uniform(size=(12, 12)))
KINDS = {
    "centred": {},
    "moved": {"decentre": (0.2, -0.1), "tilt_deg": (0.5, -0.3)},
    "asphere": {"conic": 0.3, "asphere": (1e-5, -2e-7, 3e-10)},
    "odd asphere": {"conic": 0.3, "asphere": (1e-5,), "odd_asphere": (2e-4, -3e-6, 1e-10)},
    "cylinder": {"curvature_x": 0.0},
    "zernike": {"figure": Figure(zernike_nm=((5, 300.0), (9, -80.0), (28, 40.0)))},
    "image": {"figure": Figure(heights=BUMPS, image="bumps.png", peak_valley_nm=200.0)},
    "all": {
        "conic": -0.4,
        "asphere": (1e-5,),
        "decentre": (0.1, 0.0),
        "figure": Figure(zernike_nm=((7, 5000.0),), heights=BUMPS, image="bumps.png", peak_valley_nm=500.0),
    },
}


@pytest.mark.parametrize("nearness", [0.0, 1.0 / 300.0])
@pytest.mark.parametrize("kind", KINDS)
def test_lanes_are_rays_one_by_one(kind, nearness):
    a_lens = lens(TRIPLET, 5.0)
    rows = list(a_lens.rows)
    # a decentred first row sends the centred rows through the shape table too
    rows[0] = rows[0].replace(**KINDS["moved"])
    rows[1] = rows[1].replace(**KINDS[kind])
    a_lens = a_lens.replace(rows=tuple(rows))
    seen = incidence((4.0, 7.0), None)
    packed = facing(pack_lens(a_lens, first_order(a_lens), (None,) * len(rows), np.array([550.0])), seen.axes, nearness)
    # more than two sets of lanes, the last not full; some miss
    x, y = np.random.default_rng(2).uniform(-9.0, 9.0, (2, 2 * LANES + 7))
    for path in (direct_path(a_lens), ghost_path(a_lens, 4, 1)):
        light = IncidentLight(seen.tilt, nearness)
        out = np.empty((x.size, STOP_X + 2 * path.stop_crossings))
        arrays = packed.arrays(packed.n_gap[0], packed.reflectance[0])
        trace_nodes(PathSteps(path.rows, path.actions), arrays, light, x, y, out)
        hits = np.empty((x.size, len(path.rows) + 2, 3))
        trace_hits(
            path.rows,
            path.actions,
            packed.curvature,
            packed.form,
            packed.z_vertex,
            packed.n_gap[0],
            packed.sensor_z,
            *light,
            x,
            y,
            hits,
        )
        alive = np.isfinite(hits[:, -1]).all(axis=1)
        assert np.array_equal(out[:, ALIVE] > 0.0, alive)
        assert alive.sum() > 10
        assert out[alive][:, [X, Y]] == pytest.approx(hits[alive][:, -1, :2], abs=2e-6)
        stop = 1 + int(np.flatnonzero(path.actions == STOP)[0])
        assert out[alive][:, STOP_X : STOP_X + 2] == pytest.approx(hits[alive][:, stop, :2], abs=2e-6)
        # rays that ended store the number of surfaces they passed
        passed = np.isfinite(hits[:, 1:-1, 0]) & (path.actions != STOP)
        assert np.array_equal(out[~alive, X], passed[~alive].sum(axis=1))
