"""The sun in a camera's view: against published angles and against a photographer's turns of the camera."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta, timezone

import numpy as np
import pytest

from flarewright.errors import ProjectError
from flarewright.model.project.scene import Site
from flarewright.workflow.sun_place import CameraAim, sun_place

pytest.importorskip("astral")

# Reda and Andreas, NREL/TP-560-34302, table A5.1: azimuth 194.34024, zenith 50.11162 degrees with refraction
MOUNTAIN = datetime(2003, 10, 17, 12, 30, 30, tzinfo=timezone(timedelta(hours=-7)))
GOLDEN, AZIMUTH, ELEVATION = Site(latitude_deg=39.742476, longitude_deg=-105.1786), 194.34024, 39.88838


def test_a_camera_aimed_at_the_published_place_has_the_sun_on_its_axis():
    found = sun_place(MOUNTAIN, GOLDEN, CameraAim(AZIMUTH, ELEVATION))
    assert found.field_deg == pytest.approx((0.0, 0.0), abs=0.02)


@pytest.mark.parametrize(
    ("aim", "field"),
    [
        # turned left, the sun is right; tilted down, it is up
        (CameraAim(AZIMUTH - 10.0, 0.0), (10.0, None)),
        (CameraAim(AZIMUTH, ELEVATION - 12.0), (0.0, 12.0)),
        # leaning right turns the picture left: what was up is left
        (CameraAim(AZIMUTH, ELEVATION - 12.0, 90.0), (-12.0, 0.0)),
        (CameraAim(AZIMUTH, ELEVATION - 12.0, 180.0), (0.0, -12.0)),
    ],
)
def test_turns_of_the_camera(aim, field):
    x, y = sun_place(MOUNTAIN, GOLDEN, aim).field_deg
    assert x == pytest.approx(field[0], abs=0.02)
    if field[1] is None:
        # tan Y = tan(elevation) / cos(turn) of a level camera
        expected = np.degrees(np.arctan(np.tan(np.radians(ELEVATION)) / np.cos(np.radians(10.0))))
        assert y == pytest.approx(expected, abs=0.02)
    else:
        assert y == pytest.approx(field[1], abs=0.02)


def test_the_zone_of_the_time_does_not_matter():
    aim = CameraAim(180.0, 30.0)
    assert sun_place(MOUNTAIN.astimezone(UTC), GOLDEN, aim) == sun_place(MOUNTAIN, GOLDEN, aim)


def test_a_sun_that_cannot_be_seen_is_one_sentence():
    with pytest.raises(ProjectError, match="degrees below the horizon then and there"):
        sun_place(MOUNTAIN + timedelta(hours=12), GOLDEN, CameraAim(0.0))
    with pytest.raises(ProjectError, match=r"azimuth 194.3 and elevation 39.9 degrees, 1\d\d degrees from where"):
        sun_place(MOUNTAIN, GOLDEN, CameraAim(14.0))
