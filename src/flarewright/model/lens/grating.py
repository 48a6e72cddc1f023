"""The periodic structure of a sensor."""

from __future__ import annotations

from pydantic import Field

from ..base import Frozen


class SensorGrating(Frozen):
    """A sensor that reflects as a square grating: bright cells in even rows and columns, dark between.

    Attributes
    ----------
    period_um : float
        Distance between bright cells, micrometres: the pixel pitch, or twice that where colour filters matter.
    fill : float
        Width of a bright cell over the period; 1 is a uniform mirror.
    orders : int
        Diffraction orders from -orders to +orders are drawn in each direction.
    """

    period_um: float = Field(gt=0.2, le=1000.0)
    fill: float = Field(0.7, gt=0.0, le=1.0)
    orders: int = Field(3, ge=1, le=12)
