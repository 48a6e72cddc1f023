"""Image of a ghost's pupil centre over the constellation: position, size and radiance with their errors."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ...kernels.ghost_model.pupil_centre import fill_middles
from ...model.measurement.ghost_model import AberrationGhost, Curves
from ...typing import Floats
from ..core.parameter_vector import channel_deviation, channel_numbers, field
from ..core.pose_curves import Pose, pose_at, posed
from ..fitting.detected_ghost import CHANNELS

PLACE, SIZE, RADIANCE = 0, 1, 2

# step of the numerical derivatives, over the standard deviation of the parameter
_STEP = 0.1


@dataclass(frozen=True)
class Known:
    """A quantity over the constellation.

    Attributes
    ----------
    value, deviation : ndarray, shape (K,)
        The standard deviation is 0 where the model holds none.
    """

    value: Floats
    deviation: Floats


@dataclass(frozen=True)
class Middles:
    """Image of a ghost's pupil centre over the constellation.

    Attributes
    ----------
    values : ndarray, shape (3, 3, K)
        Position, size and radiance of red, green and blue. The position is in pixels from the axis, positive on the
        side of the light at positive constellations. The size is in pixels per pupil radius, across the line through
        axis and light, negative where the ghost is inverted.
    changes : ndarray, shape (P, 3, 3, K)
        First-order change of the values by one standard deviation of each of the model's P parameters.
    """

    values: Floats
    changes: Floats

    def known(self, quantity: int, colour: int) -> Known:
        """Return one quantity in one colour: `PLACE`, `SIZE` or `RADIANCE`."""
        return _known(self.values[colour, quantity], self.changes[:, colour, quantity])

    def apart(self, quantity: int, colour: int, other: int) -> Known:
        """Return the difference of a quantity between two colours; errors common to both, as of curves, cancel."""
        values, changes = self.values[:, quantity], self.changes[:, :, quantity]
        return _known(values[colour] - values[other], changes[:, colour] - changes[:, other])


def _known(value: Floats, changes: Floats) -> Known:
    return Known(value, np.sqrt(np.square(changes).sum(axis=0)))


def side_of(constellation_deg: Floats) -> Floats:
    """Return the sign of the constellation, -1 or 1; it converts positions towards the light to those of reports."""
    return np.where(constellation_deg < 0.0, -1.0, 1.0)


def middles_of(ghost: AberrationGhost, constellation_deg: Floats, largest_deg: float) -> Middles:
    """Compute the image of a ghost's pupil centre over the constellation.

    Parameters
    ----------
    ghost : AberrationGhost
    constellation_deg : ndarray, shape (K,)
    largest_deg : float
        Largest constellation of the model.

    Returns
    -------
    Middles
        Computed even where a rim covers the pupil centre.

    Notes
    -----
    First-order error propagation by central differences of the replay's formulas, with a step of a tenth of each
    parameter's standard deviation. It is exact for parameters that enter linearly: all of f and g, and the knots of
    curves. The file stores no correlations, so they are neglected.
    """
    fields = np.array([field(angle, largest_deg) for angle in constellation_deg])
    numbers = [channel_numbers(one, ghost.blades) for one in (ghost.red, ghost.green, ghost.blue)]

    def poses(curves: Curves) -> list[Pose]:
        return [pose_at(curves, angle, ghost.visible_deg) for angle in constellation_deg.tolist()]

    def colours(posing: Sequence[Pose]) -> Floats:
        return np.stack([_pupil_centre(one, posing, fields) for one in numbers])

    plain = poses(ghost.curves)
    values = colours(plain)
    changes = []
    for m, channel in enumerate((ghost.red, ghost.green, ghost.blue)):
        deviation = channel_deviation(channel)
        for n in np.flatnonzero(deviation):
            step = np.zeros(deviation.size)
            step[n] = _STEP * deviation[n]
            change = np.zeros_like(values)
            change[m] = _pupil_centre(numbers[m] + step, plain, fields) - _pupil_centre(
                numbers[m] - step, plain, fields
            )
            changes.append(change)
    for more, less in _perturbed_curves(ghost.curves):
        changes.append(colours(poses(more)) - colours(poses(less)))
    return Middles(values, np.array(changes).reshape(-1, CHANNELS, *values.shape[1:]) / (2.0 * _STEP))


def _pupil_centre(numbers: Floats, poses: Sequence[Pose], fields: Floats) -> Floats:
    """Return position, size and radiance of one colour, shape (3, K)."""
    sigma, out = np.abs(fields), np.zeros((3, fields.size))
    fill_middles(np.stack([posed(numbers, *each) for each in zip(sigma.tolist(), poses, strict=True)]), sigma, out)
    out[PLACE] *= side_of(fields)
    return out


def _perturbed_curves(curves: Curves) -> Iterator[tuple[Curves, Curves]]:
    """Yield pairs of curves with one knot a step higher and a step lower, for each knot with an error."""
    for name in Curves.model_fields:
        curve = getattr(curves, name)
        for k, error in enumerate(() if curve is None else curve.error):
            if error:
                step = _STEP * error * np.eye(len(curve.values))[k]
                more, less = (tuple(map(float, np.array(curve.values) + each)) for each in (step, -step))
                yield (
                    curves.replace(**{name: curve.replace(values=more)}),
                    curves.replace(**{name: curve.replace(values=less)}),
                )
