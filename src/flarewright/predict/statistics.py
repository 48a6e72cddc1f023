"""Occurrence estimators: numbers that say how much flare a picture holds (Walch 2017, section 9.1)."""

from __future__ import annotations

from dataclasses import astuple, dataclass, fields
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from .flare import Frame

Floats = NDArray[np.float64]

FLOOR = 1e-9
"""Added before the logarithm is averaged, so that a black pixel does not make it minus infinity: what a sensor that
holds 30 stops below the light's own irradiance could still tell from black."""

__all__ = ["FLOOR", "Statistics", "coverage", "measure"]


@dataclass(frozen=True)
class Statistics:
    """Of the flare within a frame, relative to the light's irradiance on a plane facing it.

    Attributes
    ----------
    sum_mm2 : float
        Flux: irradiance times area, added over the frame.
    mean : float
        Irradiance.
    maximum, minimum : float
        Of the pixels.
    log_average : float
        exp(mean(log(E + FLOOR))), the key of a picture (Reinhard et al. 2002, equation 1): what is typical of it.
    """

    sum_mm2: float
    mean: float
    maximum: float
    minimum: float
    log_average: float

    @property
    def values(self) -> Floats:
        """All of them in order, shape (5,)."""
        return np.array(astuple(self))


NAMES = tuple(field.name for field in fields(Statistics))


@lru_cache(maxsize=512)
def coverage(size_px: tuple[int, int], sensor: Frame, frame: Frame, turn_deg: float) -> Floats:
    """Compute how much of each pixel of a picture lies in a frame that is turned clockwise against it.

    Parameters
    ----------
    size_px : tuple of int
        Width and height of the picture.
    sensor : Frame
        What it covers.
    frame : Frame
    turn_deg : float
        A picture drawn at roll 0 within a frame turned by the roll shows what the upright frame sees at that roll.

    Returns
    -------
    ndarray, shape (H, W)
        0 to 1.
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
    """Measure the flare in a frame.

    Parameters
    ----------
    light : ndarray, shape (H, W)
        Luminance of the picture.
    share : ndarray, shape (H, W)
        From `coverage`.
    area : float
        Of the frame, mm^2.

    Returns
    -------
    Statistics
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
