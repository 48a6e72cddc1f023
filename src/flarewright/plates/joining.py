"""Limit the lights of a frame: the brightest sources stay, the others are joined to a few.

A joined light has the sum, the centroid and the moments of its sources, so all light is kept. Which sources are joined
is decided for the whole sequence: no source changes its group between frames.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..typing import Floats, Indices, Mask
from .detection import LUMINANCE
from .tracking import Tracks


@dataclass(frozen=True)
class JoinedSourceSettings:
    """How many lights are joined ones.

    Attributes
    ----------
    joined_part : float
        Part of the lights that joined sources get, if there are more sources than lights.
    """

    joined_part: float = 0.5


def joined(tracks: Tracks, most_lights: int, settings: JoinedSourceSettings | None = None) -> tuple[Tracks, int, int]:
    """Join the faintest sources, so that no frame has more lights than allowed.

    Returns
    -------
    tracks : Tracks
        The single ones in their order, then the joined ones.
    sources, lights : int
        How many tracks were joined, and to how many, which come last.
    """
    bright = tracks.light @ LUMINANCE
    present = bright > 0.0
    if int(present.sum(axis=0).max(initial=0)) <= most_lights:
        return tracks, 0, 0
    groups = max(1, round(most_lights * (settings or JoinedSourceSettings()).joined_part))
    single = _singles(bright, present, most_lights - groups)
    others = np.flatnonzero(~single)
    weight = bright[others].sum(axis=1)
    centre = np.nansum(tracks.centre_px[others] * bright[others][..., None], axis=1) / weight[:, None]
    labels = _grouped(centre, weight, groups)
    kept = [_part(tracks, np.flatnonzero(single))]
    kept += [_sum(tracks, others[labels == group]) for group in range(labels.max() + 1)]
    return _concatenated(kept), len(others), len(kept) - 1


def _singles(bright: Floats, present: Mask, most: int) -> Mask:
    """Return the tracks that are among the brightest in each frame that has them; bright is bright at any time."""
    score = bright.max(axis=1)
    order = np.argsort(-score, kind="stable")
    # brighter tracks in the frame with the most of them
    before: Indices = np.cumsum(present[order], axis=0) - present[order]
    rank = np.where(present[order], before, 0).max(axis=1)
    single = np.zeros(len(bright), dtype=np.bool_)
    single[order[rank < most]] = True
    # tracks of no light stay out of the groups, whose centroids they would not change
    return np.asarray(single | (score <= 0.0))


def _grouped(places: Floats, weights: Floats, groups: int) -> Indices:
    """Divide places into groups: that with the largest moment is cut at its centroid until there are enough."""
    labels = np.zeros(len(places), dtype=np.intp)
    spread = [_spread(places, weights)]
    while len(spread) < min(groups, len(places)):
        widest = int(np.argmax([moment for moment, _, _ in spread]))
        moment, centre, axis = spread[widest]
        if moment <= 0.0:
            break
        mine = np.flatnonzero(labels == widest)
        beyond = mine[(places[mine] - centre) @ axis > 0.0]
        if not 0 < len(beyond) < len(mine):
            # all on one side by rounding: their light lies at one place
            spread[widest] = (0.0, centre, axis)
            continue
        labels[beyond] = len(spread)
        left = labels == widest
        spread[widest] = _spread(places[left], weights[left])
        spread.append(_spread(places[beyond], weights[beyond]))
    return labels


def _spread(places: Floats, weights: Floats) -> tuple[float, Floats, Floats]:
    """Return the largest second moment of places, their centroid, and the axis of the moment."""
    centre = weights @ places / weights.sum()
    off = places - centre
    values, axes = np.linalg.eigh((weights[:, None] * off).T @ off)
    return (float(values[1]) if len(places) > 1 else 0.0), centre, axes[:, 1]


def _part(tracks: Tracks, which: Indices) -> Tracks:
    return Tracks(
        tracks.frames, tracks.centre_px[which], tracks.light[which], tracks.moments_px2[which], tracks.peak[which]
    )


def _sum(tracks: Tracks, which: Indices) -> Tracks:
    """Return one track with the light, centroid and moments of several."""
    bright = tracks.light[which] @ LUMINANCE
    # absent sources have no place, and no weight
    centres, moments = np.nan_to_num(tracks.centre_px[which]), np.nan_to_num(tracks.moments_px2[which])
    total = bright.sum(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        centre = (centres * bright[..., None]).sum(axis=0) / total[:, None]
        off = centres - centre
        between = np.stack([off[..., 0] ** 2, off[..., 0] * off[..., 1], off[..., 1] ** 2], axis=-1)
        second = ((moments + between) * bright[..., None]).sum(axis=0) / total[:, None]
    light = tracks.light[which].sum(axis=0)
    return Tracks(tracks.frames, centre[None], light[None], second[None], tracks.peak[which].max(axis=0)[None])


def _concatenated(parts: list[Tracks]) -> Tracks:
    return Tracks(
        parts[0].frames,
        np.concatenate([part.centre_px for part in parts]),
        np.concatenate([part.light for part in parts]),
        np.concatenate([part.moments_px2 for part in parts]),
        np.concatenate([part.peak for part in parts]),
    )
