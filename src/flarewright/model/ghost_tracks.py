"""Ghosts followed from constellation to constellation: when each is born, what it does, and when it dies."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from .base import Frozen

NotNegative = Annotated[float, Field(ge=0.0)]

State = Literal["seen", "faint", "hidden", "outside"]
Turning = Literal["range", "fade", "frame", "hidden"]


class Step(Frozen):
    """One ghost in one frame, against what the model's one set of numbers foretells there.

    Attributes
    ----------
    constellation_deg : float
    state : {"seen", "faint", "hidden", "outside"}
        faint: it would show and does not; hidden: nobody can tell, for it lies under brighter ghosts, clipped light or
        noise; outside: the frame's border leaves nothing of it.
    inside : float
        Part of the box around it that lies in the frame.
    brightness, brightness_error : float or None
        Factor; None when nothing tells.
    along_px, along_error_px : float or None
        Pixels towards the light.
    size, size_error : float or None
        Factor.
    crossing : float
        By which factor the other ghosts that lie over it widen the error of its brightness; 1: it stands alone.
    """

    constellation_deg: float
    state: State
    inside: float = Field(ge=0.0, le=1.0)
    brightness: float | None = None
    brightness_error: NotNegative | None = None
    along_px: float | None = None
    along_error_px: NotNegative | None = None
    size: float | None = None
    size_error: NotNegative | None = None
    crossing: float = Field(1.0, ge=1.0)


class Turn(Frozen):
    """A birth or a death.

    Attributes
    ----------
    constellation_deg, error_deg : float
    how : {"range", "fade", "frame", "hidden"}
        range: the captures begin or end; fade: its light comes or goes; frame: it comes or goes through the border;
        hidden: something lies over it, so it may well have lived longer.
    """

    constellation_deg: float
    error_deg: NotNegative
    how: Turning


class Life(Frozen):
    """From a birth to a death, both at rising constellations."""

    birth: Turn
    death: Turn


class GhostTrack(Frozen):
    """A ghost over all frames.

    Attributes
    ----------
    name : str
        As in the ghost model.
    lives : tuple of Life
        None when it is never seen; several when it comes again.
    steps : tuple of Step
        By rising constellation.
    """

    name: str
    lives: tuple[Life, ...]
    steps: tuple[Step, ...]


class Tracks(Frozen):
    """All ghosts of a model: `tracks.json`."""

    schema_version: Literal[1] = 1
    ghosts: tuple[GhostTrack, ...]

    @model_validator(mode="after")
    def _names(self) -> Tracks:
        names = [ghost.name for ghost in self.ghosts]
        if len(set(names)) != len(names):
            raise ValueError("two tracks have the same name")
        return self
