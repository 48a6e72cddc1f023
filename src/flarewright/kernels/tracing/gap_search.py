"""The search for light between the rays of the pre-pass: in the gaps of its grid, and on the mirror axis."""

import numpy as np

from ..jit.decorators import borrowing, inner
from .ray_failures import RIM, excess_of, failure, outside, passes, surfaces_passed
from .sequential import ALIVE, REL, STOP, STOP_X, WEIGHT, X, trace_lanes

# most samples per side of a searched cell
PROBES = 8
# number of halvings of the gap between two rays if one of them ends, or if both end at different surfaces
HALVINGS = 5
# samples of the mirror axis along a cell where nothing else was found; numbers of halvings of the gap between two rays
# that end at different surfaces there, and of the intervals beside the best rays
ON_AXIS, ENDED_HALVINGS, NARROWINGS = 4, 3, 6
# where many cells pass, a gap is searched only if one of its rays has a largest r / semi-diameter of at most this
NEAR = 2.0


@inner
def search_gaps(steps, lens, light, crossings, iris_radius, samples, few, spots, sums):
    """Search between grid neighbours that end differently by halving the gap HALVINGS times.

    In the halves rays that do not end differ too, if they fail at different limits: light passes between a ray beyond a
    rim and one beyond the iris.
    """
    px, py, data, width, hx, hy = samples
    # surfaces before the first crossing of the stop
    before = 0
    while before < steps.actions.size and steps.actions[before] != STOP:
        before += 1
    gaps = np.empty((2 * px.size, 6))
    n_gaps = 0
    for k in range(px.size):
        for along in range(2):
            other = k + 1 if along == 0 else k + width
            if other >= px.size or (along == 0 and other % width == 0):
                continue
            if not _is_doubtful_gap(data, k, other, before, crossings, iris_radius, few):
                continue
            end, its_end = failure(data, k, crossings, iris_radius), failure(data, other, crossings, iris_radius)
            gaps[n_gaps, 0], gaps[n_gaps, 1], gaps[n_gaps, 2] = px[k], py[k], end
            gaps[n_gaps, 3], gaps[n_gaps, 4], gaps[n_gaps, 5] = px[other], py[other], its_end
            n_gaps += 1
    share = hx * hy * np.cos(light.tilt)
    for _ in range(HALVINGS):
        share *= 0.5
        mx, my = np.empty(n_gaps), np.empty(n_gaps)
        for k in range(n_gaps):
            mx[k], my[k] = 0.5 * (gaps[k, 0] + gaps[k, 3]), 0.5 * (gaps[k, 1] + gaps[k, 4])
        middle = np.empty((n_gaps, STOP_X + 2 * crossings))
        trace_lanes(steps, lens, light, mx, my, middle)
        narrower = np.empty((2 * n_gaps, 6))
        count = 0
        for k in range(n_gaps):
            if passes(middle, k, crossings, iris_radius):
                add_spot(spots, sums, middle, k, mx[k], my[k], hx / PROBES, hy / PROBES, share)
                continue
            end = failure(middle, k, crossings, iris_radius)
            for side in range(2):
                # keep the half whose rays still fail differently
                if end != gaps[k, 3 * side + 2]:
                    for m in range(3):
                        narrower[count, m] = gaps[k, 3 * side + m]
                    narrower[count, 3], narrower[count, 4], narrower[count, 5] = mx[k], my[k], end
                    count += 1
        gaps = narrower
        n_gaps = count


@borrowing
def _is_doubtful_gap(data, a, b, before, crossings, iris_radius, few):
    """Return whether to search between two rays: both fail, end differently, and not both far beyond rim or iris."""
    if surfaces_passed(data, a) == surfaces_passed(data, b):
        return False
    low, high = min(data[a, REL], data[b, REL]), max(data[a, REL], data[b, REL])
    if low > NEAR and not (few and not outside(low, high, 0.5)):
        return False
    if passes(data, a, crossings, iris_radius) or passes(data, b, crossings, iris_radius):
        return False
    for k in (a, b):
        # the ray ended in front of the iris, so its place there is unknown
        if data[k, ALIVE] == 0.0 and data[k, X] < before:
            return True
    ua, va, ub, vb = data[a, STOP_X], data[a, STOP_X + 1], data[b, STOP_X], data[b, STOP_X + 1]
    ra, rb = np.sqrt(ua * ua + va * va) / iris_radius, np.sqrt(ub * ub + vb * vb) / iris_radius
    return not outside(min(ra, rb), max(ra, rb), 0.5)


@inner
def search_axis(steps, lens, light, crossings, iris_radius, samples, kept, each, spots, sums):
    """Search the mirror axis beside the kept cells, with `each` rays a cell; add passing ones to `spots` and `sums`.

    The first row of the samples lies on the axis.

    Light may lie beside a ray that comes nearer to its limits than its neighbours, or whose neighbours end. Such a ray
    may hide between two that end at different surfaces.
    """
    _, py, data, on_axis, hx, hy = samples
    cells, step = on_axis - 1, hy / each
    places, count = py[:on_axis], cells * each + 1
    if each > 1:
        places = np.empty(count)
        for k in range(count):
            places[k] = py[0] + k * step
        data = _axis_rays(steps, lens, light, crossings, places)
    width, share = hx / PROBES, hx * np.cos(light.tilt) / PROBES
    excess = np.empty(count)
    for k in range(count):
        excess[k] = excess_of(data, k, crossings, iris_radius)
        if kept[min(k // each, cells - 1)] == 1 or kept[max(k - 1, 0) // each] == 1:
            # in the region that is known
            excess[k] = 0.0
        elif excess[k] <= RIM:
            add_spot(spots, sums, data, k, 0.0, places[k], width, step, share * step)
    # place, excess and distance of neighbours; place of a gap's middle, and where the rays on both sides end
    best, gaps = np.empty((count << ENDED_HALVINGS, 3)), np.empty((count, 3))
    n_best, n_gaps = 0, 0
    for k in range(count - 1):
        if k > 0 and RIM < excess[k] < np.inf and excess[k] <= min(excess[k - 1], excess[k + 1]):
            best[n_best, 0], best[n_best, 1], best[n_best, 2] = places[k], excess[k], step
            n_best += 1
        if excess[k] == np.inf and excess[k + 1] == np.inf and data[k, X] != data[k + 1, X]:
            gaps[n_gaps, 0], gaps[n_gaps, 1], gaps[n_gaps, 2] = places[k] + 0.5 * step, data[k, X], data[k + 1, X]
            n_gaps += 1
    for _ in range(ENDED_HALVINGS):
        step *= 0.5
        places = np.empty(n_gaps)
        for k in range(n_gaps):
            places[k] = gaps[k, 0]
        data = _axis_rays(steps, lens, light, crossings, places)
        narrower, count = np.empty((2 * n_gaps, 3)), 0
        for k in range(n_gaps):
            far = excess_of(data, k, crossings, iris_radius)
            if far <= RIM:
                add_spot(spots, sums, data, k, 0.0, places[k], width, step, share * step)
            elif far < np.inf:
                best[n_best, 0], best[n_best, 1], best[n_best, 2] = places[k], far, step
                n_best += 1
            for side in range(2):
                if far == np.inf and data[k, X] != gaps[k, side + 1]:
                    narrower[count, 0] = places[k] + (side - 0.5) * step
                    narrower[count, side + 1], narrower[count, 2 - side] = gaps[k, side + 1], data[k, X]
                    count += 1
        gaps, n_gaps = narrower, count
    _narrow(steps, lens, light, crossings, iris_radius, best, n_best, width, share, spots, sums)


@inner
def _narrow(steps, lens, light, crossings, iris_radius, best, n_best, width, share, spots, sums):
    """Halve the intervals beside each of the `best` rays on the mirror axis, around the best of its three each time.

    `best`, changed, holds places, excesses and distances of the neighbours; a ray that passes ends its search.
    """
    for _ in range(NARROWINGS):
        places = np.empty(2 * n_best)
        for k in range(n_best):
            best[k, 2] *= 0.5
            places[2 * k], places[2 * k + 1] = best[k, 0] - best[k, 2], best[k, 0] + best[k, 2]
        data = _axis_rays(steps, lens, light, crossings, places)
        count = 0
        for k in range(n_best):
            place, least, step = best[k, 0], best[k, 1], best[k, 2]
            for m in range(2 * k, 2 * k + 2):
                far = excess_of(data, m, crossings, iris_radius)
                if far <= RIM:
                    add_spot(spots, sums, data, m, 0.0, places[m], width, step, share * step)
                if far < least:
                    place, least = places[m], far
            if least > RIM:
                best[count, 0], best[count, 1], best[count, 2] = place, least, step
                count += 1
        n_best = count


@inner
def _axis_rays(steps, lens, light, crossings, places):
    """Trace rays through places on the mirror axis, shape (N,)."""
    px = np.empty(places.size)
    for k in range(places.size):
        px[k] = 0.0
    data = np.empty((places.size, STOP_X + 2 * crossings))
    trace_lanes(steps, lens, light, px, places, data)
    return data


@borrowing
def add_spot(spots, sums, data, k, x, y, hx, hy, share):
    """Add a passing ray between the samples to `spots` and `sums`; it represents `share` mm^2 in each pupil half."""
    spots[0], spots[1] = min(spots[0], x - hx), max(spots[1], x + hx)
    spots[2], spots[3] = min(spots[2], y - hy), max(spots[3], y + hy)
    sums[0] += 2.0 * data[k, WEIGHT] * share
    sums[3] += 1.0
