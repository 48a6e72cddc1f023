"""How a picture is shown: settings of the screen that no file's pixels depend on."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from ..model.base import Frozen

Look = Literal["filmic", "srgb", "aces", "false-colour"]


class View(Frozen):
    """Settings of the viewport.

    Attributes
    ----------
    exposure_stops : float or None
        None: found for each lens, and held while the light moves or the lens is edited.
    found_stops : float or None
        What was found, so that a session that goes on looks as it did.
    look : {"filmic", "srgb", "aces", "false-colour"}
    grey : bool
        Every ghost reflects alike, so that those which coatings hide are seen; drawn by matrices.
    unclipped : bool
        The first surface has no rim, so that ghosts hidden at this angle are seen; drawn by matrices.
    safe_frame : bool
    plate : str or None
        Path of a background picture.
    plate_stops : float
        Its brightness.
    """

    exposure_stops: float | None = Field(None, ge=-60.0, le=60.0)
    found_stops: float | None = None
    look: Look = "filmic"
    grey: bool = False
    unclipped: bool = False
    safe_frame: bool = False
    plate: str | None = None
    plate_stops: float = Field(0.0, ge=-30.0, le=30.0)

    @property
    def plain(self) -> bool:
        """Whether a picture is shown as `render.display.view` shows it, with nothing behind it."""
        return self.look in ("srgb", "filmic") and self.plate is None
