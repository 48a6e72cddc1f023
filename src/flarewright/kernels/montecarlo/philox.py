"""Counter-based random numbers: each block is a function of a counter and a key, so streams need no stored state."""

import numpy as np

from ..jit.decorators import inner

_M0, _M1 = np.uint64(0xD2511F53), np.uint64(0xCD9E8D57)
_W0, _W1 = np.uint64(0x9E3779B9), np.uint64(0xBB67AE85)
_LOW, _HALF = np.uint64(0xFFFFFFFF), np.uint64(32)
_ONE = np.uint64(1)


@inner
def philox(c0, c1, c2, c3, k0, k1):
    """Return a block of random bits: Philox 4x32 with ten rounds.

    Parameters
    ----------
    c0, c1, c2, c3 : uint64
        The counter, 32 bits each.
    k0, k1 : uint64
        The key, 32 bits each.

    Returns
    -------
    tuple of four uint64
        32 bits each.

    Notes
    -----
    J. K. Salmon, M. A. Moraes, R. O. Dror and D. E. Shaw, "Parallel random numbers: as easy as 1, 2, 3", SC 2011,
    section 3.3. `tests/kernels/montecarlo/test_forward.py` compares with the authors' published values.
    """
    for _ in range(10):
        p0, p1 = _M0 * c0, _M1 * c2
        c0, c1, c2, c3 = (p1 >> _HALF) ^ c1 ^ k0, p1 & _LOW, (p0 >> _HALF) ^ c3 ^ k1, p0 & _LOW
        k0, k1 = (k0 + _W0) & _LOW, (k1 + _W1) & _LOW
    return c0, c1, c2, c3


@inner
def refill(stream, pool):
    """Fill a pool with the next four numbers of a stream, each in (0, 1).

    Parameters
    ----------
    stream : ndarray, shape (6,), uint64
        Counter and key; the first word of the counter is incremented.
    pool : ndarray, shape (4,)
        Filled.
    """
    b0, b1, b2, b3 = philox(stream[0], stream[1], stream[2], stream[3], stream[4], stream[5])
    stream[0] += _ONE
    pool[0], pool[1], pool[2], pool[3] = _unit(b0), _unit(b1), _unit(b2), _unit(b3)


@inner
def _unit(bits):
    return (np.float64(bits) + 0.5) * 2.0**-32
