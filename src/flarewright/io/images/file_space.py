"""Linear colour spaces of files beside Rec.709 and ACEScg: what an EXR states about its pixels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

__all__ = ["PRIMARIES", "FileSpace"]

PRIMARIES: Mapping[str, tuple[float, ...]] = {
    "lin_rec709_scene": (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290),
    "lin_ap1_scene": (0.713, 0.293, 0.165, 0.830, 0.128, 0.044, 0.32168, 0.33767),
    "lin_ap0_scene": (0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.0770, 0.32168, 0.33767),
    "lin_p3d65_scene": (0.680, 0.320, 0.265, 0.690, 0.150, 0.060, 0.3127, 0.3290),
    "lin_rec2020_scene": (0.708, 0.292, 0.170, 0.797, 0.131, 0.046, 0.3127, 0.3290),
    "lin_adobergb_scene": (0.64, 0.33, 0.21, 0.71, 0.15, 0.06, 0.3127, 0.3290),
}
"""Red, green, blue and white x, y by the names of the ASWF Color Interop Forum.

ITU-R BT.709-6 table 3, S-2014-004 (AP1), SMPTE ST 2065-1 (AP0), SMPTE EG 432-1 with D65 (P3), ITU-R BT.2020-2 table 3,
Adobe RGB (1998).
"""


@dataclass(frozen=True)
class FileSpace:
    """A linear colour space of an OpenColorIO configuration.

    Attributes
    ----------
    name : str
        As the configuration writes it.
    config : str
        Name of the configuration.
    known : str or None
        Key of `PRIMARIES`, if its primaries are there.
    """

    name: str
    config: str
    known: str | None = None
