"""The flux of one two-reflection path from reference rays restricted to that path, concentrated where it passes.

The reference splits every ray at every surface and meets a faint path once in a million rays. Here a ray always takes
the two reflections of the path, with the same weights, so its mean is the same. A pilot finds the cells of the front
through which the path reaches the picture; these are sampled densely. All other cells get some points per batch too, so
nothing is missed, and the variance includes what these points find.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from flarewright.kernels.montecarlo.forward import _cross, _passes_stop
from flarewright.optics.rays.pupil_region import front_box
from flarewright.render.reference.batches import spectrum_of
from flarewright.render.reference.shot_arrays import shot_arrays
from flarewright.render.scene.shot import Shot

# cells of the front per side; if fewer than FEW are known, they are divided FINER times, up to FINEST per side
CELLS, FEW, FINER, FINEST = 128, 200, 4, 2048
# rays through a cell next to one that light passes
NEARER = 6
# points per batch in known cells; and per side, one in each, in all others
POINTS, COARSE = 12_000, 64


@njit(error_model="numpy", cache=True)
def follow(lens, stop, frame, j, i, direction, x0, y0, light):
    """Set `light` to the weight of each ray from x0, y0 that reflects at j, then at i; 0 outside the picture."""
    z_vertex, inv_semi, n_gap, reflectance = lens.z_vertex, lens.inv_semi, lens.n_gap, lens.reflectance
    stop_row, blades, (to_pixels, size) = stop.row, stop.blades, frame
    samples = reflectance.shape[1]
    for ray in range(x0.shape[0]):
        x, y, z = x0[ray], y0[ray], 0.0
        dx, dy, dz = direction[0], direction[1], direction[2]
        weight, row, heading, order = 1.0, 0, 1, 0
        while weight > 0.0 and row < z_vertex.shape[0]:
            if row == stop_row:
                t = (z_vertex[row] - z) / dz
                x, y, z = x + t * dx, y + t * dy, z_vertex[row]
                if not _passes_stop(blades, x, y):
                    weight = 0.0
                row += heading
                continue
            n_in = n_gap[row] if heading > 0 else n_gap[row + 1]
            n_out = n_gap[row + 1] if heading > 0 else n_gap[row]
            x, y, z, tx, ty, tz, rx, ry, rz, radius2, cos_in, cos_out, met, forth, back = _cross(
                lens, row, x, y, z, dx, dy, dz, float(heading), n_in / n_out
            )
            mirror = (order == 0 and row == j) or (order == 1 and row == i)
            if not met or radius2 * inv_semi[row] * inv_semi[row] > 1.0 or not (back if mirror else forth):
                weight = 0.0
                break
            R = 1.0
            if cos_out > 0.0:
                place = min(cos_in if n_in <= n_out else cos_out, 1.0) * (samples - 1)
                cell = min(int(place), samples - 2)
                R = reflectance[row, cell] + (place - cell) * (reflectance[row, cell + 1] - reflectance[row, cell])
            if mirror:
                weight *= R
                dx, dy, dz = rx, ry, rz
                order, heading = order + 1, -heading
            else:
                weight *= 1.0 - R
                dx, dy, dz = tx, ty, tz
            row += heading
        t = (lens.sensor_z - z) / dz
        column, line = to_pixels[0] - to_pixels[2] * (x + t * dx), to_pixels[1] + to_pixels[3] * (y + t * dy)
        inside = 0.0 <= column < size[0] and 0.0 <= line < size[1]
        light[ray] = weight if inside else 0.0


def path_flux(shot: Shot, j: int, i: int, batches: int, seed: int = 0) -> tuple[float, float]:
    """Return the luminous flux in the picture of one path, for a distant monochromatic light, and its error."""
    packed = shot.packed
    tilt, axes = shot.incidence.tilt, shot.incidence.axes
    assert packed.nearness == 0.0
    assert shot.opening.mask is None
    box = front_box(packed, tilt)
    box[0] = -box[1] if packed.symmetric else box[0]
    low, size = box[[0, 2]], box[[1, 3]] - box[[0, 2]]
    direction = np.array([np.sin(tilt) * axes[1, 0], np.sin(tilt) * axes[1, 1], np.cos(tilt)])
    lens, stop, frame = shot_arrays(shot)
    lens = lens._replace(n_gap=lens.n_gap[0], reflectance=lens.reflectance[0])
    rng = np.random.default_rng([seed, j, i])

    def light_at(places):
        x, y = np.ascontiguousarray((places @ axes).T)
        light = np.empty(len(places))
        follow(lens, stop, frame, j, i, direction, x, y, light)
        return light

    known = _passed(light_at, low, size, np.ones((CELLS, CELLS), dtype=bool), rng)
    if not known.any():
        known = _passed(light_at, low, size, np.ones((FINER * CELLS, FINER * CELLS), dtype=bool), rng)
    while 0 < known.sum() < FEW and len(known) < FINEST:
        # the path passes a small part of the front: use smaller cells
        known = _passed(light_at, low, size, np.kron(known, np.ones((FINER, FINER), dtype=bool)), rng)
    side = len(known)
    fine = int(np.clip(np.sqrt(POINTS / max(known.sum(), 1)), 1, 64))
    within = np.stack(np.meshgrid(np.arange(fine), np.arange(fine), indexing="ij"), axis=-1).reshape(1, -1, 2)
    dense, everywhere = np.argwhere(known)[:, None], np.argwhere(np.ones((COARSE, COARSE), dtype=bool))
    found = np.zeros(batches)
    for batch in range(batches):
        inside = (dense + (within + rng.random((len(dense), fine**2, 2))) / fine).reshape(-1, 2) / side
        outside = (everywhere + rng.random(everywhere.shape)) / COARSE
        outside = outside[~known[tuple((outside * side).astype(int).T)]]
        found[batch] = light_at(low + inside * size).sum() / (side * fine) ** 2
        found[batch] += light_at(low + outside * size).sum() / COARSE**2
    found *= np.prod(size) * spectrum_of(shot, shot.gain, 0)[0].luminances[0]
    return float(found.mean()), float(found.std(ddof=1) / np.sqrt(batches))


def _passed(light_at, low, size, where, rng):
    """Find the cells that light passes, and their neighbours, shape (side, side).

    Known cells are extended outwards until all cells around them are dark. Otherwise a spot of a few cells, half missed
    by one ray per cell, would be known only in part without any sign of it.
    """
    side = len(where)
    met, tried, wanted = (np.zeros((side, side), dtype=bool) for _ in range(3))
    wanted |= where
    rays = 1
    while wanted.any():
        cells = np.argwhere(wanted)
        places = (cells[:, None] + rng.random((len(cells), rays, 2))).reshape(-1, 2)
        met[tuple(cells.T)] |= (light_at(low + places / side * size).reshape(-1, rays) > 0.0).any(axis=1)
        tried |= wanted if rays > 1 else met
        near = np.zeros((side + 2, side + 2), dtype=bool)
        near[1:-1, 1:-1] = met
        near = np.logical_or.reduce([np.roll(near, (a, b), (0, 1)) for a in (-1, 0, 1) for b in (-1, 0, 1)])[1:-1, 1:-1]
        wanted, rays = near & ~tried, NEARER
    return near
