"""Follow sources over the frames of a plate, so that their light changes as smoothly as the plate does.

A threshold switches a flickering source on and off. Here a source counts by its brightest pixel: nothing at the
threshold, in full at a stop above it. The largest of these weights within some frames, smoothed over as many, is its
weight. So a source that flickers near the threshold stays, one that appears slowly fades in, and one that is switched
on far above the threshold is there at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.ndimage import maximum_filter1d, uniform_filter1d
from scipy.spatial import cKDTree

from ..typing import Floats
from .detection import LUMINANCE, Sources


@dataclass(frozen=True)
class SourceTrackSettings:
    """How sources of neighbouring frames are matched.

    Attributes
    ----------
    reach : float
        Largest distance between the predicted and the next place, in widths of the plate; the source's size adds.
    least_reach_px : float
        At least this far.
    light_weight, colour_weight : float
        Cost of a factor of e in brightness, and of a difference of 1 in the fraction of a channel, in reaches.
    largest_cost : float
        Above it two sources are different.
    longest_gap : int
        Frames after which an absent source is a new one.
    """

    reach: float = 0.02
    least_reach_px: float = 4.0
    light_weight: float = 0.25
    colour_weight: float = 1.0
    largest_cost: float = 1.6
    longest_gap: int = 4


@dataclass(frozen=True)
class Tracks:
    """Sources over time; T tracks, F frames.

    Attributes
    ----------
    frames : ndarray, shape (F,)
        Numbers of the frames, ascending.
    centre_px : ndarray, shape (T, F, 2)
        NaN where the source is absent.
    light : ndarray, shape (T, F, 3)
        0 where absent.
    moments_px2 : ndarray, shape (T, F, 3)
        NaN where absent.
    peak : ndarray, shape (T, F)
        0 where absent.
    """

    frames: Floats
    centre_px: Floats
    light: Floats
    moments_px2: Floats
    peak: Floats

    def __len__(self) -> int:
        """Return the number of tracks."""
        return len(self.peak)


def follow(
    frames: Sequence[int], found: Sequence[Sources], width_px: int, settings: SourceTrackSettings | None = None
) -> Tracks:
    """Match the sources of neighbouring frames.

    Parameters
    ----------
    frames : sequence of int
        Ascending.
    found : sequence of Sources
        One a frame.
    width_px : int
        Of the plate.
    settings : SourceTrackSettings, optional

    Returns
    -------
    Tracks
        In the order of their first frames.

    Notes
    -----
    Each source is expected where its last step leads. Pairs are accepted in the order of their costs, and equal costs
    in the order of the sources, so that the result is unique.
    """
    settings = settings or SourceTrackSettings()
    # the source of each track in each of its frames
    tracks: list[dict[int, int]] = []
    for k, sources in enumerate(found):
        recent = [t for t, track in enumerate(tracks) if k - next(reversed(track)) <= settings.longest_gap + 1]
        owner = np.full(len(sources), -1)
        for a, b in _pairs(found, [tracks[t] for t in recent], k, width_px, settings):
            owner[b] = recent[a]
        for new in np.flatnonzero(owner < 0):
            owner[new] = len(tracks)
            tracks.append({})
        for number, track in enumerate(owner):
            tracks[track][k] = number
    return _dense(frames, found, tracks)


def _pairs(
    found: Sequence[Sources], tracks: Sequence[dict[int, int]], k: int, width_px: int, settings: SourceTrackSettings
) -> list[tuple[int, int]]:
    """Return which tracks go on with which sources of frame `k`."""
    now = found[k]
    if not tracks or not len(now):
        return []
    last = [list(track.items())[-2:] for track in tracks]
    centre, light, size = (np.zeros((len(tracks), n)) for n in (2, 3, 1))
    for t, ends in enumerate(last):
        frame, number = ends[-1]
        before = found[frame]
        centre[t], light[t] = before.centre_px[number], before.light[number]
        size[t] = np.sqrt(before.moments_px2[number, 0] + before.moments_px2[number, 2])
        if len(ends) == 2:
            earlier = found[ends[0][0]].centre_px[ends[0][1]]
            centre[t] += (centre[t] - earlier) * (k - frame) / (frame - ends[0][0])
    reach = max(settings.reach * width_px, settings.least_reach_px) + size[:, 0]
    near = cKDTree(now.centre_px).query_ball_point(centre, reach)
    a = np.repeat(np.arange(len(tracks)), [len(each) for each in near])
    b = np.array([m for each in near for m in sorted(each)], dtype=np.int64)
    if not len(b):
        return []
    one, two = light[a], now.light[b]
    ratio = np.log((two @ LUMINANCE) / (one @ LUMINANCE))
    colour = np.abs(two / two.sum(axis=1)[:, None] - one / one.sum(axis=1)[:, None]).max(axis=1)
    cost = np.hypot(*(now.centre_px[b] - centre[a]).T) / reach[a]
    cost += settings.light_weight * np.abs(ratio) + settings.colour_weight * colour
    pairs: list[tuple[int, int]] = []
    used_a: set[int] = set()
    used_b: set[int] = set()
    for number in np.argsort(cost, kind="stable"):
        pair = int(a[number]), int(b[number])
        if cost[number] > settings.largest_cost:
            break
        if pair[0] not in used_a and pair[1] not in used_b:
            pairs.append(pair)
            used_a.add(pair[0])
            used_b.add(pair[1])
    return pairs


def _dense(frames: Sequence[int], found: Sequence[Sources], tracks: Sequence[dict[int, int]]) -> Tracks:
    shape = len(tracks), len(found)
    centre, moments = np.full((*shape, 2), np.nan), np.full((*shape, 3), np.nan)
    light, peak = np.zeros((*shape, 3)), np.zeros(shape)
    for t, track in enumerate(tracks):
        for k, number in track.items():
            centre[t, k], moments[t, k] = found[k].centre_px[number], found[k].moments_px2[number]
            light[t, k], peak[t, k] = found[k].light[number], found[k].peak[number]
    return Tracks(np.array(frames, dtype=np.float64), centre, light, moments, peak)


def steady(tracks: Tracks, threshold: float, knee_stops: float, fade: int) -> Tracks:
    """Weight the light of each track so that it does not flicker at the threshold.

    Parameters
    ----------
    tracks : Tracks
    threshold : float
        That of the detection.
    knee_stops : float
        Stops above the threshold from which a source counts in full.
    fade : int
        Frames. 0, or a single frame: the tracks as they are.

    Returns
    -------
    Tracks
        A source that is absent for at most `fade` frames, and near the threshold before or after, is interpolated.
    """
    if fade == 0 or tracks.peak.shape[1] == 1 or not len(tracks):
        return tracks
    with np.errstate(divide="ignore"):
        stops = np.log2(tracks.peak / threshold)
    counts = np.clip(stops / max(knee_stops, 1e-6), 0.0, 1.0)
    filled = _filled(tracks, counts, fade)
    wide = 2 * fade + 1
    weights = uniform_filter1d(maximum_filter1d(counts, wide, axis=1, mode="nearest"), wide, axis=1, mode="nearest")
    # sums of a running mean leave the range by rounding
    weights = np.clip(weights, 0.0, 1.0)
    return Tracks(filled.frames, filled.centre_px, filled.light * weights[..., None], filled.moments_px2, filled.peak)


def _filled(tracks: Tracks, counts: Floats, longest: int) -> Tracks:
    """Interpolate short absences of sources that are near the threshold at one end."""
    centre, light, moments, peak = (
        values.copy() for values in (tracks.centre_px, tracks.light, tracks.moments_px2, tracks.peak)
    )
    for t in range(len(tracks)):
        there = np.flatnonzero(tracks.peak[t] > 0.0)
        for a, b in pairwise(there):
            if not (1 < b - a <= longest + 1 and min(counts[t, a], counts[t, b]) < 1.0):
                continue
            part = (np.arange(a + 1, b) - a) / (b - a)
            for values in (centre, light, moments):
                values[t, a + 1 : b] = values[t, a] + part[:, None] * (values[t, b] - values[t, a])
            peak[t, a + 1 : b] = peak[t, a] + part * (peak[t, b] - peak[t, a])
    return Tracks(tracks.frames, centre, light, moments, peak)
