"""Cost of a prescription's ghosts: misfit to the matched targets, cost of extra ghosts, and the matching."""

import numpy as np

from ..jit.decorators import compiled, inner
from .assignment import assign
from .ghosts import PLACE, RADIUS, REACH, light_values
from .vignetting import beyond_sight

# columns of targets and of weights: place on the line (mm), signed radius (mm), log irradiance
T_PLACE, T_RADIUS, T_LIGHT = 0, 1, 2
# least radius in the cost of an extra ghost, mm
TINY = 1e-3


@inner
def light_counts(weights):
    """Return whether the irradiance of any target has a weight.

    A function's result is no compile-time constant; a constant would compile its callees separately for True and False.
    """
    for t in range(weights.shape[0]):
        if weights[t, T_LIGHT] > 0.0:
            return True
    return False


@compiled
def irradiance_of_ghosts(q, stop, mirrors, values, light):
    """Compute the logarithm of each ghost's irradiance with uncoated surfaces, relative to the light.

    Parameters
    ----------
    q : ndarray, shape (1 + 3 K,)
    stop, mirrors
        As in `kernels.design.ghosts.ghosts_of_many`.
    values : ndarray, shape (G, COLUMNS)
        Ghosts of the same prescription.
    light : ndarray, shape (G,)
        Filled.
    """
    light_values(q, (q.size - 1) // 3, stop, mirrors, values, light)


@inner
def hidden_weight(t, targets, weights):
    """Return the weight of a hidden target ghost: at the limit of sight it costs as much as a miss by its radius."""
    return max(weights[t, T_PLACE], weights[t, T_RADIUS]) * abs(targets[t, T_RADIUS])


@inner
def extra_cost(g, slope, values, extra):
    """Return the cost of a ghost without a target; 0 if no part of it is visible."""
    return 0.0 if slope > values[g, REACH] else extra / max(abs(values[g, RADIUS]), TINY)


@inner
def misfit(t, g, slope, aims, values, light):
    """Return the squared misfit of one ghost to one target."""
    targets, weights = aims.targets, aims.weights
    radius = values[g, RADIUS] if aims.signed else abs(values[g, RADIUS])
    place = weights[t, T_PLACE] * (values[g, PLACE] * slope - targets[t, T_PLACE])
    size = weights[t, T_RADIUS] * (radius - targets[t, T_RADIUS])
    hidden = hidden_weight(t, targets, weights) * beyond_sight(g, slope, values)
    total = place * place + size * size + hidden * hidden
    if weights[t, T_LIGHT] > 0.0:
        bright = weights[t, T_LIGHT] * (light[g] - targets[t, T_LIGHT])
        total += bright * bright
    return total


@inner
def fill_costs(ghosts, s, aims, values, light, parts, cost):
    """Fill the cost of each ghost for each target of light `s`, minus its cost as an extra ghost.

    The same sums as in `misfit`, in an order that vectorises the inner loop.
    """
    targets, weights, slope = aims.targets, aims.weights, aims.slopes[s]
    first, last = aims.spans[s], aims.spans[s + 1]
    for g in range(ghosts):
        parts[0, g] = values[g, PLACE] * slope
        parts[1, g] = values[g, RADIUS] if aims.signed else abs(values[g, RADIUS])
        parts[2, g] = beyond_sight(g, slope, values) ** 2
        parts[3, g] = extra_cost(g, slope, values, aims.extra)
    for t in range(first, last):
        place, radius = targets[t, T_PLACE], targets[t, T_RADIUS]
        by_place, by_size = weights[t, T_PLACE] ** 2, weights[t, T_RADIUS] ** 2
        by_sight = hidden_weight(t, targets, weights) ** 2
        row = cost[t - first]
        for g in range(ghosts):
            row[g] = (
                by_place * (parts[0, g] - place) ** 2 + by_size * (parts[1, g] - radius) ** 2 + by_sight * parts[2, g]
                - parts[3, g]
            )  # fmt: skip
        by_light = weights[t, T_LIGHT] ** 2
        if by_light > 0.0:
            for g in range(ghosts):
                row[g] += by_light * (light[g] - targets[t, T_LIGHT]) ** 2
        for g in range(ghosts):
            # a ghost at infinity must not spoil the sums
            row[g] = min(row[g], 1e30) if row[g] == row[g] else 1e30


@inner
def rematch(ghosts, aims, values, light, matching):
    """Match the ghosts of every light to its targets; return whether anything changed."""
    cost, small, parts, chosen = matching.cost, matching.small, matching.parts, matching.chosen
    changed = False
    for s in range(aims.slopes.size):
        first, last = aims.spans[s], aims.spans[s + 1]
        fill_costs(ghosts, s, aims, values, light, parts, cost)
        assign(cost, last - first, ghosts, small[0], matching.prices[s], small[1], small[2], parts[0], matching.flags)
        for t in range(first, last):
            if chosen[t] != small[0, t - first]:
                chosen[t] = small[0, t - first]
                changed = True
    return changed


@inner
def total_cost(ghosts, aims, values, light, matching, missed):
    """Return the sum of the squared residuals; `missed`: those of the limits of the lens."""
    slopes, taken = aims.slopes, matching.taken
    total = 0.0
    for m in range(missed.size):
        total += missed[m] * missed[m]
    for s in range(slopes.size):
        for g in range(ghosts):
            taken[g] = False
        for t in range(aims.spans[s], aims.spans[s + 1]):
            g = matching.chosen[t]
            taken[g] = True
            total += misfit(t, g, slopes[s], aims, values, light)
        if aims.extra > 0.0:
            for g in range(ghosts):
                if not taken[g]:
                    total += extra_cost(g, slopes[s], values, aims.extra)
    # NaN means an impossible lens
    return total if total == total else np.inf
