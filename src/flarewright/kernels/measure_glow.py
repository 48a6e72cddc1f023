"""Light around the light's image by its radial law, for every pixel of a picture: halo and star."""

import numpy as np

from ._jit import borrowing, compiled

# spikes are dark so many widths off their middle: there is less than a part in 10**14
_WIDTHS = 8.0


@borrowing
def _by_law(radius, part, knots, values, first, dark, out):
    """Fill the three colours' light so far from the light's image; return the knot below, where the next one looks.

    `knots`, shape (K,), and `values`, shape (K, 3), are logarithms; what is `dark` or less is 0.
    """
    at, last = max(np.log(radius), knots[0]), knots.size - 1
    if at > knots[last]:
        out[0] = out[1] = out[2] = 0.0
        return first
    # neighbours lie between the same knots
    k = first
    while k > 0 and at < knots[k]:
        k -= 1
    while k < last - 1 and at > knots[k + 1]:
        k += 1
    along = (at - knots[k]) / (knots[k + 1] - knots[k])
    for m in range(3):
        value = values[k, m] + along * (values[k + 1, m] - values[k, m])
        out[m] = part * np.exp(value) if value > dark else 0.0
    return k


@compiled
def halo_light(x, y, knots, values, dark, strength, even, out):
    """Fill a halo's light.

    Parameters
    ----------
    x, y : ndarray, shape (P,), float64
        Offsets from the light's image.
    knots : ndarray, shape (K,), float64
        Logarithms of at least two rising radii; within the first the law is even, beyond the last there is nothing.
    values : ndarray, shape (K, 3), float64
        Logarithms of the radiance there, between them linear.
    dark : float
        Logarithm of the radiance that counts as none.
    strength : float
        Factor of the law.
    even : ndarray, shape (3,), float64
        Light that is added everywhere.
    out : ndarray, shape (P, 3), float64
        Filled.
    """
    near = 0
    for p in range(x.size):
        near = _by_law(np.hypot(x[p], y[p]), strength, knots, values, near, dark, out[p])
        for m in range(3):
            out[p, m] += even[m]


@compiled
def star_light(x, y, spikes, first_rad, width, knots, values, dark, out):
    """Fill a star's light: every spike falls off as a Gaussian across and by the law along.

    Parameters
    ----------
    x, y : ndarray, shape (P,), float64
        Offsets from the light's image, y up.
    spikes : int
        How many, evenly around.
    first_rad : float
        Direction of one of them, anticlockwise from x.
    width : float
        Standard deviation across.
    knots, values, dark, out
        As for `halo_light`.
    """
    apart, near = 2.0 * np.pi / spikes, 0
    for p in range(x.size):
        radius = np.hypot(x[p], y[p])
        turned = (np.arctan2(y[p], x[p]) - first_rad) / apart
        # the nearest spike only: beside it, a spike's own circle is farther than the next one's
        across = radius * np.sin(apart * (turned - np.round(turned))) / width
        if abs(across) > _WIDTHS:
            out[p] = 0.0
        else:
            near = _by_law(radius, np.exp(-0.5 * across**2), knots, values, near, dark, out[p])
