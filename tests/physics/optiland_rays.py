"""Trace rays with optiland: rays as JSON in, positions as JSON out. `test_optiland.py` runs this in a subprocess.

A ghost path is unfolded into a chain of surfaces with mirrors and negative gaps. Imports nothing of Flarewright.
"""

import json
import sys

import numpy as np
from optiland.materials import IdealMaterial
from optiland.optic import Optic
from optiland.rays import RealRays


def chain(job):
    """Return an Optic for one path of the prescription."""
    rows, path = job["rows"], job["path"]
    n = len(rows)
    behind = [r["index"] for r in rows]
    front = [1.0, *behind[:-1]]
    z = np.concatenate([[0.0], np.cumsum([r["thickness"] for r in rows[:-1]])])
    order = [(k, False, True) for k in range(n)]
    if path is not None:
        j, i = path
        order = [(k, False, True) for k in range(j)] + [(j, True, True)]
        order += [(k, False, False) for k in range(j - 1, i, -1)] + [(i, True, False)]
        order += [(k, False, True) for k in range(i + 1, n)]
    lens = Optic()
    lens.surfaces.add(index=0, radius=np.inf, thickness=np.inf)
    # A plane at z = 0 starts the chain, so that the first surface can have any shape.
    lens.surfaces.add(index=1, radius=np.inf, thickness=0.0, is_stop=True, material=IdealMaterial(1.0))
    at = [z[k] for k, _, _ in order] + [z[-1] + job["sensor_distance"]]
    for m, (k, mirror, forward) in enumerate(order):
        lens.surfaces.add(
            index=m + 2,
            thickness=at[m + 1] - at[m],
            material="mirror" if mirror else IdealMaterial(behind[k] if forward else front[k]),
            **form(rows[k]),
        )
    lens.surfaces.add(index=len(order) + 2)
    return lens


def form(row):
    """Return shape and position of a row as optiland's arguments."""
    radius = np.inf if row["curvature"] == 0.0 else 1.0 / row["curvature"]
    place = {name: row[name] for name in ("dx", "dy", "rx", "ry") if row.get(name)}
    exact = {"tol": 1e-13, "max_iter": 100}
    if row.get("zernike"):
        coefficients, norm_radius = row["zernike"]
        words = {"surface_type": "zernike", "radius": radius, "conic": row["conic"], **exact}
        return {**words, "coefficients": coefficients, "norm_radius": norm_radius, "zernike_type": "noll", **place}
    if row.get("odd_asphere"):
        # optiland's first coefficient belongs to r
        coefficients = [0.0] * (max(len(row["asphere"]) + 1, len(row["odd_asphere"])) * 2 + 2)
        coefficients[2 : 2 + 2 * len(row["odd_asphere"]) : 2] = row["odd_asphere"]
        coefficients[3 : 3 + 2 * len(row["asphere"]) : 2] = row["asphere"]
        words = {"surface_type": "odd_asphere", "radius": radius, "conic": row["conic"], **exact}
        return {**words, "coefficients": coefficients, **place}
    if row.get("torus"):
        across = np.inf if row["curvature_x"] == 0.0 else 1.0 / row["curvature_x"]
        words = {"surface_type": "toroidal", "radius_x": across, "radius_y": radius, "conic": row["conic"], **exact}
        # its first coefficient belongs to y^2
        return {**words, "toroidal_coeffs_poly_y": [0.0, *row["asphere"]], **place}
    if row.get("asphere"):
        # optiland's first coefficient belongs to r^2
        coefficients = [0.0, *row["asphere"]]
        words = {"surface_type": "even_asphere", "radius": radius, "conic": row["conic"], **exact}
        return {**words, "coefficients": coefficients, **place}
    if row.get("curvature_x") is not None:
        across = np.inf if row["curvature_x"] == 0.0 else 1.0 / row["curvature_x"]
        words = {"surface_type": "biconic", "radius_x": across, "radius_y": radius, **exact}
        return {**words, "conic_x": row["conic_x"], "conic_y": row["conic"], **place}
    return {"radius": radius, "conic": row["conic"], **place}


def main():
    answers = []
    for job in json.load(sys.stdin):
        x, y = np.array(job["x"]), np.array(job["y"])
        d = np.array(job["direction"])
        one = np.ones_like(x)
        rays = RealRays(x, y, 0.0 * x, d[0] * one, d[1] * one, d[2] * one, one, 0.58756 * one)
        chain(job).surfaces.trace(rays)
        answers.append({"x": (-rays.x).tolist(), "y": (-rays.y).tolist()})
    json.dump(answers, sys.stdout)


if __name__ == "__main__":
    main()
