"""Occurrence estimators: statistics of a picture's flare (Walch 2017, section 9.1)."""

from __future__ import annotations

from dataclasses import astuple, dataclass, fields
from functools import lru_cache

import numpy as np

from ..typing import Floats
from .flare import Frame

FLOOR = 1e-9
"""Added before the logarithm so that black pixels do not give minus infinity. It is 30 stops below the light's
irradiance, the least value that a sensor could distinguish from black."""


@dataclass(frozen=True)
class Statistics:
    """Statistics of the flare within a frame, relative to the light's irradiance on a plane facing it.

    Attributes
    ----------
    sum_mm2 : float
        Flux: irradiance times area, summed over the frame.
    mean : float
        Mean irradiance.
    maximum, minimum : float
        Extremes of the pixels.
    log_average : float
        exp(mean(log(E + FLOOR))), the key of a picture (Reinhard et al. 2002, equation 1), a typical value.
    """

    sum_mm2: float
    mean: float
    maximum: float
    minimum: float
    log_average: float

    @property
    def values(self) -> Floats:
        """All statistics in order, shape (5,)."""
        return np.array(astuple(self))


NAMES = tuple(field.name for field in fields(Statistics))


@lru_cache(maxsize=512)
def covered_area(size_px: tuple[int, int], sensor: Frame, frame: Frame, turn_deg: float) -> Floats:
    """Compute the part of each pixel of a picture inside a frame that is rotated clockwise against it.

    Parameters
    ----------
    size_px : tuple of int
        Width and height of the picture.
    sensor : Frame
        Area that the picture covers.
    frame : Frame
    turn_deg : float
        Clockwise rotation of the frame. A picture at roll 0 in a frame rotated by the roll equals the picture at that
        roll in the upright frame.

    Returns
    -------
    ndarray, shape (H, W)
        From 0 to 1.
    """
    width, height = size_px
    x = ((np.arange(width) + 0.5) / width - 0.5) * sensor.width
    y = (0.5 - (np.arange(height) + 0.5) / height) * sensor.height
    turn = np.radians(turn_deg)
    across = np.abs(np.cos(turn) * x - np.sin(turn) * y[:, None])
    upward = np.abs(np.sin(turn) * x + np.cos(turn) * y[:, None])
    pitch = np.sqrt(sensor.area / (width * height))
    inside = [np.clip(0.5 + (0.5 * side - at) / pitch, 0.0, 1.0) for side, at in
              ((frame.width, across), (frame.height, upward))]  # fmt: skip
    share = np.asarray(inside[0] * inside[1])
    share.flags.writeable = False
    return share


def measure(light: Floats, share: Floats, area: float) -> Statistics:
    """Compute the statistics of the flare in a frame.

    Parameters
    ----------
    light : ndarray, shape (H, W)
        Luminance of the picture.
    share : ndarray, shape (H, W)
        From `covered_area`.
    area : float
        Area of the frame, mm^2.
    """
    whole = float(share.sum())
    within = light[share >= 0.5]
    mean = float((light * share).sum()) / whole
    return Statistics(
        sum_mm2=mean * area,
        mean=mean,
        maximum=float(within.max()),
        minimum=float(within.min()),
        log_average=float(np.exp((np.log(light + FLOOR) * share).sum() / whole)),
    )
