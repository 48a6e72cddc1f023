"""The exposure of a real camera against a light meter's, and against the equation of camera and scene."""

from math import log2, pi

import pytest

from flarewright.errors import ProjectError
from flarewright.render.image.photographic_exposure import SUN_LUX, photographic_stops


@pytest.mark.parametrize(("f_number", "shutter_s", "iso"), [(8.0, 1 / 250, 100.0), (2.0, 1 / 48, 800.0)])
def test_what_a_meter_calls_right_is_middle_grey(f_number, shutter_s, iso):
    """A reflected-light meter with K = 12.5 chooses t = K N^2 / (L S); the sensor gets pi / 4 L / N^2."""
    luminance = 12.5 * f_number**2 / (shutter_s * iso)
    on_sensor = pi / 4.0 * luminance / f_number**2
    stops = photographic_stops(f_number, shutter_s=shutter_s, iso=iso, lux=1000.0)
    # a pixel holds the illuminance of the sensor relative to that of the light
    assert on_sensor / 1000.0 * 2.0**stops == pytest.approx(0.18, rel=0.02)


def test_ev_is_f_number_and_shutter():
    assert photographic_stops(8.0, ev=log2(8.0**2 * 250)) == pytest.approx(photographic_stops(8.0, shutter_s=1 / 250))
    # one stop more of EV is one stop less light; twice the ISO and twice the light are one stop more each
    base = photographic_stops(4.0, ev=12.0)
    assert photographic_stops(4.0, ev=13.0) == pytest.approx(base - 1.0)
    assert photographic_stops(4.0, ev=12.0, iso=200.0) == pytest.approx(base + 1.0)
    assert photographic_stops(4.0, ev=12.0, lux=2.0 * SUN_LUX) == pytest.approx(base + 1.0)


@pytest.mark.parametrize("wrong", [{}, {"ev": 1.0, "shutter_s": 1.0}, {"shutter_s": 0.0}, {"ev": 1.0, "iso": -1.0}])
def test_what_says_nothing_is_refused(wrong):
    with pytest.raises(ProjectError):
        photographic_stops(4.0, **wrong)
