"""The radiance of area lights along rays that leave the front of the lens: what a ray from the camera meets."""

from math import sqrt

import numpy as np

from ._jit import inner

# what is known of the lights: columns of `bounds`
LEFT, RIGHT, LOW, HIGH, DISTANCE, TO_PUPIL = range(6)


@inner
def radiance_from(lit, x, y, z, dx, dy, dz):
    """Radiance that comes in along a ray that runs out through the front.

    Parameters
    ----------
    lit : tuple
        The light's border, shape (N, 5): slopes (tan X, tan Y) of field angles, weights in radiance, strip by strip of
        tan Y, an edge in every strip that it comes into; the pixel, which nobody asks for here; bounds, shape (6,): of
        the slopes, then how far the light stands in front of the first vertex and of the entrance pupil, mm, both 0
        when it is distant; and where the edges of each strip begin, with the end of the last.
    x, y, z, dx, dy, dz : float
        Where the ray leaves, mm, and its unit direction; dz is negative.

    Returns
    -------
    float
        0 where there is no light.

    Notes
    -----
    A point of a near light shines alike in all directions (`kernels.bend.ray_from_near`), and its piece of the light
    has the solid angle that the middle of the entrance pupil sees; so the radiance goes as the cosine towards that
    middle over the cosine of the ray.
    """
    border, _, bounds, strips = lit
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
