"""Mixing a colour with white in such a way that its hue looks the same."""

from math import sqrt

import numpy as np

from ..jit.decorators import inner

# squared chroma below which a colour has no hue; white has 1e-15 by the rounding of the matrices
_GREY = 1e-10


@inner
def keep_hue(red, green, blue, mixed_red, mixed_green, mixed_blue):
    """Return a colour with the lightness and the chroma of a mixture and the hue of what was mixed with white.

    Parameters
    ----------
    red, green, blue : float
        The colour, linear Rec.709, not negative.
    mixed_red, mixed_green, mixed_blue : float
        The same colour mixed with white in linear light. It looks as if its hue had changed (Abney 1909): blue turns
        violet, by 22 degrees.

    Returns
    -------
    tuple of float32
        In [0, 1]: of the largest channel up to 2 % are cut off.

    Notes
    -----
    Lightness, chroma and hue of Oklab (B. Ottosson, "A perceptual color space for image processing", 2020).
    """
    _, a, b = _oklab(red, green, blue)
    lightness, mixed_a, mixed_b = _oklab(mixed_red, mixed_green, mixed_blue)
    whole, part = a * a + b * b, mixed_a * mixed_a + mixed_b * mixed_b
    scale = sqrt(part / whole) if whole > _GREY else 0.0
    red, green, blue = _rec709(lightness, scale * a, scale * b)
    return (
        np.float32(min(max(red, 0.0), 1.0)), np.float32(min(max(green, 0.0), 1.0)), np.float32(min(max(blue, 0.0), 1.0))
    )  # fmt: skip


@inner
def _oklab(red, green, blue):
    """Return lightness and the two chromatic coordinates of a linear Rec.709 colour."""
    one = (0.4122214708 * red + 0.5363325363 * green + 0.0514459929 * blue) ** (1.0 / 3.0)
    two = (0.2119034982 * red + 0.6806995451 * green + 0.1073969566 * blue) ** (1.0 / 3.0)
    three = (0.0883024619 * red + 0.2817188376 * green + 0.6299787005 * blue) ** (1.0 / 3.0)
    return (
        0.2104542553 * one + 0.7936177850 * two - 0.0040720468 * three,
        1.9779984951 * one - 2.4285922050 * two + 0.4505937099 * three,
        0.0259040371 * one + 0.7827717662 * two - 0.8086757660 * three,
    )


@inner
def _rec709(lightness, a, b):
    """Return the linear Rec.709 colour of Oklab coordinates."""
    one = (lightness + 0.3963377774 * a + 0.2158037573 * b) ** 3
    two = (lightness - 0.1055613458 * a - 0.0638541728 * b) ** 3
    three = (lightness - 0.0894841775 * a - 1.2914855480 * b) ** 3
    return (
        4.0767416621 * one - 3.3077115913 * two + 0.2309699292 * three,
        -1.2684380046 * one + 2.6097574011 * two - 0.3413193965 * three,
        -0.0041960863 * one - 0.7034186147 * two + 1.7076147010 * three,
    )
