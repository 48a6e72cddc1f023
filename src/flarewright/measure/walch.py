"""Walch's way, for comparison: a blurred cost and gradient descent, one number after the other (2017, chapter 7)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..kernels.measure_bezier import BORDER, INNER, NUMBERS, bezier_window, draw_bezier, draw_beziers
from .numbers import Floats, with_bounded_controls

# how much the edges' part of the cost counts
EDGES = 4.0


@dataclass(frozen=True)
class Descent:
    """What came of a descent.

    Attributes
    ----------
    numbers : ndarray, shape (19,)
    cost : float
    evaluations : int
        Pictures drawn.
    """

    numbers: Floats
    cost: float
    evaluations: int


def draw(numbers: Floats, frame: Floats, window: tuple[int, int, int, int]) -> Floats:
    """Draw a Bezier ghost inside a window (left, top, width, height), shape (h, w, 3)."""
    left, top, width, height = window
    pixels = np.zeros((height, width, 3))
    draw_beziers(numbers[None], frame, left, top, pixels)
    return pixels


def _blur(picture: Floats) -> Floats:
    """Spread a picture (H, W) by the binomial kernel 1 4 6 4 1 along both axes."""
    for axis, size in enumerate(picture.shape):
        # the border repeated
        padded = np.take(picture, np.clip(np.arange(-2, size + 2), 0, size - 1), axis)
        a, b, c, d, e = (padded[k : k + size] if axis == 0 else padded[:, k : k + size] for k in range(5))
        picture = (a + 4.0 * b + 6.0 * c + 4.0 * d + e) / 16.0
    return picture


def edges(picture: Floats) -> Floats:
    """Return the blurred Laplacian of the blurred picture (section 7.1.2), shape (H, W)."""
    smooth = np.pad(_blur(picture), 1, mode="edge")
    laplace = smooth[:-2, 1:-1] + smooth[2:, 1:-1] + smooth[1:-1, :-2] + smooth[1:-1, 2:] - 4.0 * smooth[1:-1, 1:-1]
    return _blur(laplace)


def cost(picture: Floats, wanted: Floats, wanted_edges: Floats | None = None) -> float:
    """Return Walch's cost: mean squared error (equation 7.2) and that of the blurred edges.

    Parameters
    ----------
    picture, wanted : ndarray, shape (H, W)
        Grey.
    wanted_edges : ndarray, shape (H, W), optional
        Of `wanted`, where they are known already.
    """
    there = edges(wanted) if wanted_edges is None else wanted_edges
    return float(((picture - wanted) ** 2).mean() + EDGES * ((edges(picture) - there) ** 2).mean())


def descend(
    start: Floats,
    wanted: Floats,
    frame: Floats,
    window: tuple[int, int, int, int],
    *,
    rounds: int = 200,
    rate: float = 1.0,
) -> Descent:
    """Fit one ghost in one picture by online gradient descent.

    Parameters
    ----------
    start : ndarray, shape (19,)
    wanted : ndarray, shape (H, W)
        Grey, inside the window.
    frame : ndarray, shape (5,)
    window : tuple of int
        left, top, width, height.
    rounds : int
        Each changes every number once, shape before shade.
    rate : float
        The learning rate to begin with; it is halved after a round without progress.

    Returns
    -------
    Descent

    Notes
    -----
    Section 7.2: central differences (equation 7.3), a step size of its own for each number, numbers updated at once
    ("online"). Grey pictures, as there: all colours of a level move together.
    """
    numbers = start.copy()
    scale = 0.5 * (abs(numbers[3]) + abs(numbers[4]))
    steps = np.array([0.02 * scale] * 9 + [0.02 * scale] * 2 + [0.05] * 2)
    level = max(float(numbers[BORDER]), 1e-12)
    groups = [(k, steps[k]) for k in range(13)] + [(BORDER, 0.05 * level), (INNER, 0.05 * level)]
    evaluations, wanted_edges = 0, edges(wanted)

    def look(trial: Floats) -> float:
        nonlocal evaluations
        evaluations += 1
        return cost(draw(trial, frame, window)[..., 1], wanted, wanted_edges)

    def moved(at: int, by: float) -> Floats:
        trial = numbers.copy()
        trial[at : at + 3 if at >= BORDER else at + 1] += by
        trial[2:5], trial[9:] = np.maximum(trial[2:5], 0.5), np.maximum(trial[9:], 1e-6)
        return with_bounded_controls(trial)

    here = look(numbers)
    for _ in range(rounds):
        before = here
        for at, step in groups:
            probe = 0.25 * step * max(rate, 0.05)
            slope = (look(moved(at, probe)) - look(moved(at, -probe))) / (2.0 * probe)
            if slope == 0.0:
                continue
            # the gradient says which way; the number's own step and the rate say how far
            trial = moved(at, -np.sign(slope) * step * rate)
            there = look(trial)
            if there < here:
                numbers, here = trial, there
        if here > before * (1.0 - 1e-4):
            rate *= 0.5
            if rate < 1e-3:
                break
    return Descent(numbers, here, evaluations)


def fit_bezier(
    start: Floats,
    wanted: Floats,
    weight: Floats,
    frame: Floats,
    window: tuple[int, int, int, int],
    *,
    steps: int = 40,
) -> tuple[Descent, Floats]:
    """Fit one Bezier ghost in one picture by Levenberg-Marquardt with noise weights and exact derivatives.

    Parameters
    ----------
    start : ndarray, shape (19,)
    wanted, weight : ndarray, shape (H, W, 3)
        Inside the window; inverse variances.
    frame, window
        As in `descend`.
    steps : int
        At most.

    Returns
    -------
    Descent
        Its cost is the weighted sum of squares.
    ndarray, shape (19,)
        Standard deviation of each number.
    """
    left, top, width, height = window
    numbers = start.copy()
    prior = np.full(NUMBERS, 1e-6) / np.maximum(np.abs(start), 1.0) ** 2
    evaluations = 0

    def look(trial: Floats) -> tuple[float, Floats, Floats]:
        nonlocal evaluations
        evaluations += 1
        pixels, changes = np.zeros((height, width, 3)), np.zeros((height, width, 3, NUMBERS))
        draw_bezier(trial, frame, left, top, pixels, changes)
        residual = (wanted - pixels).ravel()
        jacobian = changes.reshape(-1, NUMBERS)
        weighted = jacobian * weight.reshape(-1, 1)
        cost_here = float((weight.ravel() * residual**2).sum())
        return cost_here, weighted.T @ jacobian + np.diag(prior), weighted.T @ residual

    here, matrix, side = look(numbers)
    damping = 1e-2
    for _ in range(steps):
        step = np.linalg.solve(matrix + damping * np.diag(np.diag(matrix)), side)
        trial = numbers + step
        trial[2:5], trial[9:13] = np.maximum(trial[2:5], 0.5), np.maximum(trial[9:13], 0.05)
        trial = with_bounded_controls(trial)
        there, new_matrix, new_side = look(trial)
        if there < here:
            gained, numbers, here, matrix, side = here - there, trial, there, new_matrix, new_side
            damping *= 0.3
            if gained < 1e-5 * here:
                break
        else:
            damping *= 6.0
            if damping > 1e8:
                break
    deviation = np.sqrt(np.maximum(np.diag(np.linalg.pinv(matrix, hermitian=True)), 0.0))
    return Descent(numbers, here, evaluations), deviation


def window_of(numbers: Floats, frame: Floats, size_px: tuple[int, int], margin: int = 6) -> tuple[int, int, int, int]:
    """Return the window (left, top, width, height) of a Bezier ghost and a margin; width 0: outside the picture."""
    left, top, width, height = bezier_window(numbers, frame, *size_px)
    if not width:
        return 0, 0, 0, 0
    x0, y0 = max(left - margin, 0), max(top - margin, 0)
    return x0, y0, min(left + width + margin, size_px[0]) - x0, min(top + height + margin, size_px[1]) - y0


def circle(centre: float, radius: float, border: NDArray[np.float64], inner: NDArray[np.float64]) -> Floats:
    """Return the numbers of a round ghost: 0.5523 radii make a Bezier curve a quarter circle to 2e-4."""
    k = 0.5523 * radius
    shape = [centre, 0.0, radius, radius, radius, k, k, k, k]
    return np.array([*shape, 0.15 * radius, 0.5 * radius, 1.0, 1.0, *border, *inner])
