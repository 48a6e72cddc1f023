"""Change of a ghost over the constellation beyond its polynomials: brightness, shift and size."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ...kernels.ghost_model.pupil_mesh import BELOW, FIRST_DISC, FIRST_G, FIRST_I
from ...model.measurement.ghost_model import Curve, Curves
from ...typing import Floats
from .checkpoint import recorded
from .parameter_vector import denominator


@recorded
@dataclass(frozen=True)
class Pose:
    """Deviation of a ghost at one constellation from the prediction of its polynomials.

    Attributes
    ----------
    brightness : float
        Factor on its light.
    along_px : float
        Shift towards the light, pixels.
    size : float
        Factor on its size.
    """

    brightness: float = 1.0
    along_px: float = 0.0
    size: float = 1.0


def posed(numbers: Floats, sigma: float, pose: Pose) -> Floats:
    """Return the parameters of a ghost at one constellation.

    Parameters
    ----------
    numbers : ndarray, shape (53,)
    sigma : float
        Magnitude of the normalized field; 0 (light on the axis) allows no shift.
    pose : Pose

    Returns
    -------
    ndarray, shape (53,)
    """
    out = numbers.copy()
    out[0] += pose.along_px * by_shift(numbers, sigma)
    out[FIRST_G:FIRST_I] *= pose.size
    out[FIRST_I:FIRST_DISC] *= pose.brightness
    return out


def by_shift(numbers: Floats, sigma: float) -> float:
    """Return the change of f that shifts the centre of a ghost by one pixel; 0 with the light on the axis."""
    if not sigma > 0.0:
        return 0.0
    b, c = numbers[BELOW:]
    return float(denominator(b, c, np.array(0.0), np.array(sigma**2))) / sigma


def pose_at(curves: Curves, constellation_deg: float, visible_deg: tuple[float, float]) -> Pose:
    """Return the pose of a ghost at a constellation; beyond `visible_deg` the curves keep their end values."""
    return Pose(
        1.0 if curves.brightness is None else max(value_at(curves.brightness, constellation_deg, visible_deg), 0.0),
        0.0 if curves.along_px is None else value_at(curves.along_px, constellation_deg, visible_deg),
        1.0 if curves.size is None else max(value_at(curves.size, constellation_deg, visible_deg), 0.05),
    )


def value_at(curve: Curve, constellation_deg: float, visible_deg: tuple[float, float]) -> float:
    """Return the value of a curve at a constellation."""
    weights = spline_basis(np.array([constellation_deg]), visible_deg, len(curve.values))[0]
    return float(weights @ np.array(curve.values))


def spline_basis(constellation_deg: Floats, visible_deg: tuple[float, float], knots: int) -> Floats:
    """Return the weight of each knot of a natural cubic spline at some constellations.

    Parameters
    ----------
    constellation_deg : ndarray, shape (K,)
    visible_deg : tuple of float
        Positions of the first and the last knot.
    knots : int
        Number of evenly spaced knots; 1: a constant, 2: a straight line.

    Returns
    -------
    ndarray, shape (K, knots)

    Notes
    -----
    Natural cubic splines: the second derivative is 0 at both ends (de Boor, A Practical Guide to Splines, chapter IV).
    """
    low, high = visible_deg
    z = np.clip((constellation_deg - low) / max(high - low, 1e-12), 0.0, 1.0)
    if knots == 1:
        return np.ones((z.size, 1))
    if knots == 2:
        return np.stack([1.0 - z, z], axis=1)
    h = 1.0 / (knots - 1)
    left = np.minimum((z / h).astype(np.int64), knots - 2)
    b = z / h - left
    a = 1.0 - b
    unit, bent = np.eye(knots), _second_derivatives(knots)
    straight = a[:, None] * unit[left] + b[:, None] * unit[left + 1]
    bend = (a**3 - a)[:, None] * bent[left] + (b**3 - b)[:, None] * bent[left + 1]
    return np.asarray(straight + bend * (h * h / 6.0), dtype=np.float64)


@lru_cache(maxsize=64)
def _second_derivatives(knots: int) -> Floats:
    """Return the matrix from values to second derivatives at the knots, which are 0 at both ends; square."""
    inner = np.arange(1, knots - 1)
    system, side = np.eye(knots), np.zeros((knots, knots))
    for k in inner:
        system[k, k - 1 : k + 2] = 1.0, 4.0, 1.0
        side[k, k - 1 : k + 2] = np.array([1.0, -2.0, 1.0]) * (6.0 * (knots - 1) ** 2)
    return np.asarray(np.linalg.solve(system, side), dtype=np.float64)
