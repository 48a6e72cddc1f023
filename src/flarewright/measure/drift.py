"""How the light drifted from one constellation to the next, from the glow around its image and from the whole picture.

What lies right around the light's image is haze and the star's wings: in proportion to the light, and apart from it
only slowly changing with the constellation. So what neighbouring frames do not foretell of it is the light's own doing,
or that of a ghost that comes near the light. Half of all other pixels grow or fade by more than the light does, half by
less, but for what many ghosts do together. What both tell alike is the light's, and as far as they differ neither is
believed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..io.merged import read_frame
from ..model.capture import FrameInfo, MergedFrame, MergedRun
from .curves import spline_basis
from .views import all_known

Floats = NDArray[np.float64]

# the ring around the light that is looked at, parts of the picture's width, and at least these pixels
_RING, _LEAST_PX = (0.015, 0.06), (6.0, 14.0)
# directions, both ways, that are looked at apart: a ghost or the border spoils a few of them
_SECTORS, _LEAST_PIXELS = 8, 8
# slower changes than over so many degrees are the lens', not the light's
_SLOW_DEG = 6.0
# light over noise from which on a pixel of the whole picture counts, and which part of them must
_SEEN, _MOST_DARK = 5.0, 0.1
# a drift is believed when it is so many times its error, and corrected where it is known to this part
_SURE, _WORST = 2.0, 0.01
# fewer frames foretell nothing
_FEWEST = 6


@dataclass(frozen=True)
class _Ratio:
    """Light of a frame over that of the one before: logarithm and its standard error."""

    log: float
    error: float


def without_drift(folder: Path, run: MergedRun) -> MergedRun:
    """Tell every frame of a run its gain.

    Parameters
    ----------
    folder : Path
        Of the run, its frames written.
    run : MergedRun
        As yet without gains.

    Returns
    -------
    MergedRun
        With `FrameInfo.gain` where a drift is seen, and a remark about it.
    """
    gains: dict[str, tuple[float, float]] = {}
    for roll in dict.fromkeys(info.nominal_roll_deg for info in run.frames):
        line = [info for info in run.frames if info.nominal_roll_deg == roll and info.light_found]
        gains.update(_gains_of(folder, line, run.size_px[0]))
    if not gains:
        return run
    frames = tuple(
        info.replace(gain=gains[info.file][0], gain_error=gains[info.file][1]) if info.file in gains else info
        for info in run.frames
    )
    spread = float(np.std([gain for gain, _ in gains.values()]))
    told = (
        f"the light drifted by {spread:.2%} (standard deviation) from frame to frame, which is taken out; what changes "
        f"more slowly than over {_SLOW_DEG:g} degrees cannot be told from the lens"
    )
    out: MergedRun = run.replace(frames=frames, remarks=(*run.remarks, told))
    return out


def _gains_of(folder: Path, line: Sequence[FrameInfo], width: int) -> dict[str, tuple[float, float]]:
    if len(line) < _FEWEST:
        return {}
    near, whole = [_Ratio(0.0, 0.0)], [0.0]
    before: tuple[MergedFrame, tuple[Floats, Floats]] | None = None
    for info in line:
        frame = read_frame(folder, info)
        here = frame, _ring(frame, width)
        if before is not None:
            one, other = _ratio(before[1], here[1]), _whole_ratio(before[0], frame)
            if one is None or other is None:
                return {}
            near.append(one)
            whole.append(other)
        before = here
    angle = np.array([info.constellation_deg for info in line])
    logs = np.cumsum([[one.log for one in near], whole], axis=1).T
    knots = 2 + int((angle[-1] - angle[0]) / _SLOW_DEG)
    if len(line) < knots + 3:
        return {}
    basis = spline_basis(angle, (float(angle[0]), float(angle[-1])), knots)
    off = logs - basis @ np.linalg.lstsq(basis, logs, rcond=None)[0]
    drift, error = _both(off[:, 0], off[:, 1], float(np.median([one.error for one in near[1:]])))
    if error > _WORST or float(np.sqrt(np.mean(drift**2))) <= _SURE * error:
        return {}
    return {info.file: (float(np.exp(each)), error) for info, each in zip(line, drift, strict=True)}


def _both(one: Floats, other: Floats, error: float) -> tuple[Floats, float]:
    """Return what two series tell of a third, and its standard error; neither is known better than to `error`.

    Errors that have nothing to do with each other leave the mean product of both to what they share, and the rest of
    each one's squares to itself. So weighted, squares are least (Wiener).
    """
    shared = max(float(np.mean(one * other)), 0.0)
    if shared == 0.0:
        return np.zeros_like(one), 0.0
    own = [max(float(np.mean(each**2)) - shared, error**2, 1e-12) for each in (one, other)]
    known = 1.0 / shared + 1.0 / own[0] + 1.0 / own[1]
    return (one / own[0] + other / own[1]) / known, float(np.sqrt(1.0 / known))


def _whole_ratio(one: MergedFrame, other: MergedFrame) -> float | None:
    """Return the median of the logarithm by which pixels are brighter; None where too few are seen well."""
    seen = [
        np.isfinite(each.variance) & (each.radiance > _SEEN * np.sqrt(np.maximum(each.variance, 0.0)))
        for each in (one, other)
    ]
    both = seen[0] & seen[1]
    if np.count_nonzero(both) < _MOST_DARK * both.size:
        return None
    return float(np.median(np.log(other.radiance[both]) - np.log(one.radiance[both])))


def _ring(frame: MergedFrame, width: int) -> tuple[Floats, Floats]:
    """Return the pixels around the light, shifted to its middle, and their variances, shape (S, S, 3); NaN: unknown."""
    reach = int(np.ceil(max(_RING[1] * width, _LEAST_PX[1]))) + 1
    x, y = frame.light_px[0] - 0.5, frame.light_px[1] - 0.5
    left, top = int(np.floor(x)), int(np.floor(y))
    a, b = x - left, y - top
    light = np.where(np.isfinite(frame.variance), frame.radiance, np.nan)
    cut = np.full((2 * reach + 2, 2 * reach + 2, 3), np.nan)
    noise = cut.copy()
    height, wide = light.shape[:2]
    x0, x1 = max(left - reach, 0), min(left + reach + 2, wide)
    y0, y1 = max(top - reach, 0), min(top + reach + 2, height)
    if x0 < x1 and y0 < y1:
        here = (slice(y0 - top + reach, y1 - top + reach), slice(x0 - left + reach, x1 - left + reach))
        cut[here], noise[here] = light[y0:y1, x0:x1], frame.variance[y0:y1, x0:x1]
    weights = ((1 - a) * (1 - b), a * (1 - b), (1 - a) * b, a * b)
    parts = (np.s_[:-1, :-1], np.s_[:-1, 1:], np.s_[1:, :-1], np.s_[1:, 1:])
    shifted = sum(w * cut[part] for w, part in zip(weights, parts, strict=True))
    spread = sum(w * w * noise[part] for w, part in zip(weights, parts, strict=True))
    across = np.arange(-reach, reach + 1)
    away = np.hypot(across, across[:, None])
    inner, outer = max(_RING[0] * width, _LEAST_PX[0]), max(_RING[1] * width, _LEAST_PX[1])
    outside = (away < inner) | (away > outer)
    return np.where(outside[..., None], np.nan, shifted), np.where(outside[..., None], np.nan, spread)


def _ratio(one: tuple[Floats, Floats], other: tuple[Floats, Floats]) -> _Ratio | None:
    """Compare two rings sector by sector; opposite sectors count as one, so that an offset cancels."""
    half = one[0].shape[0] // 2
    across = np.arange(-half, half + 1)
    sector = np.floor((np.arctan2(across[:, None], across) % np.pi) / np.pi * _SECTORS).astype(int) % _SECTORS
    known = all_known(one[0]) & all_known(other[0])
    # only where the mirrored pixel is known too
    known = known & np.asarray(known)[::-1, ::-1]
    logs = []
    for k in range(_SECTORS):
        chosen = known & (sector == k)
        if np.count_nonzero(chosen) < _LEAST_PIXELS:
            continue
        a, b = float(one[0][chosen].sum()), float(other[0][chosen].sum())
        noise = float(one[1][chosen].sum()) + float(other[1][chosen].sum())
        if a > 0.0 and b > 0.0 and a * b > 25.0 * noise:
            logs.append(np.log(b / a))
    if len(logs) < _SECTORS // 2:
        return None
    return _Ratio(float(np.median(logs)), 1.25 * float(np.std(logs)) / float(np.sqrt(len(logs))))
