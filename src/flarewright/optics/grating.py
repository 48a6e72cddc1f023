"""The sensor as a reflection grating: how much goes into each order, and where it lands."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..model.grating import SensorGrating
from .pack import PackedLens

Floats = NDArray[np.float64]

__all__ = ["GratingOrder", "grating_orders", "order_efficiency", "return_trip"]

FAINTEST = 1e-4
"""Orders below this part of the strongest are left out."""


@dataclass(frozen=True)
class GratingOrder:
    """One diffraction order of the sensor on its way by a surface and back.

    Attributes
    ----------
    order : tuple of int
        Across and down.
    efficiency : float
        Part of the sensor's reflected light.
    shift_mm : ndarray, shape (W, 2)
        Where it lands on the sensor, from where the mirrored light does, per traced wavelength; NaN where there is no
        such order, or the surface's rim lies before it.
    """

    order: tuple[int, int]
    efficiency: float
    shift_mm: Floats


def order_efficiency(order: NDArray[np.int64] | int, fill: float) -> Floats:
    """Part of the reflected light that goes into an order of a row of even fields.

    Parameters
    ----------
    order : int or ndarray of int
    fill : float
        Width of a field over the period.

    Returns
    -------
    ndarray
        Their sum over all orders is 1; of a square grating an order has the product of two.

    Notes
    -----
    The Fourier coefficients of a row of rectangles, fill sinc(m fill), squared, over the mean reflectance, fill
    (Goodman, Introduction to Fourier Optics, section 4.4; scalar, thin, without polarisation).
    """
    return np.asarray(fill * np.sinc(np.asarray(order) * fill) ** 2, dtype=np.float64)


def return_trip(packed: PackedLens, row: int, w: int) -> tuple[float, float]:
    """Tell how far light that leaves the sensor with a slope of 1 lands from its start, by way of a mirror row.

    Parameters
    ----------
    packed : PackedLens
        The sensor is no row of it, or the last.
    row : int
        Where it is reflected.
    w : int
        Which of the packed wavelengths.

    Returns
    -------
    shift : float
        B of the way from the sensor to the row and back, mm.
    height : float
        B of the way there: at which height it meets the row, mm.

    Notes
    -----
    Ray transfer matrices of docs/physics.md; all legs of positive length. Back from a mirror the matrices are the same
    in reverse order.
    """
    count = packed.n_gap.shape[1] - 1
    lens_rows = [k for k in range(row, count) if packed.z_vertex[k] < packed.sensor_z]
    n = packed.n_gap[w]

    def across(k: int, forward: bool) -> Floats:
        n1, n2 = (n[k], n[k + 1]) if forward else (n[k + 1], n[k])
        power = packed.curvature[k] * (1.0 if forward else -1.0)
        return np.array([[1.0, 0.0], [(n1 - n2) / n2 * power, n1 / n2]])

    def gap(length: float) -> Floats:
        return np.array([[1.0, length], [0.0, 1.0]])

    there, here = np.eye(2), packed.sensor_z
    for k in reversed(lens_rows):
        there = gap(here - packed.z_vertex[k]) @ there
        here = float(packed.z_vertex[k])
        if k != row:
            there = across(k, False) @ there
    # the light runs backward when it meets the mirror
    total = np.array([[1.0, 0.0], [-2.0 * packed.curvature[row], 1.0]]) @ there
    for k in lens_rows[1:]:
        total = across(k, True) @ gap(packed.z_vertex[k] - here) @ total
        here = float(packed.z_vertex[k])
    total = gap(packed.sensor_z - here) @ total
    return float(total[0, 1]), float(there[0, 1])


def grating_orders(packed: PackedLens, row: int, grating: SensorGrating) -> tuple[GratingOrder, ...]:
    """List the orders that a sensor sends by way of a surface.

    Parameters
    ----------
    packed : PackedLens
    row : int
        The surface that reflects the light back.
    grating : SensorGrating

    Returns
    -------
    tuple of GratingOrder
        The mirrored light, order (0, 0), first.

    Notes
    -----
    The grating equation adds (m, n) lambda / period to the direction cosines across and down. The middle of a cone of
    light along the axis then leaves at the angle whose sine that is, and lands B tan(angle) beside; the cone is taken
    to follow its middle, so each order looks like the mirrored ghost. That is exact for plane surfaces in air.
    """
    most = grating.orders
    every = [(m, n) for m in range(-most, most + 1) for n in range(-most, most + 1)]
    every.sort(key=lambda order: (order[0] ** 2 + order[1] ** 2, order))
    trips = np.array([return_trip(packed, row, w) for w in range(len(packed.wavelengths_nm))])
    strongest = float(order_efficiency(0, grating.fill)) ** 2
    found = []
    for order in every:
        efficiency = float(np.prod(order_efficiency(np.array(order), grating.fill)))
        if efficiency < FAINTEST * strongest:
            continue
        sine = np.array(order) * (1e-3 * packed.wavelengths_nm[:, None] / grating.period_um)
        squared = (sine**2).sum(axis=1)
        slope = sine / np.sqrt(np.where(squared < 1.0, 1.0 - squared, np.nan))[:, None]
        shift = trips[:, :1] * slope
        shift[np.hypot(*(trips[:, 1:] * slope).T) > packed.semi[row]] = np.nan
        found.append(GratingOrder(order, efficiency, shift))
    return tuple(found)
