"""Levenberg and Marquardt's way down, whatever the numbers belong to."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, TypeVar

import numpy as np

from .normal import solution
from .numbers import Floats

# where the damping begins. Numbers stand in for each other, and from far a first step along them, undamped, ends in a
# wrong valley; from near, along the right one, a damped step is lost
FAR, NEAR = 1.0, 1e-3
# by how much it grows when a step fails, at least from here, and shrinks when it does not, and how often one fails
_LEAST, _GROWS, _SHRINKS, _FAILS = 1e-4, 6.0, 0.2, 8


class State(Protocol):
    """Where a search stands."""

    @property
    def cost(self) -> float:
        """What is to become little."""


Here = TypeVar("Here", bound=State)


def descend(
    at: Here,
    steps: int,
    *,
    slopes: Callable[[Here], tuple[Floats, Floats]],
    moved: Callable[[Here, Floats], Here],
    anew: Callable[[Here], Here],
    enough: float,
    damping: float = NEAR,
) -> tuple[Here, Floats | None]:
    """Go down step by step.

    Parameters
    ----------
    at : State
    steps : int
        At most.
    slopes : callable
        Returns normal matrix, shape (Q, Q), and right side, shape (Q,), of a state.
    moved : callable
        Returns the state one step, shape (Q,), away from another.
    anew : callable
        Returns a state as the next step shall judge it.
    enough : float
        A step that gains less than this part of the cost is the last.
    damping : float
        At first: `FAR` or `NEAR`.

    Returns
    -------
    at : State
    matrix : ndarray, shape (Q, Q), or None
        Its normal matrix, when it is known.

    Notes
    -----
    Marquardt (1963): the damping scales with the diagonal. Most steps that are tried are not taken, and derivatives
    cost many times what the picture does: they are drawn only where a step begins.
    """
    for _ in range(steps):
        at = anew(at)
        matrix, side = slopes(at)
        for _retry in range(_FAILS):
            trial = moved(at, solution(matrix + damping * np.diag(np.diag(matrix)), side))
            if trial.cost < at.cost:
                break
            damping = max(damping, _LEAST) * _GROWS
        else:
            return at, matrix
        gained, at = at.cost - trial.cost, trial
        damping *= _SHRINKS
        if gained < enough * at.cost:
            break
    return at, None
