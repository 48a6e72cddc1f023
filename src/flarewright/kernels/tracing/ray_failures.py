"""Which rays of a path pass all rims and the iris, how others fail, and whether all rays of a patch do."""

import numpy as np

from ..jit.decorators import borrowing
from .sequential import ALIVE, REL, STOP_X, X

# largest r / semi-diameter of a ray that passes: the box around the front touches its rim, and so may a sample
RIM = 1.0 + 1e-6


@borrowing
def passes(data, k, crossings, iris_radius):
    """Return whether a ray passes every rim, and the circle around the iris at each crossing."""
    return not (data[k, ALIVE] == 0.0 or data[k, REL] > RIM or beyond_iris(data, k, crossings, iris_radius))


@borrowing
def beyond_iris(data, k, crossings, iris_radius):
    """Return whether a ray that did not end crosses the stop outside the circle around the iris, at any crossing."""
    for c in range(crossings):
        u, v = data[k, STOP_X + 2 * c], data[k, STOP_X + 2 * c + 1]
        if u * u + v * v > iris_radius * iris_radius:
            return True
    return False


@borrowing
def excess_of(data, k, crossings, iris_radius):
    """Return how far out a ray comes: the largest r / semi-diameter of rims and iris; infinite for a ray that ends."""
    if data[k, ALIVE] == 0.0:
        return np.inf
    far = data[k, REL]
    for c in range(crossings):
        u, v = data[k, STOP_X + 2 * c], data[k, STOP_X + 2 * c + 1]
        far = max(far, np.sqrt(u * u + v * v) / iris_radius)
    return far


@borrowing
def surfaces_passed(data, k):
    """Return the number of surfaces that a ray passed before it ended, -1 for a ray that did not end."""
    return -1.0 if data[k, ALIVE] > 0.0 else data[k, X]


@borrowing
def failure(data, k, crossings, iris_radius):
    """Return the number of surfaces that a ray passed before it ended; -1: beyond a rim, -2: the iris, -3: both."""
    if data[k, ALIVE] == 0.0:
        return data[k, X]
    if not beyond_iris(data, k, crossings, iris_radius):
        return -1.0
    return -3.0 if data[k, REL] > RIM else -2.0


@borrowing
def rejected(data, nodes, crossings, iris_radius, slack):
    """Return whether no ray of a patch can pass: all samples end, all lie beyond a rim, or all miss the iris."""
    low, high, alive = np.inf, -np.inf, 0
    for k in nodes:
        if data[k, ALIVE] > 0.0:
            alive += 1
            low, high = min(low, data[k, REL]), max(high, data[k, REL])
    if alive == 0 or outside(low, high, slack):
        return True
    for crossing in range(crossings):
        if stop_outside(data, nodes, crossing, iris_radius, slack):
            return True
    return False


@borrowing
def stop_outside(data, nodes, crossing, iris_radius, slack):
    """Return whether a patch misses the iris at one crossing: its widened box in the stop plane lies outside."""
    u_low, u_high, v_low, v_high = np.inf, -np.inf, np.inf, -np.inf
    for k in nodes:
        if data[k, ALIVE] > 0.0:
            u = data[k, STOP_X + 2 * crossing]
            v = data[k, STOP_X + 2 * crossing + 1]
            u_low, u_high = min(u_low, u), max(u_high, u)
            v_low, v_high = min(v_low, v), max(v_high, v)
    u_wide, v_wide = slack * (u_high - u_low), slack * (v_high - v_low)
    du = max(max(u_low - u_wide, -u_high - u_wide), 0.0)
    dv = max(max(v_low - v_wide, -v_high - v_wide), 0.0)
    return du * du + dv * dv > iris_radius * iris_radius


@borrowing
def outside(value_low, value_high, slack):
    """Return whether a quantity stays above RIM between samples, with a margin of `slack` times its range."""
    return value_low - slack * (value_high - value_low) > RIM
