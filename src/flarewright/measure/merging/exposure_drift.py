"""Measure the drift of the light source between constellations, from the glow around its image and the whole picture.

The surroundings of the light's image are haze and the star's wings. They are proportional to the light and otherwise
change slowly with the constellation. Deviations from the neighbouring frames are therefore drift, or a ghost that comes
close. The median change of all other pixels is drift as well, apart from common changes of many ghosts. The part that
both estimates share is the drift; where they differ, neither is used.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...io.measurement.merged import read_frame
from ...model.measurement.capture import FrameInfo, MergedFrame, MergedRun
from ...typing import Floats
from ..core.pose_curves import spline_basis
from ..core.views import all_finite
from .settings import DriftSettings


@dataclass(frozen=True)
class _Ratio:
    """Light of a frame over that of the frame before: logarithm and its standard error."""

    log: float
    error: float


def with_drift_gains(folder: Path, run: MergedRun, settings: DriftSettings = DriftSettings()) -> MergedRun:
    """Add the gain of each frame to a run.

    Parameters
    ----------
    folder : Path
        Folder of the run with its frames.
    run : MergedRun
        Without gains.
    settings : DriftSettings

    Returns
    -------
    MergedRun
        With `FrameInfo.gain` where a drift is detected, and a remark about it.
    """
    gains: dict[str, tuple[float, float]] = {}
    for roll in dict.fromkeys(info.nominal_roll_deg for info in run.frames):
        line = [info for info in run.frames if info.nominal_roll_deg == roll and info.light_found]
        gains.update(_gains_of(folder, line, run.size_px[0], settings))
    if not gains:
        return run
    frames = tuple(
        info.replace(gain=gains[info.file][0], gain_error=gains[info.file][1]) if info.file in gains else info
        for info in run.frames
    )
    spread = float(np.std([gain for gain, _ in gains.values()]))
    remark = (
        f"the light drifted by {spread:.2%} (standard deviation) from frame to frame, which is corrected; changes "
        f"slower than over {settings.slow_deg:g} degrees are attributed to the lens"
    )
    return run.replace(frames=frames, remarks=(*run.remarks, remark))


def _gains_of(
    folder: Path, line: Sequence[FrameInfo], width: int, settings: DriftSettings
) -> dict[str, tuple[float, float]]:
    if len(line) < settings.least_frames:
        return {}
    near, whole = [_Ratio(0.0, 0.0)], [0.0]
    before: tuple[MergedFrame, tuple[Floats, Floats]] | None = None
    for info in line:
        frame = read_frame(folder, info)
        here = frame, _ring(frame, width, settings)
        if before is not None:
            one, other = _ratio(before[1], here[1], settings), _whole_ratio(before[0], frame, settings)
            if one is None or other is None:
                return {}
            near.append(one)
            whole.append(other)
        before = here
    angle = np.array([info.constellation_deg for info in line])
    logs = np.cumsum([[one.log for one in near], whole], axis=1).T
    knots = 2 + int((angle[-1] - angle[0]) / settings.slow_deg)
    if len(line) < knots + 3:
        return {}
    basis = spline_basis(angle, (float(angle[0]), float(angle[-1])), knots)
    off = logs - basis @ np.linalg.lstsq(basis, logs, rcond=None)[0]
    drift, error = _common_part(off[:, 0], off[:, 1], float(np.median([one.error for one in near[1:]])))
    if error > settings.most_error or float(np.sqrt(np.mean(drift**2))) <= settings.least_sigmas * error:
        return {}
    return {info.file: (float(np.exp(each)), error) for info, each in zip(line, drift, strict=True)}


def _common_part(one: Floats, other: Floats, error: float) -> tuple[Floats, float]:
    """Estimate the common part of two series, and its standard error, assuming at least `error` for each.

    With independent errors the mean product of both is the power of the common part, and the excess of each one's
    squares is its error. These weights give the least squared error (Wiener).
    """
    shared = max(float(np.mean(one * other)), 0.0)
    if shared == 0.0:
        return np.zeros_like(one), 0.0
    own = [max(float(np.mean(each**2)) - shared, error**2, 1e-12) for each in (one, other)]
    known = 1.0 / shared + 1.0 / own[0] + 1.0 / own[1]
    return (one / own[0] + other / own[1]) / known, float(np.sqrt(1.0 / known))


def _whole_ratio(one: MergedFrame, other: MergedFrame, settings: DriftSettings) -> float | None:
    """Return the median logarithm of the brightness ratio of pixels; None when too few are above the noise."""
    seen = [
        np.isfinite(each.variance) & (each.radiance > settings.least_snr * np.sqrt(np.maximum(each.variance, 0.0)))
        for each in (one, other)
    ]
    both = seen[0] & seen[1]
    if np.count_nonzero(both) < settings.least_bright * both.size:
        return None
    return float(np.median(np.log(other.radiance[both]) - np.log(one.radiance[both])))


def _ring(frame: MergedFrame, width: int, settings: DriftSettings) -> tuple[Floats, Floats]:
    """Return the pixels around the light, shifted to its centre, and their variances, shape (S, S, 3); NaN: unknown."""
    reach = int(np.ceil(max(settings.ring[1] * width, settings.least_px[1]))) + 1
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
    inner, outer = (max(part * width, least) for part, least in zip(settings.ring, settings.least_px, strict=True))
    outside = (away < inner) | (away > outer)
    return np.where(outside[..., None], np.nan, shifted), np.where(outside[..., None], np.nan, spread)


def _ratio(one: tuple[Floats, Floats], other: tuple[Floats, Floats], settings: DriftSettings) -> _Ratio | None:
    """Compare two rings sector by sector; opposite sectors are summed, so that an offset cancels."""
    half = one[0].shape[0] // 2
    across = np.arange(-half, half + 1)
    count = settings.sectors
    sector = np.floor((np.arctan2(across[:, None], across) % np.pi) / np.pi * count).astype(int) % count
    known = all_finite(one[0]) & all_finite(other[0])
    # require the mirrored pixel too
    known = known & np.asarray(known)[::-1, ::-1]
    logs = []
    for k in range(settings.sectors):
        chosen = known & (sector == k)
        if np.count_nonzero(chosen) < settings.least_pixels:
            continue
        a, b = float(one[0][chosen].sum()), float(other[0][chosen].sum())
        noise = float(one[1][chosen].sum()) + float(other[1][chosen].sum())
        if a > 0.0 and b > 0.0 and a * b > 25.0 * noise:
            logs.append(np.log(b / a))
    if len(logs) < settings.sectors // 2:
        return None
    return _Ratio(float(np.median(logs)), 1.25 * float(np.std(logs)) / float(np.sqrt(len(logs))))
