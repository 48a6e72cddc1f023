"""Veiling glare of the ghosts: light of a uniform surround that two reflections bring to the picture's centre."""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from ...kernels.scattering.glare import ALL, BEYOND, BOUNDS, light_from_surround
from ...model import Lens
from ...typing import Floats
from ..lens.paths import LightPath
from ..rays.pack import PackedLens

# rays per side of three grids: to find the transmitting part of the last surface, within it, and for the direct path
COARSE, FINE, DIRECT = 48, 64, 256


def object_nearness(packed: PackedLens, lens: Lens) -> float:
    """Return the reciprocal object distance of the plane in focus, by matrices, at the first packed wavelength.

    Returns
    -------
    float
        1 / distance in front of the first vertex, 1/mm; 0 for infinity, or for a plane behind the camera.
    """
    total, n = np.eye(2), packed.n_gap[0]
    count = len(lens.rows)
    for k in range(count):
        bend = np.array([[1.0, 0.0], [(n[k] - n[k + 1]) * packed.curvature[k] / n[k + 1], n[k] / n[k + 1]]])
        following = packed.z_vertex[k + 1] if k + 1 < count else packed.sensor_z
        total = np.array([[1.0, following - packed.z_vertex[k]], [0.0, 1.0]]) @ bend @ total
    nearness = -float(total[0, 0] / total[0, 1])
    # a lens focused at infinity for another colour counts as focused at infinity
    return nearness if nearness > 1e-4 else 0.0


def from_surround(
    lens: Lens, packed: PackedLens, paths: Sequence[LightPath], patch: float, *, threads: int | None = None
) -> Floats:
    """Integrate a uniform surround over each path to the centre of the sensor, at the first packed wavelength.

    Parameters
    ----------
    lens : Lens
    packed : PackedLens
        Turned to an arbitrary direction if the lens has no rotational symmetry (`pack.facing`).
    paths : sequence of LightPath
        The direct path, or ghosts.
    patch : float
        Radius of a black patch on the axis over its distance.
    threads : int, optional
        None: all cores; results do not depend on it.

    Returns
    -------
    ndarray, shape (len(paths), 2)
        Irradiance per radiance: of the whole surround, and of the surround without the patch. The stop is round.
    """
    nearness = object_nearness(packed, lens)
    last = len(lens.rows) - 1
    plane_z = float(packed.z_vertex[last])
    # a rim lies off its vertex plane, so slightly more of that plane is visible through it
    reach = 1.3 * float(packed.semi[last])

    def one(path: LightPath) -> tuple[float, float]:
        box = np.array([-reach, reach, -reach, reach])
        sums = np.zeros(6)
        side = DIRECT if path.first_reflection is None else FINE
        for rays in (COARSE, side):
            light_from_surround(
                path.rows, path.actions, packed.curvature, packed.form, packed.z_vertex, packed.inv_semi,
                packed.n_gap[0], packed.reflectance[0], packed.sensor_z, packed.stop_semi, plane_z, box, rays,
                nearness, patch, sums,
            )  # fmt: skip
            if sums[ALL] <= 0.0:
                return 0.0, 0.0
            room = 1.5 * (box[1] - box[0]) / rays
            box = sums[BOUNDS:] + np.array([-room, room, -room, room])
        return float(sums[ALL]), float(sums[BEYOND])

    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        return np.array(list(pool.map(one, paths))).reshape(len(paths), 2)
