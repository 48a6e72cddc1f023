"""Area lights in parts."""

import numpy as np
import pytest

from flarewright.errors import ProjectError
from flarewright.model import Light
from flarewright.optics.pupil.light_shape import disc_fits, parts


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
