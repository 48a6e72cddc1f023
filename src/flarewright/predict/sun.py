"""Position and illuminance of the sun at a place and date."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime

import numpy as np
from numpy.typing import ArrayLike

from ..errors import FlarewrightError, optional
from ..model.project.scene import Site
from ..typing import Floats

# illuminance on a plane facing the sun outside the atmosphere, lx, and extinction of the clear sky per air mass
OUTSIDE_LX, CLEAR = 127500.0, 0.21


def sun_path(site: Site, times: Sequence[datetime]) -> tuple[Floats, Floats]:
    """Compute the position of the sun.

    Parameters
    ----------
    site : Site
    times : sequence of datetime
        With their offsets from UTC.

    Returns
    -------
    azimuth_deg, elevation_deg : ndarray, shape (T,)
        Azimuth clockwise from north; apparent elevation above the horizon, including refraction.

    Raises
    ------
    FlarewrightError
        When the `astral` library is not installed, or the date is out of range.

    Notes
    -----
    Computed by `astral` (NOAA's formulas after Meeus), accurate to some hundredths of a degree for the years 1900 to
    2100, less within a degree of the horizon. Compared with almanac values in tests/predict/test_sun.py.
    """
    sun = optional("astral.sun", "predict", "the sun's path")
    from astral import Observer

    here = Observer(latitude=site.latitude_deg, longitude=site.longitude_deg)
    found = []
    for time in times:
        if not 1900 <= time.year <= 2100:
            raise FlarewrightError(
                f"the sun's path is known for the years 1900 to 2100, not for {time.year}; check the date"
            )
        utc = time.astimezone(UTC)
        found.append((sun.azimuth(here, utc), sun.elevation(here, utc, with_refraction=True)))
    return np.array([one[0] for one in found]), np.array([one[1] for one in found])


def sky_direction(azimuth_deg: ArrayLike, elevation_deg: ArrayLike) -> Floats:
    """Return unit vectors towards places of the sky.

    Parameters
    ----------
    azimuth_deg, elevation_deg : array_like
        Clockwise from north, and above the horizon.

    Returns
    -------
    ndarray, shape (..., 3)
        East, north and up.

    Examples
    --------
    >>> sky_direction(90.0, 0.0).round(6).tolist()
    [1.0, 0.0, 0.0]
    """
    turn, height = np.radians(azimuth_deg), np.radians(elevation_deg)
    flat = np.cos(height)
    return np.stack([np.sin(turn) * flat, np.cos(turn) * flat, np.sin(height)], axis=-1)


def sun_illuminance(elevation_deg: ArrayLike) -> Floats:
    """Compute the illuminance by the sun in a clear sky on a plane facing it.

    Parameters
    ----------
    elevation_deg : array_like
        Apparent elevation.

    Returns
    -------
    ndarray
        Illuminance, lx; 0 below the horizon.

    Notes
    -----
    E = 127.5 klx exp(-0.21 m), the clear sky of the IES' daylight availability (RP-21), with the air mass of Kasten and
    Young 1989, m = 1 / (sin h + 0.50572 (h + 6.07995)^-1.6364), h in degrees. The orbit's +-3 % are ignored.
    """
    h = np.asarray(elevation_deg, dtype=np.float64)
    above = np.maximum(h, 0.0)
    air_mass = 1.0 / (np.sin(np.radians(above)) + 0.50572 * (above + 6.07995) ** -1.6364)
    return np.where(h >= 0.0, OUTSIDE_LX * np.exp(-CLEAR * air_mass), 0.0)
