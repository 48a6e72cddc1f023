"""Parameters as polynomials over the constellation, of the order with the least leave-one-out error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...typing import Floats
from ..core.robust import MAD_TO_SIGMA
from .settings import WalchSettings


@dataclass(frozen=True)
class PolynomialCurve:
    """A polynomial over the constellation.

    Attributes
    ----------
    coefficients : tuple of float
        Lowest order first, of z = (constellation - middle) / half range.
    deviation : float
        Root mean square leave-one-out error; 0 when unknown, with no more values than coefficients.
    """

    coefficients: tuple[float, ...]
    deviation: float


def fit_polynomial(
    constellation_deg: Floats, values: Floats, error: Floats, span_deg: tuple[float, float],
    settings: WalchSettings = WalchSettings(),
) -> PolynomialCurve:  # fmt: skip
    """Fit a polynomial whose order is chosen by leave-one-out.

    Parameters
    ----------
    constellation_deg, values, error : ndarray, shape (K,)
        `error` is the standard deviation of each value; values with infinite error do not count.
    span_deg : tuple of float
        Range that maps to z from -1 to 1.
    settings : WalchSettings

    Returns
    -------
    PolynomialCurve
        The constant 0 when no value counts.

    Notes
    -----
    The hat matrix gives the exact leave-one-out error of least squares. Of orders with similar errors the lowest is
    used. Values far from the median of their neighbours (4 median deviations) have less weight.
    """
    half = 0.5 * (span_deg[1] - span_deg[0]) or 1.0
    z = (constellation_deg - 0.5 * (span_deg[0] + span_deg[1])) / half
    weight = np.where(np.isfinite(error), 1.0 / np.maximum(error, 1e-12) ** 2, 0.0)
    # errors are estimates: no single value may dominate
    weight = np.minimum(weight, 100.0 * np.median(weight[weight > 0.0])) if weight.any() else weight
    if not weight.any():
        return PolynomialCurve((0.0,), 0.0)
    order = np.argsort(z)
    around = np.lib.stride_tricks.sliding_window_view(np.pad(values[order], 3, mode="reflect"), 7)
    off = np.empty(values.size)
    off[order] = np.abs(values[order] - np.median(around, axis=1))
    usual = MAD_TO_SIGMA * float(np.median(off[weight > 0.0])) + 1e-12
    trust = 1.0 / (1.0 + (off / (4.0 * usual)) ** 4)
    best, coefficients = _best_order(z, values, weight * trust, settings)
    witnesses = np.count_nonzero((weight > 0.0) & (trust > settings.least_trust))
    # a curve through all counted values has no residual, so its error is unknown
    return PolynomialCurve(tuple(map(float, coefficients)), best if witnesses > len(coefficients) else 0.0)


def _best_order(z: Floats, values: Floats, weight: Floats, settings: WalchSettings) -> tuple[float, Floats]:
    """Return the leave-one-out error and the coefficients of the best order."""
    root, known = np.sqrt(weight), int(np.count_nonzero(weight))
    tried: list[tuple[float, Floats]] = []
    for order in range(min(settings.most_order, max(known - 2, 0)) + 1):
        basis = np.vander(z, order + 1, increasing=True)
        q, r = np.linalg.qr(root[:, None] * basis)
        if np.min(np.abs(np.diag(r))) < 1e-9 * np.max(np.abs(np.diag(r))):
            break
        coefficients = np.linalg.solve(r, q.T @ (root * values))
        leverage = np.minimum((q**2).sum(axis=1), 1.0 - 1e-6)
        left_out = (values - basis @ coefficients) / (1.0 - leverage)
        error = float(np.sqrt((weight * left_out**2).sum() / weight.sum()))
        tried.append((error, coefficients))
    # orders whose errors differ by less than the error's uncertainty count as equal
    enough = min(error for error, _ in tried) * (1.0 + 1.0 / np.sqrt(2.0 * known))
    return next(each for each in tried if each[0] <= enough)
