"""Area lights in parts."""

import numpy as np
import pytest

from flarewright.errors import ProjectError
from flarewright.model import Light
from flarewright.model.project.light import Polygon, Rectangle
from flarewright.optics.pupil.light_shape import disc_fits, parts, shrunk_to_fit


def test_a_wide_light_has_at_most_the_wanted_parts_which_share_all_of_it():
    wide = Light(field_deg=(3.0, -2.0), diameter_deg=30.0)
    few, many = parts(wide, 2.0, 4), parts(wide, 2.0)
    assert len(few) <= 16 < len(many)
    assert sum(part.share for part in few) == pytest.approx(1.0)
    # the parts have the light's centroid, weighted by solid angle, as the fine ones have
    centres = [sum(part.share * np.array(part.field_deg) for part in found) for found in (few, many)]
    assert centres[0] == pytest.approx(centres[1], abs=0.05)
    assert len(parts(Light(field_deg=(3.0, -2.0), diameter_deg=3.0), 2.0, 4)) == len(
        parts(Light(field_deg=(3.0, -2.0), diameter_deg=3.0), 2.0)
    )


def test_a_disc_beyond_the_front_says_where_it_lies():
    light = Light(field_deg=(88.0, 0.0), diameter_deg=4.0)
    assert not disc_fits(light)
    with pytest.raises(ProjectError, match=r"lies 88 degrees .*, and its disc of 4 degrees reaches beyond 89"):
        parts(light, 1.0)


@pytest.mark.parametrize(
    "light",
    [
        Light(field_deg=(80.0, 20.0), diameter_deg=40.0),
        Light(field_deg=(-85.0, 0.0), shape=Rectangle(size_deg=(30.0, 10.0), rotation_deg=20.0)),
        Light(field_deg=(0.0, 84.0), shape=Polygon(corners_deg=((-9.0, -9.0), (9.0, -9.0), (0.0, 9.0)))),
    ],
)
def test_a_light_that_reaches_behind_the_camera_is_shrunk_to_fit(light):
    with pytest.raises(ProjectError):
        parts(light, 90.0)
    small = shrunk_to_fit(light)
    assert sum(part.share for part in parts(small, 90.0)) == pytest.approx(1.0)
    assert (small.field_deg, small.intensity) == (light.field_deg, light.intensity)
    # no smaller than needed, and what fits stays as it is
    assert shrunk_to_fit(small) == small
    inside = light.replace(field_deg=(3.0, -2.0))
    assert shrunk_to_fit(inside) is inside
