"""Convert the ghosts of a model to the arrays that kernels take, and back."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from typing import cast

import numpy as np

from ...kernels.ghost_model.pupil_mesh import (
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
from ...model.measurement.ghost_model import AberrationGhost, BezierGhost, Blades, Channel, Disc, GhostModel, Ten
from ...typing import Floats

# a channel stores only the first parameters of lateral colour when the others are 0
_FEW_LATERAL = 2
NUMBERS = BELOW + BELOW_NUMBERS
# largest distance of the control points of a Bezier ghost over its extent and height; those of a circle are at 0.55
MOST_CONTROL = 1.5


def channel_numbers(channel: Channel, blades: Blades | None) -> Floats:
    """Return the parameters of one colour of a ghost, shape (53,); 0 for absent discs and blades."""
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
    """Return parameters with other iris blades; None: with a round rim."""
    out = numbers.copy()
    out[BLADES] = 0.0 if blades is None else blades.count
    out[TURN] = 0.0 if blades is None else np.radians(blades.first_deg)
    return out


def blades_of(numbers: Floats) -> Blades | None:
    """Return the iris blades in a parameter vector, shape (53,); None for a round rim."""
    if not numbers[BLADES]:
        return None
    return Blades(count=int(numbers[BLADES]), first_deg=round(float(np.degrees(numbers[TURN])), 6))


def channel_of(numbers: Floats, discs: int, uncertainty: Floats | None = None) -> Channel:
    """Return the channel with these parameters.

    Parameters
    ----------
    numbers : ndarray, shape (53,)
    discs : int
        Number of discs.
    uncertainty : ndarray, shape (53,), or None
    """
    end = FIRST_DISC + DISC_NUMBERS * discs
    ten = [cast(Ten, tuple(map(float, numbers[at : at + FIRST_G]))) for at in (0, FIRST_G, FIRST_I)]
    cuts = numbers[FIRST_DISC:end].reshape(discs, DISC_NUMBERS)
    soft = float(np.sqrt(max(numbers[SOFT], 0.0)))
    errors = () if uncertainty is None else tuple(map(float, uncertainty[:end]))
    if uncertainty is not None and uncertainty[SOFT:].any():
        # softness is stored as a variance: propagate its error to the root, and to the error of the root at 0
        most = max(soft, float(np.sqrt(uncertainty[SOFT])), 1e-300)
        errors += (float(uncertainty[SOFT]) / (2.0 * most),)
        every = uncertainty[BELOW:].any()
        errors += tuple(map(float, uncertainty[LATERAL : NUMBERS if every else _lateral_end(uncertainty, LATERAL)]))
    return Channel(
        f=ten[0], g=ten[1], intensity=ten[2],
        discs=tuple(Disc(centre=(float(cut[0]), float(cut[1])), radius=float(cut[2])) for cut in cuts),
        soft_px=soft, uncertainty=errors,
        lateral_px=tuple(map(float, numbers[LATERAL : _lateral_end(numbers, LATERAL + _FEW_LATERAL)])),
        below=cast(tuple[float, float], tuple(map(float, numbers[BELOW:]))),
    )  # fmt: skip


def channel_deviation(channel: Channel) -> Floats:
    """Return the standard deviation of each parameter of one colour, shape (53,); 0 for one not fitted or not stored.

    The entry of softness, whose parameter is a variance, is the standard deviation of `soft_px`.
    """
    deviation, errors = np.zeros(NUMBERS), np.array(channel.uncertainty)
    # a channel omits absent discs: softness and the later parameters follow its last disc
    discs = min(FIRST_DISC + DISC_NUMBERS * len(channel.discs), errors.size)
    deviation[:discs] = errors[:discs]
    deviation[SOFT : SOFT + errors.size - discs] = errors[discs:]
    return deviation


def _lateral_end(numbers: Floats, least: int) -> int:
    """Return the end of the stored parameters of lateral colour: after f' and g', or after all; at least `least`."""
    few = LATERAL + _FEW_LATERAL
    if numbers[few:BELOW].any():
        return BELOW
    return few if numbers[LATERAL:few].any() else least


def away_from_axis(span_deg: tuple[float, float]) -> tuple[float, float]:
    """Return the least and the largest angle from the axis in a range of constellations, which may cross the axis."""
    low, high = span_deg
    return max(low, -high, 0.0), max(abs(low), abs(high))


def bezier_numbers(ghost: BezierGhost, constellation_deg: float) -> Floats:
    """Return the 19 parameters of a Bezier ghost at a constellation; both sides of the axis are equal."""
    low, high = away_from_axis(ghost.visible_deg)
    half = 0.5 * (high - low) or 1.0
    z = (abs(constellation_deg) - 0.5 * (low + high)) / half
    # plain Python: NumPy takes ten times as long for a few numbers
    numbers = [reduce(lambda value, one: value * z + one, reversed(row), 0.0) for row in ghost.numbers]
    # height, falloffs, exponents and levels must stay at or above 0
    for k in (2, *range(9, 19)):
        numbers[k] = max(numbers[k], 0.0)
    return with_bounded_controls(np.array(numbers))


def with_bounded_controls(numbers: Floats) -> Floats:
    """Return the parameters of a Bezier ghost with control points limited to borders that the raster can follow.

    Parameters
    ----------
    numbers : ndarray, shape (19,)

    Returns
    -------
    ndarray, shape (19,)
        Control points at 0 to `MOST_CONTROL` times the extent (along the axis) and the height (across it).
    """
    out = numbers.copy()
    _, height, left, right = numbers[1:5]
    for at, side in ((5, left), (6, height), (7, right), (8, height)):
        out[at] = min(max(out[at], 0.0), MOST_CONTROL * max(side, 0.0))
    return out


def ten_terms(u: Floats, v: Floats, w: Floats) -> Floats:
    """Return the ten terms of the ghost polynomials, shape (10, N), in parameter order; see `pupil_mesh`."""
    return np.stack([np.ones_like(u), u, v, w, u * u, u * v, v * v, u * w, v * w, w * w])


def denominator(b: float, c: float, v: Floats, w: Floats) -> Floats:
    """Return the denominator of a ghost's position and size at v and w; see `kernels.ghost_model.pupil_mesh`."""
    return np.maximum(1.0 + b * v + c * w, LEAST_BELOW)


def field(constellation_deg: float, largest_deg: float) -> float:
    """Return the normalized field s, with the sign of the constellation; 1 at the largest constellation."""
    return float(np.tan(np.radians(constellation_deg)) / np.tan(np.radians(largest_deg)))


def frame(axis_px: tuple[float, float], roll_deg: float, constellation_deg: float, scale: float) -> Floats:
    """Return axis, direction of the light and scale as kernels take them, shape (5,).

    A negative constellation is a positive one with the direction reversed.
    """
    turn = np.radians(roll_deg + (180.0 if constellation_deg < 0.0 else 0.0))
    return np.array([axis_px[0] * scale, axis_px[1] * scale, np.cos(turn), np.sin(turn), scale])


def fit_in(model: GhostModel, size_px: tuple[int, int]) -> tuple[float, float]:
    """Return the pixels of a picture per pixel of a model, and the row shift that keeps the model centred."""
    scale = size_px[0] / model.size_px[0]
    return scale, 0.5 * (size_px[1] - scale * model.size_px[1])


def frame_in(model: GhostModel, constellation_deg: float, roll_deg: float, size_px: tuple[int, int]) -> Floats:
    """Return `frame` for a model that is drawn into a picture of another size."""
    scale, top = fit_in(model, size_px)
    placed = frame(model.axis_px, roll_deg, constellation_deg, scale)
    placed[1] += top
    return placed


def visible(ghosts: Sequence[AberrationGhost | BezierGhost], constellation_deg: float) -> Floats:
    """Return the visible fraction of each ghost at a constellation, shape (G,): 0 to 1, linear where it fades."""
    return np.array([
        _faded(constellation_deg - ghost.visible_deg[0], ghost.fade_deg[0])
        * _faded(ghost.visible_deg[1] - constellation_deg, ghost.fade_deg[1])
        for ghost in ghosts
    ])  # fmt: skip


def _faded(beyond: float, fade: float) -> float:
    if fade == 0.0:
        return 1.0 if beyond >= 0.0 else 0.0
    return min(max(beyond / fade + 0.5, 0.0), 1.0)
