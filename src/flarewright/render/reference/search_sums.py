"""Sums over the batches of a search for four-reflection paths; an interrupted search adds further batches later."""

from __future__ import annotations

from collections.abc import Mapping
from math import ceil
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...typing import Floats

# mean number of rays that meet a path at the limit; its estimate then has an error of about 1/7
HITS = 50
# entries of `Tally.arrays` beside the fluxes of paths: batches, two-reflection flux, sum and sum of squares of weights
_FACTS = 4


class Tally:
    """Flux of four-reflection paths in the picture, summed over batches.

    Parameters
    ----------
    keys : ndarray, shape (N,), int64
        Paths, each as one number, in the order in which they were met.
    numbers : ndarray, shape (N + 4,)
        Their flux; then what `arrays` appends to it.
    """

    def __init__(self, keys: NDArray[Any] | None = None, numbers: NDArray[Any] | None = None) -> None:
        # replaced at once, so that an interruption finds whole batches only
        self._state: tuple[dict[int, float], int, float, Floats] = ({}, 0, 0.0, np.zeros(2))
        if keys is not None and numbers is not None:
            if keys.shape != (len(numbers) - _FACTS,) or not np.isfinite(numbers).all():
                raise ValueError("sums of a search are damaged")
            flux = dict(zip(keys.tolist(), numbers[:-_FACTS].tolist(), strict=True))
            self._state = (flux, int(numbers[-4]), float(numbers[-3]), numbers[-2:].astype(np.float64))

    @property
    def flux(self) -> dict[int, float]:
        """Flux of each path, by its number, summed over the batches."""
        return self._state[0]

    @property
    def batches(self) -> int:
        """Number of batches."""
        return self._state[1]

    @property
    def two(self) -> float:
        """Two-reflection flux of all batches."""
        return self._state[2]

    def add(self, fours: Floats, two: float) -> None:
        """Add a batch: its four-reflection rays, as of `batches.run_batch`, and its two-reflection flux."""
        keys, weights = fours[:, 0].astype(np.int64), fours[:, 1]
        names, place = np.unique(keys, return_inverse=True)
        found = np.bincount(place, weights=weights, minlength=len(names))
        flux = dict(self.flux)
        for key, value in zip(names.tolist(), found.tolist(), strict=True):
            flux[key] = flux.get(key, 0.0) + value
        sums = self._state[3] + np.array([weights.sum(), (weights**2).sum()])
        self._state = (flux, self.batches + 1, self.two + two, sums)

    def batches_for(self, limit: float) -> int:
        """Return the number of batches in which `HITS` rays meet a path at the limit."""
        flux, squares = self._state[3]
        if flux <= 0.0 or self.two <= 0.0:
            return self.batches
        # effective flux per ray for the variance of a sum of rays
        ray = squares / flux
        needed, least = HITS * ray * self.batches, limit * self.two
        # the quotient of a tiny limit overflows
        return max(self.batches, ceil(needed / least) if needed < 1e9 * least else 1_000_000_000)

    def arrays(self) -> tuple[NDArray[Any], NDArray[Any]]:
        """Return the keys and numbers from which a tally starts with the same sums."""
        facts = [float(self.batches), self.two, *self._state[3].tolist()]
        return np.array(list(self.flux), dtype=np.int64), np.array([*self.flux.values(), *facts])


class SearchSums:
    """What a search has found after its batches so far.

    Parameters
    ----------
    arrays : mapping of str to ndarray, optional
        What `arrays` of an interrupted search returned; None: no batch is done.

    Raises
    ------
    ValueError, KeyError
        When the arrays are damaged.
    """

    def __init__(self, arrays: Mapping[str, NDArray[Any]] | None = None) -> None:
        self._lock = Lock()
        if arrays is None:
            self.search, self.estimate = Tally(), Tally()
            self.wanted: int | None = None
            return
        self.search = Tally(arrays["search.keys"], arrays["search.numbers"])
        self.estimate = Tally(arrays["estimate.keys"], arrays["estimate.numbers"])
        wanted = int(arrays["wanted"])
        self.wanted = wanted if wanted > 0 else None
        """Batches that the limit needs; None before the pilot batches are done."""

    @property
    def batches(self) -> int:
        """Number of batches that are summed."""
        return self.search.batches + self.estimate.batches

    def add(self, fours: Floats, two: float, *, choosing: bool) -> None:
        """Add the next batch, to the sums that choose the paths or to those that estimate the flux."""
        with self._lock:
            (self.search if choosing else self.estimate).add(fours, two)

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return the sums as arrays for a file; also while another thread adds batches."""
        with self._lock:
            found: dict[str, NDArray[Any]] = {"wanted": np.array(self.wanted or 0)}
            for name, tally in (("search", self.search), ("estimate", self.estimate)):
                found[f"{name}.keys"], found[f"{name}.numbers"] = tally.arrays()
        return found
