"""Half floats for light: the scale that brings a project's faint light into their range, and their rounding.

Half floats hold 11 bits between 6.1e-5 and 65504, in steps of 6e-8 below. Irradiances of a light of 1 reach from 1e-8
in a faint ghost to 4e5 in a star's core. The scale serves the faint end; what is then above the range is written as
32-bit floats that are rounded like half floats, for such numbers compress far better than full ones.
"""

from __future__ import annotations

from math import frexp

import numpy as np
from numpy.typing import NDArray

from ..model.project import Project

HALF_MAX = 65504.0
"""The largest number that 16-bit floating point holds."""

# the brightest light stands at about 2^10: ghosts of 6e-8 of it keep 11 bits, and most of a starburst is below 2^16
_LIGHT_EXPONENT = 10
# a scale and its square, that of variances, are normal 32-bit floats
_LARGEST_EXPONENT = 63
# a float of 24 bits keeps 11
_DROPPED_BITS = 13
# below this half floats have even steps of 2^-24, as have 32-bit floats from 0.5 to 1
_LEAST_NORMAL = np.float32(2.0**-14)
_STEPS_OF_FAINT = np.float32(0.75)


def half_scale(brightest: float = 1.0) -> float:
    """Return by what irradiances are multiplied in a file of half floats.

    Parameters
    ----------
    brightest : float
        Intensity of the brightest light.

    Returns
    -------
    float
        2^10 over the least power of two that is not below the intensity: 1024 for 1, 2^-7 for 100 000. That of no
        light is 1024.

    Notes
    -----
    A power of two, so scaling rounds nothing. It depends on the lights alone: one that depended on a picture would
    change from frame to frame of a sequence.
    """
    if not brightest > 0.0:
        return half_scale()
    part, exponent = frexp(brightest)
    # frexp: brightest = part * 2^exponent with 0.5 <= part < 1
    above = exponent - 1 if part == 0.5 else exponent
    return float(2.0 ** max(-_LARGEST_EXPONENT, min(_LIGHT_EXPONENT - above, _LARGEST_EXPONENT)))


def exr_scale(project: Project) -> float:
    """Return by what the irradiances of a project's pictures are multiplied in its EXR files.

    Parameters
    ----------
    project : Project

    Returns
    -------
    float
        1 for `pixel_type` "float", else `half_scale` of the brightest light.
    """
    if project.output.pixel_type == "float":
        return 1.0
    return half_scale(max(light.intensity for light in project.lights))


def rounded_to_half(pixels: NDArray[np.float32]) -> NDArray[np.float32]:
    """Round 32-bit floats to what half floats hold, and to as many bits above their range.

    Parameters
    ----------
    pixels : ndarray of float32, any shape

    Returns
    -------
    ndarray of float32
        Up to 65504 the nearest half float, beyond that the nearest number of 11 bits; ties go to the even one
        (IEEE 754, 4.3.1). Infinities and NaN stay.
    """
    bits = np.ascontiguousarray(pixels).view(np.uint32)
    # half a step less one, and one more where the last bit that stays is odd: the carry rounds to nearest, ties to even
    rounded = bits >> np.uint32(_DROPPED_BITS)
    rounded &= np.uint32(1)
    rounded += bits
    rounded += np.uint32((1 << (_DROPPED_BITS - 1)) - 1)
    rounded &= ~np.uint32((1 << _DROPPED_BITS) - 1)
    values: NDArray[np.float32] = rounded.view(np.float32)
    # floats near 0.75 are as far apart as the faintest half floats, and adding rounds to the nearest
    faint = np.abs(pixels) < _LEAST_NORMAL
    np.subtract(pixels + _STEPS_OF_FAINT, _STEPS_OF_FAINT, out=values, where=faint)
    np.copyto(values, pixels, where=~np.isfinite(pixels))
    return values
