"""Monte Carlo rays from the sensor out through the front: the reference for ghosts of area lights."""

from math import pi, sqrt

import numpy as np

from ..jit.decorators import compiled
from ..tracing.lens_arrays import at_wavelength
from .arguments import Ray, Scratch
from .forward import STACK, sample_at, trace_tree
from .philox import refill

# the points of a batch are multiples (modulo 1) of the inverse powers of the root of x^6 = x + 1 in (1, 2); each has
# five coordinates
ROOT = 1.1347241384015194
DIMENSIONS = 5


@compiled
def trace_camera_batch(lens, samples, points, chances, batch, number, stop, frame, light, sums):
    """Trace a batch of picture points backward at several wavelengths each, through all orders of reflection.

    Parameters
    ----------
    lens : ConicLens or ShapedLens
        At the S spectral samples, in the lens' frame.
    samples : SpectralSamples
        For a light of radiance 1.
    points : PicturePoints
    chances : Chances
    batch, number : int
        Of the batch and of the light; they select the stream of random numbers.
    stop : StopArrays
    frame : PictureFrame
    light : AreaLight
    sums : LightSums
        Added to, for light in the picture; the other tallies count rays and have no physical meaning.

    Notes
    -----
    The flux through a pixel is the integral of radiance times cos^4 / distance^2 over the pixel and the rear disc.
    Radiance changes along a ray only by reflectances and transmittances, which are the same in both directions. The
    points of a batch form a lattice in picture, disc and spectrum with a random shift (Cranley and Patterson 1976), so
    batches are independent and each is evenly distributed.
    """
    to_pixels, size = frame
    (rear_z, rear_radius), heroes = points.rear, samples.heroes
    stream, pool = np.empty(6, dtype=np.uint64), np.empty(4)
    scratch, start = Scratch(stream, pool, np.empty((STACK, 11))), np.empty(6)
    stream[4], stream[5] = chances.key[0], chances.key[1]
    shift, step, place, pixel = np.empty(8), np.empty(DIMENSIONS), np.empty(DIMENSIONS), np.empty(2)
    for part in range(2):
        stream[0], stream[1] = np.uint64(0), np.uint64(part)
        stream[2], stream[3] = np.uint64(batch), np.uint64(2 * number)
        refill(stream, pool)
        for k in range(4):
            shift[4 * part + k] = pool[k]
    for k in range(DIMENSIONS):
        step[k] = ROOT ** -(k + 1.0)
    no_fours = np.empty((0, 2))
    area = size[0] / to_pixels[2] * size[1] / to_pixels[3] * pi * rear_radius * rear_radius
    for point in range(points.number):
        for k in range(DIMENSIONS):
            place[k] = (shift[k] + point * step[k]) % 1.0
        pixel[0], pixel[1] = place[0] * size[0], place[1] * size[1]
        x, y = (to_pixels[0] - pixel[0]) / to_pixels[2], (pixel[1] - to_pixels[1]) / to_pixels[3]
        radius, angle = rear_radius * sqrt(place[2]), 2.0 * pi * place[3]
        dx, dy, dz = radius * np.cos(angle) - x, radius * np.sin(angle) - y, rear_z - lens.sensor_z
        square = dx * dx + dy * dy + dz * dz
        inverse = 1.0 / sqrt(square)
        start[0], start[1], start[2] = x, y, lens.sensor_z
        start[3], start[4], start[5] = dx * inverse, dy * inverse, dz * inverse
        unit = area * (dz * dz / square) / square / (points.number * heroes)
        for hero in range(heroes):
            s = sample_at(samples, (hero + place[4]) / heroes)
            stream[0], stream[1] = np.uint64(0), np.uint64(point * heroes + hero)
            stream[2], stream[3] = np.uint64(batch), np.uint64(2 * number + 1)
            ray = Ray(start, -1, unit, samples.luminances[s], samples.rgbs[s])
            trace_tree(
                at_wavelength(lens, s), ray, chances.boosts, scratch, stop, frame, sums, no_fours, 0, None,
                (pixel, light),
            )  # fmt: skip
