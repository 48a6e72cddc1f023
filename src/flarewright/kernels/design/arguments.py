"""Named tuples that the searches for a prescription take."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...typing import Floats, Indices, Mask
from ..jit.decorators import inner
from .ghosts import COLUMNS, TRAIL, WORK_ROWS


class LensStructure(NamedTuple):
    """What a local search does not change.

    Attributes
    ----------
    stop : int
        Row of the stop.
    mirrors : ndarray, shape (K,), bool
        Which rows reflect.
    entrance : float
        Diameter of the entrance at the first vertex, mm.
    """

    stop: int
    mirrors: Mask
    entrance: float


class FreeVariables(NamedTuple):
    """The variables of a local search.

    Attributes
    ----------
    low, high : ndarray, shape (1 + 3 K,)
        Bounds of the search variables, never exceeded.
    free : ndarray, shape (F,), int64
        Indices of the variables that may change.
    reach : ndarray, shape (F,)
        Largest change of each free variable in one step.
    """

    low: Floats
    high: Floats
    free: Indices
    reach: Floats


class GhostAims(NamedTuple):
    """Target ghosts.

    Attributes
    ----------
    slopes : ndarray, shape (L,)
        Slope of each light.
    spans : ndarray, shape (L + 1,), int64
        First target of each light, and the end of the last.
    targets, weights : ndarray, shape (N, 3)
        Place, radius and log irradiance; a weight of 0 ignores the value.
    signed : bool
        Whether the radii of targets have a sign.
    extra : float
        Cost of an extra ghost times its radius.
    """

    slopes: Floats
    spans: Indices
    targets: Floats
    weights: Floats
    signed: bool
    extra: float


class Effort(NamedTuple):
    """How long a local search lasts.

    Attributes
    ----------
    steps : int
        Largest number of steps.
    patience : int
        Steps before ghosts are first rematched; the intervals grow.
    enough : float
        Cost at which a search ends.
    """

    steps: int
    patience: int
    enough: float


class TargetPicture(NamedTuple):
    """The pictures of all lights on rows of pixels along their lines, and how ghosts are drawn there.

    Attributes
    ----------
    light : float
        Level of a ghost times its radius, mm.
    unit : float
        Cost of a mean squared difference of 1.
    edges : ndarray, shape (L, 2, E, 2)
        For each light the upright and the inverted polygon of radius 1: for every edge the apothem over the cosine, and
        the tangent, of the angle between its normal and the line. E = 0: ghosts are round.
    rows : ndarray, shape (V, 2)
        Distance of each row of pixels from the line (mm), and a pixel's part of the picture's area.
    limits : ndarray, shape (L, V, 2)
        Begin and end of each row in the picture, in pixels from `start`.
    start, pixel : float
        Start of the rows and length of a pixel, mm.
    wanted : ndarray, shape (L, V, U)
        The target pictures; U is two pixels more than any row reaches.
    """

    light: float
    unit: float
    edges: Floats
    rows: Floats
    limits: Floats
    start: float
    pixel: float
    wanted: Floats


class GeneCode(NamedTuple):
    """How genes are decoded, see `kernels.design.fitness.decode`.

    Attributes
    ----------
    stops : ndarray, shape (S,), int64
        Rows where the stop may be.
    pattern : ndarray, shape (K,), int64
        1: glass, 0: air, -1: the genes choose.
    places : ndarray, shape (D,), int64
        Meaning of each gene: 0 the stop, 1 + v search variable v.
    low, high : ndarray, shape (2, 1 + 3 K)
        Bounds of the search variables where a row's gap is air, and where it is glass.
    """

    stops: Indices
    pattern: Indices
    places: Indices
    low: Floats
    high: Floats


class GhostValues(NamedTuple):
    """The ghosts of one prescription, filled by `kernels.design.ghosts`, with derivatives by the prescription.

    Attributes
    ----------
    values : ndarray, shape (G, COLUMNS)
    jacobian : ndarray, shape (3, G, 1 + 3 K)
        Derivatives of PLACE, RADIUS and SCALE.
    light : ndarray, shape (G,)
        Log irradiance.
    light_by : ndarray, shape (G, 1 + 3 K)
        Its derivatives.
    """

    values: Floats
    jacobian: Floats
    light: Floats
    light_by: Floats


class Matching(NamedTuple):
    """Which ghost each target has, and the working arrays of the assignment.

    Attributes
    ----------
    chosen : ndarray, shape (N,), int64
        The ghost of each target; -1 for none yet.
    taken : ndarray, shape (G,), bool
        Whether a ghost of the present light has a target.
    cost : ndarray, shape (N, G)
        Cost of each ghost for each target of one light.
    prices : ndarray, shape (L, G)
        Of the last assignment; the next begins with them.
    small, parts, flags : ndarray
        Working arrays.
    """

    chosen: Indices
    taken: Mask
    cost: Floats
    prices: Floats
    small: Indices
    parts: Floats
    flags: Mask


class DerivativeRoom(NamedTuple):
    """Working arrays for derivatives by a prescription.

    Attributes
    ----------
    work : ndarray, shape (WORK_ROWS, K)
        Reduced rows of the prescription (`kernels.design.ghosts.reduce_rows`).
    trail : ndarray, shape (TRAIL * K,)
    partial : ndarray, shape (4, K)
        All 0 between uses.
    common : ndarray, shape (6, 1 + 3 K)
    beam : ndarray, shape (K + 2,)
        From `kernels.design.edge_thickness.fill_beam`.
    row : ndarray, shape (1 + 3 K,)
    """

    work: Floats
    trail: Floats
    partial: Floats
    common: Floats
    beam: Floats
    row: Floats


@inner
def room_for_derivatives(rows):
    """Return the working arrays for a prescription of some rows."""
    size = 1 + 3 * rows
    return DerivativeRoom(
        np.empty((WORK_ROWS, rows)), np.empty(TRAIL * rows), np.zeros((4, rows)), np.empty((6, size)),
        np.empty(rows + 2), np.empty(size),
    )  # fmt: skip


@inner
def room_for_ghosts(most, size):
    """Return arrays for the ghosts of a prescription of `size` numbers."""
    return GhostValues(
        np.empty((most, COLUMNS)), np.empty((3, most, size)), np.zeros(most), np.zeros((most, size))
    )  # fmt: skip


@inner
def room_to_match(count, most, lights, tabulated):
    """Return the arrays of a matching of `count` targets; `tabulated`: whether ghosts will be assigned."""
    shape = (count, most) if tabulated else (1, 1)
    return Matching(
        np.empty(count, np.int64), np.empty(most, np.bool_), np.empty(shape), np.empty((lights, most)),
        np.empty((3, max(most, count)), np.int64), np.empty((4, most)), np.empty(most, np.bool_),
    )  # fmt: skip


@inner
def unmatch(matching):
    """Forget a matching and its prices, so that a search does not depend on the one before."""
    for t in range(matching.chosen.size):
        matching.chosen[t] = -1
    matching.prices[:] = 0.0
