"""Pictures of a search on a screen: a target picture looks like its file."""

from io import BytesIO

import numpy as np
from PIL import Image

from flarewright.design.problem.grey_picture import png_bytes, screen_pixels
from flarewright.design.thesis.figures import _shown
from flarewright.io.images.picture import read_picture


def test_a_wanted_picture_is_shown_as_in_its_file(tmp_path):
    codes = np.random.default_rng(4).integers(0, 256, (16, 24, 3), dtype=np.uint8)
    codes[:, :16] = np.arange(256, dtype=np.uint8).reshape(16, 16, 1)
    Image.fromarray(codes).save(tmp_path / "wanted.png")
    light = read_picture(tmp_path / "wanted.png")[::-1]
    np.testing.assert_array_equal(screen_pixels(light), codes)
    np.testing.assert_array_equal(np.asarray(Image.open(BytesIO(png_bytes(light)))), codes)


def test_grey_pictures_and_light_out_of_range():
    picture = np.array([[0.0, 1.0], [-0.5, 7.0]])
    expected = [[[0, 0, 0], [255, 255, 255]], [[0, 0, 0], [255, 255, 255]]]
    assert screen_pixels(picture).tolist() == screen_pixels(picture[..., None]).tolist() == expected
    # the sRGB code of half of white is 188
    assert _shown(picture.clip(0.0, 1.0)).tolist() == [[[188, 188, 188]]]
