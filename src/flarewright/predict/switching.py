"""Choose the camera with the least flare over time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..typing import Floats


@dataclass(frozen=True)
class Shot:
    """A camera over a range of times.

    Attributes
    ----------
    camera : int
    first, until : int
        Indices of the start, and of the start of the next shot.
    """

    camera: int
    first: int
    until: int


def choose_cameras(veil: Floats, times_s: Floats, shortest_s: float) -> tuple[Shot, ...]:
    """Compute the sequence of cameras with the least veil over time.

    Parameters
    ----------
    veil : ndarray, shape (C, T)
        Veil of each camera; NaN where unknown.
    times_s : ndarray, shape (T,)
    shortest_s : float
        Least duration of a shot, rounded up to whole steps.

    Returns
    -------
    tuple of Shot
        Empty for one camera or one time.

    Notes
    -----
    Unknown veil counts as worse than all known: such a camera is chosen only where no other sequence exists.
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
    """Compute the sequence of cameras with the least sum of costs and a least duration of shots.

    Parameters
    ----------
    cost : ndarray, shape (C, T)
        Cost of each camera in each interval of time.
    shortest : int
        Least number of intervals per shot; a single shot if there are fewer.

    Returns
    -------
    tuple of Shot
        At equal cost the current camera stays, otherwise the first one is chosen.

    Notes
    -----
    Exact, by dynamic programming over the end of a shot: the best sequence up to time t ends with a shot of at least
    `shortest`. Compared with an exhaustive search in tests/predict/test_plan.py.
    """
    cameras, count = cost.shape
    shortest = min(max(shortest, 1), count)
    sums = np.concatenate([np.zeros((cameras, 1)), np.cumsum(cost, axis=1)], axis=1)
    # best[t]: least cost of the first t intervals, ending with a complete shot
    best = np.full(count + 1, np.inf)
    best[0] = 0.0
    started = np.zeros(count + 1, dtype=np.int64)
    chosen = np.zeros(count + 1, dtype=np.int64)
    # per camera: least best[s] - sums[c, s] over all starts s up to now, and that start
    least, start = np.full(cameras, np.inf), np.zeros(cameras, dtype=np.int64)
    for t in range(shortest, count + 1):
        fresh = best[t - shortest] - sums[:, t - shortest]
        # prefer the earlier start at equal cost: fewer cuts
        better = fresh < least - 1e-12 * np.abs(least) if np.isfinite(least).all() else np.isfinite(fresh)
        least, start = np.where(better, fresh, least), np.where(better, t - shortest, start)
        ends = least + sums[:, t]
        camera = int(np.argmin(ends))
        best[t], started[t], chosen[t] = ends[camera], start[camera], camera
    shots: list[Shot] = []
    t = count
    while t > 0:
        shots.insert(0, Shot(int(chosen[t]), int(started[t]), t))
        t = int(started[t])
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
