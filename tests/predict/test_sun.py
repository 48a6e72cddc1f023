"""The sun against published values, each with its source."""

from datetime import UTC, datetime, timedelta, timezone

import numpy as np
import pytest

from flarewright.errors import FlarewrightError
from flarewright.model.scene import Site
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


def test_equinox_and_solstice_of_2024():
    """USNO, Earth's Seasons: equinox 2024 March 20 03:06 UT, solstice June 20 20:51 UT; obliquity 23.4362 degrees."""
    # declination 0: seen from the equator the sun rises due east and stays there
    azimuth, _ = at(0.0, 0.0, datetime(2024, 3, 20, 3, 6, tzinfo=UTC))
    assert azimuth[0] == pytest.approx(90.0, abs=0.01)
    # on the tropic, where it is noon: 8 h 51 min less the equation of time, -1 min 48 s, in degrees west
    _, elevation = at(23.4362, -(8.85 * 15.0 - 1.8 / 60.0 * 15.0), datetime(2024, 6, 20, 20, 51, tzinfo=UTC))
    assert elevation[0] > 89.95


@pytest.mark.parametrize(
    "transit", [datetime(2023, 11, 3, 11, 43, 35, tzinfo=UTC), datetime(2023, 2, 11, 12, 14, 14, tzinfo=UTC)]
)
def test_transit_at_greenwich_at_the_extremes_of_the_equation_of_time(transit):
    """The Astronomical Almanac: +16 min 25 s on November 3, -14 min 14 s on February 11."""
    azimuth, _ = at(51.4779, 0.0, transit)
    # the azimuth runs half a degree in a minute and a half
    assert azimuth[0] == pytest.approx(180.0, abs=0.05)


def test_clear_sky():
    """100 klx overhead (103 klx: 127.5 exp(-0.21)), nothing at night, and never brighter when lower."""
    assert sun_illuminance(90.0) == pytest.approx(127500.0 * np.exp(-0.21), rel=1e-3)
    assert sun_illuminance(-0.1) == 0.0
    assert (np.diff(sun_illuminance(np.linspace(0.0, 90.0, 181))) > 0.0).all()
    # two air masses at 30 degrees
    assert sun_illuminance(30.0) == pytest.approx(127500.0 * np.exp(-0.42), rel=5e-3)


def test_a_year_beyond_what_is_known_is_told():
    with pytest.raises(FlarewrightError, match="1900 to 2100"):
        at(0.0, 0.0, datetime(3000, 1, 1, tzinfo=UTC))
