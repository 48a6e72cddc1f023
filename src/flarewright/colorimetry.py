"""The range of visible light, chromaticities of the primaries and whites of linear RGB, and matrices to XYZ."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from .typing import Floats

VISIBLE_NM = (360.0, 830.0)
"""Range over which colours are integrated: that of the colour matching functions (CIE 018:2019). Of X, Y and Z, 4e-6 of
daylight and 12e-6 of an incandescent lamp lie beyond 780 nm, but films reflect so much there that it counts in ghosts
under a black body of 2000 K."""

D65_WHITE = (0.3127, 0.3290)
"""Chromaticity of the white of Rec.709 (ITU-R BT.709-6, item 1.4)."""

_ACES_WHITE = (0.32168, 0.33767)

PRIMARIES: Mapping[str, tuple[float, ...]] = {
    "lin_rec709_scene": (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, *D65_WHITE),
    "lin_ap1_scene": (0.713, 0.293, 0.165, 0.830, 0.128, 0.044, *_ACES_WHITE),
    "lin_ap0_scene": (0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.0770, *_ACES_WHITE),
    "lin_p3d65_scene": (0.680, 0.320, 0.265, 0.690, 0.150, 0.060, *D65_WHITE),
    "lin_rec2020_scene": (0.708, 0.292, 0.170, 0.797, 0.131, 0.046, *D65_WHITE),
    "lin_adobergb_scene": (0.64, 0.33, 0.21, 0.71, 0.15, 0.06, *D65_WHITE),
}
"""Red, green, blue and white x, y by the names of the ASWF Color Interop Forum.

ITU-R BT.709-6 table 3, S-2014-004 (AP1), SMPTE ST 2065-1 (AP0; TB-2018-001 has the white), SMPTE EG 432-1 with D65
(P3), ITU-R BT.2020-2 table 3, Adobe RGB (1998).
"""


def xyz_of(xy: Sequence[float]) -> Floats:
    """Return XYZ with Y = 1 of a chromaticity, shape (3,)."""
    x, y = xy
    return np.array([x / y, 1.0, (1.0 - x - y) / y])


def rgb_to_xyz(primaries: Sequence[float]) -> Floats:
    """Return the matrix from linear RGB to XYZ: each primary has the amount with which they add up to white.

    Parameters
    ----------
    primaries : sequence of float, length 8
        As in `PRIMARIES`.

    Returns
    -------
    ndarray, shape (3, 3)
        xyz = matrix @ rgb (SMPTE RP 177).
    """
    P = np.stack([xyz_of(primaries[k : k + 2]) for k in (0, 2, 4)], axis=1)
    return P * np.linalg.solve(P, xyz_of(primaries[6:]))
