"""What a sensor makes of light, in one pass over the pixels."""

import numpy as np

from ..jit.decorators import compiled


@compiled
def record(light, noise, well, read, black, most, out):
    """Add noise and a black level to light, and clip it.

    Parameters
    ----------
    light : ndarray, shape (N,), float32
        White at 1.
    noise : ndarray, shape (N,), float32
        Standard normal numbers; empty: no noise.
    well, read : float32
        Electrons of the full well and rms of the read noise. The noise has the variance v well + read^2, electrons, for
        the light v between 0 and 1.
    black : float32
        Value of black; white stays at 1.
    most : float32
        Values are clipped to 0 and this.
    out : ndarray, shape (N,), float32
        Filled; may be `light`.
    """
    zero, one = np.float32(0.0), np.float32(1.0)
    part, variance = one / well, read * read
    noisy = noise.size > 0
    for k in range(light.size):
        value = light[k]
        if noisy:
            value += noise[k] * (np.sqrt(min(max(value, zero), one) * well + variance) * part)
        out[k] = min(max(black + (one - black) * value, zero), most)
