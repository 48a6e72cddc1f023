"""The sun as a light of a camera: its field angles at a time, a place and an orientation."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime

import numpy as np

from ..errors import ProjectError
from ..model.project.scene import Site
from ..predict.sun import sky_direction, sun_illuminance, sun_path
from ..typing import Floats

# elevation at which the upper edge of the sun sets, degrees; `sun_path` includes refraction
_SETTING_DEG = -0.27
# largest angle from the camera's axis: its field angles reach 90 degrees
_LARGEST_DEG = 89.0


@dataclass(frozen=True)
class CameraAim:
    """Orientation of a camera on the ground.

    Attributes
    ----------
    heading_deg : float
        Where it looks, clockwise from true north.
    tilt_deg : float
        Above the horizon.
    roll_deg : float
        By which it leans right, clockwise as seen from behind it.
    """

    heading_deg: float
    tilt_deg: float = 0.0
    roll_deg: float = 0.0


@dataclass(frozen=True)
class SunPlace:
    """The sun in a camera's view.

    Attributes
    ----------
    azimuth_deg, elevation_deg : float
        Clockwise from north; apparent, above the horizon.
    field_deg : tuple of float
        Field angles (X, Y).
    illuminance_lx : float
        On a plane facing the sun in a clear sky (`predict.sun.sun_illuminance`).
    """

    azimuth_deg: float
    elevation_deg: float
    field_deg: tuple[float, float]
    illuminance_lx: float


def sun_place(when: datetime, site: Site, aim: CameraAim) -> SunPlace:
    """Return where a camera sees the sun.

    Parameters
    ----------
    when : datetime
        With its offset from UTC.
    site : Site
    aim : CameraAim

    Raises
    ------
    FlarewrightError
        The sun is below the horizon or not in front of the camera, the date is out of range, or `astral` is missing.

    Notes
    -----
    Tests: tests/workflow/test_sun_place.py compares with Meeus' formulas and with the orientation of a photograph.
    """
    azimuth, elevation = (float(each[0]) for each in sun_path(site, [when]))
    if elevation < _SETTING_DEG:
        raise ProjectError(
            f"--sun: the sun is {-elevation:.1f} degrees below the horizon then and there; check the time with its "
            "offset from UTC, and the longitude, which counts east"
        )
    x, y, z = _axes(aim) @ sky_direction(azimuth, elevation)
    away = float(np.degrees(np.arctan2(np.hypot(x, y), z)))
    if away > _LARGEST_DEG:
        raise ProjectError(
            f"--sun: the sun stands at azimuth {azimuth:.1f} and elevation {elevation:.1f} degrees, {away:.0f} degrees "
            "from where the camera looks; turn the camera (--heading, --tilt)"
        )
    field = np.degrees(np.arctan([x / z, y / z]))
    return SunPlace(azimuth, elevation, (float(field[0]), float(field[1])), float(sun_illuminance(elevation)))


def _axes(aim: CameraAim) -> Floats:
    """Return the camera's right, up and forward in rows: east, north and up."""
    forward = sky_direction(aim.heading_deg, aim.tilt_deg)
    heading = np.radians(aim.heading_deg)
    # the horizontal direction right of the heading, so that a camera that looks at the zenith has axes too
    right = np.array([np.cos(heading), -np.sin(heading), 0.0])
    up = np.cross(right, forward)
    c, s = np.cos(np.radians(aim.roll_deg)), np.sin(np.radians(aim.roll_deg))
    return np.stack([c * right - s * up, c * up + s * right, forward])
