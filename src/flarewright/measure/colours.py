"""What the colours of a ghost have in common: the same path through glass of a slightly other index draws them all."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..kernels.measure_pupil import BELOW, DISC_NUMBERS, FIRST_DISC, FIRST_G, FIRST_I
from .numbers import NUMBERS, Floats
from .shape import Indices, Shape

# by how much f and g differ from colour to colour, by their ten terms: of the picture's width whatever the size, and of
# the size; see `ties`
_OF_WIDTH = ((28, 1, 5, 10, 3, 3, 3, 3, 3, 3), (6, 1, 2, 4, 2, 2, 2, 2, 2, 2))
_OF_SIZE = ((15, 1, 4, 6, 5, 5, 5, 5, 5, 5), (7, 1, 3, 3, 3, 3, 3, 3, 3, 3))
_WIDTH_UNIT, _SIZE_UNIT = 1e-4, 1e-3
# rims, in radii of the first one, and what place and size are divided by
_RIMS, _BELOW = 0.04, 0.05


def ties(shape: Shape, free: Indices, width: int, discs: int) -> Floats:
    """Return inverse variances of what a colour's numbers differ by from another's; 0 for those of which none is known.

    Parameters
    ----------
    shape : Shape
        Its size scales them.
    free : ndarray of int, shape (Q,)
        Numbers that are asked for.
    width : int
        Of the whole picture, pixels.
    discs : int
        That the other colour has; of other rims nothing is known.

    Returns
    -------
    ndarray, shape (Q,)

    Notes
    -----
    `benchmarks.measure.terms` traces them: whole ghosts of eight lenses at f/5.6, 720 pixels wide, blue and red against
    green, 1198 in all. Of those below 6 pixels, to 20, 60, 150 and larger three in four differ by less than 0.7, 2.5,
    0.6, 2.2 and 3.2 pixels in place, 0.3, 0.7, 0.4, 0.9 and 2.1 in size, by less in what changes with the field, and by
    less than 0.5 (1.0 of the largest) in aberrations; nine in ten by two to five times as much.
    """
    size = float(np.abs(shape.numbers[FIRST_G]))
    spread = np.full(NUMBERS, np.inf)
    apart = _WIDTH_UNIT * width * np.array(_OF_WIDTH) + _SIZE_UNIT * size * np.array(_OF_SIZE)
    spread[:FIRST_I] = apart.ravel()
    if shape.discs == discs:
        spread[FIRST_DISC : FIRST_DISC + DISC_NUMBERS * discs] = _RIMS
    spread[BELOW:] = _BELOW
    return np.asarray(1.0 / spread[free] ** 2)


@dataclass(frozen=True)
class Expectation:
    """What numbers are expected to be before anything is looked at.

    Attributes
    ----------
    weights : ndarray, shape (Q,)
        Inverse variances.
    toward : ndarray, shape (Q,)
    """

    weights: Floats
    toward: Floats

    def squares(self, numbers: Floats) -> float:
        """Return by how many squares numbers are off."""
        return float(self.weights @ (numbers - self.toward) ** 2)


def nothing(count: int) -> Expectation:
    """Return what expects nothing of so many numbers."""
    return Expectation(np.zeros(count), np.zeros(count))


def expectation(
    prior: Floats, shape: Shape, free: Indices, width: int, doubt: float, like: Shape | None
) -> Expectation:
    """Return what a ghost's numbers are expected to be.

    Parameters
    ----------
    prior : ndarray, shape (Q,)
        Inverse variances about 0, from `fit.priors`.
    shape : Shape
    free : ndarray of int, shape (Q,)
    width : int
    doubt : float
        How many pixels count as one witness: by as much more counts what is known beforehand.
    like : Shape or None
        The same ghost in the colour that tells most of it.
    """
    if like is None:
        return Expectation(prior, np.zeros(free.size))
    tied = doubt * ties(shape, free, width, like.discs)
    weights = prior + tied
    return Expectation(weights, np.where(weights > 0.0, tied * like.numbers[free] / np.maximum(weights, 1e-300), 0.0))
