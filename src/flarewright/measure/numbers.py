"""A model's ghosts as the arrays that kernels take, and back."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from typing import cast

import numpy as np
from numpy.typing import NDArray

from ..kernels.measure_pupil import (
    BELOW,
    BELOW_NUMBERS,
    BLADES,
    DISC_NUMBERS,
    FIRST_DISC,
    FIRST_G,
    FIRST_I,
    LATERAL,
    LEAST_BELOW,
    SOFT,
    TURN,
)
from ..model.ghost_model import AberrationGhost, BezierGhost, Blades, Channel, Disc, GhostModel, Ten

Floats = NDArray[np.float64]

# of lateral colour's numbers these are written where the others are not needed
_FEW_LATERAL = 2
NUMBERS = BELOW + BELOW_NUMBERS
# farthest control points of a Bezier ghost, times its extent and height; a circle's are at 0.55
MOST_CONTROL = 1.5


def channel_numbers(channel: Channel, blades: Blades | None) -> Floats:
    """Return the numbers of one colour of a ghost, shape (53,), discs and blades that are not there 0."""
    numbers = np.zeros(NUMBERS)
    numbers[:FIRST_G], numbers[FIRST_G:FIRST_I], numbers[FIRST_I:FIRST_DISC] = channel.f, channel.g, channel.intensity
    for k, disc in enumerate(channel.discs):
        at = FIRST_DISC + DISC_NUMBERS * k
        numbers[at : at + DISC_NUMBERS] = *disc.centre, disc.radius
    numbers[SOFT] = channel.soft_px**2
    numbers[LATERAL : LATERAL + len(channel.lateral_px)] = channel.lateral_px
    numbers[BELOW:] = channel.below
    return with_blades(numbers, blades)


def with_blades(numbers: Floats, blades: Blades | None) -> Floats:
    """Return numbers with other blades, or a round rim."""
    out = numbers.copy()
    out[BLADES] = 0.0 if blades is None else blades.count
    out[TURN] = 0.0 if blades is None else np.radians(blades.first_deg)
    return out


def blades_of(numbers: Floats) -> Blades | None:
    """Return the blades that numbers, shape (53,), tell of."""
    if not numbers[BLADES]:
        return None
    return Blades(count=int(numbers[BLADES]), first_deg=round(float(np.degrees(numbers[TURN])), 6))


def channel_of(numbers: Floats, discs: int, uncertainty: Floats | None = None) -> Channel:
    """Return the colour that has these numbers.

    Parameters
    ----------
    numbers : ndarray, shape (53,)
    discs : int
        How many of its discs are there.
    uncertainty : ndarray, shape (53,), or None
    """
    end = FIRST_DISC + DISC_NUMBERS * discs
    ten = [cast(Ten, tuple(map(float, numbers[at : at + FIRST_G]))) for at in (0, FIRST_G, FIRST_I)]
    cuts = numbers[FIRST_DISC:end].reshape(discs, DISC_NUMBERS)
    soft = float(np.sqrt(max(numbers[SOFT], 0.0)))
    told = () if uncertainty is None else tuple(map(float, uncertainty[:end]))
    if uncertainty is not None and uncertainty[SOFT:].any():
        # of a root; of one that is 0, as large as would be seen
        most = max(soft, float(np.sqrt(uncertainty[SOFT])), 1e-300)
        told += (float(uncertainty[SOFT]) / (2.0 * most),)
        every = uncertainty[BELOW:].any()
        told += tuple(map(float, uncertainty[LATERAL : NUMBERS if every else _written(uncertainty, LATERAL)]))
    return Channel(
        f=ten[0], g=ten[1], intensity=ten[2],
        discs=tuple(Disc(centre=(float(cut[0]), float(cut[1])), radius=float(cut[2])) for cut in cuts),
        soft_px=soft, uncertainty=told,
        lateral_px=tuple(map(float, numbers[LATERAL : _written(numbers, LATERAL + _FEW_LATERAL)])),
        below=cast(tuple[float, float], tuple(map(float, numbers[BELOW:]))),
    )  # fmt: skip


def channel_deviation(channel: Channel) -> Floats:
    """Return the standard deviation of each number of one colour, shape (53,); 0 for one that was not fitted or told.

    In the place of softness, which is a variance, stands that of `soft_px`.
    """
    deviation, told = np.zeros(NUMBERS), np.array(channel.uncertainty)
    # softness and what follows it stand behind discs that are not there
    discs = min(FIRST_DISC + DISC_NUMBERS * len(channel.discs), told.size)
    deviation[:discs] = told[:discs]
    deviation[SOFT : SOFT + told.size - discs] = told[discs:]
    return deviation


def _written(numbers: Floats, least: int) -> int:
    """Return where the numbers of lateral colour that are written end: f' and g', or all; no earlier than `least`."""
    few = LATERAL + _FEW_LATERAL
    if numbers[few:BELOW].any():
        return BELOW
    return few if numbers[LATERAL:few].any() else least


def away_from_axis(span_deg: tuple[float, float]) -> tuple[float, float]:
    """Return between which angles from the axis a range of constellations lies; it may reach over the axis."""
    low, high = span_deg
    return max(low, -high, 0.0), max(abs(low), abs(high))


def bezier_numbers(ghost: BezierGhost, constellation_deg: float) -> Floats:
    """Return a Bezier ghost's 19 numbers at a constellation: on both sides of the axis the same."""
    low, high = away_from_axis(ghost.visible_deg)
    half = 0.5 * (high - low) or 1.0
    z = (abs(constellation_deg) - 0.5 * (low + high)) / half
    # NumPy takes ten times as long for a few numbers
    numbers = [reduce(lambda value, one: value * z + one, reversed(row), 0.0) for row in ghost.numbers]
    # what a polynomial may not bring below 0: height, falloffs, exponents, levels
    for k in (2, *range(9, 19)):
        numbers[k] = max(numbers[k], 0.0)
    return with_bounded_controls(np.array(numbers))


def with_bounded_controls(numbers: Floats) -> Floats:
    """Return a Bezier ghost's numbers with control points that bend its border no sharper than a drawing can follow.

    Parameters
    ----------
    numbers : ndarray, shape (19,)

    Returns
    -------
    ndarray, shape (19,)
        Control points at most `MOST_CONTROL` times as far along as the extent and across as the height, none behind.
    """
    out = numbers.copy()
    _, height, left, right = numbers[1:5]
    for at, side in ((5, left), (6, height), (7, right), (8, height)):
        out[at] = min(max(out[at], 0.0), MOST_CONTROL * max(side, 0.0))
    return out


def ten_terms(u: Floats, v: Floats, w: Floats) -> Floats:
    """Return the terms of a ghost's polynomials, shape (10, N), in the order of its numbers; see `measure_pupil`."""
    return np.stack([np.ones_like(u), u, v, w, u * u, u * v, v * v, u * w, v * w, w * w])


def divided_by(b: float, c: float, v: Floats, w: Floats) -> Floats:
    """Return what a ghost's place and size are divided by where v and w are these; see `measure_pupil`."""
    return np.maximum(1.0 + b * v + c * w, LEAST_BELOW)


def field(constellation_deg: float, largest_deg: float) -> float:
    """Return the length of the field s, with the constellation's sign."""
    return float(np.tan(np.radians(constellation_deg)) / np.tan(np.radians(largest_deg)))


def frame(axis_px: tuple[float, float], roll_deg: float, constellation_deg: float, scale: float) -> Floats:
    """Return axis, direction of the light and scale as kernels take them, shape (5,).

    A negative constellation is a positive one on the other side.
    """
    turn = np.radians(roll_deg + (180.0 if constellation_deg < 0.0 else 0.0))
    return np.array([axis_px[0] * scale, axis_px[1] * scale, np.cos(turn), np.sin(turn), scale])


def fit_in(model: GhostModel, size_px: tuple[int, int]) -> tuple[float, float]:
    """Return a picture's pixels per pixel of a model, and by how many rows it is shifted to keep its middle."""
    scale = size_px[0] / model.size_px[0]
    return scale, 0.5 * (size_px[1] - scale * model.size_px[1])


def frame_in(model: GhostModel, constellation_deg: float, roll_deg: float, size_px: tuple[int, int]) -> Floats:
    """Return `frame` of a model's flare in a picture of another size."""
    scale, top = fit_in(model, size_px)
    placed = frame(model.axis_px, roll_deg, constellation_deg, scale)
    placed[1] += top
    return placed


def visible(ghosts: Sequence[AberrationGhost | BezierGhost], constellation_deg: float) -> Floats:
    """Return which part of each ghost's light is there at a constellation, shape (G,): 1 or 0, between at its ends."""
    return np.array([
        _risen(constellation_deg - ghost.visible_deg[0], ghost.fade_deg[0])
        * _risen(ghost.visible_deg[1] - constellation_deg, ghost.fade_deg[1])
        for ghost in ghosts
    ])  # fmt: skip


def _risen(beyond: float, fade: float) -> float:
    if fade == 0.0:
        return 1.0 if beyond >= 0.0 else 0.0
    return min(max(beyond / fade + 0.5, 0.0), 1.0)
