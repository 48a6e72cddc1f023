"""What gives drafts the light of final pictures, and what is known of it at other field angles."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import log

import numpy as np
from numpy.typing import NDArray

from ..model import Light
from .picture import Picture

Floats = NDArray[np.float64]
Levels = tuple[tuple[float, tuple[str, ...]], ...]

# gains of a draft's ghosts: their step, the least and the largest
# (one that a rim hides now may come out as the hand goes on, so it is never dimmed altogether)
STEP, LEAST, MOST = 2.0**0.25, 2.0**-1.5, 2.0
EVEN = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class Rung:
    """The ghosts of a lens at one field angle.

    Attributes
    ----------
    angle_deg : float
    parts : dict of str to float
        Of each ghost that matrices light up: its traced flux by its drafted one.
    total : float
        Traced light of all ghosts by that of all drafted ones that are multiplied so.
    """

    angle_deg: float
    parts: dict[str, float]
    total: float


@dataclass(frozen=True)
class Ladder:
    """Rungs of one lens by angle, as arrays.

    Attributes
    ----------
    rungs : tuple of Rung
    names : tuple of str, length N
    parts : ndarray, shape (A, N)
        What is dark at an angle takes what its neighbours have.
    """

    rungs: tuple[Rung, ...]
    names: tuple[str, ...]
    parts: Floats


@dataclass(frozen=True)
class Match:
    """What gives drafts the light of final pictures.

    Matrices know no inner rims, so a draft's ghosts are too bright, and its few wavelengths shift its colours.

    Attributes
    ----------
    levels : tuple of (float, names)
        Gains of single ghosts, alike ones together.
    lights : tuple of Light
        Where `levels` and `gain` were learned.
    ladder : Ladder or None
        What is known of other places (`ladder.levels_at`).
    gain : tuple of float
        Of a draft's ghosts, R, G, B.
    exposure_stops : float
        Found for the lens, and held while the light moves or the lens is edited.
    grey : float
        Of a grey picture, whose brightness means nothing, so that it is seen at this exposure.
    """

    gain: tuple[float, float, float] = EVEN
    exposure_stops: float = 0.0
    grey: float = 1.0
    levels: Levels = ()
    lights: tuple[Light, ...] = ()
    ladder: Ladder | None = None


def matched(draft: Picture | None, final: Picture, held: Match, levels: Levels | None = None) -> Match:
    """Compare a draft with the final picture of the same project.

    Parameters
    ----------
    draft : Picture or None
    final : Picture
    held : Match
        What holds until now; kept where there is nothing to compare.
    levels : Levels, optional
        That the draft was drawn with; None: those that hold.

    Returns
    -------
    Match
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
    """Compare the light of single ghosts in a draft and in the final picture of the same project.

    Parameters
    ----------
    drafted, final : mapping of str to float
        Flux by name; a ghost that is missing is dark.

    Returns
    -------
    Levels
        In steps of `STEP`; ghosts that need no gain are left out.
    """
    groups: dict[int, list[str]] = {}
    for name, flux in drafted.items():
        ratio = min(max(final.get(name, 0.0) / flux, LEAST), MOST) if flux > 0.0 else 1.0
        groups.setdefault(round(log(ratio, STEP)), []).append(name)
    return tuple((STEP**step, tuple(names)) for step, names in sorted(groups.items()) if step != 0)
