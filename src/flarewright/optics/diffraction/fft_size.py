"""Array lengths with fast Fourier transforms."""

from __future__ import annotations


def fast_size(least: int, *, even: bool = False) -> int:
    """Return the smallest length, at least `least`, without prime factors above 5.

    Parameters
    ----------
    least : int
        At least 1.
    even : bool
        Only even lengths.
    """
    step = 2 if even else 1
    found = least + least % step
    while True:
        rest = found
        for prime in (2, 3, 5):
            while rest % prime == 0:
                rest //= prime
        if rest == 1:
            return found
        found += step
