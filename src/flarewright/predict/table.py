"""Flares drawn once and kept: every prediction asks for the same few pictures again and again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import floor, inf

import numpy as np
from numpy.typing import NDArray

from ..errors import FlarewrightError
from .flare import Flare, Frame, luminance
from .statistics import NAMES, Statistics, coverage, measure

Floats = NDArray[np.float64]

# angles are told apart to this many decimals of a degree
DECIMALS = 4

Drawn = dict[tuple[float, float], NDArray[np.float32]]
Memory = dict[str, Drawn]
"""Luminance of what was drawn, by the flare's fingerprint, then by (constellation, roll) in degrees."""

__all__ = ["Drawn", "FlareTable", "Memory"]


@dataclass(frozen=True)
class FlareTable:
    """The flare within a frame for any constellation and roll.

    Attributes
    ----------
    flare : Flare
        One that turns covers the frame's diagonal both ways, so that one picture serves every roll.
    frame : Frame
    step_deg : float
        Between drawn constellations in `between`.
    roll_step_deg : float
        Between drawn rolls of a flare that does not only turn.
    drawn : dict
        The luminance of what was drawn, by (constellation, roll); a memory, and no part of what a table is.
    on_draw : callable or None
        Called after each new picture.
    """

    flare: Flare
    frame: Frame
    step_deg: float = 1.0
    roll_step_deg: float = 15.0
    drawn: Drawn = field(default_factory=dict, compare=False, repr=False)
    on_draw: Callable[[], None] | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        needed = self.frame.diagonal if self.flare.turns else 0.0
        sides = self.flare.sensor
        if min(sides.width, sides.height) < needed * (1.0 - 1e-6):
            raise FlarewrightError(
                f"the flare of {self.flare.name} covers {sides.width:g}x{sides.height:g} mm; a frame of "
                f"{self.frame.width:g}x{self.frame.height:g} mm that turns needs {needed:.4g} mm both ways"
            )

    def light(self, constellation_deg: float, roll_deg: float) -> tuple[Floats, Floats]:
        """Return the luminance drawn for a constellation, and how much of each pixel the frame sees at a roll.

        Parameters
        ----------
        constellation_deg : float
            At most the flare's reach.
        roll_deg : float

        Returns
        -------
        light, share : ndarray, shape (H, W)
        """
        turn, roll = (roll_deg, 0.0) if self.flare.turns else (0.0, roll_deg)
        key = (round(constellation_deg, DECIMALS), round(roll, DECIMALS))
        if key not in self.drawn:
            picture = self.flare.picture(*key)
            self.drawn[key] = luminance(picture).astype(np.float32)
            if self.on_draw is not None:
                self.on_draw()
        share = coverage(self.flare.size_px, self.flare.sensor, self.frame, round(turn, 1))
        return self.drawn[key].astype(np.float64), share

    def at(self, constellation_deg: float, roll_deg: float = 0.0) -> Statistics:
        """Measure the flare at exactly this constellation and roll."""
        return measure(*self.light(constellation_deg, roll_deg), self.frame.area)

    def nodes(self, constellation_deg: float, roll_deg: float) -> list[tuple[float, float, float]]:
        """Return the drawn constellations and rolls around a light with their weights, for straight lines between.

        Parameters
        ----------
        constellation_deg, roll_deg : float

        Returns
        -------
        list of (constellation_deg, roll_deg, weight)
            The weights add up to 1; those of weight 0 are left out.
        """
        across = _around(constellation_deg, self.step_deg, self.flare.least_deg, self.flare.reach_deg)
        if self.flare.turns:
            around = [(roll_deg, 1.0)]
        else:
            around = [(_wrapped(roll), weight) for roll, weight in _around(roll_deg, self.roll_step_deg)]
        return [(c, roll, a * b) for c, a in across for roll, b in around if a * b > 1e-6]

    def between(self, constellation_deg: float, roll_deg: float) -> Statistics:
        """Measure the flare by straight lines between the nearest drawn constellations.

        Parameters
        ----------
        constellation_deg : float
            At most the flare's reach.
        roll_deg : float
        """
        total = np.zeros(len(NAMES))
        for c, roll, weight in self.nodes(constellation_deg, roll_deg):
            total += weight * self.at(c, roll).values
        return Statistics(*(float(value) for value in total))

    def mean_between(self, constellation_deg: float, roll_deg: float) -> float:
        """Return the mean of `between` alone, which takes a tenth of the time."""
        total = 0.0
        for c, roll, weight in self.nodes(constellation_deg, roll_deg):
            light, share = self.light(c, roll)
            # no dot product: its threads cost more than it does
            total += weight * float((light * share).sum()) / float(share.sum())
        return total


def _around(value: float, step: float, least: float = -inf, most: float = inf) -> list[tuple[float, float]]:
    """Return the two grid points about a value, those at the ends of the range moved onto them, with weights."""
    start = floor(value / step + 1e-9) * step
    below, above = max(start, least), min(start + step, most)
    part = min(max((value - below) / (above - below), 0.0), 1.0) if above > below else 0.0
    return [(below, 1.0 - part), (above, part)]


def _wrapped(roll_deg: float) -> float:
    return (roll_deg + 180.0) % 360.0 - 180.0
