"""A plane glass plate outside the prescription: a filter in front, or the cover glass on the sensor."""

from __future__ import annotations

from pydantic import Field, model_validator

from ..base import Frozen
from .coating import Coating


class Plate(Frozen):
    """A plane plate.

    Attributes
    ----------
    thickness : float
        mm.
    gap : float or None
        Air between the plate and the first vertex (a filter), or between the plate and the sensor (a cover glass), mm;
        None: 5 mm in front of the lens, 0.5 mm in front of the sensor.
    glass : str or None
        Catalogue name; None and no index: N-BK7.
    n_d, v_d : float or None
        Index and Abbe number instead of, or beside, the name.
    coating : Coating or None
        On both faces; None: bare.
    """

    thickness: float = Field(gt=0.0, le=100.0)
    gap: float | None = Field(None, ge=0.0, le=1000.0)
    glass: str | None = Field(None, min_length=1)
    n_d: float | None = Field(None, gt=1.0, lt=4.5)
    v_d: float | None = Field(None, gt=5.0, lt=150.0)
    coating: Coating | None = None

    @model_validator(mode="after")
    def _glass_is_known(self) -> Plate:
        if self.v_d is not None and self.n_d is None and self.glass is None:
            raise ValueError("v_d alone is no glass; give glass or n_d")
        return self
