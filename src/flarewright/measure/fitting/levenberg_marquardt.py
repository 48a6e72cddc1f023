"""Levenberg-Marquardt minimization, independent of what the parameters describe."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, TypeVar

import numpy as np

from ...typing import Floats
from .normal_equations import solution

# initial damping. Parameters are nearly degenerate: an undamped first step from far start values leads into a wrong
# valley, while damping wastes steps from near ones
FAR, NEAR = 1.0, 1e-3
# damping: least value before it grows, factor after a failed step, factor after a successful one; failures before the
# search ends
_MIN_DAMPING, _INCREASE, _DECREASE, _MAX_FAILURES = 1e-4, 6.0, 0.2, 8


class DescentState(Protocol):
    """State of a search."""

    @property
    def cost(self) -> float:
        """The quantity to minimize."""


StateType = TypeVar("StateType", bound=DescentState)


def minimize(
    at: StateType,
    steps: int,
    *,
    slopes: Callable[[StateType], tuple[Floats, Floats]],
    moved: Callable[[StateType, Floats], StateType],
    reweighted: Callable[[StateType], StateType],
    min_gain: float,
    damping: float = NEAR,
) -> tuple[StateType, Floats | None]:
    """Minimize the cost of a state.

    Parameters
    ----------
    at : DescentState
        Start state.
    steps : int
        Maximum number of steps.
    slopes : callable
        Returns normal matrix, shape (Q, Q), and right-hand side, shape (Q,), of a state.
    moved : callable
        Returns the state one step, shape (Q,), away from another.
    reweighted : callable
        Returns a state with its priors recomputed; called before each step.
    min_gain : float
        The search ends after a step that lowers the cost by less than this fraction.
    damping : float
        Initial damping: `FAR` or `NEAR`.

    Returns
    -------
    at : DescentState
        Last state.
    matrix : ndarray, shape (Q, Q), or None
        Its normal matrix, when known.

    Notes
    -----
    Marquardt (1963): the damping scales with the diagonal. Most trial steps fail, and derivatives cost many times as
    much as the picture: they are computed only at the start of a step.
    """
    for _ in range(steps):
        at = reweighted(at)
        matrix, side = slopes(at)
        for _retry in range(_MAX_FAILURES):
            trial = moved(at, solution(matrix + damping * np.diag(np.diag(matrix)), side))
            if trial.cost < at.cost:
                break
            damping = max(damping, _MIN_DAMPING) * _INCREASE
        else:
            return at, matrix
        gained, at = at.cost - trial.cost, trial
        damping *= _DECREASE
        if gained < min_gain * at.cost:
            break
    return at, None
