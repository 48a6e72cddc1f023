"""What the ghosts of a prescription cost: as targets, as ghosts that nobody wanted, and which stands for which."""

import numpy as np

from ._jit import compiled, inner
from .design_ghosts import PLACE, RADIUS, REACH, light_values
from .design_match import assign
from .design_sight import beyond

# columns of targets and of weights: place on the line (mm), signed radius (mm), log irradiance
T_PLACE, T_RADIUS, T_LIGHT = 0, 1, 2
# an extra ghost is not pushed out of sight any more beyond this radius, mm
TINY = 1e-3


@inner
def light_counts(weights):
    """Return whether the irradiance of any target counts.

    What is told by a function is no constant to the compiler, which would make kernels of their own for yes and for no.
    """
    for t in range(weights.shape[0]):
        if weights[t, T_LIGHT] > 0.0:
            return True
    return False


@compiled
def irradiance_of_ghosts(q, stop, mirrors, values, light):
    """Compute the logarithm of each ghost's irradiance with bare surfaces, the light's being 1.

    Parameters
    ----------
    q : ndarray, shape (1 + 3 K,)
    stop, mirrors
        As in `kernels.design_ghosts.ghosts_of_many`.
    values : ndarray, shape (G, COLUMNS)
        Of the same prescription.
    light : ndarray, shape (G,)
        Filled.
    """
    light_values(q, (q.size - 1) // 3, stop, mirrors, values, light)


@inner
def hidden_weight(t, targets, weights):
    """Return what weighs a wanted ghost out of sight: at its edge it counts as one that misses by its own radius."""
    return max(weights[t, T_PLACE], weights[t, T_RADIUS]) * abs(targets[t, T_RADIUS])


@inner
def extra_cost(g, slope, values, extra):
    """Return what a ghost without a target costs; nothing when no part of it is in sight."""
    return 0.0 if slope > values[g, REACH] else extra / max(abs(values[g, RADIUS]), TINY)


@inner
def misfit(t, g, slope, signed, targets, weights, values, light):
    """Squared misfit of one ghost as one target."""
    radius = values[g, RADIUS] if signed else abs(values[g, RADIUS])
    place = weights[t, T_PLACE] * (values[g, PLACE] * slope - targets[t, T_PLACE])
    size = weights[t, T_RADIUS] * (radius - targets[t, T_RADIUS])
    hidden = hidden_weight(t, targets, weights) * beyond(g, slope, values)
    total = place * place + size * size + hidden * hidden
    if weights[t, T_LIGHT] > 0.0:
        bright = weights[t, T_LIGHT] * (light[g] - targets[t, T_LIGHT])
        total += bright * bright
    return total


@inner
def fill_costs(ghosts, first, last, slope, signed, targets, weights, values, light, extra, parts, cost):
    """Fill what each ghost costs as each target of one light, less what it would cost as an extra ghost.

    The sums of `misfit`, in an order that makes the inner loop one of vectors.
    """
    for g in range(ghosts):
        parts[0, g] = values[g, PLACE] * slope
        parts[1, g] = values[g, RADIUS] if signed else abs(values[g, RADIUS])
        parts[2, g] = beyond(g, slope, values) ** 2
        parts[3, g] = extra_cost(g, slope, values, extra)
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
def rematch(
    ghosts, spans, slopes, signed, targets, weights, values, light, extra, chosen, cost, prices, small, parts, flags
):
    """Match the ghosts of every light to its targets; return whether anything changed."""
    changed = False
    for s in range(slopes.size):
        first, last = spans[s], spans[s + 1]
        fill_costs(ghosts, first, last, slopes[s], signed, targets, weights, values, light, extra, parts, cost)
        assign(cost, last - first, ghosts, small[0], prices[s], small[1], small[2], parts[0], flags)
        for t in range(first, last):
            if chosen[t] != small[0, t - first]:
                chosen[t] = small[0, t - first]
                changed = True
    return changed


@inner
def total_cost(ghosts, spans, slopes, signed, targets, weights, values, light, extra, chosen, taken, wished):
    """Sum the squared residuals."""
    total = 0.0
    for m in range(wished.size):
        total += wished[m] * wished[m]
    for s in range(slopes.size):
        for g in range(ghosts):
            taken[g] = False
        for t in range(spans[s], spans[s + 1]):
            g = chosen[t]
            taken[g] = True
            total += misfit(t, g, slopes[s], signed, targets, weights, values, light)
        if extra > 0.0:
            for g in range(ghosts):
                if not taken[g]:
                    total += extra_cost(g, slopes[s], values, extra)
    # not a number is no lens
    return total if total == total else np.inf
