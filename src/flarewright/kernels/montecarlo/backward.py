"""Monte Carlo rays from the sensor out through the front: the reference for ghosts of area lights."""

from math import pi, sqrt

import numpy as np

from ..jit.decorators import compiled
from .forward import STACK, trace_tree
from .philox import refill

# the points of a batch are multiples (modulo 1) of the inverse powers of the root of x^6 = x + 1 in (1, 2); each has
# five coordinates
ROOT = 1.1347241384015194
DIMENSIONS = 5


@compiled
def trace_camera_batch(
    curvature, conic, z_vertex, inv_semi, n_gap, reflectance, sensor_z, stop_row, rear, points,
    cumulative, luminances, rgbs, heroes, boosts, key, batch, light, blades, mask, half, to_pixels, size,
    border, bounds, strips, planes, tallies, paths,
):  # fmt: skip
    """Trace a batch of picture points backward at several wavelengths each, through all orders of reflection.

    Parameters
    ----------
    curvature ... sensor_z
        As in `kernels.montecarlo.forward.trace_batch`.
    stop_row : int
    rear : tuple of float
        z and radius of a disc that all light towards the sensor crosses, mm.
    points : int
    cumulative ... size
        As in `trace_batch`; `luminances` and `rgbs` are for a light of radiance 1.
    border, bounds, strips : ndarray
        As in `kernels.montecarlo.radiance.radiance_from`.
    planes : ndarray, shape (2, 3, H, W), float32
        Added to: flux per pixel after two reflections and after more.
    tallies, paths
        As in `trace_batch`, for light in the picture; the other tallies count rays and have no physical meaning.

    Notes
    -----
    The flux through a pixel is the integral of radiance times cos^4 / distance^2 over the pixel and the rear disc.
    Radiance changes along a ray only by reflectances and transmittances, which are the same in both directions. The
    points of a batch form a lattice in picture, disc and spectrum with a random shift (Cranley and Patterson 1976), so
    batches are independent and each is evenly distributed.
    """
    stream, pool = np.empty(6, dtype=np.uint64), np.empty(4)
    stack, start = np.empty((STACK, 11)), np.empty(6)
    stream[4], stream[5] = key[0], key[1]
    shift, step, place, pixel = np.empty(8), np.empty(DIMENSIONS), np.empty(DIMENSIONS), np.empty(2)
    for part in range(2):
        stream[0], stream[1] = np.uint64(0), np.uint64(part)
        stream[2], stream[3] = np.uint64(batch), np.uint64(2 * light)
        refill(stream, pool)
        shift[4 * part : 4 * part + 4] = pool
    for k in range(DIMENSIONS):
        step[k] = ROOT ** -(k + 1.0)
    no_fours = np.empty((0, 2))
    area = size[0] / to_pixels[2] * size[1] / to_pixels[3] * pi * rear[1] * rear[1]
    for point in range(points):
        for k in range(DIMENSIONS):
            place[k] = (shift[k] + point * step[k]) % 1.0
        pixel[0], pixel[1] = place[0] * size[0], place[1] * size[1]
        x, y = (to_pixels[0] - pixel[0]) / to_pixels[2], (pixel[1] - to_pixels[1]) / to_pixels[3]
        radius, angle = rear[1] * sqrt(place[2]), 2.0 * pi * place[3]
        dx, dy, dz = radius * np.cos(angle) - x, radius * np.sin(angle) - y, rear[0] - sensor_z
        square = dx * dx + dy * dy + dz * dz
        inverse = 1.0 / sqrt(square)
        start[0], start[1], start[2] = x, y, sensor_z
        start[3], start[4], start[5] = dx * inverse, dy * inverse, dz * inverse
        unit = area * (dz * dz / square) / square / (points * heroes)
        for hero in range(heroes):
            at = (hero + place[4]) / heroes
            s = 0
            while s < cumulative.shape[0] - 1 and cumulative[s] < at:
                s += 1
            stream[0], stream[1] = np.uint64(0), np.uint64(point * heroes + hero)
            stream[2], stream[3] = np.uint64(batch), np.uint64(2 * light + 1)
            trace_tree(
                curvature, conic, z_vertex, inv_semi, n_gap[s], reflectance[s], sensor_z, stop_row, start, -1,
                unit, luminances[s], rgbs[s], boosts, stream, pool, stack, blades, mask, half, to_pixels, size,
                planes, tallies, paths, no_fours, 0, None, s, (border, pixel, bounds, strips),
            )  # fmt: skip
