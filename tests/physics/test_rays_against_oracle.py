"""Ray by ray: the fast tracer and the oracle agree on position, weight and survival of each ray."""

from __future__ import annotations

import numpy as np
import pytest
from oracle import from_lens, ghost_paths, glass_air_films, trace
from prescriptions import FIVE, lens, system
from sensor_rays import trace_rays

from flarewright.model import AsLens, Everywhere, QuarterWave
from flarewright.optics.lens.paraxial import first_order
from flarewright.optics.lens.paths import direct_path, ghost_path
from flarewright.optics.rays.pack import pack_lens, resolve_coatings

FIELDS = [(0.0, 0.0), (8.0, 5.0), (-15.0, 8.0), (40.0, 10.0)]
QUARTER_WAVE = QuarterWave(center_wavelength_nm=500.0)


# three elements, and six of which some are cemented
QUICK = ("triplet", "biotar")


@pytest.mark.parametrize(("count", "paths"), [(200, 12), pytest.param(600, 40, marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    ("name", "coated"),
    [
        *(pytest.param(name, True, marks=() if name in QUICK else pytest.mark.slow) for name in FIVE),
        # one case suffices: rays behave alike, and some surfaces of a coated lens are bare
        ("heliar", False),
        *(pytest.param(name, False, marks=pytest.mark.slow) for name in FIVE if name != "heliar"),
    ],
)
def test_rays(name, coated, count, paths):
    """Skew rays of many paths, also far outside the glass: the same rays end, the others agree to 1e-9 mm.

    Compared within twice the semi-diameters: farther out rays graze spheres, and double-precision rounding grows
    without bound. A ray almost parallel to the sensor multiplies its rounding by 1 / d_z^2. R is tabulated in the fast
    code: 1e-4.
    """
    table, f_number = FIVE[name]
    s, a_lens = system(table, f_number), lens(table, f_number)
    choice = AsLens()
    if coated:
        s, choice = s.with_films(glass_air_films(s, QUARTER_WAVE)), Everywhere(coating=QUARTER_WAVE)
    packed = pack_lens(a_lens, first_order(a_lens), resolve_coatings(a_lens, choice), np.array([587.56]))
    assert packed.stop_semi == pytest.approx(s.rows[s.stop].semi_diameter, abs=1e-10)
    assert packed.sensor_z == pytest.approx(s.sensor_z, abs=1e-10)
    h = s.rows[0].semi_diameter
    x, y = places = np.random.default_rng(0).uniform(-1.3 * h, 1.3 * h, (2, count))
    if count < 600:
        # so that enough of the few rays pass
        places[:, ::2] *= 0.2
    every = ghost_paths(s)
    seen = 0
    for path in [None, *every[:: max(1, len(every) // paths)]]:
        fast_path = direct_path(a_lens) if path is None else ghost_path(a_lens, *path)
        for field in FIELDS:
            slow = trace(s, path, x, y, field)
            fast = trace_rays(packed, fast_path, x, y, field)
            assert ((fast["status"] > 0) == slow.alive).all()
            live = slow.alive
            seen += int(live.sum())
            for ours, theirs in ((fast["x"], -slow.x), (fast["y"], -slow.y)):
                unit = np.maximum(1.0, np.hypot(slow.x, slow.y)[live] / 100.0) / slow.direction[2, live] ** 2
                assert np.abs((ours - theirs)[live] / unit)[slow.rel_radius[live] < 2.0].max(initial=0.0) < 1e-9
            inner = live & (slow.rel_radius < 2.0)
            assert np.abs(fast["stop_x"] - slow.stop_x)[inner].max(initial=0.0) < 1e-9
            assert np.abs(fast["stop_y"] - slow.stop_y)[inner].max(initial=0.0) < 1e-9
            near = live & (slow.rel_radius < 1.0)
            assert fast["weight"][near] == pytest.approx(slow.weight[0, near], rel=1e-4)
            assert np.abs(fast["weight"] - slow.weight[0])[live].max(initial=0.0) < 1e-4
    assert seen > 1000


def test_the_oracle_reads_the_model_as_it_was_typed():
    """The oracle reads a frozen Lens and a typed table as the same system."""
    for table, f_number in FIVE.values():
        a, b = from_lens(lens(table, f_number)), system(table, f_number)
        for p, q in zip(a.rows, b.rows, strict=True):
            assert (p.curvature, p.index, p.semi_diameter, p.is_stop) == (
                q.curvature,
                q.index,
                q.semi_diameter,
                q.is_stop,
            )
        assert a.sensor_distance == b.sensor_distance
