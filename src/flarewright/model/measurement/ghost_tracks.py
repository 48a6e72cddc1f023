"""Ghost tracks: where each ghost appears, how it changes over the constellation, and where it disappears."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from ..base import Frozen

NotNegative = Annotated[float, Field(ge=0.0)]

State = Literal["seen", "faint", "hidden", "outside"]
Turning = Literal["range", "fade", "frame", "hidden"]


class Step(Frozen):
    """One ghost in one frame, relative to the prediction of the model.

    Attributes
    ----------
    constellation_deg : float
    state : {"seen", "faint", "hidden", "outside"}
        faint: the ghost should be visible and is not; hidden: not measurable under brighter ghosts, clipped light or
        noise; outside: the ghost lies outside the frame.
    inside : float
        Fraction of its bounding box that lies in the frame.
    brightness, brightness_error : float or None
        Factor; None when not measurable.
    along_px, along_error_px : float or None
        Displacement towards the light, pixels.
    size, size_error : float or None
        Factor.
    crossing : float
        Factor by which overlapping ghosts widen the error of its brightness; 1: no overlap.
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
    """The constellation at which a ghost appears or disappears.

    Attributes
    ----------
    constellation_deg, error_deg : float
    how : {"range", "fade", "frame", "hidden"}
        range: the captures begin or end; fade: its light fades in or out; frame: it crosses the frame's border;
        hidden: something covers it, so its true range can be longer.
    """

    constellation_deg: float
    error_deg: NotNegative
    how: Turning


class Life(Frozen):
    """One range in which a ghost is visible, from `birth` to `death`, both at rising constellations."""

    birth: Turn
    death: Turn


class GhostTrack(Frozen):
    """A ghost over all frames.

    Attributes
    ----------
    name : str
        As in the ghost model.
    lives : tuple of Life
        Empty when the ghost is never seen; several when it reappears.
    steps : tuple of Step
        By ascending constellation.
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
