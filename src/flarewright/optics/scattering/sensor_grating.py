"""The sensor as a reflection grating: efficiency of each order, and its landing point."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...model.lens.grating import SensorGrating
from ...typing import Floats, Indices
from ..rays.pack import PackedLens

FAINTEST = 1e-4
"""Orders below this fraction of the strongest are omitted."""


@dataclass(frozen=True)
class GratingOrder:
    """One diffraction order of the sensor that returns by reflection at a surface.

    Attributes
    ----------
    order : tuple of int
        Across and down.
    efficiency : float
        Fraction of the sensor's reflected light.
    shift_mm : ndarray, shape (W, 2)
        Its displacement on the sensor from the mirrored light, per traced wavelength; NaN for evanescent orders and
        for orders outside the surface's rim.
    """

    order: tuple[int, int]
    efficiency: float
    shift_mm: Floats


def order_efficiency(order: Indices | int, fill: float) -> Floats:
    """Return the fraction of the reflected light in an order of a periodic row of bright cells.

    Parameters
    ----------
    order : int or ndarray of int
    fill : float
        Width of a cell over the period.

    Returns
    -------
    ndarray
        The sum over all orders is 1; for a square grating, multiply the values of both directions.

    Notes
    -----
    The squared Fourier coefficients of a row of rectangles, fill sinc(m fill), over the mean reflectance, fill
    (Goodman, Introduction to Fourier Optics, section 4.4; scalar, thin, without polarisation).
    """
    return np.asarray(fill * np.sinc(np.asarray(order) * fill) ** 2, dtype=np.float64)


def return_trip(packed: PackedLens, row: int, w: int) -> tuple[float, float]:
    """Return the paraxial trip of light from the sensor to a mirror row and back.

    Parameters
    ----------
    packed : PackedLens
        Without the sensor, or with the sensor as its last row.
    row : int
        The mirror.
    w : int
        Index of a packed wavelength.

    Returns
    -------
    shift : float
        B from the sensor to the row and back, mm: displacement per slope.
    height : float
        B from the sensor to the row, mm: height at the row per slope.

    Notes
    -----
    Ray transfer matrices of docs/physics.md; all legs have positive length. The matrices back from the mirror are the
    same ones in reverse order.
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
    # light runs backward when it meets the mirror
    total = np.array([[1.0, 0.0], [-2.0 * packed.curvature[row], 1.0]]) @ there
    for k in lens_rows[1:]:
        total = across(k, True) @ gap(packed.z_vertex[k] - here) @ total
        here = float(packed.z_vertex[k])
    total = gap(packed.sensor_z - here) @ total
    return float(total[0, 1]), float(there[0, 1])


def grating_orders(packed: PackedLens, row: int, grating: SensorGrating) -> tuple[GratingOrder, ...]:
    """Return the sensor's diffraction orders that return by way of a surface.

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
    The grating equation adds (m, n) lambda / period to the direction cosines across and down. The centre of a light
    cone along the axis then leaves at the angle of that sine and lands B tan(angle) away. The whole cone is assumed to
    move with its centre, so each order looks like the mirrored ghost; this is exact for plane surfaces in air.
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
