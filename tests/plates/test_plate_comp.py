"""A comp adds the flare to the plate, but no second image of a light that the plate shows."""

from __future__ import annotations

import numpy as np
import pytest

from flarewright.io.images.plate_picture import PlatePicture
from flarewright.model import Layer
from flarewright.optics.colour.rgb import luminance_weights
from flarewright.plates.comp import composed, source_mask
from flarewright.plates.measured_plate import converted

WHOLE = (0, 0, 20, 12)


def test_passes_add_and_the_starburst_stays_out_of_the_light():
    plate = np.full((12, 20, 3), 0.2, np.float32)
    plate[5:7, 9:11] = 30.0
    mask = source_mask(plate, 1.0)
    ghosts = Layer("ghosts", np.full((12, 20, 3), 0.1, np.float32), WHOLE)
    star = Layer("starburst", np.full((12, 20, 3), 5.0, np.float32), WHOLE)
    comp = composed(plate, [star, ghosts], mask).pixels
    assert comp[5, 9] == pytest.approx(30.1)
    assert comp[0, 0] == pytest.approx(5.3)
    assert (plate[0, 0] == np.float32(0.2)).all(), "the plate itself is unchanged"
    # a plate that clips shows the light too dark: the brighter image counts
    dark = composed(np.minimum(plate, 1.0), [star, ghosts], mask, too_dark=True).pixels
    assert dark[5, 9] == pytest.approx(5.1)
    assert dark[0, 0] == pytest.approx(5.3)
    assert composed(plate, [star, ghosts], mask, too_dark=True).pixels[5, 9] == pytest.approx(30.1)
    # a window of a layer lies where it says
    part = composed(plate, [Layer("ghosts", np.ones((2, 3, 3), np.float32), (4, 5, 3, 2))], mask).pixels
    assert (part - plate).sum() == pytest.approx(18.0)
    assert part[5, 4] == pytest.approx(1.2)
    assert part[5, 7] == pytest.approx(0.2)


def test_a_plate_in_acescg_is_converted_and_keeps_its_white_and_luminance():
    pixels = np.array([[[1.0, 1.0, 1.0], [0.5, 0.2, 0.1]]], np.float32)
    plate = PlatePicture(pixels, None, "linear", "acescg")
    found = converted(plate, "rec709")
    assert found[0, 0] == pytest.approx(1.0, abs=1e-6)
    one, other = pixels @ luminance_weights("acescg"), found @ luminance_weights("rec709")
    assert other[0, 0] == pytest.approx(one[0, 0], rel=1e-5)
    assert converted(plate, "acescg") is pixels
