"""What a person tells the search for ghosts."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from .base import Frozen


class Pointed(Frozen):
    """A ghost that a person sees in one frame.

    Attributes
    ----------
    constellation_deg : float
        Of that frame.
    centre_px : tuple of float
        (x, y) of its middle.
    radius_px : float
    """

    constellation_deg: float
    centre_px: tuple[float, float]
    radius_px: float = Field(gt=0.0)


class Corrections(Frozen):
    """Ghosts to look for first, and found ones to leave out.

    Attributes
    ----------
    schema_version : 1
    add : tuple of Pointed
        They are still judged by all constellations.
    remove : tuple of str
        Names of found ghosts.
    """

    schema_version: Literal[1] = 1
    add: tuple[Pointed, ...] = ()
    remove: tuple[str, ...] = ()
