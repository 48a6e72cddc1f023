"""Skew rays of image and ghost paths against optiland, a second engine, to 1e-9 mm.

Optional (`pytest -m oracle`): optiland is large (1.3 GB with dependencies), so it runs in a separate process, in the
interpreter that FLAREWRIGHT_ORACLE_PYTHON names, else in this one.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from oracle import Rays, System, direction, trace
from prescriptions import HELIAR, TRIPLET, lens, system

pytestmark = pytest.mark.oracle

PYTHON = os.environ.get("FLAREWRIGHT_ORACLE_PYTHON", sys.executable)
SCRIPT = Path(__file__).with_name("optiland_rays.py")
FIELDS = [(0.0, 0.0), (7.0, -3.0), (15.0, 9.0)]
CASES: dict[str, tuple[Any, float, list[tuple[int, int] | None]]] = {
    "heliar": (HELIAR, 4.5, [None, (1, 0), (2, 0), (4, 1), (6, 3), (8, 4), (8, 6), (8, 7)]),
    "triplet": (TRIPLET, 5.0, [None, (1, 0), (3, 0), (5, 2), (6, 3), (6, 5)]),
}


def points() -> tuple[np.ndarray, np.ndarray]:
    return np.random.default_rng(11).uniform(-4.0, 4.0, (2, 60))


def ask_optiland(jobs: list[dict[str, Any]]) -> list[dict[str, list[float]]]:
    run = subprocess.run(
        [PYTHON, str(SCRIPT)], input=json.dumps(jobs), capture_output=True, text=True, check=False, timeout=600
    )
    assert run.returncode == 0, run.stderr
    return json.loads(run.stdout)


def job(s: System, path: tuple[int, int] | None, field: tuple[float, float]) -> dict[str, Any]:
    x, y = points()
    rows = [
        {"curvature": r.curvature, "conic": r.conic, "thickness": float(r.thickness), "index": r.index} for r in s.rows
    ]
    return {
        "rows": rows,
        "path": path,
        "x": x.tolist(),
        "y": y.tolist(),
        "direction": direction(field).tolist(),
        "sensor_distance": float(s.sensor_distance),
    }


@pytest.fixture(scope="module")
def optiland() -> None:
    found = subprocess.run([PYTHON, "-c", "import optiland"], capture_output=True, check=False)
    if found.returncode != 0:
        pytest.skip(
            f"optiland is not installed for {PYTHON} (extra: oracle); name another by FLAREWRIGHT_ORACLE_PYTHON"
        )


def compare(ours: Rays, theirs: dict[str, list[float]]) -> int:
    """Compare rays that are alive in our trace and pass near the glass; optiland does not end other rays."""
    near = ours.alive & (ours.rel_radius < 1.0)
    for a, b in ((ours.x, theirs["x"]), (ours.y, theirs["y"])):
        assert np.abs(a[near] - np.array(b)[near]).max(initial=0.0) < 1e-9
    return int(near.sum())


@pytest.mark.usefixtures("optiland")
@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("conic", [0.0, -0.7])
def test_the_oracle_traces_as_optiland_does(name, conic):
    table, f_number, paths = CASES[name]
    s = system(table, f_number)
    s = replace(
        s, rows=tuple(replace(r, conic=conic if k in (0, len(s.rows) - 1) else 0.0) for k, r in enumerate(s.rows))
    )
    cases = [(p, f) for p in paths for f in FIELDS]
    theirs = ask_optiland([job(s, p, f) for p, f in cases])
    x, y = points()
    seen = [compare(trace(s, p, x, y, f), t) for (p, f), t in zip(cases, theirs, strict=True)]
    assert sum(seen) > 200
    assert sum(n > 0 for n in seen) > 0.6 * len(seen)


@pytest.mark.usefixtures("optiland")
@pytest.mark.parametrize("name", CASES)
def test_the_program_traces_as_optiland_does(name):
    from sensor_rays import trace_rays

    from flarewright.optics.lens.paraxial import first_order
    from flarewright.optics.lens.paths import direct_path, ghost_path
    from flarewright.optics.rays.pack import pack_lens

    table, f_number, paths = CASES[name]
    a_lens, s = lens(table, f_number), system(table, f_number)
    packed = pack_lens(a_lens, first_order(a_lens), (None,) * len(a_lens.rows), np.array([587.56]))
    cases = [(p, f) for p in paths for f in FIELDS]
    theirs = ask_optiland([job(s, p, f) for p, f in cases])
    x, y = points()
    seen = 0
    for (path, field), answer in zip(cases, theirs, strict=True):
        rays = trace_rays(packed, direct_path(a_lens) if path is None else ghost_path(a_lens, *path), x, y, field)
        near = (rays["status"] > 0) & (rays["rel_radius"] < 1.0)
        for axis in ("x", "y"):
            assert np.abs(-rays[axis][near] - np.array(answer[axis])[near]).max(initial=0.0) < 1e-9
        seen += int(near.sum())
    assert seen > 200


SHAPES: dict[str, dict[int, dict[str, Any]]] = {
    "aspheres": {
        0: {"conic": -0.6, "asphere": (3e-6, -2e-8, 4e-11)},
        3: {"asphere": (-2e-5, 1e-7, 0.0, 0.0, 0.0, 0.0, 3e-18)},
    },
    "odd aspheres": {
        0: {"conic": -0.6, "asphere": (3e-6,), "odd_asphere": (4e-5, 0.0, -2e-9)},
        3: {"odd_asphere": (-2e-4, 1e-6)},
    },
    "cylinders": {0: {"curvature_x": 0.0}, 6: {"curvature": 0.0, "curvature_x": -0.05, "conic_x": -0.4}},
    "tori": {
        0: {"curvature_x": 0.01, "conic": -0.6, "torus": True, "asphere": (3e-6, -2e-8)},
        3: {"curvature": 0.0, "curvature_x": 0.02, "torus": True},
        6: {"curvature_x": -0.03, "torus": True, "decentre": (0.2, -0.1)},
    },
    "decentred": {0: {"decentre": (0.4, -0.3)}, 5: {"decentre": (-0.2, 0.1)}},
    "tilted about x": {2: {"tilt_deg": (1.5, 0.0)}},
    "tilted about y": {2: {"tilt_deg": (0.0, -2.0)}},
    "an asphere beside the axis and askew": {
        5: {"asphere": (1e-5, 1e-7), "decentre": (0.2, 0.3), "tilt_deg": (0.7, -1.1)},
        6: {"curvature_x": 0.0, "tilt_deg": (0.4, 0.2)},
    },
    # optiland rejects rays beyond the disc of the terms, so the disc is large
    "figure errors": {1: {"figure": {5: 4000.0, 7: -3e4, 11: 2.5e4, 14: 1e4, 24: 5e4}, "semi_diameter": 60.0}},
}


def shaped(base: Any, changes: dict[int, dict[str, Any]]) -> Any:
    from flarewright.model import Figure

    rows = list(base.rows)
    for k, fields in changes.items():
        plain = dict(fields)
        if "figure" in plain:
            plain["figure"] = Figure(zernike_nm=tuple(plain["figure"].items()))
        rows[k] = rows[k].replace(**plain)
    return base.replace(rows=tuple(rows))


def in_optilands_words(a_lens: Any, row: dict[str, Any], k: int) -> dict[str, Any]:
    """Return the row of a job with its shape."""
    surface = a_lens.rows[k]
    if not hasattr(surface, "asphere"):
        return row
    (cx, kx), tilt = surface.meridian_x, np.radians(surface.tilt_deg or (0.0, 0.0)).tolist()
    dx, dy = surface.decentre or (0.0, 0.0)
    words = {**row, "curvature": surface.curvature, "conic": surface.conic, "asphere": list(surface.asphere)}
    words["odd_asphere"] = list(surface.odd_asphere)
    words |= {"dx": dx, "dy": dy, "rx": tilt[0], "ry": tilt[1]}
    if surface.toroidal:
        words |= {"curvature_x": cx, "conic_x": kx, "torus": surface.torus}
    if surface.figure is not None:
        terms = dict(surface.figure.zernike_nm)
        # Noll's first term is piston; optiland's terms have root mean square 1 too
        words["zernike"] = [terms.get(j, 0.0) * 1e-6 for j in range(1, 29)], surface.semi_diameter
    return words


@pytest.mark.usefixtures("optiland")
@pytest.mark.parametrize("name", SHAPES)
def test_surfaces_of_any_shape_and_place_trace_as_in_optiland(name):
    from sensor_rays import trace_rays

    from flarewright.optics.lens.paraxial import first_order
    from flarewright.optics.lens.paths import direct_path, ghost_path
    from flarewright.optics.rays.pack import pack_lens

    table, f_number, paths = CASES["triplet"]
    a_lens, s = shaped(lens(table, f_number), SHAPES[name]), system(table, f_number)
    order = first_order(lens(table, f_number))
    packed = pack_lens(a_lens, order, (None,) * len(a_lens.rows), np.array([587.56]))
    if name == "figure errors":
        paths = [None]
    cases = [(p, f) for p in paths for f in FIELDS]
    jobs = [job(s, p, f) for p, f in cases]
    for one in jobs:
        one["rows"] = [in_optilands_words(a_lens, row, k) for k, row in enumerate(one["rows"])]
    x, y = points()
    seen, moved = 0, 0.0
    plain = pack_lens(lens(table, f_number), order, (None,) * len(a_lens.rows), np.array([587.56]))
    for (path, field), answer in zip(cases, ask_optiland(jobs), strict=True):
        route = direct_path(a_lens) if path is None else ghost_path(a_lens, *path)
        rays, before = trace_rays(packed, route, x, y, field), trace_rays(plain, route, x, y, field)
        near = (rays["status"] > 0) & (rays["rel_radius"] < 1.0)
        for axis in ("x", "y"):
            off = np.abs(-rays[axis][near] - np.array(answer[axis])[near])
            # waves of 30 um: the sums of 28 terms differ in rounding by 1e-12 m
            assert off.max(initial=0.0) < (2e-9 if name == "figure errors" else 1e-9)
        seen += int(near.sum())
        moved = max(moved, float(np.abs(rays["x"] - before["x"])[near].max(initial=0.0)))
    assert seen > 100
    assert moved > 1e-3  # the shapes matter
