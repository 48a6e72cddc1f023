"""Fit curves over the constellation to values of single frames; cross-validation selects the number of knots."""

from __future__ import annotations

import numpy as np

from ...model.measurement.ghost_model import Curve
from ...typing import Floats
from ..core.pose_curves import spline_basis
from ..core.robust import MAD_TO_SIGMA
from .settings import CurveSettings


def smooth_curve(
    constellation_deg: Floats, values: Floats, error: Floats, visible_deg: tuple[float, float], *, usual: float,
    spread: float, least: float = 0.0, settings: CurveSettings = CurveSettings(),
) -> Curve | None:  # fmt: skip
    """Fit a natural spline; leave-one-out cross-validation selects its number of knots.

    Parameters
    ----------
    constellation_deg, values, error : ndarray, shape (K,)
    visible_deg : tuple of float
        Range of the knots.
    usual : float
        Constant value that needs no curve.
    spread : float
        Prior standard deviation of a knot about `usual`; it determines knots without nearby values.
    least : float
        Minimum root-mean-square deviation of a curve from `usual`.
    settings : CurveSettings

    Returns
    -------
    Curve or None
        None when the constant `usual` predicts left-out values no worse.

    Notes
    -----
    Leave-one-out residuals follow from the hat matrix, exactly for least squares. Of the numbers of knots that predict
    equally well, within the standard error of the difference, the smallest is used.
    """
    if values.size < 3:
        return None
    weight = _weights(constellation_deg, values, error, settings)
    tried: list[tuple[Floats, Floats | None, Floats | None]] = [(weight * (values - usual) ** 2, None, None)]
    for knots in settings.knots:
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
    _, chosen, deviation = next(one for one in tried if within_standard_error(one[0], best))
    if chosen is None or deviation is None or float(np.sqrt(np.mean(chosen**2))) < least:
        return None
    return Curve(values=tuple(map(float, chosen + usual)), error=tuple(map(float, deviation)))


def within_standard_error(costs: Floats, best: Floats) -> bool:
    """Return whether costs exceed the best ones by no more than the standard error of the difference."""
    off = costs - best
    return bool(off.sum() <= np.sqrt(off.size) * off.std())


def _weights(constellation_deg: Floats, values: Floats, error: Floats, settings: CurveSettings) -> Floats:
    """Return inverse variances, at most `settings.most_weight` times their median, with reduced weight for outliers."""
    weight = 1.0 / np.maximum(error, 1e-9) ** 2
    weight = np.minimum(weight, settings.most_weight * np.median(weight))
    order = np.argsort(constellation_deg)
    around = np.lib.stride_tricks.sliding_window_view(np.pad(values[order], 2, mode="reflect"), 5)
    off = np.empty(values.size)
    off[order] = np.abs(values[order] - np.median(around, axis=1))
    scale = np.maximum(MAD_TO_SIGMA * float(np.median(off)), error)
    return np.asarray(weight / (1.0 + (off / (settings.outlier * scale)) ** 4))
