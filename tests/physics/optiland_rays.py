"""Run by `test_optiland.py` in an interpreter that has optiland: rays in by JSON, positions out by JSON.

A ghost path is laid out as a chain of surfaces with mirrors and negative gaps. Imports nothing of the program.
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
    # A plane at z = 0 starts the chain, so that the first surface may have any shape.
    lens.surfaces.add(index=1, radius=np.inf, thickness=0.0, is_stop=True, material=IdealMaterial(1.0))
    at = [z[k] for k, _, _ in order] + [z[-1] + job["sensor_distance"]]
    for m, (k, mirror, forward) in enumerate(order):
        c = rows[k]["curvature"]
        lens.surfaces.add(
            index=m + 2,
            radius=np.inf if c == 0.0 else 1.0 / c,
            conic=rows[k]["conic"],
            thickness=at[m + 1] - at[m],
            material="mirror" if mirror else IdealMaterial(behind[k] if forward else front[k]),
        )
    lens.surfaces.add(index=len(order) + 2)
    return lens


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
