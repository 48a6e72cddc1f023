"""The sun against published values, each with its source, and against another formula than the library's."""

from datetime import UTC, datetime, timedelta, timezone

import numpy as np
import pytest

from flarewright.errors import FlarewrightError
from flarewright.model.project.scene import Site
from flarewright.predict.sun import sun_illuminance, sun_path

pytest.importorskip("astral")


def at(latitude_deg, longitude_deg, *times):
    return sun_path(Site(latitude_deg=latitude_deg, longitude_deg=longitude_deg), times)


def test_worked_example_of_the_solar_position_algorithm():
    """Reda and Andreas, NREL/TP-560-34302, table A5.1: zenith 50.11162, azimuth 194.34024 degrees with refraction."""
    mountain = timezone(timedelta(hours=-7))
    azimuth, elevation = at(39.742476, -105.1786, datetime(2003, 10, 17, 12, 30, 30, tzinfo=mountain))
    assert azimuth[0] == pytest.approx(194.34024, abs=0.01)
    assert elevation[0] == pytest.approx(90.0 - 50.11162, abs=0.01)


def low_precision(latitude_deg, longitude_deg, time):
    """Return azimuth and true altitude by the low precision formulas of the Astronomical Almanac (page C5).

    Good to 0.01 degrees for 1950 to 2050; sidereal time by the Almanac's expression (page B8).
    """
    n = (time - datetime(2000, 1, 1, 12, tzinfo=UTC)).total_seconds() / 86400.0
    mean, anomaly = 280.460 + 0.9856474 * n, np.radians(357.528 + 0.9856003 * n)
    along = np.radians(mean + 1.915 * np.sin(anomaly) + 0.020 * np.sin(2.0 * anomaly))
    tilt = np.radians(23.439 - 0.0000004 * n)
    ascension = np.arctan2(np.cos(tilt) * np.sin(along), np.cos(along))
    declination = np.arcsin(np.sin(tilt) * np.sin(along))
    sidereal = np.radians(280.46062 + 360.98564737 * n + longitude_deg)
    hour, north = sidereal - ascension, np.radians(latitude_deg)
    east = -np.cos(declination) * np.sin(hour)
    toward = np.sin(declination) * np.cos(north) - np.cos(declination) * np.sin(north) * np.cos(hour)
    up = np.sin(declination) * np.sin(north) + np.cos(declination) * np.cos(north) * np.cos(hour)
    return np.degrees(np.arctan2(east, toward)) % 360.0, np.degrees(np.arcsin(up))


def refraction_deg(altitude_deg):
    """Return the refraction at a true altitude (Saemundsson 1986), for 1010 hPa and 10 degrees."""
    return 1.02 / 60.0 / np.tan(np.radians(altitude_deg + 10.3 / (altitude_deg + 5.11)))


@pytest.mark.parametrize("place", [(48.14, 11.58), (-33.87, 151.21), (64.15, -21.94), (1.35, 103.82)])
def test_a_year_of_days_by_an_independent_formula(place):
    begin = datetime(2024, 1, 3, 1, 20, tzinfo=UTC)
    times = [begin + timedelta(days=6.9 * k, hours=1.7 * k) for k in range(53)]
    azimuth, elevation = at(*place, *times)
    high = 0
    for time, a, h in zip(times, azimuth, elevation, strict=True):
        expected, true = low_precision(*place, time)
        if true > 5.0:
            high += 1
            assert h == pytest.approx(true + refraction_deg(true), abs=0.03)
            # near the zenith a small error turns the azimuth far
            assert ((a - expected + 180.0) % 360.0 - 180.0) * np.cos(np.radians(true)) == pytest.approx(0.0, abs=0.03)
    assert high >= 15


def test_equinox_and_solstice_of_2024():
    """USNO, Earth's Seasons: equinox 2024 March 20 03:06 UT, solstice June 20 20:51 UT; obliquity 23.4362 degrees."""
    # declination 0: seen from the equator the sun rises due east and stays there
    azimuth, _ = at(0.0, 0.0, datetime(2024, 3, 20, 3, 6, tzinfo=UTC))
    assert azimuth[0] == pytest.approx(90.0, abs=0.01)
    # on the tropic at noon: 8 h 51 min less the equation of time, -1 min 48 s, in degrees west
    _, elevation = at(23.4362, -(8.85 * 15.0 - 1.8 / 60.0 * 15.0), datetime(2024, 6, 20, 20, 51, tzinfo=UTC))
    assert elevation[0] > 89.95


@pytest.mark.parametrize(
    "transit", [datetime(2023, 11, 3, 11, 43, 35, tzinfo=UTC), datetime(2023, 2, 11, 12, 14, 14, tzinfo=UTC)]
)
def test_transit_at_greenwich_at_the_extremes_of_the_equation_of_time(transit):
    """The Astronomical Almanac: +16 min 25 s on November 3, -14 min 14 s on February 11."""
    azimuth, _ = at(51.4779, 0.0, transit)
    # the azimuth changes half a degree in a minute and a half
    assert azimuth[0] == pytest.approx(180.0, abs=0.05)


def test_clear_sky():
    """100 klx overhead (103 klx: 127.5 exp(-0.21)), 0 at night, and less at lower elevations."""
    assert sun_illuminance(90.0) == pytest.approx(127500.0 * np.exp(-0.21), rel=1e-3)
    assert sun_illuminance(-0.1) == 0.0
    assert (np.diff(sun_illuminance(np.linspace(0.0, 90.0, 181))) > 0.0).all()
    # two air masses at 30 degrees
    assert sun_illuminance(30.0) == pytest.approx(127500.0 * np.exp(-0.42), rel=5e-3)


def test_a_year_beyond_what_is_known_is_reported():
    with pytest.raises(FlarewrightError, match="1900 to 2100"):
        at(0.0, 0.0, datetime(3000, 1, 1, tzinfo=UTC))
