"""What the middle of a ghost's pupil does over the constellation, and how well that is known."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np

from ..kernels.measure_middle import fill_middles
from ..model.ghost_model import AberrationGhost, Curves
from .curves import Pose, pose_at, posed
from .found import CHANNELS
from .numbers import Floats, channel_deviation, channel_numbers, field

PLACE, SIZE, RADIANCE = 0, 1, 2

# numbers are moved by this part of their standard deviation to see what they change
_STEP = 0.1


@dataclass(frozen=True)
class Known:
    """A number over the constellation.

    Attributes
    ----------
    value, deviation : ndarray, shape (K,)
        The standard deviation is 0 where none is known.
    """

    value: Floats
    deviation: Floats


@dataclass(frozen=True)
class Middles:
    """The middle of a ghost's pupil over the constellation.

    Attributes
    ----------
    values : ndarray, shape (3, 3, K)
        Of red, green and blue place, size and radiance: pixels from the axis, to where the light is at positive
        constellations; pixels for a radius of the pupil, at right angles to the light's line, below 0 where the ghost
        is turned over; radiance.
    changes : ndarray, shape (P, 3, 3, K)
        By how much these change, to first order, with one standard deviation of each of the model's P numbers.
    """

    values: Floats
    changes: Floats

    def known(self, quantity: int, colour: int) -> Known:
        """Return one of the three quantities in one colour."""
        return _known(self.values[colour, quantity], self.changes[:, colour, quantity])

    def apart(self, quantity: int, colour: int, other: int) -> Known:
        """Return by how much a quantity is more in one colour than in another: curves move all colours alike."""
        values, changes = self.values[:, quantity], self.changes[:, :, quantity]
        return _known(values[colour] - values[other], changes[:, colour] - changes[:, other])


def _known(value: Floats, changes: Floats) -> Known:
    return Known(value, np.sqrt(np.square(changes).sum(axis=0)))


def side_of(constellation_deg: Floats) -> Floats:
    """Return on which side the light is, -1 or 1; times this, a place told towards the light is that in reports."""
    return np.where(constellation_deg < 0.0, -1.0, 1.0)


def middles_of(ghost: AberrationGhost, constellation_deg: Floats, largest_deg: float) -> Middles:
    """Follow the middle of a ghost's pupil over the constellation.

    Parameters
    ----------
    ghost : AberrationGhost
    constellation_deg : ndarray, shape (K,)
    largest_deg : float
        The model's.

    Returns
    -------
    Middles
        Whether or not a rim leaves the middle open.

    Notes
    -----
    First-order propagation: central differences of what replays are drawn by, each number moved by a tenth of its
    standard deviation (exact for those that enter linearly: all of f and g, and the curves' knots). How numbers go
    together the file does not tell, so their correlations are left out.
    """
    fields = np.array([field(angle, largest_deg) for angle in constellation_deg])
    numbers = [channel_numbers(one, ghost.blades) for one in (ghost.red, ghost.green, ghost.blue)]

    def poses(curves: Curves) -> list[Pose]:
        return [pose_at(curves, angle, ghost.visible_deg) for angle in constellation_deg.tolist()]

    def colours(posing: Sequence[Pose]) -> Floats:
        return np.stack([_look(one, posing, fields) for one in numbers])

    plain = poses(ghost.curves)
    values = colours(plain)
    changes = []
    for m, channel in enumerate((ghost.red, ghost.green, ghost.blue)):
        deviation = channel_deviation(channel)
        for n in np.flatnonzero(deviation):
            step = np.zeros(deviation.size)
            step[n] = _STEP * deviation[n]
            change = np.zeros_like(values)
            change[m] = _look(numbers[m] + step, plain, fields) - _look(numbers[m] - step, plain, fields)
            changes.append(change)
    for more, less in _moved(ghost.curves):
        changes.append(colours(poses(more)) - colours(poses(less)))
    return Middles(values, np.array(changes).reshape(-1, CHANNELS, *values.shape[1:]) / (2.0 * _STEP))


def _look(numbers: Floats, poses: Sequence[Pose], fields: Floats) -> Floats:
    """Return place, size and radiance of one colour, shape (3, K)."""
    sigma, out = np.abs(fields), np.zeros((3, fields.size))
    fill_middles(np.stack([posed(numbers, *each) for each in zip(sigma.tolist(), poses, strict=True)]), sigma, out)
    out[PLACE] *= side_of(fields)
    return out


def _moved(curves: Curves) -> Iterator[tuple[Curves, Curves]]:
    """Yield curves with each knot a step more and a step less."""
    for name in Curves.model_fields:
        curve = getattr(curves, name)
        for k, error in enumerate(() if curve is None else curve.error):
            if error:
                step = _STEP * error * np.eye(len(curve.values))[k]
                more, less = (tuple(map(float, np.array(curve.values) + each)) for each in (step, -step))
                yield (
                    cast(Curves, curves.replace(**{name: curve.replace(values=more)})),
                    cast(Curves, curves.replace(**{name: curve.replace(values=less)})),
                )
