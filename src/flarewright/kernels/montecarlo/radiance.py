"""Radiance of area lights along rays that leave the lens through its front."""

from math import sqrt

import numpy as np

from ..jit.decorators import inner

# columns of `bounds`
LEFT, RIGHT, LOW, HIGH, DISTANCE, TO_PUPIL = range(6)


@inner
def radiance_from(light, x, y, z, dx, dy, dz):
    """Return the radiance that enters the lens along a ray traced out through the front.

    Parameters
    ----------
    light : AreaLight
    x, y, z, dx, dy, dz : float
        Where the ray leaves the lens, mm, and its unit direction; dz is negative.

    Returns
    -------
    float
        0 where there is no light.

    Notes
    -----
    A point of a near light has the same intensity in all directions (`kernels.tracing.refract.ray_from_near`), and its
    area is given by the solid angle seen from the centre of the entrance pupil. The radiance is therefore proportional
    to the cosine towards that centre over the cosine of the ray.
    """
    border, bounds, strips = light
    if bounds[DISTANCE] > 0.0:
        t = (-bounds[DISTANCE] - z) / dz
        across, up = (x + t * dx) / bounds[TO_PUPIL], (y + t * dy) / bounds[TO_PUPIL]
    else:
        across, up = -dx / dz, -dy / dz
    if across < bounds[LEFT] or across > bounds[RIGHT] or up < bounds[LOW] or up > bounds[HIGH]:
        return 0.0
    found = 0.0
    count = strips.shape[0] - 1
    strip = min(np.int64((up - bounds[LOW]) / (bounds[HIGH] - bounds[LOW]) * count), count - 1)
    for k in range(strips[strip], strips[strip + 1]):
        y0, y1 = border[k, 1], border[k, 3]
        if (y0 > up) != (y1 > up) and across < border[k, 0] + (up - y0) / (y1 - y0) * (border[k, 2] - border[k, 0]):
            found += border[k, 4] if y1 > y0 else -border[k, 4]
    if bounds[DISTANCE] > 0.0:
        found /= -dz * sqrt(1.0 + across * across + up * up)
    return found
