"""Curves over the constellation from what single frames say: how many knots, cross-validation decides."""

from __future__ import annotations

import numpy as np

from ..model.ghost_model import Curve
from .curves import spline_basis
from .numbers import Floats

# knots that are tried: a constant, a line, natural splines
KNOTS = (1, 2, 3, 4, 5, 6, 8, 10, 12)
# values farther than this many of the usual deviations from their neighbours' median count less and less
_FAR = 4.0


def smooth_curve(
    constellation_deg: Floats,
    values: Floats,
    error: Floats,
    visible_deg: tuple[float, float],
    *,
    usual: float,
    spread: float,
    least: float = 0.0,
) -> Curve | None:
    """Fit a natural spline whose number of knots is chosen by leaving values out in turn.

    Parameters
    ----------
    constellation_deg, values, error : ndarray, shape (K,)
    visible_deg : tuple of float
        Where the knots are spread.
    usual : float
        The value that needs no curve.
    spread : float
        How far from `usual` a knot may weakly be expected, which holds those that no value is near.
    least : float
        A curve that leaves `usual` by less (root mean square) is none.

    Returns
    -------
    Curve or None
        None when `usual` foretells left-out values no worse.

    Notes
    -----
    Leave-one-out by the hat matrix, which is exact for least squares. Of numbers of knots that foretell alike, within
    the standard error of the difference, the smallest is taken.
    """
    if values.size < 3:
        return None
    weight = _weights(constellation_deg, values, error)
    tried: list[tuple[Floats, Floats | None, Floats | None]] = [(weight * (values - usual) ** 2, None, None)]
    for knots in KNOTS:
        if knots > values.size - 2:
            break
        basis = spline_basis(constellation_deg, visible_deg, knots)
        matrix = (basis.T * weight) @ basis + np.eye(knots) / spread**2
        inverse = np.linalg.inv(matrix)
        found = inverse @ ((basis.T * weight) @ (values - usual))
        leverage = np.minimum(weight * np.einsum("ij,jk,ik->i", basis, inverse, basis), 1.0 - 1e-6)
        left_out = (values - usual - basis @ found) / (1.0 - leverage)
        excess = max(1.0, float((weight * (values - usual - basis @ found) ** 2).sum()) / max(values.size - knots, 1))
        tried.append((weight * left_out**2, found, np.sqrt(np.diag(inverse) * excess)))
    best = min(tried, key=lambda one: float(one[0].sum()))[0]
    _, chosen, deviation = next(one for one in tried if alike(one[0], best))
    if chosen is None or deviation is None or float(np.sqrt(np.mean(chosen**2))) < least:
        return None
    return Curve(values=tuple(map(float, chosen + usual)), error=tuple(map(float, deviation)))


def alike(costs: Floats, best: Floats) -> bool:
    """Tell whether costs exceed the best ones by no more than the standard error of the difference."""
    off = costs - best
    return bool(off.sum() <= np.sqrt(off.size) * off.std())


def _weights(constellation_deg: Floats, values: Floats, error: Floats) -> Floats:
    """Return inverse variances; none rules all others, and what stands far out counts less and less."""
    weight = 1.0 / np.maximum(error, 1e-9) ** 2
    weight = np.minimum(weight, 25.0 * np.median(weight))
    order = np.argsort(constellation_deg)
    around = np.lib.stride_tricks.sliding_window_view(np.pad(values[order], 2, mode="reflect"), 5)
    off = np.empty(values.size)
    off[order] = np.abs(values[order] - np.median(around, axis=1))
    scale = np.maximum(1.4826 * float(np.median(off)), error)
    return np.asarray(weight / (1.0 + (off / (_FAR * scale)) ** 4))
