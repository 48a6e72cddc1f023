"""Linear colour spaces of files beside Rec.709 and ACEScg: what an EXR states about its pixels."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class FileSpace:
    """A linear colour space of an OpenColorIO configuration.

    Attributes
    ----------
    name : str
        As the configuration writes it.
    config : str
        Name of the configuration; empty for colours of no configuration, such as those of a camera.
    known : str or None
        Key of `colorimetry.PRIMARIES`, if its primaries are there.
    """

    name: str
    config: str
    known: str | None = None
