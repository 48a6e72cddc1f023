"""Position of a light relative to a camera, and brightness scaling of its flare: Walch 2017, section 8.2.

The *constellation* is the angle between the camera's axis and the light, the *roll* the light's direction around the
axis in the upright picture. For a lens of revolution with a round opening, the constellation determines the flare's
shape and the roll rotates it.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import prod

import numpy as np
from numpy.typing import ArrayLike

from ...typing import Floats

POWERS = {"f_number": -2, "iso": 1, "exposure_s": 1, "luminance_cd_m2": 1, "solid_angle_sr": 1}
"""Exponent of each setting in the brightness."""


def view_axes(forward: ArrayLike, up: ArrayLike) -> Floats:
    """Return the axes of a camera's view.

    Parameters
    ----------
    forward, up : array_like, shape (..., 3)
        View direction, of any length, and the world's up direction; not parallel.

    Returns
    -------
    ndarray, shape (..., 3, 3)
        Rows: right and up in the upright picture, and forward; unit vectors. NaN where `up` is parallel to `forward`.
    """
    ahead = np.asarray(forward, dtype=np.float64)
    ahead = ahead / np.linalg.norm(ahead, axis=-1, keepdims=True)
    right = np.cross(ahead, np.asarray(up, dtype=np.float64))
    length = np.linalg.norm(right, axis=-1, keepdims=True)
    with np.errstate(invalid="ignore", divide="ignore"):
        right = np.where(length > 1e-9 * np.linalg.norm(up, axis=-1, keepdims=True), right / length, np.nan)
    return np.stack([right, np.cross(right, ahead), ahead], axis=-2)


def constellation_and_roll(axes: ArrayLike, to_light: ArrayLike) -> tuple[Floats, Floats]:
    """Compute the constellation and the roll of a light.

    Parameters
    ----------
    axes : array_like, shape (..., 3, 3)
        From `view_axes`.
    to_light : array_like, shape (..., 3)
        From the camera to the light, of any length above 0.

    Returns
    -------
    constellation_deg, roll_deg : ndarray
        0 to 180, and -180 to 180 counter-clockwise from the right; a light on the axis has roll 0.

    Notes
    -----
    Walch 2017, equations 8.1 and 8.2. The arc cosine of 8.1 loses all digits near the axis; the arc tangent of the
    same two vectors does not.
    """
    seen = np.einsum("...ij,...j->...i", np.asarray(axes, dtype=np.float64), np.asarray(to_light, dtype=np.float64))
    x, y, z = seen[..., 0], seen[..., 1], seen[..., 2]
    aside = np.hypot(x, y)
    on_axis = aside <= 1e-15 * np.abs(z)
    roll = np.where(on_axis, 0.0, np.arctan2(y, x))
    return np.degrees(np.arctan2(aside, z)), np.degrees(roll)


def field_angles(constellation_deg: float, roll_deg: float) -> tuple[float, float]:
    """Return the field angles (X, Y) in degrees of a light in front of the camera.

    Parameters
    ----------
    constellation_deg : float
        Below 90.
    roll_deg : float

    Notes
    -----
    The slopes tan X and tan Y are the light's position on a plane at distance 1 (docs/physics.md, "Conventions").
    """
    slope = np.tan(np.radians(constellation_deg))
    x, y = np.degrees(np.arctan(slope * np.array([np.cos(np.radians(roll_deg)), np.sin(np.radians(roll_deg))])))
    return float(x), float(y)


def brightness_scale(ratios: Mapping[str, float]) -> float:
    """Return the factor from a flare at known settings to a flare at other settings.

    Parameters
    ----------
    ratios : mapping of str to float
        New setting over known setting, by name in `POWERS`; a missing one is 1.

    Notes
    -----
    Walch 2017, equation 8.3: f_F^2 / f_R^2 * ISO_R / ISO_F * EXP_R / EXP_F * (l_R alpha_R) / (l_F alpha_F). The
    f-number scales a flare only roughly: a wider opening also makes larger ghosts. A flare rendered at its own opening
    needs no such factor. Tests: tests/optics/lens/test_field_angles.py.
    """
    return prod(ratio ** POWERS[name] for name, ratio in ratios.items())
