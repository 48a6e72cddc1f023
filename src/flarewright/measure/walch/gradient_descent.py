"""Walch's fit of one ghost, for comparison: a blurred cost and coordinate-wise gradient descent (2017, chapter 7)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from ...kernels.ghost_model.bezier import BORDER, INNER, bezier_window, draw_beziers
from ...typing import Floats
from ..core.parameter_vector import with_bounded_controls

# weight of the edge term in the cost
EDGES = 4.0


@dataclass(frozen=True)
class Descent:
    """Result of a descent.

    Attributes
    ----------
    numbers : ndarray, shape (19,)
    cost : float
    evaluations : int
        Number of images drawn.
    """

    numbers: Floats
    cost: float
    evaluations: int


def draw_single(numbers: Floats, frame: Floats, window: tuple[int, int, int, int]) -> Floats:
    """Draw a Bezier ghost inside a window (left, top, width, height), shape (h, w, 3)."""
    left, top, width, height = window
    pixels = np.zeros((height, width, 3))
    draw_beziers(numbers[None], frame, left, top, pixels)
    return pixels


def _blur(picture: Floats) -> Floats:
    """Blur an image (H, W) with the binomial kernel 1 4 6 4 1 along both axes."""
    for axis in (0, 1):
        picture = ndimage.correlate1d(picture, np.array([1.0, 4.0, 6.0, 4.0, 1.0]) / 16.0, axis, mode="nearest")
    return picture


def edges(picture: Floats) -> Floats:
    """Return the blurred Laplacian of the blurred image (section 7.1.2), shape (H, W)."""
    return _blur(ndimage.laplace(_blur(picture), mode="nearest"))


def cost(picture: Floats, wanted: Floats, wanted_edges: Floats | None = None) -> float:
    """Return Walch's cost: the mean squared error (equation 7.2) plus that of the blurred edges.

    Parameters
    ----------
    picture, wanted : ndarray, shape (H, W)
        Grey.
    wanted_edges : ndarray, shape (H, W), optional
        `edges(wanted)`, if already computed.
    """
    there = edges(wanted) if wanted_edges is None else wanted_edges
    return float(((picture - wanted) ** 2).mean() + EDGES * ((edges(picture) - there) ** 2).mean())


def descend_gradient(
    start: Floats, wanted: Floats, frame: Floats, window: tuple[int, int, int, int], *, rounds: int = 200
) -> Descent:
    """Fit one ghost in one image by online gradient descent.

    Parameters
    ----------
    start : ndarray, shape (19,)
    wanted : ndarray, shape (H, W)
        Grey, inside the window.
    frame : ndarray, shape (5,)
    window : tuple of int
        left, top, width, height.
    rounds : int
        Each round changes every number once, shape numbers before brightness.

    Notes
    -----
    Section 7.2: central differences (equation 7.3), a separate step size for each number, each number updated at once
    ("online"). Images are grey as in Walch's work: all colours of a level change together.
    """
    numbers = start.copy()
    scale = 0.5 * (abs(numbers[3]) + abs(numbers[4]))
    steps = np.array([0.02 * scale] * 9 + [0.02 * scale] * 2 + [0.05] * 2)
    # pictures are of green; of a ghost that is dark there, the picture's light gives the step
    level = max(float(numbers[BORDER + 1]), float(numbers[INNER + 1]), 1e-6 * float(np.abs(wanted).max()), 1e-300)
    groups = [(k, steps[k]) for k in range(13)] + [(BORDER, 0.05 * level), (INNER, 0.05 * level)]
    evaluations, wanted_edges = 0, edges(wanted)

    def look(trial: Floats) -> float:
        nonlocal evaluations
        evaluations += 1
        return cost(draw_single(trial, frame, window)[..., 1], wanted, wanted_edges)

    def moved(at: int, by: float) -> Floats:
        trial = numbers.copy()
        trial[at : at + 3 if at >= BORDER else at + 1] += by
        trial[2:5], trial[9:BORDER] = np.maximum(trial[2:5], 0.5), np.maximum(trial[9:BORDER], 1e-6)
        # radiance has no natural least value
        trial[BORDER:] = np.maximum(trial[BORDER:], 0.0)
        return with_bounded_controls(trial)

    # the learning rate is halved after a round without progress
    here, rate = look(numbers), 1.0
    for _ in range(rounds):
        before = here
        for at, step in groups:
            probe = 0.25 * step * max(rate, 0.05)
            slope = (look(moved(at, probe)) - look(moved(at, -probe))) / (2.0 * probe)
            if slope == 0.0:
                continue
            # the gradient gives the sign, the number's step size and the rate give the length
            trial = moved(at, -np.sign(slope) * step * rate)
            there = look(trial)
            if there < here:
                numbers, here = trial, there
        if here > before * (1.0 - 1e-4):
            rate *= 0.5
            if rate < 1e-3:
                break
    return Descent(numbers, here, evaluations)


def window_with_margin(
    numbers: Floats, frame: Floats, size_px: tuple[int, int], margin: int = 6
) -> tuple[int, int, int, int]:
    """Return the window (left, top, width, height) of a Bezier ghost plus a margin; width 0 outside the image."""
    left, top, width, height = bezier_window(numbers, frame, *size_px)
    if not width:
        return 0, 0, 0, 0
    x0, y0 = max(left - margin, 0), max(top - margin, 0)
    return x0, y0, min(left + width + margin, size_px[0]) - x0, min(top + height + margin, size_px[1]) - y0


def circle(centre: float, radius: float, border: Floats, inner: Floats) -> Floats:
    """Return the numbers of a round ghost; handles of 0.5523 radii approximate a quarter circle to 2e-4."""
    k = 0.5523 * radius
    shape = [centre, 0.0, radius, radius, radius, k, k, k, k]
    return np.array([*shape, 0.15 * radius, 0.5 * radius, 1.0, 1.0, *border, *inner])
