"""Settings of the screen that do not affect files."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from ...model.base import Frozen

Look = Literal["filmic", "srgb", "aces", "false-colour"]


class View(Frozen):
    """Settings of the viewport.

    Attributes
    ----------
    exposure_stops : float or None
        None: determined for each lens, and constant while the light moves or the lens is edited.
    found_stops : float or None
        The determined exposure, so that a resumed session looks the same.
    look : {"filmic", "srgb", "aces", "false-colour"}
    grey : bool
        All surfaces reflect alike, so that ghosts hidden by coatings are visible; drawn by matrices.
    unclipped : bool
        The first surface has no rim, so that ghosts hidden at this angle are visible; drawn by matrices.
    safe_frame : bool
    plate_shown : bool
        Whether the project's plate lies under the flare.
    plate_stops : float
        Exposure of the plate, and of a flare in its unit.
    """

    exposure_stops: float | None = Field(None, ge=-60.0, le=60.0)
    found_stops: float | None = None
    look: Look = "filmic"
    grey: bool = False
    unclipped: bool = False
    safe_frame: bool = False
    plate_shown: bool = True
    plate_stops: float = Field(0.0, ge=-30.0, le=30.0)

    @property
    def plain(self) -> bool:
        """Whether `render.image.display.view` has the look."""
        return self.look in ("srgb", "filmic")
