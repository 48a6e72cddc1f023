"""Where a light stands for a camera, and how bright its flare is at other settings (Walch 2017, section 8.2)."""

from __future__ import annotations

import numpy as np

from ..errors import FlarewrightError
from ..model.ghost_model import Reference
from ..model.replay_camera import ReplayCamera, Vector


def constellation_and_roll(position: Vector, forward: Vector, up: Vector, light: Vector) -> tuple[float, float]:
    """Return the angle between a camera's axis and a light, and the light's direction about the axis.

    Parameters
    ----------
    position, forward, up, light : tuple of float
        Camera position, where it looks, what is up, and where the light is; the lengths of `forward` and `up` do not
        matter.

    Returns
    -------
    constellation_deg, roll_deg : float
        The roll counts counterclockwise in the upright picture from the right; 0 for a light on the axis.

    Raises
    ------
    FlarewrightError
        When the light is at the camera's place, a direction has no length, or up is forward.

    Notes
    -----
    Equations 8.1 and 8.2; the angle by the arc tangent, which keeps its digits near the axis, where the arc cosine of
    8.1 loses half of them.
    """
    ahead, above = np.array(forward, float), np.array(up, float)
    away = np.array(light, float) - np.array(position, float)
    if not (np.linalg.norm(away) > 0.0 and np.linalg.norm(ahead) > 0.0):
        raise FlarewrightError("a light at the camera's own place has no direction; move one of them")
    ahead /= np.linalg.norm(ahead)
    right = np.cross(ahead, above)
    if not np.linalg.norm(right) > 1e-9 * np.linalg.norm(above):
        raise FlarewrightError("the camera's up is along its forward; give another up")
    right /= np.linalg.norm(right)
    x, y, z = float(away @ right), float(away @ np.cross(right, ahead)), float(away @ ahead)
    return float(np.degrees(np.arctan2(np.hypot(x, y), z))), float(np.degrees(np.arctan2(y, x)))


def brightness(reference: Reference, camera: ReplayCamera) -> float:
    """Return by how much a flare is brighter than in the captures (equation 8.3).

    Parameters
    ----------
    reference : Reference
        The captures' settings.
    camera : ReplayCamera
        The new ones; what is None stays as it was.

    Returns
    -------
    float

    Raises
    ------
    FlarewrightError
        When a new setting is given whose old value the model does not know.
    """
    factor = 1.0
    for name, power in (
        ("f_number", -2), ("iso", 1), ("exposure_s", 1), ("luminance_cd_m2", 1), ("solid_angle_sr", 1)
    ):  # fmt: skip
        new, old = getattr(camera, name), getattr(reference, name)
        if new is None:
            continue
        if old is None:
            raise FlarewrightError(
                f"the model does not tell the {name} of its captures, so {name} {new:g} has no meaning; "
                f"leave it out or write it into the model's reference"
            )
        factor *= (new / old) ** power
    return float(factor)
