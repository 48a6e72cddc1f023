"""Position of a light relative to a camera, and brightness of its flare at other settings (Walch 2017, section 8.2)."""

from __future__ import annotations

from math import inf

import numpy as np

from ...errors import FlarewrightError
from ...model.measurement.ghost_model import GhostModel, Reference
from ...model.measurement.replay_camera import ReplayCamera, Vector
from ...optics.lens.field_angles import POWERS, brightness_scale, constellation_and_roll, view_axes

# limit of a brightness factor that 32-bit pixels can hold
_FAINTEST = 1e-20


def constellation_of_light(position: Vector, forward: Vector, up: Vector, light: Vector) -> tuple[float, float]:
    """Return the angle between a camera's axis and a light, and the light's direction about the axis.

    Parameters
    ----------
    position, forward, up, light : tuple of float
        Camera position, viewing direction, up direction, and light position; the lengths of `forward` and `up` do not
        matter.

    Returns
    -------
    constellation_deg, roll_deg : float
        The roll counts counterclockwise from the right in the upright picture; 0 for a light on the axis.

    Raises
    ------
    FlarewrightError
        When the light is at the camera's position, a direction has no length, or up is parallel to forward.

    Notes
    -----
    Equations 8.1 and 8.2 (`optics.lens.field_angles`).
    """
    away = np.array(light, float) - np.array(position, float)
    if not np.linalg.norm(forward) > 0.0:
        raise FlarewrightError("the camera's forward has no length, so it looks nowhere; give another forward")
    if not np.linalg.norm(away) > 0.0:
        raise FlarewrightError("a light at the camera's own place has no direction; move one of them")
    axes = view_axes(forward, up)
    if np.isnan(axes).any():
        raise FlarewrightError("the camera's up is along its forward; give another up")
    constellation_deg, roll_deg = constellation_and_roll(axes, away)
    return float(constellation_deg), float(roll_deg)


def brightness_gain(reference: Reference, camera: ReplayCamera) -> float:
    """Return the factor by which a flare is brighter than in the captures (equation 8.3).

    Parameters
    ----------
    reference : Reference
        Settings of the captures.
    camera : ReplayCamera
        New settings; None leaves a setting unchanged.

    Raises
    ------
    FlarewrightError
        When a new setting is given whose captured value is unknown, or the factor is beyond the range of pixels.
    """
    ratios: dict[str, float] = {}
    for name in POWERS:
        new, old = getattr(camera, name), getattr(reference, name)
        if new is None:
            continue
        if old is None:
            raise FlarewrightError(
                f"the model does not know the {name} of its captures, so {name} {new:g} has no meaning; "
                f"leave it out or write it into the model's reference"
            )
        ratios[name] = new / old
    try:
        gain = brightness_scale(ratios)
    except (OverflowError, ZeroDivisionError):
        gain = inf
    if not _FAINTEST <= gain <= 1.0 / _FAINTEST:
        named = ", ".join(f"{name} {getattr(camera, name):g}" for name in ratios)
        raise FlarewrightError(
            f"{named} make the flare {gain:g} times as bright as in the captures; check these settings"
        )
    return gain


def over_clipping(model: GhostModel, camera: ReplayCamera) -> float:
    """Return the sensor signal over its clipping level for light of luminance 1 in a model's unit.

    Parameters
    ----------
    model : GhostModel
    camera : ReplayCamera
        As for `brightness_gain`.

    Returns
    -------
    float
        For daylight white, in the colour that clips first; for coloured light another colour may clip first.

    Raises
    ------
    FlarewrightError
        When the model has no clipping level, and as `brightness_gain`.
    """
    clipping = model.reference.clipping
    if clipping is None:
        raise FlarewrightError(
            "the model does not know at which radiance the sensor of its captures clips (clipping in its reference)"
        )
    # the camera's red, green and blue for white of luminance 1
    white = np.ones(3) if model.to_rec709 is None else np.linalg.pinv(np.array(model.to_rec709)) @ np.ones(3)
    return brightness_gain(model.reference, camera) * float((white / np.array(clipping)).max())
