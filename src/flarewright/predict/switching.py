"""Which camera when: the order of shots with the least flare."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

__all__ = ["Shot", "shots_of", "switching"]


@dataclass(frozen=True)
class Shot:
    """A camera from one time on.

    Attributes
    ----------
    camera : int
    first, until : int
        Of the times: where it begins, and where the next one does.
    """

    camera: int
    first: int
    until: int


def shots_of(veil: Floats, times_s: Floats, shortest_s: float) -> tuple[Shot, ...]:
    """Find the order of cameras with the least veil over time.

    Parameters
    ----------
    veil : ndarray, shape (C, T)
        NaN where it is not known.
    times_s : ndarray, shape (T,)
    shortest_s : float
        No shot is shorter, rounded up to whole steps.

    Returns
    -------
    tuple of Shot
        None for one camera or one time.

    Notes
    -----
    What is not known counts as worse than all that is: a camera is on the air unknown only where no other order is.
    """
    if len(veil) < 2 or len(times_s) < 2:
        return ()
    steps = np.diff(times_s)
    cost = 0.5 * (veil[:, 1:] + veil[:, :-1]) * steps
    unknown = np.isnan(cost)
    if unknown.any():
        cost = np.where(unknown, (2.0 * float(np.nansum(cost)) or 1.0) * steps / steps.min(), cost)
    return switching(cost, int(np.ceil(shortest_s / steps[0] - 1e-9)))


def switching(cost: Floats, shortest: int = 1) -> tuple[Shot, ...]:
    """Find the order of cameras with the least sum of costs, no shot shorter than asked for.

    Parameters
    ----------
    cost : ndarray, shape (C, T)
        What each camera costs in each interval of time.
    shortest : int
        Intervals in a shot at least; one shot over all when there are fewer.

    Returns
    -------
    tuple of Shot
        Where costs are equal a camera goes on, and else the first one is taken.

    Notes
    -----
    Exact, by dynamic programming over where a shot ends: at time t the best order ends with a camera that has run for
    at least `shortest`. Judged by trying all orders in tests/predict/test_planning.py.
    """
    cameras, count = cost.shape
    shortest = min(max(shortest, 1), count)
    sums = np.concatenate([np.zeros((cameras, 1)), np.cumsum(cost, axis=1)], axis=1)
    # best[t]: least cost of the first t times with whole shots; going[c]: the same, camera c still running
    best = np.full(count + 1, np.inf)
    best[0] = 0.0
    begun = np.zeros(count + 1, dtype=np.int64)
    chosen = np.zeros(count + 1, dtype=np.int64)
    # for each camera the least of best[s] - sums[c, s] over the starts s so far, and that start
    least, start = np.full(cameras, np.inf), np.zeros(cameras, dtype=np.int64)
    for t in range(shortest, count + 1):
        fresh = best[t - shortest] - sums[:, t - shortest]
        # an earlier start is kept where it costs no more: fewer cuts
        better = fresh < least - 1e-12 * np.abs(least) if np.isfinite(least).all() else np.isfinite(fresh)
        least, start = np.where(better, fresh, least), np.where(better, t - shortest, start)
        ends = least + sums[:, t]
        camera = int(np.argmin(ends))
        best[t], begun[t], chosen[t] = ends[camera], start[camera], camera
    shots: list[Shot] = []
    t = count
    while t > 0:
        shots.insert(0, Shot(int(chosen[t]), int(begun[t]), t))
        t = int(begun[t])
    return _joined(shots)


def _joined(shots: list[Shot]) -> tuple[Shot, ...]:
    """Join neighbouring shots of one camera."""
    out: list[Shot] = []
    for shot in shots:
        if out and out[-1].camera == shot.camera:
            out[-1] = Shot(shot.camera, out[-1].first, shot.until)
        else:
            out.append(shot)
    return tuple(out)
