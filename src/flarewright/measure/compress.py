"""Numbers over the constellation as polynomials of the order that foretells best."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .numbers import Floats

MOST = 6
# values that count a smaller part than this because they lie off their neighbours witness nothing
_WITNESS = 0.01


@dataclass(frozen=True)
class Curve:
    """A number over the constellation.

    Attributes
    ----------
    coefficients : tuple of float
        Lowest order first, of z = (constellation - middle) / half range.
    deviation : float
        Root mean square error of foretelling values left out; 0: not known, for no more values than coefficients
        count.
    """

    coefficients: tuple[float, ...]
    deviation: float


def compress(constellation_deg: Floats, values: Floats, error: Floats, span_deg: tuple[float, float]) -> Curve:
    """Fit a polynomial whose order is chosen by leaving values out in turn.

    Parameters
    ----------
    constellation_deg, values, error : ndarray, shape (K,)
        `error` is each value's standard deviation; the infinite ones do not count.
    span_deg : tuple of float
        Range for which z runs from -1 to 1.

    Returns
    -------
    Curve
        Constant 0 when no value counts.

    Notes
    -----
    Leave-one-out by the hat matrix, exact for least squares; of orders that foretell alike the lowest is taken. Values
    far off the median of their neighbours (4 median deviations) count less.
    """
    half = 0.5 * (span_deg[1] - span_deg[0]) or 1.0
    z = (constellation_deg - 0.5 * (span_deg[0] + span_deg[1])) / half
    weight = np.where(np.isfinite(error), 1.0 / np.maximum(error, 1e-12) ** 2, 0.0)
    # errors are estimates: none may rule all others
    weight = np.minimum(weight, 100.0 * np.median(weight[weight > 0.0])) if weight.any() else weight
    if not weight.any():
        return Curve((0.0,), 0.0)
    order = np.argsort(z)
    around = np.lib.stride_tricks.sliding_window_view(np.pad(values[order], 3, mode="reflect"), 7)
    off = np.empty(values.size)
    off[order] = np.abs(values[order] - np.median(around, axis=1))
    usual = 1.4826 * float(np.median(off[weight > 0.0])) + 1e-12
    trust = 1.0 / (1.0 + (off / (4.0 * usual)) ** 4)
    best, coefficients = _best_order(z, values, weight * trust)
    witnesses = np.count_nonzero((weight > 0.0) & (trust > _WITNESS))
    # a curve that goes through all that counts leaves nothing by which to judge it
    return Curve(tuple(map(float, coefficients)), best if witnesses > len(coefficients) else 0.0)


def _best_order(z: Floats, values: Floats, weight: Floats) -> tuple[float, Floats]:
    """Return the error of foretelling and the coefficients of the order that foretells best."""
    root, known = np.sqrt(weight), int(np.count_nonzero(weight))
    tried: list[tuple[float, Floats]] = []
    for order in range(min(MOST, max(known - 2, 0)) + 1):
        basis = np.vander(z, order + 1, increasing=True)
        q, r = np.linalg.qr(root[:, None] * basis)
        if np.min(np.abs(np.diag(r))) < 1e-9 * np.max(np.abs(np.diag(r))):
            break
        coefficients = np.linalg.solve(r, q.T @ (root * values))
        leverage = np.minimum((q**2).sum(axis=1), 1.0 - 1e-6)
        left_out = (values - basis @ coefficients) / (1.0 - leverage)
        error = float(np.sqrt((weight * left_out**2).sum() / weight.sum()))
        tried.append((error, coefficients))
    # orders within the error of the error foretell alike
    enough = min(error for error, _ in tried) * (1.0 + 1.0 / np.sqrt(2.0 * known))
    return next(each for each in tried if each[0] <= enough)
