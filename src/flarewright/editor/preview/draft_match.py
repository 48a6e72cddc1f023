"""Gains that match the light of drafts to that of final pictures, also at other field angles."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import log

import numpy as np

from ...model import Light
from ...typing import Floats
from .picture import DrawnPicture

Levels = tuple[tuple[float, tuple[str, ...]], ...]

# gains of a draft's ghosts: step, least and largest
# (a ghost hidden by a rim may appear during a drag, so its gain is never 0)
STEP, LEAST, MOST = 2.0**0.25, 2.0**-1.5, 2.0
EVEN = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class Node:
    """The ghosts of a lens at one field angle.

    Attributes
    ----------
    angle_deg : float
    parts : dict of str to float
        For each ghost in the draft: traced flux divided by draft flux.
    total : float
        Traced light of all ghosts divided by that of the draft's ghosts after these gains.
    """

    angle_deg: float
    parts: dict[str, float]
    total: float


@dataclass(frozen=True)
class DraftCalibration:
    """Nodes of one lens, sorted by angle, as arrays.

    Attributes
    ----------
    nodes : tuple of Node
    names : tuple of str, length N
    parts : ndarray, shape (A, N)
        Ghosts that are dark at an angle have interpolated gains.
    """

    nodes: tuple[Node, ...]
    names: tuple[str, ...]
    parts: Floats


@dataclass(frozen=True)
class Match:
    """Gains and exposure of a lens' pictures.

    Matrices ignore inner rims, so a draft's ghosts are too bright, and its few wavelengths shift its colours.

    Attributes
    ----------
    levels : tuple of (float, names)
        Gains of single ghosts, with ghosts of equal gain in one group.
    lights : tuple of Light
        Lights for which `levels` and `gain` were learned.
    calibration : DraftCalibration or None
        Gains at other field angles (`draft_calibration.levels_at`).
    gain : tuple of float
        Overall gain of a draft's ghosts, R, G, B.
    exposure_stops : float
        Determined for the lens, and constant while the light moves or the lens is edited.
    grey : float
        Gain of a picture with equal reflectances, whose brightness is arbitrary, for this exposure.
    """

    gain: tuple[float, float, float] = EVEN
    exposure_stops: float = 0.0
    grey: float = 1.0
    levels: Levels = ()
    lights: tuple[Light, ...] = ()
    calibration: DraftCalibration | None = None


def matched(draft: DrawnPicture | None, final: DrawnPicture, held: Match, levels: Levels | None = None) -> Match:
    """Compare a draft with the final picture of the same project.

    Parameters
    ----------
    draft : DrawnPicture or None
    final : DrawnPicture
    held : Match
        Present match; returned if there is nothing to compare.
    levels : Levels, optional
        Levels of the draft; None: those of `held`.
    """
    if draft is None or draft.project != final.project:
        return held
    ours, theirs = draft.ghost_light, final.ghost_light
    if min(ours.min(), theirs.min()) <= 0.0:
        return held
    red, green, blue = (float(gain) for gain in np.clip(theirs / ours, 0.02, 4.0))
    levels = held.levels if levels is None else levels
    return replace(held, gain=(red, green, blue), levels=levels, lights=final.project.lights)


def levels_of(drafted: Mapping[str, float], final: Mapping[str, float]) -> Levels:
    """Compare the flux of single ghosts in a draft and in the final picture of the same project.

    Parameters
    ----------
    drafted, final : mapping of str to float
        Flux by name; a missing ghost is dark.

    Returns
    -------
    Levels
        In steps of `STEP`; without ghosts of gain 1.
    """
    groups: dict[int, list[str]] = {}
    for name, flux in drafted.items():
        ratio = min(max(final.get(name, 0.0) / flux, LEAST), MOST) if flux > 0.0 else 1.0
        groups.setdefault(round(log(ratio, STEP)), []).append(name)
    return tuple((STEP**step, tuple(names)) for step, names in sorted(groups.items()) if step != 0)
