"""The periodic structure of a sensor."""

from __future__ import annotations

from pydantic import Field

from .base import Frozen


class SensorGrating(Frozen):
    """A sensor that reflects as a square grating: bright fields in even rows and columns, dark between.

    Attributes
    ----------
    period_um : float
        From one field to the next, micrometres: the pixel pitch, or twice that where colour filters tell.
    fill : float
        Width of a bright field over the period; 1 is an even mirror.
    orders : int
        Orders from -orders to +orders are drawn in each direction.
    """

    period_um: float = Field(gt=0.2, le=1000.0)
    fill: float = Field(0.7, gt=0.0, le=1.0)
    orders: int = Field(3, ge=1, le=12)
