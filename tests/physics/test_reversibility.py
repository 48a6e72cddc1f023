"""Light is reversible: the package's tracer, through a lens and through the reversed lens."""

import numpy as np
import pytest

from flarewright.kernels.tracing.sequential import trace_hits
from flarewright.optics.lens.paraxial import first_order
from flarewright.optics.lens.paths import direct_path, ghost_paths
from flarewright.optics.rays.pack import pack_lens
from flarewright.render.scene.resolve import load_lens


@pytest.mark.parametrize("name", ["heliar-tronnier", "canon-28-80", "tessar-brendel"])
def test_a_ray_returns_through_the_lens_turned_round(name):
    lens = load_lens(name)
    packed = pack_lens(lens, first_order(lens, 8.0), (None,) * len(lens.rows), np.array([480.0]))
    curvature, conic, vertices, indices = packed.curvature, packed.conic, packed.z_vertex, packed.n_gap[0]
    last = vertices[-1]
    turned = -curvature[::-1], conic[::-1].copy(), last - vertices[::-1], indices[::-1].copy()
    rng, tilt, traced = np.random.default_rng(5), -0.06, 0
    for path in (direct_path(lens), *ghost_paths(lens, "all")[::3]):
        rows, actions = np.asarray(path.rows), np.asarray(path.actions)
        steps = len(rows)
        for px, py in rng.uniform(-4.0, 4.0, (6, 2)):
            there = np.empty((1, steps + 2, 3))
            trace_hits(
                rows, actions, curvature, conic, vertices, indices, last + 30.0, tilt, 0.0, np.array([px]),
                np.array([py]), there,
            )  # fmt: skip
            if not np.isfinite(there).all():
                continue
            hit, end = there[0, -2], there[0, -1]
            way = (end - hit) / np.linalg.norm(end - hit)
            x, y, _ = hit + way * (last - hit[2]) / way[2]
            # rotated about the axis into the frame that the tracer expects
            angle = np.arctan2(-way[0], -way[1])
            turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
            start = turn @ [x, y]
            back = np.empty_like(there)
            trace_hits(
                len(vertices) - 1 - rows[::-1], actions[::-1].copy(), *turned, last + 30.0,
                float(np.arctan2(np.hypot(way[0], way[1]), way[2])), 0.0, start[:1], start[1:], back,
            )  # fmt: skip
            returned = back[0, 1:-1]
            returned[:, :2] = returned[:, :2] @ turn
            returned[:, 2] = last - returned[:, 2]
            np.testing.assert_allclose(returned[::-1], there[0, 1:-1], rtol=0.0, atol=1e-9)
            traced += 1
    assert traced > 40
