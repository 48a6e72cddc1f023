"""Where a light stands for a camera, and how bright its flare is at other settings (Walch 2017, section 8.2)."""

from __future__ import annotations

from math import inf

import numpy as np

from ..errors import FlarewrightError
from ..model.ghost_model import GhostModel, Reference
from ..model.replay_camera import ReplayCamera, Vector
from ..optics.constellation import POWERS, brightness_scale, view_axes
from ..optics.constellation import constellation_and_roll as optics_constellation

# of the captures' brightness: fainter, and as much brighter, pixels of 32 bits do not hold
_FAINTEST = 1e-20


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
    Equations 8.1 and 8.2 (`optics.constellation`).
    """
    away = np.array(light, float) - np.array(position, float)
    if not np.linalg.norm(forward) > 0.0:
        raise FlarewrightError("the camera's forward has no length, so it looks nowhere; give another forward")
    if not np.linalg.norm(away) > 0.0:
        raise FlarewrightError("a light at the camera's own place has no direction; move one of them")
    axes = view_axes(forward, up)
    if np.isnan(axes).any():
        raise FlarewrightError("the camera's up is along its forward; give another up")
    constellation_deg, roll_deg = optics_constellation(axes, away)
    return float(constellation_deg), float(roll_deg)


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
        When a new setting is given whose old value the model does not know, or all together are no brightness that a
        picture can hold.
    """
    ratios: dict[str, float] = {}
    for name in POWERS:
        new, old = getattr(camera, name), getattr(reference, name)
        if new is None:
            continue
        if old is None:
            raise FlarewrightError(
                f"the model does not tell the {name} of its captures, so {name} {new:g} has no meaning; "
                f"leave it out or write it into the model's reference"
            )
        ratios[name] = new / old
    try:
        gain = brightness_scale(ratios)
    except (OverflowError, ZeroDivisionError):
        gain = inf
    if not _FAINTEST <= gain <= 1.0 / _FAINTEST:
        told = ", ".join(f"{name} {getattr(camera, name):g}" for name in ratios)
        raise FlarewrightError(
            f"{told} make the flare {gain:g} times as bright as in the captures; check these settings"
        )
    return gain


def over_clipping(model: GhostModel, camera: ReplayCamera) -> float:
    """Return the signal on the sensor, over the one at which it clips, of light of luminance 1 in a model's unit.

    Parameters
    ----------
    model : GhostModel
    camera : ReplayCamera
        As `brightness` takes it.

    Returns
    -------
    float
        Of light as white as daylight, in the colour that clips first; of coloured light another colour may.

    Raises
    ------
    FlarewrightError
        When the model does not tell where its sensor clips, and as `brightness`.
    """
    clipping = model.reference.clipping
    if clipping is None:
        raise FlarewrightError(
            "the model does not tell at which radiance the sensor of its captures clips (clipping in its reference)"
        )
    # the camera's red, green and blue of white of luminance 1
    white = np.ones(3) if model.to_rec709 is None else np.linalg.pinv(np.array(model.to_rec709)) @ np.ones(3)
    return brightness(model.reference, camera) * float((white / np.array(clipping)).max())
