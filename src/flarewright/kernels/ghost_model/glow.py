"""Halo and star around the image of a light, from radial profiles, for every pixel of a picture."""

import numpy as np

from ..jit.decorators import borrowing, compiled

# half width of a drawn spike in standard deviations; beyond it less than 1e-14 of the light
_WIDTHS = 8.0


@borrowing
def _profile_light(radius, part, knots, values, first, dark, out):
    """Fill the light of three colours at a radius, times `part`; return the knot below, the start of the next search.

    `knots`, shape (K,), and `values`, shape (K, 3), are logarithms; values up to `dark` give 0.
    """
    at, last = max(np.log(radius), knots[0]), knots.size - 1
    if at > knots[last]:
        out[0] = out[1] = out[2] = 0.0
        return first
    # start at the last knot: neighbouring pixels mostly lie between the same knots
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
    """Fill the light of a halo.

    Parameters
    ----------
    x, y : ndarray, shape (P,), float64
        Offsets from the image of the light.
    knots : ndarray, shape (K,), float64
        Logarithms of at least two increasing radii; the profile is constant inside the first and 0 beyond the last.
    values : ndarray, shape (K, 3), float64
        Logarithms of the radiance at the knots, interpolated linearly.
    dark : float
        Logarithm of the radiance that is treated as 0.
    strength : float
        Factor of the profile.
    even : ndarray, shape (3,), float64
        Constant light, added everywhere.
    out : ndarray, shape (P, 3), float64
        Filled.
    """
    near = 0
    for p in range(x.size):
        near = _profile_light(np.hypot(x[p], y[p]), strength, knots, values, near, dark, out[p])
        for m in range(3):
            out[p, m] += even[m]


@compiled
def star_light(x, y, spikes, first_rad, width, knots, values, dark, out):
    """Fill the light of a star: each spike is a Gaussian across and the radial profile along.

    Parameters
    ----------
    x, y : ndarray, shape (P,), float64
        Offsets from the image of the light, y up.
    spikes : int
        Number of spikes, at equal angles.
    first_rad : float
        Direction of one spike, counterclockwise from x.
    width : float
        Standard deviation across a spike.
    knots, values, dark, out
        As in `halo_light`.
    """
    apart, near = 2.0 * np.pi / spikes, 0
    for p in range(x.size):
        radius = np.hypot(x[p], y[p])
        turned = (np.arctan2(y[p], x[p]) - first_rad) / apart
        # only the nearest spike counts
        across = radius * np.sin(apart * (turned - np.round(turned))) / width
        if abs(across) > _WIDTHS:
            out[p] = 0.0
        else:
            near = _profile_light(radius, np.exp(-0.5 * across**2), knots, values, near, dark, out[p])
