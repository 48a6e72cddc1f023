"""Prior that ties the colours of a ghost: all follow the same path, through glass of slightly different index."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...kernels.ghost_model.pupil_mesh import BELOW, DISC_NUMBERS, FIRST_DISC, FIRST_G, FIRST_I
from ...typing import Floats, Indices
from ..core.parameter_vector import NUMBERS
from ..core.parameters import Shape
from .settings import PriorSettings

_WIDTH_UNIT, _SIZE_UNIT = 1e-4, 1e-3


def ties(shape: Shape, free: Indices, width: int, discs: int, settings: PriorSettings = PriorSettings()) -> Floats:
    """Return inverse variances of the differences between two colours of a ghost; 0 where no spread is known.

    Parameters
    ----------
    shape : Shape
        Its size scales the spread.
    free : ndarray of int, shape (Q,)
        Indices of the parameters.
    width : int
        Width of the whole picture, pixels.
    discs : int
        Number of discs of the other colour; discs are tied only when both colours have equally many.
    settings : PriorSettings

    Returns
    -------
    ndarray, shape (Q,)

    Notes
    -----
    `benchmarks.measure.terms` traces the spread: 1198 unvignetted ghosts of eight lenses at f/5.6, 720 pixels wide,
    blue and red against green. In the size classes below 6, 20, 60 and 150 pixels and above, three in four differ by
    less than 0.7, 2.5, 0.6, 2.2 and 3.2 pixels in position and by less than 0.3, 0.7, 0.4, 0.9 and 2.1 pixels in size.
    They differ by less in the terms of the field, and by less than 0.5 pixels (1.0 in the largest class) in
    aberrations. Nine in ten differ by less than two to five times as much.
    """
    size = float(np.abs(shape.numbers[FIRST_G]))
    spread = np.full(NUMBERS, np.inf)
    apart = _WIDTH_UNIT * width * np.array(settings.colour_widths) + _SIZE_UNIT * size * np.array(settings.colour_sizes)
    spread[:FIRST_I] = apart.ravel()
    if shape.discs == discs:
        spread[FIRST_DISC : FIRST_DISC + DISC_NUMBERS * discs] = settings.colour_rims
    spread[BELOW:] = settings.colour_denominator
    return np.asarray(1.0 / spread[free] ** 2)


@dataclass(frozen=True)
class Expectation:
    """Gaussian prior of the free parameters.

    Attributes
    ----------
    weights : ndarray, shape (Q,)
        Inverse variances.
    toward : ndarray, shape (Q,)
        Means.
    """

    weights: Floats
    toward: Floats

    def squares(self, numbers: Floats) -> float:
        """Return the weighted squares of the deviation of parameters from the means."""
        return float(self.weights @ (numbers - self.toward) ** 2)


def nothing(count: int) -> Expectation:
    """Return a flat prior of `count` parameters."""
    return Expectation(np.zeros(count), np.zeros(count))


def expectation(
    prior: Floats, shape: Shape, free: Indices, width: int, doubt: float, like: Shape | None,
    settings: PriorSettings = PriorSettings(),
) -> Expectation:  # fmt: skip
    """Return the prior of a ghost's parameters, with the tie to another colour.

    Parameters
    ----------
    prior : ndarray, shape (Q,)
        Inverse variances about 0, from `ghost_fit.priors`.
    shape : Shape
    free : ndarray of int, shape (Q,)
    width : int
    doubt : float
        Pixels per independent observation; a factor on the weight of the tie.
    like : Shape or None
        The same ghost in its leading colour; None: no tie.
    settings : PriorSettings
    """
    if like is None:
        return Expectation(prior, np.zeros(free.size))
    tied = doubt * ties(shape, free, width, like.discs, settings)
    weights = prior + tied
    return Expectation(weights, np.where(weights > 0.0, tied * like.numbers[free] / np.maximum(weights, 1e-300), 0.0))
