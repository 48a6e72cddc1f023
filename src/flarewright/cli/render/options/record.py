"""All options of `flarewright render`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from .art import ArtOptions
from .camera import CameraOptions
from .inputs import InputOptions
from .lens import LensOptions
from .light import LightOptions
from .output import OutputOptions
from .place import PlaceOptions
from .quality import QualityOptions
from .reference import ReferenceOptions
from .starburst import StarburstOptions


@dataclass(frozen=True, kw_only=True)
class RenderOptions(
    ReferenceOptions,
    QualityOptions,
    CameraOptions,
    ArtOptions,
    StarburstOptions,
    LensOptions,
    PlaceOptions,
    LightOptions,
    InputOptions,
    OutputOptions,
):
    """The options as given; the last base comes first on the help page."""

    base: Any = None
    """The `Project` of the file, of a picture that resumes or of a look; help does not load its type."""
    tracked: Any = ()
    """Tracks of `--track` (`cli.render.tracks.GivenTrack`)."""
