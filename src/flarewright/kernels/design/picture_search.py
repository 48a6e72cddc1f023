"""Local search by the picture: the difference between a lens' ghosts and a target picture, with derivatives.

All ghosts of a light have their centre on one line, so a picture is drawn on rows of pixels along that line: a disc or
polygon is one span of each row, with exact coverage at both ends. Rows are closer together near the line, where small
ghosts lie. A ghost's level is proportional to 1 / radius, as Van Acoleyen 2025, section 4.3.4, draws it without
colours.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...typing import Floats
from ..jit.decorators import compiled, inner
from .arguments import room_for_derivatives
from .cost import TINY
from .ghosts import BOUND, COLUMNS, PLACE, RADIUS, REACH_THESIS, differentiate_ghosts, list_ghosts
from .local_search import (
    LIMITS,
    clip_start,
    damped_step,
    fill_limit_rows,
    fill_normal_equations,
    fill_scale,
    ghosts_of_structure,
    hold_at_bounds,
    limit_values,
    step_within,
    to_prescription,
)

# columns of the tables of rows and of edges
DISTANCE, AREA = 0, 1
APOTHEM, TANGENT = 0, 1
# columns of the drawn ghosts: centre and unsigned radius (mm), level added to the pixels, index of its polygon
AT, SIZE, LEVEL, SHAPE = 0, 1, 2, 3
# SHAPE of a disc
ROUND = 2
# columns of derivatives: by place and radius, then approximate second derivatives
BY_PLACE, BY_RADIUS, PLACE_PLACE, PLACE_RADIUS, RADIUS_RADIUS = 0, 1, 2, 3, 4
# the search ends after this many consecutive steps that reduce the cost by less than this part
SLOW, MOST_SLOW = 1e-3, 3
# most attempts at a step that reduces the cost, and the largest factor by which later steps are stretched
TRIES, LONGEST = 8, 8.0


@inner
def covered_pixels(distance, radius, edges):
    """Return begin and end of a disc, or of a polygon around 0, on a row, and their derivatives by the radius.

    An empty span has an end before its begin.
    """
    if edges.shape[0] == 0:
        rest = radius * radius - distance * distance
        if rest <= 0.0:
            return 1.0, -1.0, 0.0, 0.0
        half = np.sqrt(rest)
        return -half, half, -radius / half, radius / half
    begin, end, begin_by, end_by = -1e30, 1e30, 0.0, 0.0
    for k in range(edges.shape[0]):
        # an edge is x cos + y sin = apothem; the table holds apothem / cos, positive for right and negative for left
        # edges, and tan
        by = edges[k, APOTHEM]
        at = by * radius - edges[k, TANGENT] * distance
        if by > 0.0:
            if at < end:
                end, end_by = at, by
        elif at > begin:
            begin, begin_by = at, by
    return begin, end, begin_by, end_by


@inner
def add_disc_edge(row, at, light):
    """Add a step in light at a place of a row of pixels, as differences along the row."""
    pixel = int(at)
    part = at - pixel
    row[pixel] += light * (1.0 - part)
    row[pixel + 1] += light * part


@inner
def draw_row(shown, edges, distance, low, high, start, pixel, row, spans):
    """Draw the ghosts on one row of pixels, and fill begin and end of each with their derivatives by the radius."""
    row[:] = 0.0
    for g in range(shown.shape[0]):
        spans[g, 0], spans[g, 1] = 1.0, 0.0
        if shown[g, LEVEL] <= 0.0:
            continue
        shape = int(shown[g, SHAPE])
        begin, end, begin_by, end_by = covered_pixels(
            distance, shown[g, SIZE], edges[shape] if shape < ROUND else edges[0, :0]
        )
        begin, end = (shown[g, AT] + begin - start) / pixel, (shown[g, AT] + end - start) / pixel
        in_begin, in_end = max(begin, low), min(end, high)
        if in_end <= in_begin:
            continue
        add_disc_edge(row, in_begin, shown[g, LEVEL])
        add_disc_edge(row, in_end, -shown[g, LEVEL])
        spans[g, 0], spans[g, 1] = in_begin, in_end
        # an end outside the picture has no derivative
        spans[g, 2] = begin_by if begin > low else np.nan
        spans[g, 3] = end_by if end < high else np.nan


@compiled
def draw_picture(shown, edges, rows, limits, start, pixel, out):
    """Draw ghosts as `polish_by_picture` does for its comparison.

    Parameters
    ----------
    shown : ndarray, shape (G, 4)
        AT, SIZE, LEVEL, SHAPE.
    edges, rows, limits, start, pixel
        As in `kernels.design.arguments.TargetPicture`, for one light.
    out : ndarray, shape (V, U)
        Filled; light is clipped at 1.
    """
    row, spans = np.empty(out.shape[1] + 2), np.empty((shown.shape[0], 4))
    for v in range(rows.shape[0]):
        draw_row(shown, edges, rows[v, DISTANCE], limits[v, 0], limits[v, 1], start, pixel, row, spans)
        light = 0.0
        for u in range(out.shape[1]):
            light += row[u]
            out[v, u] = min(light, 1.0)


@inner
def compare(shown, edges, rows, limits, start, pixel, wanted, row, spans, off, sums, by):
    """Return the mean squared difference of two pictures, and fill its derivatives `by`, shape (G, 5).

    The second derivatives are those of Gauss and Newton, for each ghost separately.
    """
    by[:] = 0.0
    total = 0.0
    for v in range(rows.shape[0]):
        area = rows[v, AREA]
        draw_row(shown, edges, rows[v, DISTANCE], limits[v, 0], limits[v, 1], start, pixel, row, spans)
        light = 0.0
        sums[0] = 0.0
        for u in range(wanted.shape[1]):
            light += row[u]
            miss = min(light, 1.0) - wanted[v, u]
            total += area * miss * miss
            off[u] = 2.0 * area * miss if light <= 1.0 else 0.0
            sums[u + 1] = sums[u] + off[u]
        for g in range(shown.shape[0]):
            begin, end = spans[g, 0], spans[g, 1]
            if end <= begin:
                continue
            first, last = int(begin), int(end)
            inside = sums[last] - sums[first] + (end - last) * off[last] - (begin - first) * off[first]
            fades, sharp = shown[g, LEVEL] / shown[g, SIZE], shown[g, LEVEL] / pixel
            by[g, BY_RADIUS] -= fades * inside
            by[g, RADIUS_RADIUS] += 2.0 * area * fades * fades * (end - begin)
            bend = 2.0 * area * sharp * sharp
            for side in range(2):
                moves = spans[g, 2 + side]
                if moves == moves:
                    push = -sharp * off[first] if side == 0 else sharp * off[last]
                    by[g, BY_PLACE] += push
                    by[g, BY_RADIUS] += push * moves
                    by[g, PLACE_PLACE] += bend
                    by[g, PLACE_RADIUS] += bend * moves
                    by[g, RADIUS_RADIUS] += bend * moves * moves
    return total


@inner
def show(values, slope, light, round_only, shown):
    """Fill the drawn ghosts of one light; a ghost that the thesis' program hides is dark."""
    for g in range(shown.shape[0]):
        radius = values[g, RADIUS]
        shown[g, AT], shown[g, SIZE] = values[g, PLACE] * slope, max(abs(radius), TINY)
        # a ghost at infinity lies outside the picture
        dark = slope > values[g, REACH_THESIS] or not (abs(shown[g, AT]) < 1e9 and shown[g, SIZE] < 1e9)
        shown[g, LEVEL] = 0.0 if dark else light / shown[g, SIZE]
        shown[g, SHAPE] = ROUND if round_only or values[g, BOUND] != 0.0 else (0 if radius > 0.0 else 1)


class _Drawing(NamedTuple):
    """Working arrays for the comparison of a row of pixels.

    Attributes
    ----------
    shown, spans : ndarray, shape (G, 4)
        The drawn ghosts of one light, and their spans of a row (`draw_row`).
    row : ndarray, shape (U + 2,)
    off : ndarray, shape (U,)
    sums : ndarray, shape (U + 1,)
    """

    shown: Floats
    spans: Floats
    row: Floats
    off: Floats
    sums: Floats


@inner
def picture_cost(values, missed, slopes, picture, drawing, by):
    """Return the cost of a lens: `unit` times the squared differences of its pictures, plus the squares of `missed`."""
    shown, spans, row, off, sums = drawing
    edges = picture.edges
    total = 0.0
    for m in range(missed.size):
        total += missed[m] * missed[m]
    for s in range(slopes.size):
        show(values, slopes[s], picture.light, edges.shape[2] == 0, shown)
        total += picture.unit * compare(
            shown, edges[s], picture.rows, picture.limits[s], picture.start, picture.pixel, picture.wanted[s], row,
            spans, off, sums, by[s],
        )  # fmt: skip
    # NaN means an impossible lens
    return total if total == total else np.inf


@inner
def fill_picture_rows(values, jacobian, slopes, unit, by, free, scale, push, system):
    """Fill half the gradient of the pictures' cost, and rows whose squares give its Hessian; return their number."""
    unknowns, m = free.size, 0
    push[:] = 0.0
    for s in range(slopes.size):
        for g in range(by.shape[1]):
            twice = 0.5 * unit * by[s, g, RADIUS_RADIUS]
            if not twice > 0.0:
                continue
            flip = 1.0 if values[g, RADIUS] >= 0.0 else -1.0
            # Cholesky factor of the ghost's 2 x 2 Hessian
            a = np.sqrt(twice)
            c = 0.5 * unit * by[s, g, PLACE_RADIUS] / a
            d = np.sqrt(max(0.5 * unit * by[s, g, PLACE_PLACE] - c * c, 0.0))
            by_place, by_radius = 0.5 * unit * by[s, g, BY_PLACE], 0.5 * unit * by[s, g, BY_RADIUS]
            for v in range(unknowns):
                place = slopes[s] * jacobian[0, g, free[v]] * scale[v]
                radius = flip * jacobian[1, g, free[v]] * scale[v]
                system[m, v] = a * radius + c * place
                system[m + 1, v] = d * place
                push[v] += by_place * place + by_radius * radius
            system[m, unknowns] = 0.0
            system[m + 1, unknowns] = 0.0
            m += 2
    return m


@compiled
def polish_by_picture(starts, lens, space, slopes, limits, picture, steps, worth, ends, costs):
    """Run one local search from each of several starting points.

    Parameters
    ----------
    starts : ndarray, shape (B, 1 + 3 K), float64
        Search variables, as in `kernels.design.local_search.polish_many`.
    lens : LensStructure
    space : FreeVariables
    slopes : ndarray, shape (L,)
        Slope of each light.
    limits
        As in `polish_many`.
    picture : TargetPicture
    steps : int
        Largest number of evaluations of a search; 0: only compute the cost.
    worth : float
        A start of a higher cost is not searched.
    ends : ndarray, shape (B, 1 + 3 K)
        Filled.
    costs : ndarray, shape (B,)
        Filled.

    Notes
    -----
    Damped Gauss-Newton, with bounds as in `polish_many`. The cost of an edge that is off by more than a pixel grows
    linearly and not quadratically, so the step after a successful one is stretched.
    """
    size, unknowns = starts.shape[1], space.free.size
    count = (size - 1) // 3
    logs = 1 + count
    stop, mirrors, entrance = lens
    low, high, free, reach = space
    most = ghosts_of_structure(stop, count, mirrors)
    room = room_for_derivatives(count)
    jacobian, values = np.empty((3, most, size)), np.empty((most, COLUMNS))
    system = np.empty((2 * most * slopes.size + LIMITS + 2 * count + 4, unknowns + 1))
    normal, factor = np.empty((unknowns + 1, unknowns + 1)), np.empty((unknowns, unknowns))
    step, scale, push, held = np.empty(unknowns), np.empty(unknowns), np.empty(unknowns), np.empty(unknowns, np.bool_)
    missed = np.empty(LIMITS + 2 * count)
    x, trial, q = np.empty(size), np.empty(size), np.empty(size)
    columns = picture.wanted.shape[2]
    drawing = _Drawing(
        np.empty((most, 4)), np.empty((most, 4)), np.empty(columns + 2), np.empty(columns), np.empty(columns + 1)
    )
    by, new_by = np.empty((slopes.size, most, 5)), np.empty((slopes.size, most, 5))
    for b in range(starts.shape[0]):
        clip_start(starts[b], low, high, x)
        to_prescription(x, logs, q)
        list_ghosts(q, count, stop, mirrors, entrance, room.work, values)
        limit_values(q, count, stop, entrance, room.work, limits, room.beam, missed)
        cost = picture_cost(values, missed, slopes, picture, drawing, by)
        left = steps if cost <= worth else 0
        damping, stretch, slow = 1e-3, 1.0, 0
        while left > 0 and slow < MOST_SLOW:
            to_prescription(x, logs, q)
            differentiate_ghosts(q, count, stop, mirrors, entrance, False, room.work, room.trail, room.partial,
                                 room.common, values, jacobian)  # fmt: skip
            fill_scale(q, free, logs, scale)
            filled = fill_picture_rows(values, jacobian, slopes, picture.unit, by, free, scale, push, system)
            filled = fill_limit_rows(q, lens, limits, missed, free, scale, room, system, filled)
            fill_normal_equations(system, filled, unknowns, normal)
            for v in range(unknowns):
                normal[unknowns, v] += push[v]
            hold_at_bounds(normal[unknowns], x, free, low, high, held)
            better = cost
            for _ in range(TRIES):
                left -= 1
                if damped_step(normal, unknowns, damping, held, factor, step):
                    step_within(x, step, stretch, reach, free, low, high, trial)
                    to_prescription(trial, logs, q)
                    list_ghosts(q, count, stop, mirrors, entrance, room.work, values)
                    limit_values(q, count, stop, entrance, room.work, limits, room.beam, missed)
                    better = picture_cost(values, missed, slopes, picture, drawing, new_by)
                    if better < cost:
                        break
                damping = damping if stretch > 1.0 else 4.0 * damping
                stretch = 1.0 if stretch > 1.0 else 0.5 * stretch
            if not better < cost:
                break
            slow = slow + 1 if cost - better < SLOW * cost else 0
            cost = better
            stretch, damping = min(2.0 * stretch, LONGEST), max(0.3 * damping, 1e-6)
            x, trial, by, new_by = trial, x, new_by, by
        for v in range(size):
            ends[b, v] = x[v]
        costs[b] = cost
