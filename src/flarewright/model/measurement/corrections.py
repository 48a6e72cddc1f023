"""The user's corrections of the ghost search: ghosts to add and to remove."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from ..base import Frozen


class MarkedGhost(Frozen):
    """A ghost that the user marked in one frame.

    Attributes
    ----------
    constellation_deg : float
        Constellation of that frame.
    centre_px : tuple of float
        (x, y) of the ghost's centre.
    radius_px : float
    """

    constellation_deg: float
    centre_px: tuple[float, float]
    radius_px: float = Field(gt=0.0)


class Corrections(Frozen):
    """Ghosts to search first, and detected ghosts to leave out.

    Attributes
    ----------
    schema_version : 1
    add : tuple of MarkedGhost
        Marked ghosts; the fit still tests them against all constellations.
    remove : tuple of str
        Names of detected ghosts.
    """

    schema_version: Literal[1] = 1
    add: tuple[MarkedGhost, ...] = ()
    remove: tuple[str, ...] = ()
