"""A table of a flare's pictures: each is drawn once and reused by all predictions."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import floor, inf

import numpy as np

from ..errors import FlarewrightError
from ..typing import Floats
from .flare import Flare, Frame
from .pictures import Drawn, PictureRequest, draw_all
from .statistics import NAMES, Statistics, covered_area, measure

# drawn rolls per blade of an iris, and step of drawn rolls for a flare that cannot be rotated, degrees
PHASES, ROLL_STEP_DEG = 4, 15.0
# decimals of a degree to which angles are rounded
DECIMALS = 4


@dataclass(frozen=True)
class FlareTable:
    """The flare within a frame for any constellation and roll.

    Attributes
    ----------
    flare : Flare
        If it can be rotated, it covers the frame's diagonal both ways, so that one picture serves many rolls.
    frame : Frame
    step_deg : float
        Distance of drawn constellations in `between`.
    drawn : dict
        Luminance of drawn pictures by (constellation, roll); a cache, ignored in comparisons.
    """

    flare: Flare
    frame: Frame
    step_deg: float = 1.0
    drawn: Drawn = field(default_factory=dict, compare=False, repr=False)

    def __post_init__(self) -> None:
        needed = 0.0 if self.flare.turns_by_deg is None else self.frame.diagonal
        sides = self.flare.sensor
        if min(sides.width, sides.height) < needed * (1.0 - 1e-6):
            raise FlarewrightError(
                f"the flare of {self.flare.name} covers {sides.width:g}x{sides.height:g} mm; a frame of "
                f"{self.frame.width:g}x{self.frame.height:g} mm that turns needs {needed:.4g} mm both ways"
            )

    def request(self, constellation_deg: float, roll_deg: float) -> PictureRequest:
        """Return the request for the picture at a constellation and a drawn roll."""
        return PictureRequest(
            self.flare, round(constellation_deg, DECIMALS), round(roll_deg, DECIMALS), drawn=self.drawn
        )

    def light(self, constellation_deg: float, roll_deg: float) -> Floats:
        """Return the luminance of the picture at a constellation and roll, shape (H, W); drawn once."""
        return draw_all([self.request(constellation_deg, roll_deg)])[0].astype(np.float64)

    def _share(self, turn_deg: float) -> Floats:
        return covered_area(self.flare.size_px, self.flare.sensor, self.frame, round(turn_deg, 1))

    def views(self, roll_deg: float) -> list[tuple[float, float, float]]:
        """Return the pictures to combine for the flare at a roll.

        Returns
        -------
        list of (drawn_roll_deg, turn_deg, weight)
            Roll of the picture, rotation of the frame over it, and weight; weights sum to 1.
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
        """Return the pictures to combine for linear interpolation at a constellation.

        Returns
        -------
        list of (constellation_deg, drawn_roll_deg, turn_deg, weight)
            Weights sum to 1; pictures of weight 0 are left out.
        """
        across = _around(constellation_deg, self.step_deg, self.flare.least_deg, self.flare.reach_deg)
        around = self.views(roll_deg)
        return [(c, at, turn, a * b) for c, a in across if a > 1e-6 for at, turn, b in around]

    def at(self, constellation_deg: float, roll_deg: float = 0.0) -> Statistics:
        """Compute the statistics at exactly this constellation."""
        return self._measured([(constellation_deg, *view) for view in self.views(roll_deg)])

    def between(self, constellation_deg: float, roll_deg: float) -> Statistics:
        """Interpolate the statistics linearly between drawn constellations, up to the flare's reach."""
        return self._measured(self.nodes(constellation_deg, roll_deg))

    def mean_between(self, constellation_deg: float, roll_deg: float) -> float:
        """Return the mean of `between` only, in a tenth of the time."""
        total = 0.0
        for c, at, turn, weight in self.nodes(constellation_deg, roll_deg):
            share = self._share(turn)
            # a dot product would start threads, which take longer than the sum
            total += weight * float((self.light(c, at) * share).sum()) / float(share.sum())
        return total

    def _measured(self, nodes: list[tuple[float, float, float, float]]) -> Statistics:
        total = np.zeros(len(NAMES))
        for c, at, turn, weight in nodes:
            total += weight * measure(self.light(c, at), self._share(turn), self.frame.area).values
        return Statistics(*(float(value) for value in total))


def _around(value: float, step: float, least: float = -inf, most: float = inf) -> list[tuple[float, float]]:
    """Return the two grid points around a value, limited to the range, with their weights."""
    start = floor(value / step + 1e-9) * step
    below, above = max(start, least), min(start + step, most)
    part = min(max((value - below) / (above - below), 0.0), 1.0) if above > below else 0.0
    return [(below, 1.0 - part), (above, part)]
