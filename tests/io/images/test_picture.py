"""Colour pictures: sRGB decoding of each channel."""

import numpy as np
import pytest
from PIL import Image

from flarewright.errors import FlarewrightError
from flarewright.io.images.picture import read_picture


def test_a_png_is_decoded_by_the_curve_of_srgb_in_each_channel(tmp_path):
    # IEC 61966-2-1: linear up to 0.04045, a power of 2.4 above
    codes = np.array([[[0, 10, 255], [128, 188, 64]]], dtype=np.uint8)
    light = [[[0.0, 0.00303527, 1.0], [0.2158605, 0.5028865, 0.0512695]]]
    Image.fromarray(codes).save(tmp_path / "a.png")
    np.testing.assert_allclose(read_picture(tmp_path / "a.png"), light, rtol=1e-5)


def test_a_picture_that_is_missing_or_none_is_refused(tmp_path):
    with pytest.raises(FlarewrightError, match="does not exist"):
        read_picture(tmp_path / "no.png")
    (tmp_path / "text.png").write_text("no picture")
    with pytest.raises(FlarewrightError, match="cannot be read as an image"):
        read_picture(tmp_path / "text.png")
