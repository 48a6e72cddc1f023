"""Half floats for irradiance: the scale that brings faint ghosts into their range, and rounding to their precision.

Half floats have 11 significant bits between 6.1e-5 and 65504, and steps of 6e-8 below. Irradiances for a light of 1
range from 1e-8 in a faint ghost to 4e5 in a star's core. The scale serves the faint end. Values above the range are
written as 32-bit floats rounded to 11 bits, because these compress far better than full 32-bit floats.
"""

from __future__ import annotations

from math import frexp

import numpy as np

from ...model.project.project import Project
from ...typing import Pixels

HALF_MAX = 65504.0
"""The largest 16-bit float."""

# exponent of the brightest light: ghosts of 6e-8 of it keep 11 bits, and most of a starburst stays below 2^16
_LIGHT_EXPONENT = 10
# limit that keeps the scale and its square (for variances) normal 32-bit floats
_LARGEST_EXPONENT = 63
# 24 significant bits of a float less the 11 of a half float
_DROPPED_BITS = 13
# below this, half floats have uniform steps of 2^-24, like 32-bit floats from 0.5 to 1
_LEAST_NORMAL = np.float32(2.0**-14)
_STEPS_OF_FAINT = np.float32(0.75)


def half_scale(brightest: float = 1.0) -> float:
    """Return the factor of irradiances in a file of half floats.

    Parameters
    ----------
    brightest : float
        Intensity of the brightest light.

    Returns
    -------
    float
        2^10 over the smallest power of two that is at least the intensity: 1024 for 1, 2^-7 for 100 000; 1024 without
        a light.

    Notes
    -----
    A power of two scales without rounding. It depends only on the lights: a scale from the pixels would change from
    frame to frame of a sequence.
    """
    if not brightest > 0.0:
        return half_scale()
    part, exponent = frexp(brightest)
    # frexp: brightest = part * 2^exponent with 0.5 <= part < 1
    above = exponent - 1 if part == 0.5 else exponent
    return float(2.0 ** max(-_LARGEST_EXPONENT, min(_LIGHT_EXPONENT - above, _LARGEST_EXPONENT)))


def exr_scale(project: Project) -> float:
    """Return the factor of a project's irradiances in its EXR files.

    Returns
    -------
    float
        1 for `pixel_type` "float", and over a plate whose lights are the project's: layers then add to it as they are.
        Else `half_scale` of the brightest light.
    """
    if project.output.pixel_type == "float" or project.lit_by_plate:
        return 1.0
    return half_scale(max(light.intensity for light in project.lights))


def rounded_to_half(pixels: Pixels) -> Pixels:
    """Round 32-bit floats to half floats, and to the same precision above half's range.

    Parameters
    ----------
    pixels : ndarray of float32, any shape

    Returns
    -------
    ndarray of float32
        Up to 65504 the nearest half float, beyond it the nearest number of 11 significant bits; ties round to even
        (IEEE 754, 4.3.1). Infinities and NaN stay.
    """
    bits = np.ascontiguousarray(pixels).view(np.uint32)
    # add half a step minus one, plus the last kept bit: rounds to nearest, ties to even
    rounded = bits >> np.uint32(_DROPPED_BITS)
    rounded &= np.uint32(1)
    rounded += bits
    rounded += np.uint32((1 << (_DROPPED_BITS - 1)) - 1)
    rounded &= ~np.uint32((1 << _DROPPED_BITS) - 1)
    values: Pixels = rounded.view(np.float32)
    # floats near 0.75 have the step of the faintest half floats, so that the addition rounds to that step
    faint = np.abs(pixels) < _LEAST_NORMAL
    np.subtract(pixels + _STEPS_OF_FAINT, _STEPS_OF_FAINT, out=values, where=faint)
    np.copyto(values, pixels, where=~np.isfinite(pixels))
    return values
