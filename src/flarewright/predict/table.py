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

# rolls drawn for each blade of an iris, and between those of a flare that does not turn, degrees
PHASES, ROLL_STEP_DEG = 4, 15.0
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
        One that turns covers the frame's diagonal both ways, so that one picture serves many rolls.
    frame : Frame
    step_deg : float
        Between drawn constellations in `between`.
    drawn : dict
        The luminance of what was drawn, by (constellation, roll); a memory, and no part of what a table is.
    on_draw : callable or None
        Called after each new picture.
    """

    flare: Flare
    frame: Frame
    step_deg: float = 1.0
    drawn: Drawn = field(default_factory=dict, compare=False, repr=False)
    on_draw: Callable[[], None] | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        needed = 0.0 if self.flare.turns_by_deg is None else self.frame.diagonal
        sides = self.flare.sensor
        if min(sides.width, sides.height) < needed * (1.0 - 1e-6):
            raise FlarewrightError(
                f"the flare of {self.flare.name} covers {sides.width:g}x{sides.height:g} mm; a frame of "
                f"{self.frame.width:g}x{self.frame.height:g} mm that turns needs {needed:.4g} mm both ways"
            )

    def light(self, constellation_deg: float, roll_deg: float) -> Floats:
        """Return the luminance of what is drawn with the light at this constellation and roll, shape (H, W)."""
        key = (round(constellation_deg, DECIMALS), round(roll_deg, DECIMALS))
        if key not in self.drawn:
            self.drawn[key] = luminance(self.flare.picture(*key)).astype(np.float32)
            if self.on_draw is not None:
                self.on_draw()
        return self.drawn[key].astype(np.float64)

    def _share(self, turn_deg: float) -> Floats:
        return coverage(self.flare.size_px, self.flare.sensor, self.frame, round(turn_deg, 1))

    def views(self, roll_deg: float) -> list[tuple[float, float, float]]:
        """Return what is drawn to see the flare at a roll.

        Parameters
        ----------
        roll_deg : float

        Returns
        -------
        list of (drawn_roll_deg, turn_deg, weight)
            The roll at which it is drawn, by how much the frame turns over that picture, and weights that add up to 1.
        """
        period = self.flare.turns_by_deg
        if period == 0.0:
            return [(0.0, roll_deg, 1.0)]
        if period is None:
            return [((at + 180.0) % 360.0 - 180.0, 0.0, w) for at, w in _around(roll_deg, ROLL_STEP_DEG) if w > 1e-6]
        found = []
        for at, weight in _around(roll_deg, period / PHASES):
            phase = round(at * PHASES / period) % PHASES * period / PHASES
            if weight > 1e-6:
                found.append((phase, roll_deg - phase, weight))
        return found

    def nodes(self, constellation_deg: float, roll_deg: float) -> list[tuple[float, float, float, float]]:
        """Return what is drawn around a constellation for straight lines between.

        Parameters
        ----------
        constellation_deg, roll_deg : float

        Returns
        -------
        list of (constellation_deg, drawn_roll_deg, turn_deg, weight)
            The weights add up to 1; those of weight 0 are left out.
        """
        across = _around(constellation_deg, self.step_deg, self.flare.least_deg, self.flare.reach_deg)
        around = self.views(roll_deg)
        return [(c, at, turn, a * b) for c, a in across if a > 1e-6 for at, turn, b in around]

    def at(self, constellation_deg: float, roll_deg: float = 0.0) -> Statistics:
        """Measure the flare at exactly this constellation."""
        return self._measured([(constellation_deg, *view) for view in self.views(roll_deg)])

    def between(self, constellation_deg: float, roll_deg: float) -> Statistics:
        """Measure the flare by straight lines between the nearest drawn constellations; at most the flare's reach."""
        return self._measured(self.nodes(constellation_deg, roll_deg))

    def mean_between(self, constellation_deg: float, roll_deg: float) -> float:
        """Return the mean of `between` alone, which takes a tenth of the time."""
        total = 0.0
        for c, at, turn, weight in self.nodes(constellation_deg, roll_deg):
            share = self._share(turn)
            # no dot product: its threads cost more than it does
            total += weight * float((self.light(c, at) * share).sum()) / float(share.sum())
        return total

    def _measured(self, nodes: list[tuple[float, float, float, float]]) -> Statistics:
        total = np.zeros(len(NAMES))
        for c, at, turn, weight in nodes:
            total += weight * measure(self.light(c, at), self._share(turn), self.frame.area).values
        return Statistics(*(float(value) for value in total))


def _around(value: float, step: float, least: float = -inf, most: float = inf) -> list[tuple[float, float]]:
    """Return the two grid points about a value, those at the ends of the range moved onto them, with weights."""
    start = floor(value / step + 1e-9) * step
    below, above = max(start, least), min(start + step, most)
    part = min(max((value - below) / (above - below), 0.0), 1.0) if above > below else 0.0
    return [(below, 1.0 - part), (above, part)]
